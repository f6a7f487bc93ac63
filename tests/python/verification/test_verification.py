# SPDX-License-Identifier: Apache-2.0
"""Comparison of a model with a recording, row by row."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from imperfect import press_and_release
from palpate import (
    InputError,
    Model,
    Recording,
    identify,
    load_model,
    read_recording,
    verify,
)
from palpate._core.model import Memory, play
from palpate.model import Fit
from palpate.plotting import plot
from palpate.recording import Source, sample_recording
from palpate.recording.units import Unit
from palpate.verification import compare
from palpate.verification.metrics import noticed_findings

RAD = {"position": "rad", "force": "N*m"}
NOISE = 0.01


def model_of(data: Source, hysteresis: bool = False, **change: Any) -> Model:
    """Returns a model of force 2 x + 1 for x in [0, 1]; with hysteresis h = 0.25 + 0.5 x if requested."""
    given: dict[str, Any] = {
        "kind": "hysteresis" if hysteresis else "position",
        "inputs": ["position"],
        "units": RAD,
        "alpha": np.empty((0, 1)),
        "beta": np.empty((0, 1)),
        "weight": [],
        "linear": [2.0],
        "bias": 1.0,
        "lower": [0.0],
        "upper": [1.0],
        "fit": Fit("linear", "bic", 0.1, 0, 2),
        "data": data,
    }
    if hysteresis:
        given |= {"weight_hysteresis": [], "linear_hysteresis": [0.5], "bias_hysteresis": 0.25}
    return Model(**given | change)


def stroke(n: int = 400, seed: int = 1, direction: bool = True) -> Recording:
    """Returns a press and a release of the hysteresis model, with noise."""
    x = np.concatenate([np.linspace(0, 1, n), np.linspace(1, 0, n)])
    s = np.repeat([1, -1], n)
    noise = np.random.default_rng(seed).normal(0.0, NOISE, 2 * n)
    force = 2 * x + 1 + s * (0.25 + 0.5 * x) + noise
    return Recording.from_arrays(x, force, direction=s if direction else None, units=RAD)


def curve(seed: int = 1, n: int = 1000) -> Recording:
    x = np.linspace(0, 1, n)
    return Recording.from_arrays(x, 2 * x + 1 + np.random.default_rng(seed).normal(0, NOISE, n), units=RAD)


def test_every_error_follows_its_definition() -> None:
    recording = curve()
    result = verify(model_of(stroke().source), recording)
    residual = 2 * recording.position + 1 - recording.force
    assert result.rmse == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-12)
    assert result.mse == pytest.approx(np.mean(residual**2), rel=1e-12)
    assert result.nrmse == pytest.approx(result.rmse / np.std(recording.force), rel=1e-12)
    assert result.r2 == pytest.approx(
        1 - np.sum(residual**2) / np.sum((recording.force - recording.force.mean()) ** 2)
    )
    assert result.worst == pytest.approx(np.abs(residual).max(), rel=1e-12)
    assert result.within_jnd == 1.0
    assert result.jnd_floor == pytest.approx(0.01 * np.abs(recording.force).max())
    assert result.stiffness_within_jnd == 1.0
    assert abs(result.whiteness) < 0.1
    assert result.durbin_watson == pytest.approx(2.0, abs=0.2)
    assert (result.n, result.extrapolated, result.units) == (1000, 0, RAD)
    np.testing.assert_allclose(result.residual, residual, atol=1e-14)
    np.testing.assert_allclose(result.force, 2 * recording.position + 1, rtol=1e-14)
    assert result.rows.all()


def test_rows_outside_the_domain_are_counted() -> None:
    model = model_of(stroke().source, lower=[0.25], upper=[0.75])
    assert verify(model, curve()).extrapolated == 500


def test_direction_selects_press_or_release_force() -> None:
    result = verify(model_of(curve().source, hysteresis=True), stroke())
    assert result.rmse == pytest.approx(NOISE, rel=0.1)
    assert result.stiffness_within_jnd == 1.0


def test_the_stiffness_is_that_of_each_stroke() -> None:
    # The press is half steeper, the release half flatter: perceptible in each stroke, but not in their mean.
    recording = stroke()
    assert recording.direction is not None
    wrong = Recording.from_arrays(
        recording.position,
        2 * recording.position + 1 + recording.direction * recording.position,
        direction=recording.direction,
        units=RAD,
    )
    assert verify(model_of(curve().source), wrong).stiffness_within_jnd == 0.0


def test_rows_without_direction_are_dropped_and_counted() -> None:
    recording = stroke()
    assert recording.direction is not None
    words = recording.direction.copy()
    words[100:150] = 0
    force = recording.force.copy()
    force[100:150] = 1e6
    resting = Recording.from_arrays(recording.position, force, direction=words, units=RAD)
    result = verify(model_of(curve().source, hysteresis=True), resting)
    assert result.n == 750
    assert np.count_nonzero(~result.rows) == 50
    assert result.rmse == pytest.approx(NOISE, rel=0.1)
    assert "50 rows without a direction (pause, hold) are not compared." in result.notes


def test_a_single_valued_model_keeps_rows_without_a_direction() -> None:
    recording = stroke()
    resting = Recording.from_arrays(
        recording.position, recording.force, direction=np.zeros(len(recording)), units=RAD
    )
    assert verify(model_of(curve().source), resting).n == len(recording)


def test_without_a_direction_the_play_operator_follows_the_motion() -> None:
    model = model_of(curve().source, hysteresis=True, play_radius=0.005)
    result = verify(model, stroke(direction=False))
    # The direction state is 1 or -1, as in a file with directions, except for 2 play radii after reversals.
    assert np.mean(np.abs(result.residual) < 4 * NOISE) > 0.98
    assert "the play operator follows the positions" in result.notes[0]


def test_the_play_operator_follows_a_motion_also_if_its_directions_are_stated() -> None:
    """Near a turn s is not +-1: a direction column would give another force there."""
    model, recording = model_of(curve().source, hysteresis=True, play_radius=0.005), stroke()
    without, stated = verify(model, replace(recording, direction=None)), verify(model, recording)
    assert (stated.force == without.force).all()
    assert recording.direction is not None
    mixed = np.random.default_rng(0).permutation(len(recording))
    x, force, side = (each[mixed] for each in (recording.position, recording.force, recording.direction))
    assert verify(model, Recording.from_arrays(x, force, direction=side, units=RAD)).n == len(recording)


@pytest.mark.parametrize("timed", [False, True])
def test_without_direction_and_play_radius_the_strokes_follow_from_the_order_of_rows(timed: bool) -> None:
    table = stroke(direction=False)
    time = 1e-3 * np.arange(len(table)) if timed else None
    motion = Recording.from_arrays(table.position, table.force, time, units=RAD)
    result = verify(model_of(curve().source, hysteresis=True), motion)
    assert np.mean(np.abs(result.residual) < 4 * NOISE) > 0.99
    assert result.notes[0] == "The direction is taken from the order of rows: 1 turn."


def test_rows_without_order_direction_and_play_radius_take_one_percent_of_the_travel_and_name_it() -> None:
    table = stroke(direction=False)
    mixed = np.random.default_rng(1).permutation(len(table))
    motion = Recording.from_arrays(table.position[mixed], table.force[mixed], units=RAD)
    result = verify(model_of(curve().source, hysteresis=True), motion)
    assert "radius is 0.01 rad, 1 % of the travel" in result.notes[0]


def test_a_play_radius_that_is_given_is_used_even_with_a_direction() -> None:
    model = model_of(curve().source, hysteresis=True, play_radius=0.005)
    result = verify(model, stroke(), play_radius=0.02)
    assert "radius is 0.02 rad, as given" in result.notes[0]
    assert result.rmse != verify(model, stroke()).rmse
    with pytest.raises(InputError, match="play_radius is -1"):
        verify(model, stroke(), play_radius=-1)


def test_the_play_of_held_out_rows_follows_the_rows_between_them() -> None:
    """Every 60th row of a fast motion is held out; its direction state depends on the other rows."""
    time = np.arange(6000) * 1e-3
    x = 0.5 - 0.45 * np.cos(2 * np.pi * 3.0 * time) * np.cos(2 * np.pi * 0.11 * time)
    model = model_of(curve().source, hysteresis=True, play_radius=0.05)
    force = model.force(x, play=model.play(x))
    _, held = Recording.from_arrays(x, force, time, units=RAD).split(60)
    assert verify(model, held).worst < 1e-12


def curved() -> Model:
    """Returns a model whose force is curved: an offset of the position differs from one of the force."""
    wavelet = {"alpha": [[4.0]], "beta": [[0.3]], "weight": [2.0], "linear": [0.5]}
    return model_of(stroke().source, **wavelet, fit=Fit("position", "bic", 0.1, 1, 5))


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"force": lambda x, f: f * 1e3}, r"force is multiplied by (0.001|0.000999\d?): it may be in mNm"),
        ({"force": lambda x, f: f / 7.0}, r"force is multiplied by (7|6.99\d?|7.00\d): the gain may differ"),
        ({"force": lambda x, f: -f}, "with the opposite sign of the recorded force: give --negate force"),
        (
            {"force": lambda x, f: f + 5.0},
            r"if (5|4.999|5.001) N\*m is subtracted from the recorded force: the sensor may have an offset",
        ),
        ({"position": lambda x, f: 180 / np.pi * x}, "position is multiplied by 0.01745: it may be in deg"),
        (
            {"position": lambda x, f: x - 0.4},
            r"if (0.4|0.3999|0.4001)\d? rad is added to the recorded position",
        ),
        (
            {"position": lambda x, f: -x},
            "with the opposite sign of the recorded position: give --negate position",
        ),
        (
            {"position": lambda x, f: -x, "force": lambda x, f: -f},
            "with the opposite signs of the recorded position and force: give --negate position --negate f",
        ),
    ],
    ids=["unit", "gain", "force-sign", "offset", "degrees", "zero", "position-sign", "both-signs"],
)
def test_large_error_reports_the_change_that_makes_the_model_fit(
    changed: dict[str, Any], sentence: str
) -> None:
    model = curved()
    x = np.random.default_rng(1).uniform(0.0, 1.0, 500)
    force = model.force(x) + np.random.default_rng(2).normal(0.0, NOISE, 500)
    given = {"position": x, "force": force}
    given |= {role: change(x, force) for role, change in changed.items()}
    verdict = verify(model, Recording.from_arrays(**given, units=RAD)).verdict
    assert verdict.level == "no"
    causes = [reason for reason in verdict.reasons if reason.startswith("the model fits ")]
    assert len(causes) == 1
    assert re.search(sentence, causes[0])


SWEPT_TIME = np.arange(3000) * 1e-3
"""[s]"""

SWEPT = 0.5 - 0.4 * np.cos(2 * np.pi * 1.7 * SWEPT_TIME) * np.cos(2 * np.pi * 0.3 * SWEPT_TIME)
"""Positions of a motion by hand [rad]"""


@pytest.mark.parametrize(
    ("shifted", "delay", "sentence"),
    [
        (0.01, 0.0, r"0\.01 rad is subtracted from the recorded pos"),
        (0.0, 0.02, r"0\.02 s late: give --force-l"),
    ],
)
def test_a_cause_is_named_for_an_error_that_is_noticed(shifted: float, delay: float, sentence: str) -> None:
    model = curved()
    force = model.force(np.interp(SWEPT_TIME - delay, SWEPT_TIME, SWEPT))
    found = verify(model, Recording.from_arrays(SWEPT + shifted, force, SWEPT_TIME, units=RAD))
    assert found.verdict.level == "usable"
    assert re.search(f"the model fits if .*{sentence}", str(found.verdict))


def test_a_change_that_only_reduces_the_error_is_not_one_with_which_the_model_fits() -> None:
    """The force is clipped: an offset of the force halves the error."""
    model = model_of(stroke().source, linear=[40.0])
    force = np.minimum(model.force(SWEPT), 8.0)
    verdict = str(verify(model, Recording.from_arrays(SWEPT, force, SWEPT_TIME, units=RAD)).verdict)
    assert "clipped" in verdict
    assert "the model fits" not in verdict
    assert "neighbouring" not in verdict


def test_exchanged_press_and_release_are_reported() -> None:
    recording = stroke()
    assert recording.direction is not None
    turned = replace(recording, direction=-recording.direction)
    verdict = verify(model_of(curve().source, hysteresis=True), turned).verdict
    assert any("press and release exchanged" in reason for reason in verdict.reasons)


def test_a_good_fresh_recording_has_a_good_verdict() -> None:
    assert str(verify(model_of(stroke().source), curve()).verdict) == "good"


def test_rows_of_the_identification_and_outside_the_domain_give_findings() -> None:
    recording = curve()
    seen = verify(model_of(recording.source), recording).verdict
    assert seen.level == "usable"
    assert "identified on this recording" in seen.reasons[0]
    outside = verify(model_of(stroke().source, lower=[0.0], upper=[0.9]), recording).verdict
    assert outside.level == "usable"
    assert "100 of 1000 rows (10%) lie outside the model's domain from 0 to 0.9" in str(outside)


def test_correlated_error_is_reported_as_structured() -> None:
    x = np.linspace(0.0, 1.0, 1000)
    force = 2 * x + 1 + 0.4 * np.sin(20 * x)
    verdict = verify(model_of(stroke().source), Recording.from_arrays(x, force, units=RAD)).verdict
    assert verdict.level == "usable"
    assert any(
        "the errors of neighbouring rows are correlated (1, above 0.5)" in reason
        for reason in verdict.reasons
    )


def test_noise_is_not_reported_as_structured() -> None:
    x = np.linspace(0.0, 1.0, 1000)
    force = 2 * x + 1 + np.random.default_rng(0).normal(0.0, 0.3, 1000)
    verdict = verify(model_of(stroke().source), Recording.from_arrays(x, force, units=RAD)).verdict
    assert verdict.level == "usable"
    assert not any("neighbouring" in reason or "fits with" in reason for reason in verdict.reasons)


def test_recording_with_pauses_only_is_refused() -> None:
    recording = stroke()
    rest = Recording.from_arrays(
        recording.position, recording.force, direction=np.zeros(len(recording)), units=RAD
    )
    with pytest.raises(InputError, match="no row of the recording has a direction"):
        verify(model_of(curve().source, hysteresis=True), rest)


def test_other_units_are_refused() -> None:
    metres = Recording.from_arrays([0.0, 1.0], [0.0, 1.0], units={"position": "m", "force": "N*m"})
    with pytest.raises(InputError, match="the position of the model is in rad, that of the recording in m"):
        verify(model_of(curve().source), metres)
    current = Recording.from_arrays([0.0, 1.0], [0.0, 1.0], units={"position": "rad", "force": "A"})
    with pytest.raises(InputError, match="give --torque-constant-Nm-per-A"):
        verify(model_of(curve().source), current)


def test_units_that_are_not_stated_fit() -> None:
    recording = curve()
    plain = Recording.from_arrays(recording.position, recording.force)
    assert verify(model_of(curve().source), plain).rmse == verify(model_of(curve().source), recording).rmse


def test_further_inputs_are_taken_by_name() -> None:
    recording = curve()
    load = np.random.default_rng(5).uniform(size=len(recording))
    both = replace(
        recording, force=recording.force + 3 * load, inputs=load.reshape(-1, 1), input_names=("load_N",)
    )
    model = model_of(
        stroke().source,
        kind="general",
        inputs=["position", "load_N"],
        alpha=np.empty((0, 2)),
        beta=np.empty((0, 2)),
        linear=[2.0, 3.0],
        lower=[0.0, 0.25],
        upper=[1.0, 1.0],
    )
    # Outside the domain of its inputs the model continues with a limited gradient, not with the true plane.
    inside = load >= 0.25
    result = verify(model, both)
    assert np.abs(result.residual[inside]).max() < 5 * NOISE
    assert result.extrapolated == np.count_nonzero(~inside)
    with pytest.raises(
        InputError,
        match=re.escape(
            "the recording has no input load_N, only position; read the recording with inputs=('load_N',)"
        ),
    ):
        verify(model, recording)


def test_a_model_with_mass_is_not_compared_row_by_row() -> None:
    with pytest.raises(InputError, match="the mass or damping of the model needs"):
        verify(model_of(stroke().source, mass=0.1), curve())


def test_data_is_fresh_unless_used_for_identification(tmp_path: Path) -> None:
    whole = read_recording(curve().write(tmp_path / "a.csv"))
    other = read_recording(curve(seed=2).write(tmp_path / "b.csv"))
    train, test = whole.split(5)
    assert not verify(model_of(whole.source), whole).fresh
    assert verify(model_of(whole.source), other).fresh
    assert not verify(model_of(whole.source), test).fresh
    assert verify(model_of(train.source), test).fresh
    assert not verify(model_of(train.source), train).fresh
    assert verify(model_of(test.source), train).fresh
    assert not verify(model_of(test.source), test).fresh
    assert not verify(model_of(train.source), whole).fresh
    assert not verify(model_of(train.source), whole.split(4)[1]).fresh
    both = Source.merged([train.source, other.split(5)[0].source])
    assert verify(model_of(both), other.split(5)[1]).fresh
    assert not verify(model_of(both), other).fresh
    assert "not a fresh recording" in verify(model_of(whole.source), whole).notes[-1]


def test_freshness_survives_the_file(tmp_path: Path) -> None:
    whole = read_recording(curve().write(tmp_path / "a.csv"))
    train, test = whole.split(5)
    model = load_model(model_of(train.source).save(tmp_path / "a.json"))
    assert verify(model, test).fresh
    assert not verify(model, whole).fresh


def test_a_copied_file_is_not_fresh(tmp_path: Path) -> None:
    path = curve().write(tmp_path / "a.csv")
    copy = tmp_path / "other_name.csv"
    copy.write_bytes(path.read_bytes())
    assert not verify(model_of(read_recording(path).source), read_recording(copy)).fresh


def file_of(recording: Recording, path: Path, time: str) -> Path:
    """Writes a recording in deg and mN*m, with the numbers of its rows as times in a column of this name."""
    rows = zip(np.arange(len(recording)), np.degrees(recording.position), 1e3 * recording.force, strict=True)
    text = "".join(f"{number},{angle:.6f},{torque:.6f}\n" for number, angle, torque in rows)
    path.write_text(f"{time},angle_deg,torque_mNm\n{text}", encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["again.csv", "again.mcap"])
def test_a_recording_that_is_saved_again_is_not_fresh(name: str, tmp_path: Path) -> None:
    whole = read_recording(file_of(curve(), tmp_path / "a.csv", "time_ms"))
    model = load_model(model_of(whole.source).save(tmp_path / "a.json"))
    again = read_recording(whole.write(tmp_path / name))
    assert again.source.sha256 != whole.source.sha256
    assert not verify(model, again).fresh
    assert not verify(model, whole.position, whole.force).fresh
    assert verify(model, whole.position, whole.force + 1e-6).fresh


def test_a_model_without_the_digest_of_the_values_is_compared_by_the_file(tmp_path: Path) -> None:
    whole = read_recording(curve().write(tmp_path / "a.csv"))
    content = model_of(whole.source).to_dict()
    assert content["notes"].pop("sha256_of_values") == whole.source.values_sha256
    assert not verify(Model.from_dict(content), whole).fresh


def test_a_time_that_is_not_read_does_not_change_a_verification(tmp_path: Path) -> None:
    recording = read_recording(file_of(curve(), tmp_path / "a.csv", "t"))
    assert "is not read as time" in recording.unread_time
    assert verify(model_of(stroke().source), recording).verdict.level == "good"


@cache
def of_a_sample() -> Model:
    return identify(sample_recording(1, 2.0))


@cache
def without_waits() -> Model:
    return identify(with_waits(0))


def test_a_frame_of_a_verification_is_read_back_as_its_compared_rows() -> None:
    recording = sample_recording(2, 2.0)
    found = verify(of_a_sample(), recording)
    frame = found.to_frame()
    assert list(frame.columns) == ["time_s", "position_rad", "force_Nm", "modelled_force_Nm", "residual_Nm"]
    for table in (frame, pd.DataFrame(dict(frame))):  # with and without the roles in attrs
        read = Recording.from_frame(table)
        np.testing.assert_array_equal(read.position, recording.position[found.rows])
        np.testing.assert_array_equal(read.force, recording.force[found.rows])
        np.testing.assert_array_equal(read.columns["modelled_force_Nm"], found.force)
        np.testing.assert_array_equal(read.columns["residual_Nm"], found.residual)
    assert found.recording is recording
    again = identify(found.compared)
    assert again.units == recording.units


def test_plot_of_a_verification_draws_forces_or_residuals() -> None:
    recording = sample_recording(2, 2.0)
    found = verify(of_a_sample(), recording)
    forces, residuals = Figure().subplots(2)
    assert plot(found, forces) is forces
    plot(found, residuals, residual=True)
    assert forces.get_xlabel() == residuals.get_xlabel() == "position [rad]"
    assert (forces.get_ylabel(), residuals.get_ylabel()) == ("force [N·m]", "residual [mN·m]")
    drawn = 1e-3 * np.asarray(residuals.lines[0].get_ydata())
    np.testing.assert_allclose(drawn, -found.residual, rtol=1e-12)


def with_waits(rows: int) -> Recording:
    """Returns a press and a release with waits before them and at the turn, in which the force relaxes."""
    x, y = press_and_release(400, 1.0), np.repeat([1.0, -1.0], 400)
    f = 2.0 * x + 1.0 + 0.25 * y + np.random.default_rng(2).normal(0.0, NOISE, 800)
    relaxing = 3.25 - 0.5 * (1.0 - np.exp(-np.linspace(0.0, 5.0, rows)))
    x = np.concatenate([np.zeros(rows), x[:400], np.ones(rows), x[400:]])
    f = np.concatenate([np.ones(rows), f[:400], relaxing, f[400:]])
    return Recording.from_arrays(x, f, units=RAD)


@pytest.mark.parametrize("rows", [30, 300, 5000])
def test_rows_that_wait_are_not_compared(rows: int) -> None:
    model = without_waits()
    without, found = verify(model, with_waits(0)), verify(model, with_waits(rows))
    assert found.n == pytest.approx(without.n, abs=4)
    assert found.nrmse == pytest.approx(without.nrmse, rel=0.05)
    assert any(f"of {800 + 2 * rows} rows are not compared: " in note for note in found.notes)
    assert len(found.force) == len(found.residual) == np.count_nonzero(found.rows) == found.n
    assert found.compared.position.tolist() == with_waits(rows).position[found.rows].tolist()


def test_rows_that_are_stored_when_the_position_changes_have_no_gap() -> None:
    """Near a turn the time between two rows is long, but the tool does not move far."""
    phase = np.linspace(0.0, 4.0 * np.pi, 40_000)
    step = np.round(200.0 * (1.0 - np.cos(phase)))
    stored = np.insert(np.diff(step) != 0.0, 0, True)
    x, y = step[stored] / 400.0, np.sign(np.sin(phase[stored]))
    f = 2.0 * x + 1.0 + 0.25 * y + np.random.default_rng(2).normal(0.0, NOISE, len(x))
    recording = Recording.from_arrays(x, f, phase[stored], units=RAD)
    # The play operator needs the first 0.2 rad to know the side of a row.
    assert verify(identify(recording), recording, play_radius=0.1).n > len(x) - 90


def test_rows_that_wait_are_compared_if_no_others_have_a_direction() -> None:
    recording = with_waits(300)
    hold = np.zeros(len(recording))
    hold[720:980] = 1.0
    assert verify(without_waits(), replace(recording, direction=hold.astype(np.int8))).n == 260


def contact_model(memory: bool, **change: Any) -> Model:
    """Returns a model of force 2 x that the tool leaves at x = 0, with a branch of stiffness 3 if
    requested."""
    branch = {"alpha": [], "beta": [], "weight": [], "linear": 0.0, "bias": 1.0, "stiffness": [3.0]}
    given: dict[str, Any] = {"bias": 0.0, "below": "free"}
    if memory:
        given |= {"kind": "memory", "memory": Memory(**branch, time_constant_s=[0.5])}
    return model_of(stroke().source, **given | change)


def contacts(memory: bool, wait_s: float = 1.0, shift: float = 0.0) -> Recording:
    """Returns two contacts of the object of `contact_model` with a wait in air before and between them."""
    lasts = [wait_s, 0.5, 1.0, 0.5, wait_s, 0.5, 0.5]
    time = np.arange(0.0, sum(lasts), 5e-3)
    x = np.interp(time, np.cumsum([0.0, *lasts]), [-0.6, -0.6, 1.0, 1.0, -0.6, -0.6, 1.0, -0.6])
    model = contact_model(memory)
    force = model.force_over_time(time, x)[0] if memory else model.force(x)
    force += np.random.default_rng(1).normal(0.0, 2e-3, len(x))
    return Recording.from_arrays(x + shift, force, time, units=RAD)


def test_waits_of_a_model_with_memory_are_compared() -> None:
    time = np.arange(3000) * 4e-3
    x = np.interp(time, [0.0, 0.5, 4.5, 5.0, 6.0, 8.0, 12.0], [0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0])
    model = contact_model(memory=True)
    f = model.force_over_time(time, x)[0] + np.random.default_rng(0).normal(0.0, 1e-3, len(x))
    assert verify(model, Recording.from_arrays(x, f, time, units=RAD)).n == len(x)


@pytest.mark.parametrize("memory", [False, True])
def test_air_below_a_free_model_neither_counts_as_extrapolated_nor_changes_the_error(memory: bool) -> None:
    model, recording = contact_model(memory), contacts(memory)
    found, longer = verify(model, recording), verify(model, contacts(memory, wait_s=20.0))
    assert str(found.verdict) == str(longer.verdict) == "good"
    assert (found.extrapolated, longer.extrapolated) == (0, 0)
    assert recording.position[found.rows].min() > -0.15
    assert longer.n == pytest.approx(found.n, abs=4)
    assert longer.nrmse == pytest.approx(found.nrmse, rel=0.1)
    linear = verify(contact_model(memory, below="linear"), recording)
    below = recording.position[linear.rows] < 0.0
    assert linear.extrapolated == np.count_nonzero(below) > 0


@pytest.mark.parametrize("memory", [False, True])
@pytest.mark.parametrize("shift", [-0.3, 0.3])
def test_contact_at_another_position_is_named_by_its_error(memory: bool, shift: float) -> None:
    found = verify(contact_model(memory), contacts(memory, shift=shift))
    assert found.nrmse > 0.3
    assert "has at most 0.1" in found.verdict.reasons[0]


def test_a_wait_just_outside_the_domain_counts_as_little_as_the_motion_there() -> None:
    found = verify(contact_model(memory=True, upper=[0.999]), contacts(memory=True))
    assert np.count_nonzero(found.compared.position > 0.999) > 190
    assert found.extrapolated < 5
    assert "outside" not in str(found.verdict)


def differs_on(share: float, noise: float = 0.0) -> Recording:
    """Returns a recording whose force is 0.4 N*m, two just noticeable differences, above the model's on a
    share of the travel."""
    x = np.linspace(0, 1, 2000)
    step = np.where(x < share, 0.4, 0.0)
    return Recording.from_arrays(
        x, 2 * x + 1 + step + np.random.default_rng(0).normal(0.0, noise, len(x)), units=RAD
    )


def noticed_sentences(recording: Recording) -> list[str]:
    reasons = verify(model_of(stroke().source), recording).verdict.reasons
    return [reason for reason in reasons if "a hand feels the difference" in reason]


def test_a_difference_that_a_hand_feels_on_more_than_a_twentieth_of_the_travel_is_a_finding() -> None:
    assert noticed_sentences(differs_on(0.05)) == []
    (sentence,) = noticed_sentences(differs_on(0.1))
    assert "on 10% of the travel" in sentence
    assert "-0.4 N*m at 0.0" in sentence


def test_noise_is_not_taken_for_a_difference_that_a_hand_feels() -> None:
    """Single rows differ by more than a just noticeable difference, but not their means."""
    noisy = differs_on(0.0, noise=0.4)
    assert verify(model_of(stroke().source), noisy).within_jnd < 0.5
    assert noticed_sentences(noisy) == []


def test_two_models_and_a_model_with_a_recording_are_judged_by_one_rule() -> None:
    model, other = model_of(stroke().source), model_of(stroke().source, bias=1.4)
    x = np.linspace(0, 1, 2000)
    recording = Recording.from_arrays(x, other.force(x), units=RAD)
    (sentence,) = noticed_sentences(recording)
    units = Unit.of_si("rad"), Unit.of_si("N*m")
    (finding,) = noticed_findings(compare(other, model), *units)
    words = sentence.split(": up to ")[0]
    assert finding.sentence.startswith(words)


def test_a_defect_of_the_fresh_recording_is_named() -> None:
    x = np.tile(np.concatenate([np.linspace(0.0, 4.0, 300), np.linspace(4.0, 0.0, 300)]), 2)
    noise = np.random.default_rng(5).normal(0.0, 0.01, (2, len(x)))
    force = 0.2 * x**2
    model = identify(x, force + noise[0])
    assert verify(model, x, force + noise[1]).verdict.level == "good"
    clipped = verify(model, x, np.minimum(force, 3.0) + np.where(force < 3.0, noise[1], 0.0))
    assert any("the largest force, 3" in each for each in clipped.verdict.reasons)


def friction(seed: int, turning: float | None = None) -> Recording:
    """Returns four strokes of a spring with friction that reverses over a tenth of the travel as no play
    operator does, or as the play operator of a radius `turning` does, with a noise of 0.001 N*m."""
    time = np.arange(0.0, 8.0, 0.008)
    x = np.abs((time / 2.0 + 1.0) % 2.0 - 1.0)
    way = np.where(np.gradient(x) > 0.0, 1.0, -1.0)
    since = np.where(way > 0.0, x, 1.0 - x)
    side = way * np.where(time < 1.0, 1.0, 1.0 - 2.0 * np.exp(-((since / 0.08) ** 5)))
    if turning is not None:
        side = (x - play(x, turning)) / turning
    noise = np.random.default_rng(seed).normal(0.0, 0.001, len(x))
    return Recording.from_arrays(x, 0.02 * x + 0.1 * side + noise, time, units=RAD)


@cache
def of_friction() -> Model:
    return identify(friction(0))


def test_an_identification_and_a_verification_state_one_error_and_one_verdict() -> None:
    model, own, fresh = of_friction(), verify(of_friction(), friction(0)), verify(of_friction(), friction(1))
    assert model.play_radius is None
    assert own.nrmse == pytest.approx(model.fit.nrmse)
    assert own.settled_nrmse == pytest.approx(model.notes["settled_nrmse"])
    assert [*model.verdict.findings, *own.verdict.findings[-1:]] == list(own.verdict.findings)
    assert "identified on this recording" in str(own.verdict)
    assert str(model.verdict) == str(fresh.verdict) == "good"


def test_the_error_of_rows_behind_turns_is_named() -> None:
    found = verify(of_friction(), friction(1))
    assert found.settled_nrmse < 0.02 < 0.1 < found.nrmse
    statement = found.summary()["error"]
    assert f"NRMSE {found.nrmse:.4g} on {found.n} rows" in statement
    assert f"{found.settled_nrmse:.4g} if rows that wait or in which friction reverses" in statement
    assert "just noticeable differences" in found.summary()["felt"]
    assert "behind turns" not in verify(model_of(stroke().source), curve()).summary()["error"]


def test_a_wrong_play_radius_is_not_good() -> None:
    """A play radius states how friction reverses, so that the rows behind turns count whole."""
    model = identify(friction(0, turning=0.02))
    assert model.play_radius == pytest.approx(0.02, rel=0.1)
    assert str(verify(model, friction(1, turning=0.02)).verdict) == "good"
    wrong = verify(model, friction(1, turning=0.02), play_radius=0.08)
    assert wrong.settled_nrmse == wrong.nrmse > 0.1
    assert wrong.verdict.level == "usable"


def test_wrong_readings_are_dropped_and_named() -> None:
    recording, model = friction(1), of_friction()
    force = recording.force.copy()
    force[[210, 460, 730]] = 5.0
    found, clean = verify(model, replace(recording, force=force)), verify(model, recording)
    assert str(found.verdict) == "good"
    assert not found.rows[[210, 460, 730]].any()
    assert found.nrmse == pytest.approx(clean.nrmse, rel=0.01)
    assert "3 of 1000 rows dropped (wrong readings)" in found.summary()["dropped"]
    assert len(found.force) == len(found.to_frame()) == found.n == clean.n - 3


def test_rows_without_direction_form_no_stroke() -> None:
    """Two rows between the strokes do not show a share of the travel."""
    recording = stroke()
    assert recording.direction is not None
    direction, force = recording.direction.copy(), recording.force.copy()
    direction[[399, 400]] = 0
    force[[399, 400]] += 0.3
    turned = replace(recording, direction=direction, force=force)
    found = verify(model_of(curve().source, linear=[2.0]), turned)
    assert [each.name for each in found.strokes] == ["release", "press"]
