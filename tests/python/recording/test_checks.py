# SPDX-License-Identifier: Apache-2.0
"""Checks of a recording: each finding names value, cause and cure; clean recordings have no finding."""

import inspect
import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import palpate
from any_input import SCALE
from conftest import sampled
from corruptions import SEED, SYNTHETIC, Rows, base, base_names
from palpate import InputError, Recording, read_recording
from palpate.cli.main import main
from palpate.recording.checks import CHECKS, findings_of, quality_findings
from palpate.recording.checks.recordings import UNIT_RATIOS
from palpate.recording.contact import air_rows


def rows_of(name: str, draw: int = 0) -> Rows:
    return base(name, np.random.default_rng([SEED, draw]))


def sentences(*rows: Rows) -> list[str]:
    return [finding.sentence for finding in findings_of([each.recording() for each in rows])]


def only_sentence(*rows: Rows) -> str:
    """Returns the sentence of the finding; checks that the recordings have only one finding."""
    (sentence,) = sentences(*rows)
    return sentence


@pytest.mark.parametrize("name", base_names())
def test_a_clean_recording_has_no_finding(name: str) -> None:
    assert sentences(rows_of(name)) == []


@pytest.mark.parametrize("folder", ["keyswitches", "rubber_domes", "switch_springs"])
def test_clean_measured_files_have_no_finding(data: Path, folder: str) -> None:
    found = {}
    for path in sorted((data / folder).glob("*.csv"))[:: 1 if SCALE > 1 else 6]:
        if "latch" not in path.name and "lock" not in path.name:
            found[path.name] = quality_findings(palpate.read_recording(path))
    assert not any(found.values()), found


def test_a_clipped_force_is_reported_with_value_rows_and_cure() -> None:
    rows = rows_of("P1")
    limit = 5.0
    sentence = only_sentence(replace(rows, f=np.minimum(rows.f, limit)))
    assert f"the largest force, 5 N*m, occurs in {np.count_nonzero(rows.f >= limit)} rows" in sentence
    assert "clipped" in sentence
    assert sentence.endswith("record with a larger force range or press less far")


def test_a_force_clipped_at_its_lower_end_is_reported() -> None:
    rows = rows_of("P1")
    both = replace(rows, f=np.clip(rows.f - 6.0, -5.0, 1e9))
    assert "the least force, -5 N*m, occurs in" in only_sentence(both)


def test_a_force_clipped_near_zero_is_reported() -> None:
    rows = rows_of("P1")
    pulled = replace(rows, f=np.minimum(rows.f - 10.0, -1.0))
    assert "the largest force, -1 N*m, occurs in" in only_sentence(pulled)


def test_a_coarse_force_with_a_flat_maximum_is_not_clipped() -> None:
    x = np.linspace(0.0, 1e-2, 2000)
    f = np.round(50.0 * (1.0 - (x / 1e-2 - 0.5) ** 2) / 0.1) * 0.1
    assert sentences(Rows(x, f, None, None, {"position": "m", "force": "N"})) == []


def test_a_force_of_zero_before_the_contact_is_not_clipped() -> None:
    x = np.linspace(0.0, 1e-2, 2000)
    f = np.round(np.maximum(0.0, 1e4 * (x - 4e-3)), 2)
    assert sentences(Rows(x, f, None, None, {"position": "m", "force": "N"})) == []


def test_a_pause_before_a_reversal_is_not_a_clipped_position() -> None:
    t = np.linspace(0.0, 1.0, 500)
    x = np.r_[t**0.5, np.ones(60), 1.0 - t**2]
    relaxing = np.linspace(1.0, 0.7, 60)
    f = np.r_[1.0 * t**0.5 + 0.1, relaxing, 0.8 * (1.0 - t**2) - 0.1]
    assert sentences(Rows(1e-2 * x, f, None, None, {"position": "m", "force": "N"})) == []


