# SPDX-License-Identifier: Apache-2.0
"""Motor, hand and bus of the emulated CAN drives, for tests and for the pages of the site.

The bus is a Unix socket that carries the frames of SocketCAN. Each command of the host is one millisecond of
the motor and of its watchdog, so that no result depends on the speed of the machine.
"""

from __future__ import annotations

import contextlib
import math
import socket
import struct
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, field
from threading import Event

from emulated_device import answer_next

CAN = struct.Struct("=IB3x8s")
"""A struct can_frame of Linux: number, length, data"""
CAN_FD = struct.Struct("=IBB2x64s")
"""A struct canfd_frame of Linux: number, length, flags, data"""
STEP_S = 1e-3
SUBSTEPS = 20


@dataclass
class CanMotor(ABC):
    """Motor with a hand that turns its shaft slowly, and the faults of its bus."""

    number: int = 1
    center: float = 0.25
    """Middle of the motion of the hand [rad]"""
    inertia: float = 1e-3
    damping: float = 5e-3
    torque_limit: float = 10.0
    answers: int | None = None
    """Number of commands after which the drive is silent; None: never"""
    second: bool = False
    """True if a second drive has the same number"""
    lost: set[int] = field(default_factory=set)
    """Commands that do not reach the drive, by their number; its line stays"""
    unanswered: set[int] = field(default_factory=set)
    """Commands whose answer is lost"""
    jolt: tuple[int, float] | None = None
    """Command from which on the hand is elsewhere, and by how much [rad]"""
    idle_s: float = 0.0
    """Time without a command that a test lets pass [s]"""
    enabled: bool = False
    watchdog_s: float = 0.0
    """Time without a command after which there is no torque; 0: never [s]"""
    position: float = 0.0
    velocity: float = 0.0
    command: tuple[float, float, float, float, float] = (0.0,) * 5
    """Position, velocity, stiffness, damping and torque of the last command"""
    commands: int = 0
    last_command: float = 0.0
    largest_torque: float = 0.0
    disconnected: Event = field(default_factory=Event)
    """Set after the last frame of a connection that was closed"""
    trace: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=100_000))
    """Position and torque at the end of the last milliseconds"""

    def __post_init__(self) -> None:
        self.position = self.center

    def now(self) -> float:
        return self.commands * STEP_S + self.idle_s

    @property
    def torque(self) -> float:
        """Torque of the motor now [N*m]; the watchdog ends it."""
        if not self.enabled or (self.watchdog_s and self.now() - self.last_command > self.watchdog_s):
            return 0.0
        target, speed, stiffness, damping, torque = self.command
        wanted = stiffness * (target - self.position) + damping * (speed - self.velocity) + torque
        return min(max(wanted, -self.torque_limit), self.torque_limit)

    def hand(self) -> float:
        """Returns the position to which the hand pulls [rad]."""
        turn = self.center + 0.2 * math.sin(2 * math.pi * 0.8 * self.commands * STEP_S)
        return turn + (self.jolt[1] if self.jolt and self.commands >= self.jolt[0] else 0.0)

    def step(self) -> None:
        """Moves motor and hand by a millisecond with the present line."""
        self.commands += 1
        hand = self.hand()
        for _ in range(SUBSTEPS):
            torque = self.torque
            pull = 20.0 * (hand - self.position) - 0.2 * self.velocity
            self.velocity += (torque + pull - self.damping * self.velocity) / self.inertia * STEP_S / SUBSTEPS
            self.position += self.velocity * STEP_S / SUBSTEPS
        self.largest_torque = max(self.largest_torque, abs(self.torque))
        self.trace.append((self.position, self.torque))

    def replies(self, frame: bytes) -> list[bytes]:
        """Returns the frames that answer a frame."""
        if not self.is_command(frame):
            return self.other(frame)
        self.step()
        if self.commands in self.lost:
            return []
        self.last_command = self.now()
        answer = self.obeyed(frame)
        silent = self.answers is not None and self.commands > self.answers
        if silent or self.commands in self.unanswered:
            return []
        return [answer] * (2 if self.second else 1)

    @abstractmethod
    def is_command(self, frame: bytes) -> bool:
        """Returns True if the frame is a command to this drive."""

    @abstractmethod
    def obeyed(self, frame: bytes) -> bytes:
        """Takes a command and returns the answer with the state before it."""

    def other(self, frame: bytes) -> list[bytes]:
        """Returns the answers to a frame that is not a command."""
        del frame
        return []

    def serve(self, connection: socket.socket) -> None:
        """Answers the frames of one connection until it is closed."""
        with connection, contextlib.suppress(ConnectionError):
            while answer_next(connection, self.replies):
                pass
        self.disconnected.set()
