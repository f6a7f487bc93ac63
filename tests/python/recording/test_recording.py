# SPDX-License-Identifier: Apache-2.0
"""Recordings in memory and on disk: shapes, held-out rows, exact round trips."""

import hashlib
import re
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest

from palpate import InputError, Recording, read_recording
from palpate.recording import Source

N = 37


def awkward_numbers(seed: int) -> np.ndarray:
    """Returns random numbers that a text with few decimal digits cannot represent exactly."""
    random = np.random.default_rng(seed)
    return random.normal(size=N) * 10.0 ** random.integers(-12, 12, N)


def full_recording() -> Recording:
    recording = Recording.from_arrays(
        awkward_numbers(1),
        awkward_numbers(2),
        np.cumsum(np.abs(awkward_numbers(3)) + 1e-3),
        np.resize([1, -1, 0], N),
        units={"position": "m", "force": "N"},
        metadata={"device": "bench: 3", "empty": ""},
    )
    words = np.array(["soft", "a, b", 'say "x"', "NA", "Größe"], dtype=object)
    return replace(
        recording,
        inputs=awkward_numbers(4).reshape(-1, 1),
        input_names=("load_N",),
        columns={
            "position_count": awkward_numbers(5),
            "force_N": awkward_numbers(6),
            "note": np.resize(words, N),
        },
    )


def assert_same(a: Recording, b: Recording) -> None:
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.force, b.force)
    for first, second in ((a.time, b.time), (a.direction, b.direction)):
        assert (first is None) == (second is None)
        if first is not None and second is not None:
            np.testing.assert_array_equal(first, second)
            assert first.dtype == second.dtype
    np.testing.assert_array_equal(a.inputs, b.inputs)
    assert a.input_names == b.input_names
    assert a.columns.keys() == b.columns.keys()
    for name in a.columns:
        assert a.columns[name].tolist() == b.columns[name].tolist()
    assert dict(a.metadata) == dict(b.metadata)
    assert dict(a.units) == dict(b.units)


def test_a_written_recording_is_read_back_exactly(tmp_path: Path) -> None:
    recording = full_recording()
    assert_same(read_recording(recording.write(tmp_path / "full.csv")), recording)


def test_arrays_without_units_are_read_back_without_units(tmp_path: Path) -> None:
    recording = Recording.from_arrays(awkward_numbers(1), awkward_numbers(2))
    assert recording.units == {"position": "", "force": ""}
    assert_same(read_recording(recording.write(tmp_path / "plain.csv")), recording)


@pytest.mark.parametrize(("position", "force"), [("rad", "N*m"), ("m", "N"), ("count", "A"), ("rad", "")])
def test_column_names_contain_the_unit(tmp_path: Path, position: str, force: str) -> None:
    units = {"position": position, "force": force}
    path = Recording.from_arrays(awkward_numbers(1), awkward_numbers(2), units=units).write(
        tmp_path / "u.csv"
    )
    header = path.read_text(encoding="utf-8").splitlines()[1]
    suffix = {"N*m": "force_Nm", "N": "force_N", "A": "force_A", "": "force"}[force]
    assert header == f"position_{position},{suffix}"
    assert read_recording(path).units == units


def test_a_written_recording_opens_without_its_metadata(tmp_path: Path) -> None:
    path = Recording.from_arrays(
        awkward_numbers(1), awkward_numbers(2), units={"position": "m", "force": "N"}
    ).write(tmp_path / "a.csv")
    bare = tmp_path / "b.csv"
    bare.write_text("".join(path.read_text(encoding="utf-8").splitlines(keepends=True)[1:]), encoding="utf-8")
    assert_same(read_recording(path), read_recording(bare))


def test_an_option_overrides_the_layout_of_a_written_file(tmp_path: Path) -> None:
    recording = full_recording()
    path = recording.write(tmp_path / "full.csv")
    np.testing.assert_array_equal(read_recording(path, force="force_N").force, recording.columns["force_N"])


def test_a_damaged_layout_line_is_refused(tmp_path: Path) -> None:
    path = Recording.from_arrays(awkward_numbers(1), awkward_numbers(2)).write(tmp_path / "a.csv")
    path.write_text(path.read_text(encoding="utf-8").replace('{"position"', '"position"'), encoding="utf-8")
    with pytest.raises(InputError, match="the line '# palpate-columns:' holds"):
        read_recording(path)


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path: Path) -> None:
    recording = Recording.from_arrays(awkward_numbers(1), awkward_numbers(2), metadata={"a": "two\nlines"})
    target = tmp_path / "a.csv"
    target.write_text("before", encoding="utf-8")
    with pytest.raises(InputError, match="metadata 'a' does not fit on one line"):
        recording.write(target)
    assert target.read_text(encoding="utf-8") == "before"
    assert list(tmp_path.iterdir()) == [target]