@pytest.mark.parametrize("name", ["P1", "P2", "loop", "sweeps", "sample"])
@pytest.mark.parametrize("reversed_role", ["force", "position", "direction"])
def test_a_reversed_sign_is_reported_and_the_correct_sign_has_no_finding(
    name: str, reversed_role: str
) -> None:
    rows = rows_of(name)
    if reversed_role == "force":
        wrong, right = replace(rows, f=-rows.f), rows
    elif reversed_role == "position":
        wrong, right = replace(rows, x=-rows.x), rows
    elif rows.d is None:
        pytest.skip("has no direction")
    else:
        wrong, right = replace(rows, d=-rows.d), rows
    assert any("--negate" in sentence for sentence in sentences(wrong))
    assert sentences(right) == []


def late_spring(lag_s: float) -> Rows:
    """Returns rows of a spring that a hand presses twice, with a late force."""
    time = 0.005 * np.arange(800.0)
    x = 0.5 - 0.5 * np.cos(np.pi * time)
    return Rows(0.01 * x, np.interp(time - lag_s, time, 3.0 * x), time, None, {"position": "m", "force": "N"})


def test_a_release_above_the_press_that_no_hand_notices_is_not_reported() -> None:
    """A lag of 5 ms raises the release by 1.3 % of the largest force."""
    assert sentences(late_spring(0.005)) == []


def test_a_force_that_rises_has_no_reversed_sign() -> None:
    sentence = only_sentence(late_spring(0.04))
    assert "above that on press; a passive object cannot do that: if the force was recorded late" in sentence
    assert "--negate" not in sentence


def test_a_delay_is_named_as_a_cause_only_with_time() -> None:
    with_time = rows_of("sweeps")
    reversed_force = replace(with_time, f=-with_time.f)
    assert any("--force-late-s" in sentence for sentence in sentences(reversed_force))
    assert not any("--force-late-s" in sentence for sentence in sentences(replace(reversed_force, t=None)))


@pytest.mark.parametrize(("name", "factor"), [("P2", 1e3), ("P2", 1e-3), ("P1", 1e3), ("loop", 1e3)])
def test_an_implausible_travel_is_reported_as_a_wrong_unit(name: str, factor: float) -> None:
    rows = rows_of(name)
    found = sentences(replace(rows, x=factor * rows.x))
    assert any("the unit of position or force is probably wrong" in sentence for sentence in found)


@pytest.mark.parametrize(
    ("name", "units", "factor"),
    [("pull_mm", {}, 1.5), ("pull_cm", {}, 0.1), ("pull_m", {"pull_m": "m"}, 0.001)],
)
def test_a_stated_unit_of_a_long_travel_is_not_doubted(
    csv_file: Callable[..., Path], name: str, units: dict[str, str], factor: float
) -> None:
    path = csv_file(f"{name},force_N", [f"{factor * k},{5 + k % 7}" for k in range(1000)])
    assert not any("unit" in each.sentence for each in quality_findings(read_recording(path, units=units)))
    if units:
        (finding,) = (each for each in quality_findings(read_recording(path)) if "the unit" in each.sentence)
        assert finding.sentence.endswith("for example --units pull_m=m if it is m")


def test_the_ranges_of_a_microscope_recording_are_plausible() -> None:
    x = np.linspace(0.0, 3e-6, 500)
    assert sentences(Rows(x, 0.01 * x, None, None, {"position": "m", "force": "N"})) == []


@cache
def three_agree() -> bool:
    return sentences(*(rows_of("P2", draw) for draw in range(3))) == []


