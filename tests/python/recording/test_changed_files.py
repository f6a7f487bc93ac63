# SPDX-License-Identifier: Apache-2.0
"""A file that changes while it is read: its SHA-256 is that of the rows that were read, or it is refused."""

import hashlib
import os
import sys
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from conftest import sampled
from palpate import Recording, identify_files, read_recording
from palpate.errors import InputError

ROWS = 50

CHANGED = "was changed while it was read; read it when nothing writes to it"


def written(path: Path, seed: int) -> bytes:
    """Writes a recording in the format of the suffix and returns its bytes."""
    x = np.round(np.random.default_rng(seed).uniform(1.0, 2.0, ROWS), 6)
    columns = {"position_m": x, "force_N": 2.0 * x}
    frame = pd.DataFrame(columns)
    if path.suffix == ".csv":
        frame.to_csv(path, index=False, float_format="%.6f")
    elif path.suffix == ".parquet":
        frame.to_parquet(path)
    elif path.suffix == ".xlsx":
        frame.to_excel(path, index=False)
    elif path.suffix == ".npz":
        np.savez(path, position_m=x, force_N=2.0 * x)
    elif path.suffix == ".mcap":
        Recording.from_arrays(x, 2.0 * x, np.arange(ROWS) * 1.0).write(path)
    else:
        savemat(path, columns)
    return path.read_bytes()


def written_over(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def replaced(path: Path, content: bytes) -> None:
    other = path.with_name("new")
    other.write_bytes(content)
    other.replace(path)


def written_over_with_old_times(path: Path, content: bytes) -> None:
    before = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


class AtOpening:
    """Changes a file when the process opens it for the n-th time."""

    def __init__(self) -> None:
        self.path, self.left = "", 0
        self.change: Callable[[], None] = lambda: None
        sys.addaudithook(self._seen)  # cannot be removed, so there is one hook for all tests

    def _seen(self, event: str, arguments: tuple[object, ...]) -> None:
        if event != "open" or not self.left or str(arguments[0]) != self.path:
            return
        self.left -= 1
        if not self.left:
            self.change()


AT_OPENING = AtOpening()


CHANGES = (written_over, replaced, written_over_with_old_times)
SUFFIXES = ("csv", "parquet", "xlsx", "npz", "mat", "mcap")


@pytest.mark.parametrize(
    ("suffix", "change"),
    sampled(
        product(SUFFIXES, CHANGES),
        *product(set(SUFFIXES) - {"xlsx"}, CHANGES),
        ("xlsx", written_over_with_old_times),
    ),
)
def test_the_fingerprint_is_that_of_the_rows_read(
    tmp_path: Path, suffix: str, change: Callable[[Path, bytes], None]
) -> None:
    path, other = tmp_path / f"press.{suffix}", tmp_path / f"other.{suffix}"
    contents, forces = [written(path, 0), written(other, 1)], []
    for each in (path, other):
        forces.append(read_recording(each).force)
    assert contents[0] != contents[1]
    refusals = []
    for opening in range(1, 100):
        path.write_bytes(contents[0])
        AT_OPENING.path, AT_OPENING.left = str(path), opening
        AT_OPENING.change = lambda: change(path, contents[1])
        try:
            found = read_recording(path)
        except InputError as error:
            refusals.append(str(error))
        else:
            read = contents[[np.array_equal(found.force, each) for each in forces].index(True)]
            assert found.source.sha256 == hashlib.sha256(read).hexdigest()
        if AT_OPENING.left:  # the file was opened less often
            break
    assert refusals
    assert all(CHANGED in each for each in refusals)


def test_a_file_that_grows_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    content = written(path, 0)
    AT_OPENING.path, AT_OPENING.left = str(path), 3
    AT_OPENING.change = lambda: written_over(path, content + b"1.5,3.0\n")
    with pytest.raises(InputError, match=f"press.csv {CHANGED}"):
        read_recording(path)


def test_a_file_that_is_removed_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    written(path, 0)
    AT_OPENING.path, AT_OPENING.left, AT_OPENING.change = str(path), 2, path.unlink
    with pytest.raises(InputError, match=f"press.csv {CHANGED}"):
        read_recording(path)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_file_that_changes_between_its_parts_is_refused(tmp_path: Path, suffix: str) -> None:
    path, other = tmp_path / f"press.{suffix}", tmp_path / f"other.{suffix}"
    written(path, 0)
    content = written(other, 1)
    with pytest.raises(InputError, match=f"press.{suffix} {CHANGED}"):
        identify_files(path, part_rows=10, progress=lambda done, total: written_over(path, content))


def test_the_message_on_a_changed_file_replaces_that_on_its_content(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    content = written(path, 0)
    AT_OPENING.path, AT_OPENING.left = str(path), 3
    AT_OPENING.change = lambda: written_over(path, content[: len(content) // 2] + b"torn")
    with pytest.raises(InputError, match=CHANGED):
        read_recording(path)
