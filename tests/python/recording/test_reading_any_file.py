# SPDX-License-Identifier: Apache-2.0
"""Any file is read with consistent numbers of rows, or refused with one sentence; in all formats."""

import re
from cProfile import Profile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from any_input import SCALE, cases, is_one_sentence
from palpate import InputError, Recording, read_recording
from palpate.recording import sample_recording
from workbooks import SUFFIXES, workbook

MOST_CALLS = 1_000_000
"""A file of a few kilobytes that needs more function calls is a hang; most need less than 20 000."""


def result_of(path: Path, **options: Any) -> Recording | None:
    """Returns the recording in a file after checking it; None if the file is refused."""
    profile = Profile()
    try:
        recording = profile.runcall(read_recording, path, **options)
    except InputError as error:
        refusal = str(error)
        recording = None
    assert sum(each.callcount for each in profile.getstats()) < MOST_CALLS
    if recording is None:
        assert is_one_sentence(refusal), refusal
        return None
    check(recording, partial="rows" in options or "force_late_s" in options)
    return recording


def check(recording: Recording, *, partial: bool) -> None:
    """Compares the numbers of rows of a recording with each other and with the notes."""
    rows = len(recording)
    assert rows >= 10
    assert recording.source.rows == rows == len(recording.force)
    for values in (recording.position, recording.force):
        assert np.isfinite(values).all()
    assert len(np.unique(recording.position)) >= 3
    if recording.time is not None:
        assert len(recording.time) == rows
        assert (np.diff(recording.time) > 0).all()
    if recording.direction is not None:
        assert set(np.unique(recording.direction)) <= {-1, 0, 1}
    counts = [
        int(found) for note in recording.notes for found in re.findall(r"^(?:dropped|left out) (\d+)", note)
    ]
    unused = recording.source.file_rows - rows
    assert unused == sum(counts) if not partial else unused >= 0
    assert all(is_one_sentence(note) for note in recording.notes)


# -------------------------------------------------------------------------------------- tables as text

NAMES = [
    "position_mm",
    "force_N",
    "depth_mm",
    "Force [gf]",
    "time_s",
    "Time (ms)",
    "angle / rad",
    "torque, Nm",
    "status",
    "direction",
    "segment",
    "current_A",
    "x",
    "force",
    "counts",
    "temperature",
    "",
    "Force (mN)",
    "kraft_N",
    "a,b",
]
CELLS = [
    "",
    "nan",
    "inf",
    "-inf",
    "1e400",
    "1e-400",
    "press",
    "release",
    "Ok",
    "Clipped",
    '"',
    '"a;b"',
    "0x10",
    "1_0",
    "1,5",
    "1.5",
    "1.000,5",
    "--",
    "N/A",
    "2024-01-01",
    "12:00",
    "½",
    "−1.5",
    "1 000",
    " 3 ",
    "#",
    "+",
]

numbers = st.one_of(
    st.integers(-100, 100).map(str),
    st.floats(allow_nan=False, width=32).map(repr),
    st.floats(-10, 10).map(lambda value: f"{value:.3f}"),
)


@st.composite
def tables(draw: st.DrawFn) -> tuple[bytes, int | None]:
    """Returns a CSV file, often one that can be read, and the number of its data rows, if it is certain."""

    def usually(usual: Any, *others: Any) -> Any:
        return usual if draw(st.integers(0, 9)) else draw(st.sampled_from(others))

    separator = draw(st.sampled_from([",", ";", "\t"])) if draw(st.integers(0, 9)) else " "
    first = [usually("position_mm", *NAMES), usually("force_N", *NAMES)]
    names = [*first, *draw(st.lists(st.sampled_from(NAMES), max_size=3, unique=True))]
    names = list(dict.fromkeys(names)) if draw(st.integers(0, 9)) else names
    names = list(draw(st.permutations(names)))
    count = draw(st.integers(9, 40)) if draw(st.integers(0, 9)) else draw(st.integers(0, 9))
    steady = draw(st.booleans())
    lines, certain = [], True
    for row in range(count):
        cells = [str(0.25 * row + column) if steady else draw(numbers) for column in range(len(names))]
        for column, name in enumerate(names):
            if name in ("direction", "segment", "status"):
                cells[column] = usually("Ok" if name == "status" else "press", "release", "Ramp", "Limited")
        lines.append(cells)
    for _ in range(usually(0, 1, 2, 3) if lines else 0):
        cells = draw(st.sampled_from(lines))
        cells[draw(st.integers(0, len(cells) - 1))] = draw(st.sampled_from(CELLS))
        certain = False
    rows = [separator.join(cells) for cells in lines]
    if rows and not draw(st.integers(0, 9)):
        row = draw(st.integers(0, len(rows) - 1))
        others = [
            "",
            "# a comment",
            9 * separator,
            rows[row] + separator + "1",
            rows[row][:-3],
            draw(st.text()),
        ]
        rows[row] = draw(st.sampled_from(others))
        certain = False
    head = usually([], ["# key: value"], ["Date 2024", ""], ["sensor;3"], [separator.join(["mm", "N"])])
    header = usually([separator.join(names)], [])
    end = usually("\n", "\r\n", "\r")
    text = end.join([*head, *header, *rows]) + usually(end, "", "\0", end * 3)
    content = text.encode(usually("utf-8", "utf-8-sig", "utf-16", "latin-1", "utf-16-be"), "replace")
    return content, count if certain and header else None


