# SPDX-License-Identifier: Apache-2.0
"""Fingerprints of files, atomic writing, and recordings as CSV files.

The CSV file states the role of each column and can be read without options. A flight record has the
additional role "status": its column states for every row if the force was the model's force, or if a guard
changed it.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import stat
import struct
import time
import zipfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .._core.io import follow_links
from ..errors import InputError, shortened
from ..frames import pd
from ..system import create, sync
from .table import Cells

_BLOCK_BYTES = 1 << 20

MEMORY_LIMIT = 4 << 30
"""Largest memory for the content of a recording file [bytes]: 10^8 rows of 5 columns."""

_ZIP_END_BYTES = 22 + 0xFFFF
"""Largest number of bytes of the record that ends a zip archive and states the number of members."""

_TICK_S = 0.01
"""Longest tick of the clock that dates changes of files [s]: Linux with 100 Hz."""

CELL_BYTES = 8
"""Memory of a cell with a number, or of the place of a word [bytes]."""


class TooLargeError(InputError):
    """The content of a file needs more memory than :data:`MEMORY_LIMIT`."""


def sha256_of_file(path: Path) -> str:
    """Returns the SHA-256 of a file in hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(_BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()


def require_file(path: Path) -> None:
    """Raises InputError if a path does not name a readable file with content."""
    if not path.exists():
        raise InputError(f"there is no file {path}")
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not path.is_file():
        # Opening a pipe would wait forever if no program writes to the pipe.
        raise InputError(f"{path} is a pipe, a device or a socket; save its contents to a file first")
    try:
        with path.open("rb") as stream:
            first = stream.read(1)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if not first:
        raise InputError(f"{path} is empty")


def require_memory(path: Path | str, needed: float) -> None:
    """Raises TooLargeError if the content of a file needs more memory than `MEMORY_LIMIT`.

    Readers call it before they allocate memory.

    Parameters
    ----------
    path : Path or str
        Name of the file in the message.
    needed : float
        Memory for all cells of the file that are needed, or for those found so far [bytes].
    """
    if needed > MEMORY_LIMIT:
        raise TooLargeError(
            f"{path} needs at least {needed / 2**30:.3g} GiB of memory, and the limit is "
            f"{MEMORY_LIMIT / 2**30:.3g} GiB; remove rows or columns. palpate identify reads longer CSV and "
            "Parquet files part by part"
        )


def zip_members(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yields names and contents of the members of a zip archive, after checking their checksums.

    Raises
    ------
    ValueError
        The archive is damaged, or a member is missing.
    """
    with path.open("rb") as stream, zipfile.ZipFile(stream) as archive:
        members = archive.infolist()
        require_memory(path, sum(each.file_size for each in members))
        stream.seek(max(0, path.stat().st_size - _ZIP_END_BYTES))
        end = stream.read()
        (count,) = struct.unpack_from("<H", end, end.rfind(b"PK\5\6") + 10)
        if count != min(len(members), 0xFFFF):
            raise ValueError(f"its directory names {len(members)} of {count} members")
        for each in members:
            yield each.filename, archive.read(each)


@contextmanager
def unchanged(*paths: Path) -> Iterator[None]:
    """Ensures that all reads of files within the context, also for the fingerprint, read the same bytes.

    Raises
    ------
    InputError
        A file was changed, replaced or removed in the meantime.
    """
    before = [_state_of(path) for path in paths]
    # Two changes within one tick get the same time, so the tick of the last change must be over.
    ages_s = [time.time() - 1e-9 * state[-1] for state in before if state is not None]
    time.sleep(max((_TICK_S - age for age in ages_s if abs(age) < _TICK_S), default=0.0))

    def refuse_changed() -> None:
        for path, state in zip(paths, before, strict=True):
            if _state_of(path) != state:
                raise InputError(f"{path} was changed while it was read; read it when nothing writes to it")

    try:
        yield
    except Exception:
        refuse_changed()  # a changed file is the reason for any other message about its content
        raise
    refuse_changed()


def _state_of(path: Path) -> tuple[int, ...] | None:
    """Returns identity, size and times of change of a file; None if it cannot be found."""
    try:
        state = path.stat()
    except OSError:
        return None
    return state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns


@contextmanager
def readable(path: Path, kind: str) -> Iterator[None]:
    """Converts every exception of a library that reads a file into an `InputError` with the file name.

    On broken files these libraries raise exceptions of many kinds.

    Raises
    ------
    InputError
        Reading failed.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        reason = shortened(" ".join(str(error).split()) or type(error).__name__, 200)
        raise InputError(f"{path} is not readable as {kind}: {reason}") from None


@contextmanager
def replacing(path: str | os.PathLike[str], *, replace: bool = True) -> Iterator[Path]:
    """Yields a temporary path in the folder of `path`, and renames it to `path` at the end.

    An error removes the temporary file. Its name is unpredictable. An existing file keeps its mode and, if
    permitted, its owner.
    A symbolic link is kept and its target is replaced, except that of another user in a folder that all users
    share, such as /tmp. The content is on the disk before the file is renamed. If the process is killed, the
    temporary file stays; no later run reads it.

    Parameters
    ----------
    path : path
        The file.
    replace : bool
        False refuses an existing file, also one that appears while the new one is written.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written, or the file exists or is not a regular file.
    """
    target = follow_links(path)
    if not target.parent.is_dir():
        raise InputError(f"{path} cannot be written: there is no folder {target.parent}")
    if target.is_dir():
        raise InputError(f"{path} cannot be written: it is a folder")
    if not replace:
        require_absent(Path(path))
    replaced = target.stat() if target.exists() else None
    if replaced is not None and not stat.S_ISREG(replaced.st_mode):
        raise InputError(f"{path} cannot be written: it is not an ordinary file")
    temporary = target.with_name(f".{target.name[:40]}.{secrets.token_hex(8)}.tmp")
    try:
        create(temporary, replaced)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from None
    try:
        yield temporary
        sync(temporary)
        if replace:
            temporary.replace(target)
        else:
            _rename_to_free_name(temporary, target)
        sync(target.parent)
    finally:
        temporary.unlink(missing_ok=True)


def require_absent(path: Path) -> None:
    """Raises InputError if a path exists; a broken symbolic link also counts as existing."""
    if os.path.lexists(path):
        raise InputError(f"{path} exists already; choose another name, or replace it with --force")


def _rename_to_free_name(temporary: Path, target: Path) -> None:
    """Renames a file unless the new name was taken in the meantime."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        require_absent(target)
        raise
    except OSError:  # the file system has no hard links: rename
        require_absent(target)
        temporary.replace(target)


_LAYOUT_KEY = "palpate-columns"
"""Metadata key of the roles of the columns: ``# palpate-columns: {"position": "position_rad", ...}``."""


@dataclass(frozen=True)
class Layout:
    """Column names of a file by role, and names of the inputs; empty if the file does not state its roles."""

    roles: dict[str, str] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()

    def record(self) -> dict[str, str]:
        """Returns the metadata, one key and one line of text, that state the layout in a file or a frame."""
        return {_LAYOUT_KEY: json.dumps({**self.roles, "inputs": list(self.inputs)})}

    @staticmethod
    def pop_from(file: str, metadata: dict[str, str]) -> Layout:
        """Removes the layout from the metadata of a file and returns it."""
        text = metadata.pop(_LAYOUT_KEY, None)
        if text is None:
            return Layout()
        try:
            found: dict[str, Any] = json.loads(text)
            inputs = tuple(map(str, found.pop("inputs", ())))
            return Layout({role: str(name) for role, name in found.items()}, inputs)
        except (ValueError, AttributeError, TypeError):
            raise InputError(
                f"{file}: the line '# {_LAYOUT_KEY}:' holds {text!r}, not a JSON object of roles and columns"
            ) from None


def free_name(stem: str, suffix: str, taken: Collection[str]) -> str:
    """Returns `stem` + `suffix`, numbered if another column of the recording has that name."""
    name, number = stem + suffix, 2
    while name in taken:
        name, number = f"{stem}_{number}{suffix}", number + 1
    return name


def write_csv(
    path: Path, layout: Layout, columns: Mapping[str, Cells], metadata: Mapping[str, str], *, replace: bool
) -> None:
    """Writes columns and metadata; without `replace`, an existing file is refused.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written, the file exists and `replace` is False, or the
        metadata does not fit on one line.
    """
    with (
        replacing(path, replace=replace) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as stream,
    ):
        for key, value in {**metadata, **layout.record()}.items():
            line = f"# {key}: {value}"
            if len(line.splitlines()) != 1 or ":" in key:
                raise InputError(
                    f"{path} cannot be written: metadata {key!r} does not fit on one line, key: value"
                )
            stream.write(line + "\n")
        pd.DataFrame(dict(columns)).to_csv(stream, index=False, lineterminator="\n")
