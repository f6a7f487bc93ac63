# SPDX-License-Identifier: Apache-2.0
"""What went wrong with a device, in one sentence: which device, why, and what cures it."""

from __future__ import annotations

import errno
from typing import Any


class DeviceError(Exception):
    """A device that cannot be used: one sentence that names it, the reason and the likely cure."""


_REASONS = {
    errno.EACCES: (
        "permission denied",
        "run `sudo palpate devices --install-udev-rule` once, then plug it in again",
    ),
    errno.EPERM: (
        "permission denied",
        "run `sudo palpate devices --install-udev-rule` once, then plug it in again",
    ),
    errno.EBUSY: ("another program holds it", "close palpate-control or whatever else uses it"),
    errno.ENODEV: ("it is gone", "plug it in again"),
    errno.ENOENT: ("it is gone", "plug it in again"),
    errno.EPIPE: ("it refuses the request (stall)", "its firmware may be of another version"),
    errno.ETIMEDOUT: ("it does not answer", "plug it in again; look at its power supply"),
    errno.EIO: ("the transfer failed", "try another cable or port"),
}


def device_error(device: str, doing: str, error: Any) -> DeviceError:
    """The sentence for an error of pyusb while `doing` something with `device`."""
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    reason, cure = _REASONS.get(getattr(error, "errno", None) or 0, (said, "plug it in again"))
    return DeviceError(f"{device}, {doing}: {reason}; {cure}")
