# SPDX-License-Identifier: Apache-2.0
"""Model selection accepts exactly the model classes that the data support."""

import os

import numpy as np
import pytest

import palpate
from palpate import InputError
from palpate._core.model import wavelet_columns
from palpate.identification import IdentifyOptions, SearchOptions, fit_environment
from palpate.identification.classes.class_selection import ClassSelection, constant
from palpate.identification.classes.model_selection import select
from palpate.identification.data.rows import Rows
from palpate.identification.network.fitted import FittedNetwork

LONG = int(os.environ.get("PALPATE_TEST_SCALE", "1")) > 1
DRAWS = 100 if LONG else 3
MOST_MISJUDGED = 5 if LONG else 0


def sweep(n: int, seed: int, encoder_step: float = 0.0) -> np.ndarray:
    """Returns the motion of a hand that sweeps 0.6 rad, quantised if an encoder step is given."""
    random = np.random.default_rng(seed)
    phase = np.cumsum(random.uniform(0.5, 1.5, n)) * 40.0 / n
    x = 0.3 - 0.3 * np.cos(phase)
    return np.round(x / encoder_step) * encoder_step if encoder_step else x


@pytest.mark.parametrize(
    ("n", "encoder_step"), [(50, 0.0), pytest.param(300, 0.0, marks=pytest.mark.full), (3000, 7.7e-4)]
)
def test_a_linear_spring_with_noise_needs_no_wavelet(n: int, encoder_step: float) -> None:
    """A linear spring is fitted with 0 wavelets in at least 95 of 100 draws (3 of 3), at any noise."""
    misjudged = 0
    for draw in range(DRAWS):
        random = np.random.default_rng(1000 + draw)
        x = sweep(n, draw, encoder_step)
        noise = 10.0 ** random.uniform(-4.0, 0.0)
        network = fit_environment(x[:, None], 3.0 * x + 0.1 + random.normal(0.0, noise, n), starts=[0])
        misjudged += len(network.weight) > 0 or network.weight_hysteresis is not None
    assert misjudged <= MOST_MISJUDGED


def test_noise_about_a_level_is_a_constant() -> None:
    random = np.random.default_rng(2)
    network = fit_environment(sweep(500, 3)[:, None], 0.7 + random.normal(0.0, 0.1, 500))
    assert (network.model_class, network.n_parameters, len(network.weight)) == ("constant", 1, 0)
    assert network.linear[0] == 0.0
    assert network.bias == pytest.approx(0.7, abs=0.02)


def test_a_force_that_never_changes_is_a_constant() -> None:
    network = fit_environment(np.linspace(0.0, 1.0, 50)[:, None], np.full(50, 2.5))
    assert (network.model_class, network.bias, network.errors.nrmse) == ("constant", 2.5, 0.0)


def test_exactly_linear_data_are_linear() -> None:
    x = np.linspace(-1.0, 2.0, 50)
    network = fit_environment(x[:, None], 4.0 * x - 1.0)
    assert (network.model_class, len(network.weight), network.n_parameters) == ("linear", 0, 2)
    assert (network.linear[0], network.bias) == (pytest.approx(4.0), pytest.approx(-1.0))


@pytest.mark.parametrize("encoder_step", [0.0, 9.6e-5], ids=["exact", "encoder"])
def test_growth_on_data_without_noise_stops_at_sensor_resolution(encoder_step: float) -> None:
    """In a recording without noise more wavelets always reduce the error, but no sensor measures this."""
    x = sweep(3000, 6, encoder_step)
    force = 2.0 * x + 0.58 * np.logaddexp(0.0, (x - 0.4) / 0.01)
    network = fit_environment(x[:, None], force, starts=[0])
    assert network.model_class == "position"
    assert len(network.weight) <= 12
    assert network.errors.rmse <= 2.0**-16 * np.ptp(force)