def test_a_metadata_key_with_a_colon_is_refused(tmp_path: Path) -> None:
    recording = Recording.from_arrays(awkward_numbers(1), awkward_numbers(2), metadata={"a:b": "c"})
    with pytest.raises(InputError, match="metadata 'a:b' does not fit"):
        recording.write(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("target", "sentence"),
    [("nowhere/a.csv", "there is no folder"), (".", "it is a folder")],
)
def test_an_unwritable_target_is_refused_with_the_reason(tmp_path: Path, target: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        full_recording().write(tmp_path / target)


@pytest.mark.parametrize("every", [2, 5, N])
def test_split_holds_out_the_last_of_every_k_rows(every: int) -> None:
    recording = full_recording()
    train, test = recording.split(every)
    rows = np.arange(N)
    np.testing.assert_array_equal(test.position, recording.position[rows % every == every - 1])
    np.testing.assert_array_equal(train.position, recording.position[rows % every != every - 1])
    assert len(train) + len(test) == N
    for part in (train, test):
        assert len(part.columns["note"]) == len(part.inputs) == len(part) == part.source.rows
        assert part.source.held_out_every == every
    assert (train.source.held_out, test.source.held_out) == (False, True)


def test_rows_that_are_dropped_from_held_out_rows_leave_their_motion() -> None:
    position = np.linspace(0.0, 1.0, 20)
    _, held = Recording.from_arrays(position, position).split(5)
    left = held.without(np.array([False, True, False, False]))
    assert np.array_equal(left.motion.position, position)
    assert left.motion.rows.tolist() == [4, 14, 19]


@pytest.mark.parametrize("every", [1, 0, -3, N + 1])
def test_a_split_that_holds_out_no_row_or_every_row_is_refused(every: int) -> None:
    with pytest.raises(InputError, match=f"every is {every};"):
        full_recording().split(every)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"force": [1.0, 2.0]}, "force has shape (2,), but position has 3 samples"),
        ({"position": [[1.0, 2.0, 3.0]]}, "position has shape (1, 3); it must be one-dimensional"),
        ({"position": [1.0, np.nan, 3.0]}, "position[1] is nan; it must be a finite number"),
        ({"force": [1.0, 2.0, np.inf]}, "force[2] is inf; it must be a finite number"),
        ({"time": [0.0, 1.0, 1.0]}, "time[2] is not later than time[1]"),
        ({"direction": [1, 2, -1]}, "direction holds 2; it must be +1, -1 or 0"),
        ({"units": {"force": "gf"}}, "units['force'] is 'gf'; use one of N, N*m, A"),
    ],
)
def test_wrong_arrays_are_refused_by_name(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        Recording.from_arrays(**({"position": [1.0, 2.0, 3.0], "force": [1.0, 2.0, 3.0]} | change))  # type: ignore[arg-type]


def test_a_recording_is_immutable() -> None:
    given = np.arange(12.0)
    recording = Recording.from_arrays(given, given)
    with pytest.raises(FrozenInstanceError):
        recording.position = given  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        recording.force[0] = 1.0
    given[0] = 99.0
    assert recording.position[0] == 0.0


def test_the_sample_period_is_the_median_step() -> None:
    recording = Recording.from_arrays([0.0, 1.0, 2.0, 3.0], [0.0] * 4, [0.0, 0.001, 0.002, 0.1])
    assert recording.sample_period == pytest.approx(0.001)
    assert Recording.from_arrays([0.0, 1.0], [0.0, 0.0]).sample_period is None


def test_the_fingerprint_of_a_file_is_its_sha256(tmp_path: Path) -> None:
    path = full_recording().write(tmp_path / "full.csv")
    source = read_recording(path).source
    assert source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert source.files == (str(path),)
    assert source.rows == N


def test_different_arrays_have_different_fingerprints() -> None:
    a = Recording.from_arrays([0.0, 1.0], [0.0, 1.0])
    b = Recording.from_arrays([0.0, 1.0], [0.0, 1.0])
    c = Recording.from_arrays([0.0, 1.0], [0.0, 1.5])
    assert a.source.sha256 == b.source.sha256 != c.source.sha256


def test_merged_sources_keep_every_fingerprint() -> None:
    a, b = (
        Source(("a.csv",), "aa", 10, {"position": "x_m"}),
        Source(("b.csv",), "bb", 20, {"position": "x_m"}),
    )
    merged = Source.merged([a, b])
    assert (merged.files, merged.sha256, merged.rows) == (("a.csv", "b.csv"), "aa bb", 30)


def test_a_late_force_is_moved_to_its_position() -> None:
    t = np.linspace(0.0, 2.0, 2001)
    x, late = np.sin(np.pi * t) ** 2, 0.025
    measured = np.sin(np.pi * (t - late)) ** 2
    recording = Recording.from_arrays(x, 5.0 * measured, t, np.sign(np.cos(np.pi * t) * np.sin(np.pi * t)))
    back = recording.with_force_earlier(late)
    assert len(back) == 2001 - 25
    assert np.abs(back.force - 5.0 * back.position).max() < 1e-4
    assert np.abs(recording.force - 5.0 * recording.position).max() > 0.3
    assert back.time is not None
    assert back.time[0] == pytest.approx(late)
    assert back.direction is not None  # the direction is that of the shifted position
    moving = np.sign(np.gradient(back.position))[1:-1]
    assert np.count_nonzero(moving * back.direction[1:-1] < 0) <= 3  # one at each reversal
    assert "0.025 s before" in back.notes[-1]


@pytest.mark.parametrize("late", [-0.1, 3.0, float("nan")])
def test_a_delay_that_is_negative_or_longer_than_the_recording_is_refused(late: float) -> None:
    recording = Recording.from_arrays([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], time=[0.0, 1.0, 2.0])
    with pytest.raises(InputError, match=r"late_s is .* it must be a number from 0 to 2 s"):
        recording.with_force_earlier(late)
    with pytest.raises(InputError, match="column of time"):
        replace(recording, time=None).with_force_earlier(0.5)
