# SPDX-License-Identifier: Apache-2.0
"""What goes over the wire to a USB device while it is set up: identity and requests of protocol version 1.

Little endian, packed, of fixed size. A wrong size, magic or version is an error, never a guess. The stream of
samples is no part of this: a synchronous library reaches 500 Hz, so it is the core's.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

from ..errors import InputError

VENDOR, PRODUCT = 0x1209, 0x0001
"""A pair for tests, of pid.codes: for development only."""

INTERFACE = 0
INTERFACE_KIND = (0xFF, 0x01, 0x01)
"""Class, subclass and protocol of the interface."""

TO_HOST, TO_DEVICE = 0xC1, 0x41
"""bmRequestType: vendor, interface."""

VERSION = 1
INFO_SIZE, IN_SIZE, OUT_SIZE = 32, 32, 16
LARGEST_PACKET = 64
"""Asked for where less must come: what is too long is seen to be."""
SHORTEST_WATCHDOG_MS, LONGEST_WATCHDOG_MS = 2, 1000

_INFO = struct.Struct("<BBHIiHHIBBBBQ")
_TRANSDUCER, _VELOCITY = 1, 2


class Request(IntEnum):
    """bRequest of a control transfer."""

    GET_INFO = 1
    ENABLE = 2
    ZERO = 3
    WATCHDOG = 4
    CLEAR = 5


@dataclass(frozen=True)
class DeviceInfo:
    """What a device says of itself (GET_INFO)."""

    firmware: int
    counts_per_rev: int
    max_torque: float
    """[N*m]"""
    rate_hz: int
    watchdog_ms: int
    transducer: bool
    """Whether it has a force transducer."""
    measures_velocity: bool
    uid: int

    @property
    def encoder_step(self) -> float:
        """One count of the encoder [rad]."""
        return 2.0 * math.pi / self.counts_per_rev


def decode_info(data: bytes) -> DeviceInfo:
    """Read the 32 bytes of GET_INFO.

    Parameters
    ----------
    data : bytes
        As received.

    Raises
    ------
    InputError
        Not of this protocol and version, or a field that no device can have.
    """
    if len(data) != INFO_SIZE:
        raise InputError(f"the answer to GET_INFO has {len(data)} bytes, must have {INFO_SIZE}")
    (
        magic,
        version,
        firmware,
        counts,
        max_torque,
        rate,
        watchdog,
        capabilities,
        in_size,
        out_size,
        dof,
        reserved,
        uid,
    ) = _INFO.unpack(data)
    if magic != ord("I"):
        raise InputError(f"the answer to GET_INFO begins with 0x{magic:02x}, must begin with 'I'")
    expected = {
        "version": (version, VERSION),
        "in_size": (in_size, IN_SIZE),
        "out_size": (out_size, OUT_SIZE),
        "dof": (dof, 1),
        "the reserved byte": (reserved, 0),
        "capabilities beyond bits 0 and 1": (capabilities & ~(_TRANSDUCER | _VELOCITY), 0),
    }
    for field, (value, right) in expected.items():
        if value != right:
            raise InputError(f"the answer to GET_INFO: {field} is {value}, must be {right}")
    positive = {
        "counts_per_rev": counts,
        "max_torque_uNm": max_torque,
        "rate_hz": rate,
        "watchdog_ms": watchdog,
    }
    for field, value in positive.items():
        if value <= 0:
            raise InputError(f"the answer to GET_INFO: {field} is {value}, must be > 0")
    return DeviceInfo(
        firmware=firmware,
        counts_per_rev=counts,
        max_torque=max_torque / 1e6,
        rate_hz=rate,
        watchdog_ms=watchdog,
        transducer=bool(capabilities & _TRANSDUCER),
        measures_velocity=bool(capabilities & _VELOCITY),
        uid=uid,
    )
