# SPDX-License-Identifier: Apache-2.0
"""Hysteresis of recordings with neither a direction column nor time."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from any_input import SCALE
from palpate import InputError, Model, Recording, identify, load_model, read_recording, verify
from palpate._core.model import play
from palpate.cli.main import main
from palpate.identification.data.strokes import HysteresisInput, strokes_of, weights_behind_turns
from palpate.recording.checks.recordings import scale_findings
from palpate.recording.motion import strokes_from_order

MEASURED = ("keyswitches", "rubber_domes", "switch_springs")
IN_AND_OUT = np.concatenate([np.linspace(0.0, 4.0, 400), np.linspace(4.0, 0.0, 400)])
SIDE = np.repeat([1.0, -1.0], 400)


def loop(seed: int = 0, h: float = 0.2, noise: float = 0.02) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.asarray(IN_AND_OUT + np.sin(3.0 * IN_AND_OUT) + h * SIDE + random.normal(0.0, noise, 800))


def bare(rows: np.ndarray, force: np.ndarray) -> Recording:
    return Recording.from_arrays(IN_AND_OUT[rows], force[rows])


def notes(model: Model) -> str:
    return "\n".join([*model.notes["model_selection"], *model.notes["identification"]])


PRESS, RELEASE = np.arange(400), np.arange(400, 800)


@cache
def model_without_directions() -> Model:
    return identify(Recording.from_arrays(IN_AND_OUT, loop()))


def test_stated_directions_of_a_motion_do_not_move_its_turns() -> None:
    x, side = np.append(IN_AND_OUT, IN_AND_OUT), np.append(SIDE, SIDE)
    stated = np.roll(side, 1)  # a recorder can state the direction of the motion behind a row
    ordered, found = (
        strokes_of([Recording.from_arrays(x, x, time=0.01 * np.arange(1600), direction=each)]).order
        for each in (None, stated)
    )
    assert ordered is not None
    assert np.array_equal(ordered, found)


def test_rows_that_are_stated_to_have_no_direction_keep_none() -> None:
    x, stated = np.append(IN_AND_OUT, IN_AND_OUT), np.append(SIDE, SIDE)
    stated[[0, 399, 800]] = 0.0
    found = strokes_of([Recording.from_arrays(x, x, time=0.01 * np.arange(1600), direction=stated)]).order
    assert found is not None
    assert np.flatnonzero(found == 0.0).tolist() == [0, 399, 800]


def test_strokes_come_from_the_order_of_rows_and_are_reported() -> None:
    stated = identify(Recording.from_arrays(IN_AND_OUT, loop(), direction=SIDE))
    found = model_without_directions()
    assert found.kind == "hysteresis"
    assert found.fit.nrmse == stated.fit.nrmse
    assert "The direction is taken from the order of rows: 1 turn." in notes(found)
    assert str(found.verdict) == "good"


def test_one_file_for_each_stroke_gives_the_same_model() -> None:
    found = identify([bare(PRESS, loop()), bare(RELEASE, loop())])
    assert found.kind == "hysteresis"
    assert "2 recordings, 1 press, 1 release" in notes(found)
    assert found.fit.nrmse == model_without_directions().fit.nrmse


@pytest.mark.parametrize("stated", [False, True], ids=["unstated", "stated"])
@pytest.mark.full
def test_one_file_for_each_stroke_is_not_taken_for_two_objects(stated: bool) -> None:
    def recorded(rows: np.ndarray, factor: float = 1.0) -> Recording:
        side = SIDE[rows] if stated else None
        return Recording.from_arrays(IN_AND_OUT[rows], factor * loop(h=1.0)[rows], direction=side)

    press, release = recorded(PRESS), recorded(RELEASE)
    both = recorded(np.arange(800))
    for recordings in ([press, release], [release, press], [both, press, release]):
        assert str(identify(recordings).verdict) == "good"
    for other in (recorded(RELEASE, 3.0), recorded(RELEASE, 1 / 3), recorded(PRESS, 1.5)):
        assert "two objects" in str(identify([press, other]).verdict)
        assert "probably belong to two objects" in str(identify([both, other]).verdict)


def test_repeats_of_one_stroke_that_scatter_are_not_taken_for_press_and_release() -> None:
    x = np.linspace(0.0, 1.0, 200)
    made = [Recording.from_arrays(x, factor * x**2) for factor in (1.0, 0.97, 0.94, 0.85)]
    assert identify(made).kind == "position"


def test_two_files_parted_by_their_force_are_not_taken_for_two_objects() -> None:
    recordings = [bare(PRESS, loop(h=1.0)), bare(RELEASE[::-1], loop(h=1.0))]
    reported = str(identify(recordings).verdict)
    assert "recording 1 is taken as press and recording 2 as release" in reported
    assert "probably belong to two objects" not in reported
    assert "probably belong to two objects" in str(identify(recordings, inputs="position").verdict)


def test_a_release_above_the_press_is_taken_for_another_object() -> None:
    force = loop(h=-1.0)
    assert "two objects" in str(identify([bare(PRESS, force), bare(RELEASE, force)], max_wavelets=2).verdict)


@pytest.mark.parametrize("first", [PRESS, RELEASE[::-1]], ids=["press_first", "release_first"])
def test_two_files_sorted_by_position_are_parted_by_their_force(first: np.ndarray) -> None:
    second = RELEASE[::-1] if first is PRESS else PRESS
    found = identify([bare(first, loop()), bare(second, loop())])
    x = np.array([1.0, 2.0, 3.0])
    half = (found.force(x, direction=np.ones(3)) - found.force(x, direction=-np.ones(3))) / 2
    assert half == pytest.approx(0.2, abs=0.02)
    press = 1 if first is PRESS else 2
    assert f"recording {press} is taken as press and recording {3 - press} as release" in str(found.verdict)
    assert found.verdict.level == "usable"


def test_repetitions_of_one_stroke_are_not_hysteresis() -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.02, (3, 800))
    repeats = [bare(PRESS, IN_AND_OUT + noise[k] + 0.02 * k) for k in range(3)]
    found = identify(repeats)
    assert found.kind == "position"
    assert str(found.verdict) == "good"
    assert "hysteresis: not tested (the position never turns back in the order of rows)" in notes(found)


def test_two_repetitions_of_both_strokes_are_parted_in_pairs() -> None:
    rows = [PRESS, RELEASE[::-1], PRESS, RELEASE[::-1]]
    recordings = [bare(each, loop(seed)) for seed, each in enumerate(rows)]
    side = strokes_of(recordings).side
    assert side is not None
    assert side.tolist() == np.repeat([1.0, -1.0, 1.0, -1.0], 400).tolist()


@pytest.mark.parametrize("order", ["sorted", "shuffled"])
def test_two_strokes_in_one_file_without_order_are_not_good_and_hysteresis_is_not_tested(order: str) -> None:
    rows = np.argsort(IN_AND_OUT, kind="stable")
    if order == "shuffled":
        rows = np.random.default_rng(5).permutation(800)
    found = identify(Recording.from_arrays(IN_AND_OUT[rows], loop()[rows], units={"force": "N"}))
    reported = str(found.verdict)
    assert reported.startswith("usable: ")
    assert "record time or direction or further inputs" in reported
    assert "hysteresis: not tested" in notes(found)
    stated = Recording.from_arrays(IN_AND_OUT[rows], loop()[rows], direction=SIDE[rows])
    assert identify(stated).kind == "hysteresis"


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("step", [0.0, 0.1])
def test_one_stroke_with_noise_gives_no_finding(noise: float, step: float) -> None:
    force = loop(noise=noise)
    force = np.round(force / step) * step if step else force
    assert not strokes_of([bare(PRESS, force)]).log.findings


@pytest.mark.parametrize("times", [2, 3, 4, 5, 6, 7, 10])
def test_repeated_rows_of_one_stroke_with_noise_give_no_finding(times: int) -> None:
    rows = np.repeat(PRESS, times)
    for seed in range(4):
        assert not strokes_of([bare(rows, IN_AND_OUT + loop(seed, noise=0.3))]).log.findings


def test_equal_strokes_do_not_change_the_model() -> None:
    """The model equals, to the last bit, the model of the same rows in random order."""
    force = loop(h=0.0)
    ordered = identify(Recording.from_arrays(IN_AND_OUT, force))
    assert "hysteresis: not accepted (raises BIC by " in notes(ordered)
    rows = np.random.default_rng(5).permutation(800)
    shuffled = strokes_of([bare(rows, force)])
    assert shuffled.side is None
    sorted_rows = np.sort(IN_AND_OUT)
    assert strokes_of([Recording.from_arrays(sorted_rows, sorted_rows)]).side is None


def test_verify_takes_strokes_from_the_order_of_rows() -> None:
    model = identify(Recording.from_arrays(IN_AND_OUT, loop(), direction=SIDE))
    stated = verify(model, Recording.from_arrays(IN_AND_OUT, loop(1), direction=SIDE))
    found = verify(model, Recording.from_arrays(IN_AND_OUT, loop(1)))
    assert found.nrmse == stated.nrmse
    assert "The direction is taken from the order of rows: 1 turn." in found.notes
    for rows, word in ((PRESS, "press"), (RELEASE, "release"), (RELEASE[::-1], "release")):
        one = verify(model, bare(rows, loop(1)))
        assert one.nrmse == pytest.approx(stated.nrmse, rel=0.2)
        assert any(f"All rows are taken as {word}" in note for note in one.notes)


@pytest.mark.parametrize("hold_out", [[], ["--hold-out-every", "5"]], ids=["all_rows", "held_out"])
def test_the_command_identifies_and_verifies_two_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], hold_out: list[str]
) -> None:
    files = []
    for seed, name in enumerate(("press.csv", "fresh.csv")):
        table = np.column_stack([IN_AND_OUT, loop(seed)])
        np.savetxt(tmp_path / name, table, delimiter=",", header="depth_mm,force_N", comments="")
        files.append(str(tmp_path / name))
    model = str(tmp_path / "press.json")
    assert main(["identify", files[0], "-o", model, "--json", *hold_out]) == 0
    captured = capsys.readouterr()
    result = json.loads(captured.out)
    assert result["model_class"] == "hysteresis"
    assert result["verdict"] == "good"
    # The mean of the strokes has an NRMSE of 0.16. One held-out row is at the reversal, where force jumps.
    assert result["nrmse"] < 0.04
    note = "The direction is taken from the order of rows: 1 turn."
    assert note in load_model(model).notes["identification"]
    assert main(["verify", model, files[1], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["nrmse"] < 0.03


def test_the_command_identifies_two_files_sorted_by_position(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = []
    for name, rows in (("one.csv", PRESS), ("two.csv", RELEASE[::-1])):
        table = np.column_stack([IN_AND_OUT, loop()])[rows]
        np.savetxt(tmp_path / name, table, delimiter=",", header="depth_mm,force_N", comments="")
        files.append(str(tmp_path / name))
    model = str(tmp_path / "model.json")
    assert main(["identify", *files, "-o", model, "--json", "--hold-out-every", "5"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["nrmse"] < 0.02
    assert "one.csv is taken as press" in result["verdict"]


def test_named_hysteresis_without_strokes_is_refused() -> None:
    with pytest.raises(InputError, match="inputs names hysteresis"):
        identify(bare(PRESS, loop()), inputs="position,hysteresis")


def measured_files(data: Path) -> list[Path]:
    """Returns the recordings of strokes; the short run reads some."""
    files = sorted(path for folder in MEASURED for path in (data / folder).glob("*.csv"))
    return files[:: 16 if SCALE == 1 else 1]


def test_measured_strokes_are_found_in_the_order_of_rows(data: Path) -> None:
    """At most 1 % of the rows get the wrong stroke: rows of a pause at a reversal."""
    files = measured_files(data)
    assert files
    for path in files:
        recording = read_recording(path)
        found = strokes_from_order(recording.position)
        assert found is not None, path.name
        assert np.count_nonzero(found != recording.direction) <= 0.01 * len(recording), path.name


@pytest.mark.full
def test_measured_recordings_without_direction_are_identified_as_well(data: Path) -> None:
    """The NRMSE is at most 1.05 times that of the file with directions; equal strokes give equal models."""
    for path in measured_files(data):
        stated = replace(read_recording(path), time=None)
        unstated = replace(stated, direction=None)
        assert stated.direction is not None
        found = strokes_of([unstated]).order
        assert found is not None, path.name
        if np.count_nonzero(found != stated.direction) < 3:
            continue
        with_order, with_column = identify(unstated), identify(stated)
        assert with_order.kind == "hysteresis", path.name
        assert with_order.fit.nrmse <= 1.05 * with_column.fit.nrmse, path.name


def test_measured_files_of_one_stroke_each_are_not_taken_for_two_objects(data: Path) -> None:
    for path in measured_files(data):
        whole = replace(read_recording(path), time=None)
        assert whole.direction is not None
        stated = [whole.without(whole.direction != side) for side in (1, -1)]
        assert not scale_findings(stated), path.name
        assert not scale_findings([replace(each, direction=None) for each in stated]), path.name
        stiffer = replace(stated[1], force=3.0 * stated[1].force)
        assert scale_findings([stated[0], stiffer]), path.name


def test_the_order_of_rows_gives_the_same_model_with_and_without_time() -> None:
    whole = Recording.from_arrays(IN_AND_OUT, loop(), 1e-3 * np.arange(len(IN_AND_OUT)))
    timed, ordered = (
        identify(each, inputs=("position", "hysteresis")) for each in (whole, replace(whole, time=None))
    )
    at, press = np.linspace(0.0, 4.0, 50), np.ones(50)
    assert timed.play_radius == ordered.play_radius
    assert (timed.force(at, direction=press) == ordered.force(at, direction=press)).all()


def test_a_stated_direction_that_the_order_of_rows_shows_too_changes_no_model() -> None:
    friction = (IN_AND_OUT - play(IN_AND_OUT, 0.1)) / 0.1
    noise = np.random.default_rng(0).normal(0.0, 0.02, 800)
    ordered = Recording.from_arrays(IN_AND_OUT, IN_AND_OUT + 0.3 * friction + noise)
    recordings = (ordered, replace(ordered, direction=SIDE))
    without, stated = (identify(each, inputs=("position", "hysteresis")) for each in recordings)
    assert stated.play_radius == without.play_radius == pytest.approx(0.1, rel=0.1)
    assert (stated.force(IN_AND_OUT, direction=SIDE) == without.force(IN_AND_OUT, direction=SIDE)).all()


def test_a_stated_direction_that_contradicts_the_order_of_one_stroke_is_kept() -> None:
    motion, direction = np.tile(IN_AND_OUT, 2), np.tile(SIDE, 2).astype(np.int8)
    direction[:400] = -1
    found = strokes_of([Recording.from_arrays(motion, motion, direction=direction)])
    assert found.order is None
    assert found.side is not None
    assert (found.side == direction).all()


def test_rows_behind_a_turn_have_the_weight_of_their_shared_error() -> None:
    """Rows behind a turn that miss the force by 1 count less than one row, with noise of 0.01; those as far
    before the turn count whole."""
    path, random = np.tile(IN_AND_OUT, 2) / 4.0, np.random.default_rng(0)
    order, touched = np.tile(SIDE, 2), np.ones(1600, dtype=bool)
    residual = random.normal(0.0, 0.01, 1600)
    behind = np.arange(1600) % 400 < 20
    behind[:20] = True
    weight = weights_behind_turns(path, order, np.where(behind, 1.0, residual), touched, 1e-6)
    assert weight[behind].sum() < 0.02
    assert np.median(weight[~behind]) == 1.0
    assert weights_behind_turns(path, order, residual, touched, 1e-6).min() > 0.02


def test_walls_at_the_far_end_of_an_object_that_the_tool_leaves_count_whole() -> None:
    path = IN_AND_OUT / 4.0
    touched = path > 0.02
    behind = (np.arange(800) > 400) & (np.arange(800) < 420)
    weight = weights_behind_turns(path, SIDE, 1.0 * behind, touched, 1e-3)
    assert weight[behind & (path < 0.995)].min() == 1.0
    assert weight[401] < 0.05


def test_without_strokes_all_rows_count_whole() -> None:
    none = np.zeros(9)
    assert (weights_behind_turns(none, none, none, none > 0.0, 1e-3) == 1.0).all()
    states = HysteresisInput(none, none == 0.0)
    assert (states.share == 1.0).all()
    assert (replace(states, known=none > 0.0).share == 0.0).all()


def test_rows_with_a_stated_direction_in_another_order_are_not_followed_by_a_play_operator() -> None:
    ordered = Recording.from_arrays(IN_AND_OUT, loop())
    mixed = np.random.default_rng(0).permutation(len(IN_AND_OUT))
    stated = Recording.from_arrays(IN_AND_OUT[mixed], loop()[mixed], direction=SIDE[mixed])
    found = strokes_of([ordered, stated])
    assert not found.in_order
    assert found.side is not None
    assert (found.side[len(IN_AND_OUT) :] == SIDE[mixed]).all()