def test_friction_between_strokes_is_accepted_as_hysteresis_without_wavelets() -> None:
    random = np.random.default_rng(4)
    x = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
    side = np.repeat([1.0, -1.0], 200)
    network = fit_environment(x[:, None], 2.0 * x + 0.3 * side + random.normal(0.0, 0.02, 400), side)
    assert (network.model_class, len(network.weight), network.n_parameters) == ("hysteresis", 0, 4)
    assert network.bias_hysteresis == pytest.approx(0.3, abs=0.01)
    assert network.play_radius is None


def test_equal_strokes_are_not_accepted_as_hysteresis_and_the_criterion_is_reported() -> None:
    misjudged = 0
    for draw in range(DRAWS):
        random = np.random.default_rng(draw)
        x = np.concatenate([np.linspace(0.0, 1.0, 150), np.linspace(1.0, 0.0, 150)])
        y = x + 0.3 * np.exp(-(((x - 0.5) / 0.1) ** 2)) + random.normal(0.0, 0.02, 300)
        network = fit_environment(x[:, None], y, np.repeat([1.0, -1.0], 150))
        misjudged += network.model_class != "position"
        assert "hysteresis: not accepted (raises BIC by " in sentences(network) or misjudged
    assert misjudged <= MOST_MISJUDGED


def test_rows_without_direction_are_dropped_and_counted() -> None:
    random = np.random.default_rng(6)
    x = np.concatenate([np.linspace(0.0, 1.0, 200), np.full(30, 1.0), np.linspace(1.0, 0.0, 200)])
    side = np.repeat([1.0, 0.0, -1.0], [200, 30, 200])
    y = 2.0 * x + 0.3 * side + random.normal(0.0, 0.02, len(x))
    y[side == 0] = 50.0
    network = fit_environment(x[:, None], y, side)
    assert network.model_class == "hysteresis"
    assert network.errors.rmse < 0.03
    assert "30 rows without a direction are not fitted." in network.log.rows


def test_rows_without_direction_are_used_if_hysteresis_is_not_accepted() -> None:
    random = np.random.default_rng(6)
    x = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 1.5, 60), np.linspace(1, 0, 200)])
    side = np.repeat([1.0, 0.0, -1.0], [200, 60, 200])
    network = fit_environment(x[:, None], 2.0 * x + random.normal(0.0, 0.02, len(x)), side)
    assert network.model_class == "linear"
    assert network.upper[0] == 1.5
    assert "hysteresis: not accepted (" in sentences(network)


@pytest.mark.full
def test_strokes_that_gain_energy_do_not_become_a_rapidly_changing_force() -> None:
    """In a periodic motion press and release are sampled at different positions; the alternation of both
    forces is not a force of position."""
    random = np.random.default_rng(3)
    cycle, sample = np.divmod(np.arange(1600), 80)
    phase = 2.0 * np.pi * (sample + 0.25) / 80 + 0.0005 * cycle
    x = 0.5 - 0.5 * np.cos(phase)
    y = 0.3 * x - 0.1 * np.sign(np.sin(phase)) + random.normal(0.0, 0.002, len(x))
    network = fit_environment(x[:, None], y, starts=[0])
    assert network.weight_hysteresis is None
    assert len(network.weight) <= 5
    between = np.linspace(0.02, 0.98, 5001)
    force = wavelet_columns(between, network.alpha, network.beta) @ network.weight
    force = force + network.linear[0] * between + network.bias
    assert np.abs(force - 0.3 * between).max() < 0.05
    assert any(
        note.startswith("hysteresis: press force >= release force imposed") for note in network.log.notes
    )


def test_noise_in_rows_unused_by_a_model_class_does_not_favour_it() -> None:
    """At the start of a motion the direction state is unknown: a smaller error there does not count."""
    for draw in range(200 if LONG else 5):
        time = np.arange(3000) / (2000.0 + 30.0 * draw)
        x = 1.0 - np.abs((2.0 * time) % 2.0 - 1.0)
        noise = np.random.default_rng(draw).normal(0.0, 0.01, len(x))
        network = fit_environment(x[:, None], 3.0 * x + noise, starts=[0])
        decision = network.log.decisions[-1]
        assert (decision.model_class, decision.outcome) == ("hysteresis", "not accepted")
        assert decision.reason.startswith("raises BIC by ")