ends = st.one_of(st.none(), st.integers(-2, 50))
used = st.sampled_from([*NAMES, "position", "force"])
OPTIONS = st.fixed_dictionaries(
    {},
    optional={
        "position": st.sampled_from(NAMES),
        "force": st.sampled_from(NAMES),
        "time": st.sampled_from(NAMES),
        "direction": st.sampled_from(NAMES),
        "inputs": st.lists(st.sampled_from(NAMES), max_size=2),
        "units": st.dictionaries(used, st.sampled_from(["mm", "N", "s", "counts", "q"])),
        "torque_constant": st.sampled_from([0.1, 0.0, -1.0, float("nan")]),
        "negate": st.lists(used, max_size=2),
        "rows": st.tuples(ends, ends),
        "zero": st.tuples(ends, ends),
        "force_late_s": st.sampled_from([0.001, 0.1, -0.1, 100.0, float("nan")]),
        "invalid": st.sampled_from(["refuse", "drop", "keep"]),
    },
)


@cases(20 if SCALE == 1 else 150)
@given(table=tables(), options=st.one_of(st.just({}), st.just({"invalid": "drop"}), OPTIONS))
def test_any_table_is_read_or_refused(
    table: tuple[bytes, int | None], options: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "any_table.csv"
    content, count = table
    path.write_bytes(content or b" ")
    recording = result_of(path, **options)
    if recording is not None and count is not None:
        assert recording.source.file_rows == count


@cases(50)
@given(content=st.binary(min_size=1, max_size=400), suffix=st.sampled_from([".csv", ".part", ".txt", ".tsv"]))
def test_any_bytes_are_read_or_refused(
    content: bytes, suffix: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / f"any_bytes{suffix}"
    path.write_bytes(content)
    result_of(path)


# -------------------------------------------------------------------------------------- binary formats


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Returns one valid file of each format."""
    folder = tmp_path_factory.mktemp("valid")
    recording = sample_recording(1, 1.0)
    frame = pd.DataFrame({"position_mm": 1e3 * recording.position, "force_N": recording.force})[:60]
    frame.to_csv(folder / "a.csv", index=False)
    frame.to_parquet(folder / "a.parquet")
    for suffix in SUFFIXES:
        workbook(folder / f"a{suffix}", {"run": [list(frame), *frame.to_numpy().tolist()]})
    arrays = {name: frame[name].to_numpy() for name in frame}
    np.savez(folder / "a.npz", **arrays)
    savemat(folder / "a.mat", arrays)
    recording.write(folder / "a.mcap")
    return {path.suffix: path.read_bytes() for path in folder.iterdir()}


FORMATS = [".csv", ".parquet", ".xlsx", ".npz", ".mat", ".mcap", ".xls", ".ods"]


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_unchanged_file_is_read(suffix: str, valid: dict[str, bytes], tmp_path: Path) -> None:
    (tmp_path / f"a{suffix}").write_bytes(valid[suffix])
    assert result_of(tmp_path / f"a{suffix}") is not None


@pytest.mark.parametrize("suffix", FORMATS)
@cases(8 if SCALE == 1 else 20)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(
    suffix: str, valid: dict[str, bytes], data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    content = bytearray(valid[suffix])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        kind = data.draw(st.sampled_from(["byte", "cut", "copy", "zero", "remove"]))
        size = data.draw(st.integers(1, 64))
        if kind == "byte":
            content[place] = data.draw(st.integers(0, 255))
        elif kind == "cut":
            content = content[: max(place, 1)]
        elif kind == "copy":
            content[place:place] = content[:size]
        elif kind == "zero":
            content[place : place + size] = bytes(len(content[place : place + size]))
        else:
            content = content[:place] + content[place + size :] or bytearray(b" ")
    path = tmp_path_factory.getbasetemp() / f"damaged{suffix}"
    path.write_bytes(content)
    result_of(path, invalid=data.draw(st.sampled_from(["refuse", "drop"])))


ARRAYS = st.sampled_from(
    [
        np.arange(20.0),
        np.arange(20),
        np.linspace(0, 1, 20)[:, None],
        np.linspace(0, 1, 40).reshape(20, 2),
        np.arange(20.0) + 1j,
        np.array(["press"] * 10 + ["release"] * 10),
        np.array([1.0, np.nan] * 10),
        np.array(3.0),
        np.array([]),
        np.zeros((2, 2, 2)),
        np.arange(20) > 9,
        np.arange(20).astype("datetime64[s]"),
        np.arange(20, dtype=np.float16),
        np.arange(20, dtype=">i2"),
        np.array([2**63] * 20, dtype=np.uint64),
    ]
)


@cases(20 if SCALE == 1 else 50)
@given(
    arrays=st.dictionaries(st.sampled_from(NAMES), ARRAYS, min_size=1, max_size=4),
    suffix=st.sampled_from(FORMATS[1:5]),
)
def test_any_arrays_are_read_or_refused(
    arrays: dict[str, Any], suffix: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / f"arrays{suffix}"
    if suffix == ".npz":
        np.savez(path, **{name or "empty": array for name, array in arrays.items()})
    elif suffix == ".mat":
        numeric = {name: array for name, array in arrays.items() if array.dtype.kind != "M"}
        savemat(path, {re.sub(r"\W", "_", f"a{name}"): array for name, array in numeric.items()})
    else:
        real = {name: array for name, array in arrays.items() if array.dtype.kind != "c"}
        frame = pd.DataFrame({name: pd.Series(list(array.ravel())) for name, array in real.items()})
        if suffix == ".parquet":
            frame.to_parquet(path)
        else:
            frame.to_excel(path, index=False)
    result_of(path)