@pytest.mark.parametrize(
    "ratio",
    sampled([*UNIT_RATIOS, *(1.0 / each for each in UNIT_RATIOS)], *UNIT_RATIOS, 1.0 / max(UNIT_RATIOS)),
)
@pytest.mark.parametrize("role", ["position", "force"])
def test_a_recording_in_another_unit_than_the_others_is_reported_with_the_ratio(
    ratio: float, role: str
) -> None:
    first, second, third = (rows_of("P2", draw) for draw in range(3))
    assert three_agree()
    wrong = replace(second, x=second.x / ratio) if role == "position" else replace(second, f=second.f / ratio)
    recordings = [each.recording() for each in (first, wrong, third)]
    (finding,) = [each for each in findings_of(recordings) if "agrees with" in each.sentence]
    assert finding.level == "no"
    assert finding.sentence.startswith("recording 2 agrees with recording 1 only if")
    assert f"its {role} is multiplied by {ratio:.4g}" in finding.sentence


def test_recordings_of_two_objects_are_reported() -> None:
    first, second = rows_of("P2", 0), rows_of("P2", 1)
    sentence = only_sentence(first, replace(second, f=3.0 * second.f))
    assert "recording 2 and recording 1 differ by" in sentence or "recording 1 and recording 2" in sentence
    assert sentence.endswith("identify them separately")


@pytest.mark.parametrize("name", sampled(SYNTHETIC, "P2", "loop", "sample"))
def test_two_objects_in_one_file_are_not_called_good(name: str) -> None:
    rows = rows_of(name)
    rows = rows.take(np.arange(0, len(rows), 2))
    t = None if rows.t is None else np.r_[rows.t, rows.t + rows.t[-1] + rows.t[1]]
    d = None if rows.d is None else np.r_[rows.d, rows.d]
    both = Rows(np.r_[rows.x, rows.x], np.r_[rows.f, 2.0 * rows.f], t, d, rows.units)
    verdict = palpate.identify(both.recording()).verdict
    assert verdict.level != "good"
    if name in ("P2", "loop", "sweeps"):  # the others have two halves of opposite forces, or many strokes
        (reason,) = (each for each in verdict.reasons if "separately with --rows" in each)
        assert re.match(r"from the first row to the last .* rises by", reason)
    assert sentences(rows) == []


def test_positions_without_rows_are_reported_for_the_whole_recording_and_for_one_stroke() -> None:
    rows = rows_of("loop")
    gap = (rows.x > 1e-3) & (rows.x < 1.5e-3)
    assert "the recording has no rows from 0.00" in only_sentence(rows.take(~gap))
    one = only_sentence(rows.take(~gap | (rows.d == -1)))
    assert "the press stroke has no rows from 0.00" in one
    assert "13% of the travel" in one or "12% of the travel" in one


def test_a_stroke_that_ends_early_is_reported() -> None:
    rows = rows_of("loop")
    assert "the release stroke has no rows from 0 to 0.0005" in only_sentence(
        rows.take((rows.d == 1) | (rows.x > 5e-4))
    )


def test_a_release_that_ends_early_needs_no_direction_to_be_reported() -> None:
    """The hysteresis of half of the travel was extrapolated, and the model called good."""
    x = np.r_[np.linspace(0.0, 4e-3, 400), np.linspace(4e-3, 2e-3, 200)]
    force = 800.0 * x + np.repeat([0.1, -0.1], [400, 200])
    verdict = palpate.identify(palpate.Recording.from_arrays(x, force)).verdict
    assert verdict.level == "usable"
    assert "the release stroke has no rows from 0 to 0.00" in str(verdict)


def test_a_force_that_lets_go_does_not_fall_over_the_whole_file() -> None:
    """The force of a suction cup rises over 9 mm of 14 mm; the tool then returns in one step."""
    x = np.tile(np.linspace(0.0, 14.0, 400), 3)
    force = np.where(x < 9.0, 30.0 * np.tanh(x / 6.0) + 0.8 * x, 0.0)
    force += np.random.default_rng(0).normal(0.0, 0.05, len(x))
    assert float(np.corrcoef(x, force)[0, 1]) < -0.3
    recording = palpate.Recording.from_arrays(1e-3 * x, force)
    assert not [each for each in quality_findings(recording) if "falls with position" in each.sentence]