def test_play_radius_is_found_from_the_motion_when_no_direction_is_given() -> None:
    """f = 2 x + 0.3 s (direction state s, play radius 1 % of the travel), with inner loops."""
    random = np.random.default_rng(7)
    t = np.linspace(0.0, 30.0, 6000)
    x = 0.5 - 0.5 * np.cos(t) * np.abs(np.cos(0.21 * t))
    x = (x - x.min()) / np.ptp(x)
    radius, play = 0.01, np.empty_like(x)
    play[0] = x[0]
    for k in range(1, len(x)):
        play[k] = min(x[k] + radius, max(x[k] - radius, play[k - 1]))
    y = 2.0 * x + 0.3 * np.clip((x - play) / radius, -1.0, 1.0) + random.normal(0.0, 0.01, len(x))
    network = fit_environment(x[:, None], y, starts=[0])
    assert network.model_class == "hysteresis"
    assert network.play_radius == pytest.approx(0.01, rel=0.01)
    assert network.n_parameters == 4 * len(network.weight) + 5
    assert network.errors.rmse == pytest.approx(0.01, rel=0.1)


def test_parameters_are_counted_as_every_fitted_number() -> None:
    x = np.linspace(0.0, 1.0, 400)
    y = np.maximum(x - 0.5, 0.0) * 10.0 + np.random.default_rng(8).normal(0.0, 0.01, 400)
    network = fit_environment(x[:, None], y)
    assert len(network.weight) > 0
    assert network.n_parameters == 3 * len(network.weight) + 2
    side = np.repeat([1.0, -1.0], 400)
    both = fit_environment(np.tile(x, 2)[:, None], np.tile(y, 2) + 0.5 * side, side)
    assert both.n_parameters == 4 * len(both.weight) + 4


def test_path_contains_every_considered_network() -> None:
    x = np.linspace(0.0, 1.0, 400)
    y = np.maximum(x - 0.5, 0.0) * 10.0 + np.random.default_rng(8).normal(0.0, 0.01, 400)
    network = fit_environment(x[:, None], y)
    classes = [point.model_class for point in network.log.path]
    assert classes[:2] == ["constant", "linear"]
    sizes = [point.n_wavelets for point in network.log.path if point.model_class == "position"]
    assert sizes[:-1] == list(range(len(sizes) - 1))
    assert sizes[-1] == len(network.weight)
    assert network.log.path[-1].rmse == pytest.approx(network.errors.rmse)
    assert network.stop_reason == "bic"


@pytest.mark.parametrize(
    ("force_at_contact", "below"),
    [(0.0, "free"), (0.4, "free"), (-0.4, "linear")],
    ids=["contact", "preload", "pulled"],
)
def test_force_below_the_domain_is_zero_if_the_object_was_left(force_at_contact: float, below: str) -> None:
    x = np.linspace(0.0, 1.0, 100)
    y = force_at_contact + 2.0 * x + np.random.default_rng(9).normal(0.0, 0.01, 100)
    network = fit_environment(x[:, None], y)
    assert network.below == below


def test_the_result_does_not_depend_on_units() -> None:
    x = np.linspace(0.0, 1.0, 300)
    y = np.maximum(x - 0.5, 0.0) * 10.0 + np.random.default_rng(8).normal(0.0, 0.01, 300)
    one = fit_environment(x[:, None], y)
    other = fit_environment(1e-6 * x[:, None] + 3.0, 1e3 * y)
    assert len(one.weight) == len(other.weight)
    np.testing.assert_allclose(other.alpha, 1e6 * one.alpha, rtol=1e-2)
    assert other.errors.nrmse == pytest.approx(one.errors.nrmse, rel=1e-3)


