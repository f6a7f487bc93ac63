# SPDX-License-Identifier: Apache-2.0
"""Emulated moteus on an emulated CAN bus, for tests and for the pages of the site.

    python tests/python/moteus_controller.py BUS.sock

The controller has the number 1 and servo.pid_position.kp = 4. It is written from docs/protocol of
mjbots/moteus, without palpate: subframes of int8 and float registers over CAN FD.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from can_motor import CAN_FD, CanMotor
from emulated_device import main

TURN = 2.0 * math.pi
EXTENDED = 0x80000000
"""Flag of a frame with 29 bits of number"""
STOPPED, POSITION = 0, 10
"""Modes of register 0"""
NOTHING = 0x50
MODE, FAULT, TARGET, SPEED, TORQUE, KP_SCALE, KD_SCALE, LARGEST_TORQUE, TIMEOUT = (
    *(0x00, 0x0F, 0x20, 0x21, 0x22, 0x23, 0x24),
    *(0x25, 0x27),
)


@dataclass
class Moteus(CanMotor):
    """A moteus in its position mode, with servo.timeout_mode = 0."""

    inertia: float = 1e-4
    damping: float = 2e-3
    kp: float = 4.0
    """servo.pid_position.kp [N*m/rev]"""
    kd: float = 0.05
    """servo.pid_position.kd [N*m*s/rev]"""
    mode: int = STOPPED
    fault: int = 0

    def is_command(self, frame: bytes) -> bool:
        return len(frame) == CAN_FD.size and CAN_FD.unpack(frame)[0] & ~EXTENDED & 0x7FFF == self.number

    def obeyed(self, frame: bytes) -> bytes:
        _, length, _, data = CAN_FD.unpack(frame)
        torque = self.torque
        written, queries = self._subframes(data[:length])
        self._write(written)
        reply = b"".join(self._answer(*query, torque=torque) for query in queries)
        reply += bytes([NOTHING]) * (-len(reply) % 4)
        return CAN_FD.pack(self.number << 8 | EXTENDED, len(reply), 0x06, reply)

    @staticmethod
    def _subframes(data: bytes) -> tuple[dict[int, float], list[tuple[int, int, int]]]:
        """Returns the written registers, and type, first register and count of each query."""
        written: dict[int, float] = {}
        queries = []
        at = 0
        while at < len(data):
            head = data[at]
            at += 1
            if head == NOTHING:
                continue
            kind, count = head >> 2 & 3, head & 3
            if not count:
                count, at = data[at], at + 1
            first, at = data[at], at + 1
            if head & 0xF0 == 0x10:
                queries.append((kind, first, count))
                continue
            code = {0: "<b", 3: "<f"}[kind]
            for register in range(first, first + count):
                written[register] = struct.unpack_from(code, data, at)[0]
                at += struct.calcsize(code)
        return written, queries

    def _write(self, written: dict[int, float]) -> None:
        self.mode = int(written.get(MODE, self.mode))
        self.enabled = self.mode == POSITION
        if not self.enabled:
            self.command = (0.0,) * 5
            return
        target = written[TARGET] * TURN
        self.command = (
            self.position if math.isnan(target) else target,
            written[SPEED] * TURN,
            written[KP_SCALE] * self.kp / TURN,
            written[KD_SCALE] * self.kd / TURN,
            written[TORQUE],
        )
        self.torque_limit = written[LARGEST_TORQUE]
        self.watchdog_s = written[TIMEOUT]

    def _answer(self, kind: int, first: int, count: int, *, torque: float) -> bytes:
        values = {
            MODE: 1 if self.fault else self.mode,
            FAULT: self.fault,
            0x01: self.position / TURN,
            0x02: self.velocity / TURN,
            0x03: torque,
        }
        code = {0: "<b", 3: "<f"}[kind]
        content = b"".join(struct.pack(code, values[register]) for register in range(first, first + count))
        return bytes([0x20 | kind << 2 | count, first]) + content


if __name__ == "__main__":
    main(Moteus())