def test_a_jump_back_does_not_decide_how_far_the_force_falls() -> None:
    x = np.tile(np.linspace(0.1, 4.0, 500), 3)
    force = 38.0 / (1.0 + x) ** 2
    correlation = float(np.corrcoef(x, force)[0, 1])
    (finding,) = quality_findings(palpate.Recording.from_arrays(1e-3 * x, force))
    assert f"over the whole file (correlation {correlation:.2f})" in finding.sentence


def test_waits_do_not_decide_whether_the_force_falls_with_position() -> None:
    random = np.random.default_rng(0)
    press = np.linspace(0.0, 4.0, 400)
    x = np.concatenate([np.zeros(2000), press, np.full(2000, 4.0), press[::-1]])
    force = np.cos(1.25 * np.pi * x) + random.normal(0.0, 1e-3, len(x))
    recording = palpate.Recording.from_arrays(1e-3 * x + random.normal(0.0, 1e-7, len(x)), force)
    assert float(np.corrcoef(x, force)[0, 1]) < -0.9
    assert not [each for each in quality_findings(recording) if "falls with position" in each.sentence]


def test_the_rate_of_the_rows_does_not_decide_whether_the_force_falls() -> None:
    """A tester stores many rows where the force changes: in the rise and in the release at the largest x."""
    time = np.r_[np.arange(0.0, 5.0, 0.01), np.arange(5.0, 25.0, 0.4), np.arange(25.0, 30.0, 0.01)]
    x = np.round(np.interp(time, [0.0, 5.0, 25.0, 30.0], [0.0, 0.05, 0.3, 0.25]), 5)
    force = np.where(time < 25.0, 1.0 - np.exp(-x / 0.015), 1.0 - 20.0 * (0.3 - x))
    force += np.random.default_rng(2).normal(0.0, 1e-3, len(time))
    recording = palpate.Recording.from_arrays(x, force, time=time)
    assert not [each for each in quality_findings(recording) if "falls with position" in each.sentence]


def test_findings_on_several_recordings_name_the_recording() -> None:
    first, second = rows_of("P1", 0), rows_of("P1", 1)
    assert only_sentence(first, replace(second, f=np.minimum(second.f, 8.0))).startswith(
        "recording 2: the largest force"
    )


def test_a_clipped_file_gets_the_verdict_usable_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = rows_of("P1")
    rows = rows.take(np.arange(0, len(rows), 4))
    path = replace(rows, f=np.minimum(rows.f, 5.0)).recording().write(tmp_path / "press.csv")
    assert main(["identify", str(path), "-o", str(tmp_path / "press.json"), "--json"]) == 0
    verdict = json.loads(capsys.readouterr().out)["verdict"]
    assert verdict.startswith("usable: the largest force, 5 N*m, occurs in")