@pytest.mark.parametrize(
    ("positions", "force", "message"),
    [
        (np.full(20, 0.3), np.arange(20.0), "every position is 0.3"),
        (np.arange(9.0), np.arange(9.0), "9 rows; at least 10 are needed"),
        (np.repeat([0.0, 1.0], 10), np.arange(20.0), "2 distinct values; at least 3 are needed"),
        (np.append(np.arange(19.0), np.nan), np.arange(20.0), "position in row 19 is"),
        (np.arange(20.0), np.append(np.arange(19.0), np.inf), "force in row 19 is"),
    ],
    ids=["no-motion", "9-rows", "2-positions", "nan", "inf"],
)
def test_unusable_data_are_refused_in_one_sentence(
    positions: np.ndarray, force: np.ndarray, message: str
) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        fit_environment(positions[:, None], force)
    assert "\n" not in str(refusal.value)


def test_a_named_hysteresis_needs_directions_or_time() -> None:
    x = np.linspace(0.0, 1.0, 50)
    with pytest.raises(InputError, match="needs time, or both directions"):
        fit_environment(x[:, None], x, None, IdentifyOptions(inputs="position,hysteresis"))


def test_named_inputs_decide_the_model_class() -> None:
    random = np.random.default_rng(4)
    x = np.concatenate([np.linspace(0.0, 1.0, 100), np.linspace(1.0, 0.0, 100)])
    side = np.repeat([1.0, -1.0], 100)
    y = x + random.normal(0.0, 0.02, 200)
    named = fit_environment(x[:, None], y, side, IdentifyOptions(inputs="position, hysteresis"))
    plain = fit_environment(x[:, None], y + side, side, IdentifyOptions(inputs=("position",)))
    assert named.model_class == "hysteresis"
    assert plain.weight_hysteresis is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"inputs": "velocity"}, "inputs is"),
        ({"criterion": "aic"}, "criterion is 'aic': must be one of bic"),
        ({"max_wavelets": -1}, "max_wavelets is -1"),
        ({"max_wavelets": 2.5}, "max_wavelets is 2.5"),
        ({"search": {"frame_scale": 1.0}}, "search is"),
        ({"coupling_stiffness": -5.0}, "coupling_stiffness is -5.0"),
        ({"slope_bounds": (3.0, 1.0)}, r"slope_bounds is \(3.0, 1.0\)"),
        ({"slope_bounds": (95.0, 200.0), "coupling_stiffness": 100.0}, "at least 95 and at most 90"),
        ({"period": float("nan")}, "period is nan"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_a_bad_option_is_refused_by_name_and_value(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        IdentifyOptions(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"frame_scale": 1.0}, "frame_scale is 1.0"),
        ({"play_radius": (0.01, 0.0)}, "play_radius is 0.0"),
        ({"patience": 0}, "patience is 0: must be a whole number >= 1"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_a_bad_search_setting_is_refused_by_name_and_value(setting: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SearchOptions(**setting)  # type: ignore[arg-type]


def test_search_setting_given_as_an_option_is_refused_with_the_cure() -> None:
    with pytest.raises(InputError, match=r"no option 'patience'; give search=SearchOptions\(patience="):
        palpate.identify(np.arange(20.0), np.arange(20.0), patience=5)


def test_hysteresis_is_not_tested_if_motions_are_too_short_for_any_play() -> None:
    """Every third row starts a new motion, as in a recording whose time has a gap every few rows."""
    x = np.linspace(0.0, 1.0, 600)
    force = 2.0 * x + np.random.default_rng(5).normal(0.0, 1e-3, len(x))
    starts = [0, *range(70, len(x), 3)]
    network = fit_environment(x[:, None], force, starts=starts)
    assert network.model_class == "linear"
    assert "hysteresis: not tested (the motions" in sentences(network)
    with pytest.raises(InputError, match="inputs names hysteresis: the motions"):
        fit_environment(
            x[:, None], force, starts=starts, options=IdentifyOptions(inputs=("position", "hysteresis"))
        )


def test_hysteresis_is_not_tested_if_the_motion_never_turns_back() -> None:
    """Two magnets pulled apart: all rows with known direction state are one stroke, which does not determine
    the hysteresis h."""
    x = np.linspace(0.0, 1.0, 3000)
    force = 1e-4 / (x + 0.08) ** 4 + np.random.default_rng(7).normal(0.0, 0.005, len(x))
    network = fit_environment(x[:, None], force, starts=[0])
    assert network.model_class == "position"
    assert "never turn back" in sentences(network)
    with pytest.raises(InputError, match=r"inputs names hysteresis: .*never turn back"):
        fit_environment(
            x[:, None], force, starts=[0], options=IdentifyOptions(inputs=("position", "hysteresis"))
        )


def loop(height: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns press and release of the force 2 x, plus and minus half the height of the hysteresis loop."""
    n = len(height)
    x = np.concatenate([np.linspace(0.0, 1.0, n), np.linspace(1.0, 0.0, n)])
    side = np.repeat([1.0, -1.0], n)
    noise = np.random.default_rng(seed).normal(0.0, 0.004, 2 * n)
    return x[:, None], 2.0 * x + side * np.concatenate([height, height[::-1]]) + noise, side


def sentences(network: FittedNetwork) -> str:
    """Returns the decisions of the model selection as text, one line for each model class."""
    return "\n".join(map(str, network.log.decisions))


def sign_findings(network: FittedNetwork) -> list[str]:
    return [finding.sentence for finding in network.log.findings if "gains energy" in finding.sentence]


def test_a_loop_that_releases_stored_energy_names_the_option_that_helps() -> None:
    positions, force, side = loop(0.5 * np.sin(2.0 * np.pi * np.linspace(0.0, 1.0, 60)))
    network = fit_environment(positions, force, side)
    assert network.errors.nrmse > 0.3
    (sentence,) = sign_findings(network)
    assert "--no-hysteresis-nonnegative" in sentence
    cured = fit_environment(positions, force, side, IdentifyOptions(hysteresis_nonnegative=False))
    assert cured.errors.nrmse < 0.01
    assert sign_findings(cured) == []


def test_wavelet_limit_is_reported_if_the_error_is_structured() -> None:
    x = np.linspace(0.0, 1.0, 600)
    force = np.sin(40.0 * np.pi * x) + np.random.default_rng(0).normal(0.0, 0.02, len(x))

    def reported(max_wavelets: int) -> list[str]:
        network = fit_environment(x[:, None], force, None, IdentifyOptions(max_wavelets=max_wavelets))
        return [finding.sentence for finding in network.log.findings if "--max-wavelets" in finding.sentence]

    (sentence,) = reported(12)
    assert "12 wavelets, the largest number allowed" in sentence
    assert sentence.endswith("give --max-wavelets 48"), (
        "a period increased the error of cogging from 0.055 to 0.061"
    )
    assert reported(48) == []


def test_wavelet_limit_is_not_reported_if_the_error_is_noise() -> None:
    x = np.linspace(0.0, 1.0, 400)
    force = 0.3 * np.exp(-0.5 * ((x - 0.5) / 0.1) ** 2) + np.random.default_rng(0).normal(0.0, 0.05, 400)
    network = fit_environment(x[:, None], force, None, IdentifyOptions(max_wavelets=1))
    assert network.stop_reason == "max_wavelets"
    assert not any("--max-wavelets" in finding.sentence for finding in network.log.findings)


def test_a_value_of_the_best_candidate_is_computed_once() -> None:
    x = np.linspace(0.0, 1.0, 20)
    selection = select(Rows(("position",), x[:, None], x), IdentifyOptions(max_wavelets=0))
    computed: list[str] = []

    def name(of: ClassSelection) -> str:
        computed.append(of.best.model_class)
        return computed[-1]

    assert selection.once(name) == selection.once(name) == "linear"
    selection.best = constant(selection)
    assert selection.once(name) == "constant"
    assert computed == ["linear", "constant"]
