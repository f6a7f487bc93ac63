# SPDX-License-Identifier: Apache-2.0
"""Emulated MIT-mode drive on an emulated CAN bus, for tests and for the pages of the site.

    python tests/python/mit_drive.py BUS.sock

The bus is a Unix socket that carries the frames of SocketCAN. The drive is a Damiao DM4310 with the number 1
and a hand that turns its shaft slowly. It is written from the protocol of the maker, without palpate. Each
command is one millisecond of the motor; the watchdog uses the clock of this machine.
"""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread

FRAME = struct.Struct("=IB3x8s")
"""A struct can_frame of Linux: number, length, data"""
STEP_S = 1e-3
P_MAX, V_MAX, T_MAX, KP_MAX, KD_MAX = 12.5, 30.0, 10.0, 500.0, 5.0


def _value(code: int, low: float, high: float, bits: int) -> float:
    return code * (high - low) / ((1 << bits) - 1) + low


def _code(value: float, top: float, bits: int) -> int:
    return round((min(max(value, -top), top) + top) * ((1 << bits) - 1) / (2 * top))


@dataclass
class Drive:
    """Drive, motor and hand. `answers` and `second` are faults of the bus."""

    number: int = 1
    center: float = 0.25
    """Middle of the motion of the hand [rad]"""
    answers: int | None = None
    """Number of commands after which the drive is silent; None: never"""
    second: bool = False
    """True if a second drive has the same number"""
    enabled: bool = False
    position: float = 0.0
    velocity: float = 0.0
    command: tuple[float, float, float, float, float] = (0.0,) * 5
    """Position, velocity, kp, kd and torque of the last command"""
    registers: dict[int, bytes] = field(default_factory=dict)
    commands: int = 0
    last_command: float = 0.0
    largest_torque: float = 0.0

    def __post_init__(self) -> None:
        self.position = self.center
        self.registers = {9: struct.pack("<I", 0), 10: struct.pack("<I", 1)}
        for address, value in ((21, P_MAX), (22, V_MAX), (23, T_MAX)):
            self.registers[address] = struct.pack("<f", value)

    @property
    def torque(self) -> float:
        """Torque of the motor now [N*m]; the watchdog ends it."""
        watchdog_s = 50e-6 * struct.unpack("<I", self.registers[9])[0]
        if not self.enabled or (watchdog_s and time.monotonic() - self.last_command > watchdog_s):
            return 0.0
        target, speed, kp, kd, torque = self.command
        wanted = kp * (target - self.position) + kd * (speed - self.velocity) + torque
        return min(max(wanted, -T_MAX), T_MAX)

    def _step(self) -> None:
        """Moves motor and hand by a millisecond: inertia 1e-3 kg*m^2, damping 5e-3 N*m*s/rad."""
        self.commands += 1
        hand = self.center + 0.2 * math.sin(2 * math.pi * 0.8 * self.commands * STEP_S)
        for _ in range(20):
            torque = self.torque
            pull = 20.0 * (hand - self.position) - 0.2 * self.velocity
            self.velocity += (torque + pull - 5e-3 * self.velocity) / 1e-3 * STEP_S / 20
            self.position += self.velocity * STEP_S / 20
        self.largest_torque = max(self.largest_torque, abs(torque))

    def replies(self, number: int, data: bytes) -> list[tuple[int, bytes]]:
        """Returns number and data of the frames that answer a frame."""
        if number == 0x7FF and data[0] == self.number:
            if data[2] == 0x55:
                self.registers[data[3]] = data[4:]
            return [(0x11, data[:4] + self.registers.get(data[3], bytes(4)))]
        if number != self.number:
            return []
        self.last_command = time.monotonic()
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
        self._step()
        if self.answers is not None and self.commands > self.answers:
            return []
        state = (self.number & 0xF) | (int(self.enabled) << 4)
        bits = _code(self.position, P_MAX, 16) << 24 | _code(self.velocity, V_MAX, 12) << 12
        bits |= _code(self.torque, T_MAX, 12)
        reply = (0x11, bytes([state]) + bits.to_bytes(5, "big") + bytes([25, 30]))
        return [reply] * (2 if self.second else 1)

    def serve(self, connection: socket.socket) -> None:
        """Answers the frames of one connection until it is closed."""
        with connection, contextlib.suppress(ConnectionError):
            while frame := connection.recv(FRAME.size):
                number, length, data = FRAME.unpack(frame)
                for answer, content in self.replies(number, data[:length]):
                    connection.send(FRAME.pack(answer, len(content), content))


def _bus(path: Path) -> socket.socket:
    """Returns a listening socket of this name."""
    bus = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    bus.bind(str(path))
    bus.listen()
    return bus


@contextlib.contextmanager
def emulated(path: Path, drive: Drive) -> Iterator[Drive]:
    """Runs a drive on a bus of this name as long as the context lasts."""

    def run() -> None:
        with contextlib.suppress(OSError):
            while True:
                drive.serve(bus.accept()[0])

    with _bus(path) as bus:
        Thread(target=run, daemon=True).start()
        yield drive
        bus.shutdown(socket.SHUT_RDWR)


if __name__ == "__main__":
    own = Drive()
    own_bus = _bus(Path(sys.argv[1]))
    while True:
        own.serve(own_bus.accept()[0])
