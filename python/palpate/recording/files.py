# SPDX-License-Identifier: Apache-2.0
"""Files as a whole: their fingerprint, and writing them so that no half-written one stands at the target."""

from __future__ import annotations

import errno
import hashlib
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import InputError, shortened

_BLOCK = 1 << 20


def sha256_of_file(path: Path) -> str:
    """The SHA-256 of a file's bytes, in hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def require_file(path: Path) -> None:
    """Refuse, in one sentence, what is not a readable, non-empty file."""
    if not path.exists():
        raise InputError(f"there is no file {path}")
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not path.is_file():
        # Opening a pipe without a writer would wait for ever.
        raise InputError(f"{path} is a pipe, a device or a socket; save its contents to a file first")
    try:
        with path.open("rb") as stream:
            first = stream.read(1)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    if not first:
        raise InputError(f"{path} is empty")


@contextmanager
def readable(path: Path, kind: str) -> Iterator[None]:
    """Turn every failure of a library that reads a file into one sentence with the name of the file.

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
    """Give a temporary path beside `path`; it is renamed to `path` at the end, or removed if anything fails.

    The temporary name is unpredictable. An existing file keeps its mode and its owner, a symbolic link stays
    and its target is replaced. The content is on the disk before the file has its name.

    Parameters
    ----------
    path : path
        The file.
    replace : bool
        False refuses an existing file, also one that appears while the new one is written.

    Raises
    ------
    InputError
        The folder does not exist or cannot be written, or the file is no ordinary file or exists.
    """
    target = Path(path)
    if target.is_symlink():
        target = Path(os.path.realpath(target))
    if not target.parent.is_dir():
        raise InputError(f"{path} cannot be written: there is no folder {target.parent}")
    if target.is_dir():
        raise InputError(f"{path} cannot be written: it is a folder")
    if not replace:
        require_absent(Path(path))
    before = target.stat() if target.exists() else None
    if before is not None and not stat.S_ISREG(before.st_mode):
        raise InputError(f"{path} cannot be written: it is not an ordinary file")
    temporary = target.with_name(f".{target.name[:40]}.{secrets.token_hex(8)}.tmp")
    try:
        _create(temporary, before)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from None
    try:
        yield temporary
        _sync(temporary)
        if replace:
            temporary.replace(target)
        else:
            _rename_to_free_name(temporary, target)
        _sync(target.parent)
    finally:
        temporary.unlink(missing_ok=True)


def require_absent(path: Path) -> None:
    """Refuse a recording that exists; a broken symbolic link counts as one."""
    if os.path.lexists(path):
        raise InputError(f"{path} exists already; choose another name, or replace it with --force")


def _create(temporary: Path, before: os.stat_result | None) -> None:
    """Create a file that is not there, with owner and mode of the file that it will replace."""
    mode = 0o666 if before is None else stat.S_IMODE(before.st_mode)
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, mode)
    try:
        if before is not None:
            with suppress(PermissionError):  # only root gives files away
                os.fchown(descriptor, before.st_uid, before.st_gid)
            os.fchmod(descriptor, mode)  # without the umask
    finally:
        os.close(descriptor)


def _sync(path: Path) -> None:
    """Wait until a file or a folder is on the disk, where its file system can tell."""
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)


def _rename_to_free_name(temporary: Path, target: Path) -> None:
    """Give a file its name, unless that is taken meanwhile."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        require_absent(target)
        raise
    except OSError:  # a file system without hard links
        require_absent(target)
        temporary.replace(target)
