# SPDX-License-Identifier: Apache-2.0
"""Emulated MIT-mode drive on an emulated CAN bus, for tests and for the pages of the site.

    python tests/python/mit_drive.py BUS.sock

The drive is a Damiao DM4310 with the number 1. It is written from the protocol of the maker, without palpate.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from can_motor import CAN, CanMotor
from emulated_device import main

P_MAX, V_MAX, T_MAX, KP_MAX, KD_MAX = 12.5, 30.0, 10.0, 500.0, 5.0


def _value(code: int, low: float, high: float, bits: int) -> float:
    return code * (high - low) / ((1 << bits) - 1) + low


def _code(value: float, top: float, bits: int) -> int:
    return round((min(max(value, -top), top) + top) * ((1 << bits) - 1) / (2 * top))


@dataclass
class Drive(CanMotor):
    """A Damiao drive with its registers."""

    registers: dict[int, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.torque_limit = T_MAX
        self.registers = {9: struct.pack("<I", 0), 10: struct.pack("<I", 1)}
        for address, value in ((21, P_MAX), (22, V_MAX), (23, T_MAX)):
            self.registers[address] = struct.pack("<f", value)

    def is_command(self, frame: bytes) -> bool:
        return len(frame) == CAN.size and CAN.unpack(frame)[0] == self.number

    def other(self, frame: bytes) -> list[bytes]:
        number, length, data = CAN.unpack(frame)
        if number != 0x7FF or data[0] != self.number:
            return []
        if data[2] == 0x55:
            self.registers[data[3]] = data[4:length]
            self.watchdog_s = 50e-6 * struct.unpack("<I", self.registers[9])[0]
        return [CAN.pack(0x11, 8, data[:4] + self.registers.get(data[3], bytes(4)))]

    def obeyed(self, frame: bytes) -> bytes:
        data = CAN.unpack(frame)[2]
        torque = self.torque
        if data[:7] == b"\xff" * 7 and data[7] in (0xFC, 0xFD):
            self.enabled = data[7] == 0xFC
            self.command = (0.0,) * 5
        else:
            bits = int.from_bytes(data, "big")
            self.command = (
                _value(bits >> 48, -P_MAX, P_MAX, 16),
                _value(bits >> 36 & 0xFFF, -V_MAX, V_MAX, 12),
                _value(bits >> 24 & 0xFFF, 0.0, KP_MAX, 12),
                _value(bits >> 12 & 0xFFF, 0.0, KD_MAX, 12),
                _value(bits & 0xFFF, -T_MAX, T_MAX, 12),
            )
        state = (self.number & 0xF) | (int(self.enabled) << 4)
        bits = _code(self.position, P_MAX, 16) << 24 | _code(self.velocity, V_MAX, 12) << 12
        bits |= _code(torque, T_MAX, 12)
        return CAN.pack(0x11, 8, bytes([state]) + bits.to_bytes(5, "big") + bytes([25, 30]))


if __name__ == "__main__":
    main(Drive())