def sign_sentence(force_of: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> str:
    time = np.arange(8000) * 1e-3
    position = 0.5 - 0.5 * np.cos(2.0 * np.pi * 0.5 * time)
    force = force_of(time, position) + np.random.default_rng(0).normal(0.0, 0.002, len(time))
    side = np.sign(np.sin(2.0 * np.pi * 0.5 * time))
    units = {"position": "rad", "force": "N*m"}
    recorded = palpate.Recording.from_arrays(position, force, time, side, units=units)
    (sentence,) = (each for each in recorded.verdict.reasons if each.startswith("on average the force"))
    return sentence


def test_a_late_force_is_advised_to_be_moved() -> None:
    late = sign_sentence(lambda time, _: 1.0 - np.cos(2.0 * np.pi * 0.5 * (time - 0.025)))
    assert "if the force was recorded late, give its delay, --force-late-s SECONDS;" in late


def test_a_friction_of_the_wrong_sign_is_not_advised_to_be_late() -> None:
    driven = sign_sentence(lambda time, x: 0.2 * x - 0.5 * np.sign(np.sin(2.0 * np.pi * 0.5 * time)))
    assert "--negate force" in driven
    assert "--force-late-s" not in driven


def magnet(sign: float, seed: int) -> palpate.Recording:
    """Returns a slow press and release by hand on a magnet, whose force begins nowhere."""
    x = 0.02 * 0.5 * (1.0 - np.cos(np.linspace(0.0, 4.0 * np.pi, 1000)))
    f = sign * 5.0 * (0.3 / (1.3 - x / 0.02)) ** 3
    return palpate.Recording.from_arrays(x, f + np.random.default_rng(seed).normal(0.0, 0.005, len(x)))


@pytest.mark.parametrize("seed", range(5))
def test_the_force_of_a_magnet_is_not_that_of_air(seed: int) -> None:
    repelling = magnet(1.0, seed)
    assert repelling.verdict.level == "good"
    assert not air_rows(repelling.position, repelling.force, repelling.motion.moving).any()


def test_a_stated_attraction_needs_no_other_sign() -> None:
    attracting = magnet(-1.0, 0)
    automatic = palpate.identify(attracting)
    assert automatic.verdict.level == "usable"
    assert "if the object attracts the tool identify it with --below linear" in str(automatic.verdict)
    stated = palpate.identify(attracting, below="linear")
    assert stated.verdict.level == "good"
    np.testing.assert_array_equal(stated.force(attracting.position), automatic.force(attracting.position))


def held(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns a press, a hold in which the force relaxes by a share, and a fast release [m, N]."""
    press, relaxing = np.linspace(0.0, 5e-3, 500), np.linspace(0.0, 5.0, 2000)
    x = np.concatenate([press, np.full(2000, 5e-3), press[::-10]])
    force = 60.0 * press + 1.4e4 * press**2
    last = force[-1] * (1.0 - share * (1.0 - np.exp(-relaxing)))
    f = np.concatenate([force, last, force[::-10] * (1.0 - share)])
    return x, f + np.random.default_rng(0).normal(0.0, 1e-4, len(x))


@pytest.mark.parametrize("share", [0.05, 0.4])
def test_a_hold_in_which_the_force_relaxes_is_not_a_clipped_sensor(share: float) -> None:
    x, f = held(share)
    found = sentences(Rows(x, f, None, None, {"position": "m", "force": "N"}))
    assert not [sentence for sentence in found if "clipped" in sentence]


def contact(friction: float = 0.0, pull: float = 0.0, noise: float = 2e-3) -> tuple[np.ndarray, np.ndarray]:
    """Returns positions [m] and forces [N] of a press and a release, with friction and adhesion."""
    press = np.linspace(0.0, 4e-3, 800)
    x = np.concatenate([press, press[::-1]])
    way = np.repeat([1.0, -1.0], 800)
    f = 500.0 * x + way * friction - np.where(way < 0, pull * np.exp(-(((x - 5e-4) / 3e-4) ** 2)), 0.0)
    return x, f + np.random.default_rng(0).normal(0.0, noise, len(x))


def zero_sentences(x: np.ndarray, f: np.ndarray) -> list[str]:
    found = sentences(Rows(x, f, None, None, {"position": "m", "force": "N"}))
    return [each for each in found if "zero of the force" in each or "opposite sign" in each]


@pytest.mark.parametrize("shift", [-0.05, -0.12, -0.3])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_a_release_with_another_zero_is_reported(shift: float, scale: float) -> None:
    x, f = contact()
    f[800:] += shift * 2.0
    (sentence,) = zero_sentences(x, scale * f)
    assert sentence.startswith("the release ends at -")
    assert sentence.endswith("record again without a tare in between")


def test_a_stroke_with_the_wrong_sign_gets_the_verdict_no() -> None:
    x, f = contact(friction=0.02)
    f[800:] *= -1.0
    (sentence,) = zero_sentences(x, f)
    assert sentence.endswith("Change the sign of the force of one stroke")
    recording = palpate.Recording.from_arrays(x, f)
    assert recording.verdict.level == "no"
    assert palpate.identify(recording).verdict.level == "no"


@pytest.mark.parametrize(
    "clean",
    [
        contact(),
        contact(friction=0.3),
        contact(pull=0.4),
        contact(friction=0.05, pull=0.2),
        contact(noise=0.05),
    ],
    ids=["clean", "friction", "adhesion", "both", "noisy"],
)
def test_friction_and_adhesion_are_not_a_second_zero(clean: tuple[np.ndarray, np.ndarray]) -> None:
    assert zero_sentences(*clean) == []


def test_a_stop_that_pulls_in_both_strokes_is_not_a_second_zero() -> None:
    press = np.linspace(0.0, 1.1, 800)
    x = np.tile(np.r_[press, press[::-1]], 2)
    stop = 0.6 * np.logaddexp(0.0, (0.03 - x) / 0.01)
    f = 4.0 * x - stop + np.tile(np.repeat([0.1, -0.1], 800), 2)
    f += np.random.default_rng(0).normal(0.0, 0.03, len(x))
    assert zero_sentences(x, f) == []


def test_a_nearly_constant_friction_is_not_a_mirrored_stroke() -> None:
    x, _ = contact()
    f = np.repeat([1.0, -1.0], 800) * (0.3 + 5.0 * x) + np.random.default_rng(0).normal(0.0, 1e-3, 1600)
    assert zero_sentences(x, f) == []


def test_few_rows_of_an_approach_through_air_are_not_a_gap() -> None:
    press = np.r_[-1.2e-3, -0.8e-3, -0.3e-3, np.linspace(0.0, 4e-3, 400)]
    x = np.r_[press, press[::-1]]
    f = 500.0 * np.maximum(x, 0.0) + np.random.default_rng(0).normal(0.0, 2e-3, len(x))
    found = sentences(Rows(x, f, None, None, {"position": "m", "force": "N"}))
    assert not [each for each in found if "no rows" in each]


def cycles_with_signs(*signs: float, friction: float = 0.1) -> list[str]:
    """Returns the sentences on strokes of a spring with friction, each stored with one of the signs."""
    press = np.linspace(0.0, 4e-3, 300)
    strokes = [press if number % 2 == 0 else press[::-1] for number in range(len(signs))]
    force = [
        sign * (500.0 * x + (friction if number % 2 == 0 else -friction))
        for number, (sign, x) in enumerate(zip(signs, strokes, strict=True))
    ]
    noise = np.random.default_rng(0).normal(0.0, 2e-3, 300 * len(signs))
    return zero_sentences(np.concatenate(strokes), np.concatenate(force) + noise)


@pytest.mark.parametrize("wrong", range(4))
def test_one_of_several_strokes_with_the_wrong_sign_is_named(wrong: int) -> None:
    (sentence,) = cycles_with_signs(*(-1.0 if number == wrong else 1.0 for number in range(4)))
    assert f"the {('press', 'release')[wrong % 2]} from row" in sentence
    assert "have forces with opposite signs" in sentence
    assert "zero of the force" not in sentence


def test_friction_that_grows_with_the_position_in_two_cycles_is_not_a_wrong_sign() -> None:
    assert cycles_with_signs(1.0, -1.0, 1.0, -1.0) == []
    (sentence,) = cycles_with_signs(1.0, -1.0)
    assert "the object has only friction, which grows with the position" in sentence


def test_a_release_that_pulls_less_than_the_press_pushes_is_not_a_wrong_sign() -> None:
    x, _ = contact()
    f = np.r_[500.0 * x[:800], -100.0 * x[800:]]
    assert not [each for each in zero_sentences(x, f) if "opposite sign" in each]


def test_an_inertia_at_several_speeds_is_not_a_wrong_sign() -> None:
    time = np.arange(0.0, 6.0, 2e-3)
    phase = np.cumsum(2.0 * np.pi * 2e-3 * (1.0 + 0.4 * np.sin(2.7 * time)))
    x = np.cos(phase)
    f = 40.0 * x + np.gradient(np.gradient(x, time), time)
    assert zero_sentences(x, f) == []


def test_rows_that_wait_do_not_hide_a_second_zero() -> None:
    x, f = contact()
    f[800:] -= 0.24
    wait = np.random.default_rng(1).normal(0.0, 2e-3, 3000)
    assert len(zero_sentences(np.concatenate([np.zeros(3000), x]), np.concatenate([wait, f]))) == 1


def slow_then_fast() -> palpate.Recording:
    """Returns three slow cycles of a damped spring, then six cycles at four times the speed."""
    knots = np.r_[np.arange(0.0, 24.1, 4.0), 24.0 + np.arange(1.0, 12.1)]
    time = np.arange(0.0, knots[-1], 0.01)
    x = np.interp(time, knots, 5e-3 * (np.arange(len(knots)) % 2))
    f = 200.0 * x + 40.0 * np.gradient(x, time) + np.random.default_rng(0).normal(0.0, 3e-3, len(x))
    return palpate.Recording.from_arrays(x, f, time, units={"position": "m", "force": "N"})


@pytest.mark.full
def test_a_force_that_the_velocity_explains_has_not_changed() -> None:
    model = palpate.identify(slow_then_fast())
    assert model.damping is not None
    assert model.verdict.level == "good"


def test_each_check_has_its_own_function_and_uses_its_thresholds() -> None:
    assert len({check.defect for check in CHECKS}) == len({check.findings for check in CHECKS}) == len(CHECKS)
    for check in CHECKS:
        keywords = set(inspect.signature(check.findings).parameters) - {"checked"}
        assert keywords == set(check.thresholds), check.defect


def in_air(offset: float) -> Recording:
    """Returns a press and release of a spring, with an approach of half a millimetre."""
    there = np.linspace(-0.5e-3, 4e-3, 800)
    position = np.r_[there, there[::-1]]
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(position))
    force = np.where(position > 0.0, 2e3 * position, 0.0) + noise + offset
    return Recording.from_arrays(position, force, units={"position": "m", "force": "N"})


def test_a_force_before_the_contact_is_named_with_the_option_that_removes_it(tmp_path: Path) -> None:
    assert not in_air(0.0).verdict.findings
    (finding,) = in_air(0.8).verdict.findings
    assert "the force before the contact is 0.80" in finding.sentence
    assert finding.sentence.endswith("add --zero air")
    path = tmp_path / "press.csv"
    in_air(0.8).write(path)
    zeroed = read_recording(path, zero="air")
    assert not zeroed.verdict.findings
    np.testing.assert_allclose(zeroed.force, in_air(0.0).force, atol=0.002)


def test_a_sensor_without_rows_before_the_contact_cannot_be_zeroed_by_them(tmp_path: Path) -> None:
    position = np.linspace(0.0, 4e-3, 100)
    path = tmp_path / "press.csv"
    Recording.from_arrays(position, 2e3 * position, units={"position": "m", "force": "N"}).write(path)
    with pytest.raises(InputError, match="--zero air finds no rows before the contact"):
        read_recording(path, zero="air")


def test_a_part_that_breaks_has_no_wrong_sign_and_a_force_of_many_kilonewtons_no_wrong_unit() -> None:
    position = np.linspace(0.0, 4e-3, 800)
    force = np.where(position > 2.5e-3, 0.1, 1.0) * 1.5e7 * position
    broken = Recording.from_arrays(position, force, units={"position": "m", "force": "N"})
    assert not [
        each for each in broken.verdict.findings if "sign" in each.sentence or "unit" in each.sentence
    ]
