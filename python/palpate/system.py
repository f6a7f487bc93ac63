# SPDX-License-Identifier: Apache-2.0
"""What differs between operating systems: creation of files, and live control, which needs Linux."""

from __future__ import annotations

import errno
import os
import platform
import stat
import sys
from contextlib import suppress
from pathlib import Path

from .errors import InputError

HAS_LIVE_CONTROL = sys.platform.startswith("linux")
"""True if the core contains the control loop in real time."""


def require_live_control(work: str) -> None:
    """Refuses work in real time on a system without it.

    Raises
    ------
    InputError
        This system is not Linux.
    """
    if not HAS_LIVE_CONTROL:
        raise InputError(
            f"{work} needs Linux, and this is {platform.system()}: palpate simulate renders without a device "
            "on every system"
        )


def create(path: Path, replaced: os.stat_result | None) -> None:
    """Creates a new file with the owner and mode of the file that it will replace, where the system has
    both."""
    mode = 0o666 if replaced is None else stat.S_IMODE(replaced.st_mode)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
    descriptor = os.open(path, flags, mode)
    try:
        if replaced is not None and hasattr(os, "fchown"):
            with suppress(PermissionError):  # only root may change the owner of a file
                os.fchown(descriptor, replaced.st_uid, replaced.st_gid)
            os.fchmod(descriptor, mode)  # the umask reduces the mode given to `open`
    finally:
        os.close(descriptor)


def sync(path: Path) -> None:
    """Waits until the content of a file or folder is stored on the disk, if the file system supports this."""
    if os.name == "nt":  # Windows opens no folder, and writes back only files that are open for writing
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)
