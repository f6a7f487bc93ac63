# SPDX-License-Identifier: Apache-2.0
"""Emulated force-feedback wheel of the USB class PID, for tests and for the pages of the site.

    python tests/python/hid_wheel.py WHEEL.sock

It is written from the class definition (PID 1.0) and from the reports that an OpenFFBoard declares, without
palpate: its report descriptor has the same reports, places and ranges. The socket carries the reports of a
hidraw node behind one letter, see ``hid_node.hpp``. The wheel runs in real time. With `period_s` each force
report of the host is one period of the wheel, so that no result depends on the speed of the machine.
"""

from __future__ import annotations

import contextlib
import math
import select
import socket
import struct
import time
from collections import deque
from dataclasses import dataclass, field

from emulated_device import answer_next, main

STEP_S = 1e-3
SUBSTEPS = 10
MOST_EFFECTS = 40
TOP = 32767

INPUT, OUTPUT, FEATURE = 0x80, 0x90, 0xB0
CONSTANT_FORCE, SPRING = 1, 8
"""Places of the effect types in the list of the descriptor, from 1"""
STATE_ID, EFFECT_ID, CONDITION_ID, CONSTANT_ID, OPERATION_ID = 2, 1, 3, 5, 10
CONTROL_ID, GAIN_ID, CREATE_ID, LOAD_ID, POOL_ID = 12, 13, 17, 18, 19


class Descriptor:
    """Writes the items of a report descriptor."""

    def __init__(self) -> None:
        self.bytes = bytearray()

    def item(self, tag: int, value: int, size: int | None = None) -> Descriptor:
        """Adds an item with the smallest size for a signed value, or with `size` bytes."""
        if size is None:
            size = 1 if -128 <= value < 128 else 2 if -32768 <= value < 32768 else 4
        self.bytes += bytes([tag | (3 if size == 4 else size)])
        self.bytes += (value % (1 << 8 * size)).to_bytes(size, "little")
        return self

    def page(self, page: int) -> Descriptor:
        return self.item(0x04, page, 1 if page < 256 else 2)

    def usages(self, *usages: int) -> Descriptor:
        for usage in usages:
            self.item(0x08, usage, 4 if usage > 0xFFFF else 1)
        return self

    def collection(self, kind: int, *usages: int) -> Descriptor:
        return self.usages(*usages).item(0xA0, kind, 1)

    def end(self) -> Descriptor:
        self.bytes += b"\xc0"
        return self

    def report(self, number: int) -> Descriptor:
        return self.item(0x84, number, 1)

    def values(
        self,
        kind: int,
        bits: int,
        count: int,
        low: int | None = None,
        high: int | None = None,
        flags: int = 2,
    ) -> Descriptor:
        """Adds a main item; without a range the last one counts."""
        if low is not None and high is not None:
            self.item(0x14, low).item(0x24, high)
        self.item(0x74, bits, 1).item(0x94, count, 1)
        self.bytes += bytes([kind | 1, flags])
        return self


def _index(to: Descriptor, kind: int = OUTPUT) -> Descriptor:
    return to.usages(0x22).values(kind, 8, 1, 1, MOST_EFFECTS)


def _types(to: Descriptor, kind: int) -> Descriptor:
    types = (0x26, 0x27, 0x30, 0x31, 0x32, 0x33, 0x34, 0x40, 0x41, 0x42, 0x43)
    return to.collection(2, 0x25).usages(*types).values(kind, 8, 1, 1, len(types), 0).end()


def open_ff_board(axes: int = 1, *, spring: bool = True) -> bytes:
    """Returns a report descriptor with the reports of an OpenFFBoard with one or two axes.

    Source: Firmware/FFBoard/UserExtensions/Src/usb_hid_1ffb_desc.c and usb_hid_2ffb_desc.c of
    Ultrawipf/OpenFFBoard: report numbers of ffb_defs.h, sizes, places, ranges and units.
    """
    ordinals = [0x000A0000 + k for k in range(1, axes + 1)]
    to = Descriptor().page(1).collection(1, 0x04)
    to.collection(0).report(1).page(9).item(0x18, 1).item(0x28, 64)
    to.values(INPUT, 1, 64, 0, 1).page(1).usages(0x30, 0x31, 0x32, 0x33, 0x34, 0x35, 0x37, 0x36)
    to.values(INPUT, 16, 8, -TOP, TOP).end()
    # The maker's own commands
    to.page(0xFF00).collection(1, 0x00)
    for kind in (OUTPUT, INPUT):
        to.report(0xA1).item(0x14, 0).item(0x24, 4, 2)
        for usage, bits in ((1, 8), (2, 16), (3, 8), (4, 32), (5, 64), (6, 64)):
            to.usages(usage).values(kind, bits, 1)
    to.end()
    to.page(0x0F).collection(2, 0x92).report(STATE_ID).usages(0x9F, 0xA0, 0xA4, 0xA6, 0x94)
    to.values(INPUT, 1, 5, 0, 1).values(INPUT, 1, 3, flags=3).end()
    # Set Effect
    to.collection(2, 0x21).report(EFFECT_ID)
    _types(_index(to), OUTPUT)
    to.usages(0x50, 0x54, 0x51, 0xA7).item(0x64, 0x1003, 2).item(0x54, 0xFD, 1)
    to.values(OUTPUT, 16, 4, 0, TOP).item(0x54, 0).item(0x64, 0)
    to.usages(0x52).values(OUTPUT, 8, 1, 0, 255).usages(0x53).values(OUTPUT, 8, 1, 1, 8)
    to.collection(2, 0x55).page(1).usages(*range(0x30, 0x30 + axes))
    to.values(OUTPUT, 1, axes, 0, axes - 1).end()
    to.page(0x0F).usages(0x56).values(OUTPUT, 1, 1).values(OUTPUT, 1, 7 - axes, flags=3)
    to.collection(2, 0x57).usages(*ordinals).values(OUTPUT, 16, axes, 0, 36000).end()
    to.collection(2, 0x58).usages(*ordinals).item(0x24, 32765).values(OUTPUT, 16, axes).end().end()
    # Set Envelope
    to.collection(2, 0x5A).report(2)
    _index(to).usages(0x5B, 0x5D).values(OUTPUT, 16, 2, 0, TOP)
    to.usages(0x5C, 0x5E).values(OUTPUT, 32, 2).end()
    # Set Condition
    if spring:
        to.collection(2, 0x5F).report(CONDITION_ID)
        _index(to).usages(0x23).values(OUTPUT, 8 - 2 * axes, 1, 0, 3)
        to.collection(2, 0x58).usages(*ordinals).values(OUTPUT, 2, axes).end()
        to.usages(0x60).values(OUTPUT, 16, 1, -TOP - 1, TOP).usages(0x61, 0x62).values(OUTPUT, 16, 2)
        to.usages(0x63, 0x64).values(OUTPUT, 16, 2, 0, TOP).usages(0x65).values(OUTPUT, 16, 1).end()
    # Set Periodic, Set Constant Force, Set Ramp Force
    to.collection(2, 0x6E).report(4)
    _index(to).usages(0x70).values(OUTPUT, 16, 1, 0, TOP).usages(0x6F).values(OUTPUT, 16, 1, -TOP - 1, TOP)
    to.usages(0x71).values(OUTPUT, 16, 1, 0, 35999).usages(0x72).values(OUTPUT, 32, 1, 1, TOP).end()
    to.collection(2, 0x73).report(CONSTANT_ID)
    _index(to).usages(0x70).values(OUTPUT, 16, 1, -TOP - 1, TOP).end()
    to.collection(2, 0x74).report(6)
    _index(to).usages(0x75, 0x76).values(OUTPUT, 16, 2, -TOP - 1, TOP).end()
    # Effect Operation, PID Block Free, Device Control, Device Gain
    to.collection(2, 0x77).report(OPERATION_ID)
    _index(to).collection(2, 0x78).usages(0x79, 0x7A, 0x7B).values(OUTPUT, 8, 1, 1, 3, 0).end()
    to.usages(0x7C).values(OUTPUT, 8, 1, 0, 255).end()
    _index(to.collection(2, 0x90).report(11)).end()
    to.collection(2, 0x95).report(CONTROL_ID).collection(2, 0x96).usages(*range(0x97, 0x9D))
    to.values(OUTPUT, 1, 8, 1, 6).end().end()
    to.collection(2, 0x7D).report(GAIN_ID).usages(0x7E).values(OUTPUT, 8, 1, 0, 255).end()
    # Create New Effect, PID Block Load, PID Pool
    _types(to.collection(2, 0xAB).report(CREATE_ID), FEATURE).page(1).usages(0x3B)
    to.values(FEATURE, 10, 1, 0, 511).values(FEATURE, 6, 1, flags=1).end()
    to.page(0x0F).collection(2, 0x89).report(LOAD_ID)
    _index(to, FEATURE).collection(2, 0x8B).usages(0x8C, 0x8D, 0x8E).values(FEATURE, 8, 1, 1, 3, 0).end()
    to.usages(0xAC).values(FEATURE, 16, 1, 0, 65535, 0).end()
    to.collection(2, 0x7F).report(POOL_ID).usages(0x80).values(FEATURE, 16, 1, 0, 65535)
    to.usages(0x83).values(FEATURE, 8, 1, 0, 255).usages(0xA9, 0xAA).values(FEATURE, 1, 2, 0, 1)
    to.values(FEATURE, 6, 1, flags=3).end()
    return bytes(to.end().bytes)


@dataclass
class Effect:
    """An effect of the wheel, in the numbers of the wheel."""

    kind: int
    duration_ms: int = 0
    gain: int = 255
    direction_deg: float = 0.0
    started: float | None = None
    """Time of the last start [s]; None: stopped"""
    magnitude: int = 0
    center: int = 0
    coefficients: tuple[int, int] = (0, 0)
    saturations: tuple[int, int] = (0, 0)
    dead_band: int = 0

    def plays(self, now: float) -> bool:
        return self.started is not None and (
            self.duration_ms == 0 or now <= self.started + 1e-3 * self.duration_ms
        )

    def force(self, position: float) -> float:
        """Returns the force of the effect in the numbers of the wheel, > 0 against larger positions."""
        if self.kind == CONSTANT_FORCE:
            return self.magnitude * (self.gain / 255.0) * math.sin(math.radians(self.direction_deg))
        if self.kind != SPRING:
            return 0.0
        away = position - self.center
        if abs(away) <= self.dead_band:
            return 0.0
        away -= math.copysign(self.dead_band, away)
        wanted = Wheel.spring_gain * self.coefficients[0 if away > 0 else 1] / TOP * away
        return min(max(wanted, -self.saturations[1]), self.saturations[0])


@dataclass
class Wheel:
    """A wheel with a hand that turns it slowly, and its faults."""

    spring_gain = 4.0
    """Force of the full coefficient at the end of the axis, divided by the full force"""

    axes: int = 1
    half_range: float = 0.5 * math.radians(180.0)
    """Rotation from the middle to an end [rad]"""
    full_torque: float = 2.0
    """Torque of the full force [N*m]"""
    center: float = 0.25
    """Middle of the motion of the hand [rad]"""
    inertia: float = 5e-3
    damping: float = 0.05
    friction: float = 0.05
    period_s: float | None = None
    """Time that passes with each force report [s]; None: the wheel runs in real time. It answers each force
    report with its position, so that a program in virtual time needs no other report."""
    gone_after: int | None = None
    """Number of force reports after which the node is gone"""
    deaf_after: int | None = None
    """Number of force reports after which the wheel ignores all reports"""
    paused_after: int | None = None
    """Number of force reports after which the wheel reports that it is paused"""
    jolt: tuple[int, float] | None = None
    """Force report from which on the hand is elsewhere, and by how much [rad]"""
    cut: int | None = None
    """Number of bytes of the report descriptor that the node has"""
    memory: int = MOST_EFFECTS
    """Number of effects that the wheel can store"""
    spring: bool = True
    """True if the wheel has springs"""
    position: float = 0.0
    velocity: float = 0.0
    time_s: float = 0.0
    forces: int = 0
    enabled: bool = False
    effects: dict[int, Effect] = field(default_factory=dict)
    load: bytes = bytes(4)
    largest_torque: float = 0.0
    trace: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=100_000))
    """Position and torque at the end of the last steps"""

    def __post_init__(self) -> None:
        self.position = self.center

    @property
    def stiffness(self) -> float:
        """Stiffness of the full coefficient [N*m/rad]."""
        return self.spring_gain * self.full_torque / self.half_range

    def now(self) -> float:
        return self.time_s

    @property
    def torque(self) -> float:
        """Torque of the motor now, > 0 to larger positions [N*m]."""
        if not self.enabled:
            return 0.0
        code = TOP * self.position / self.half_range
        force = sum(each.force(code) for each in self.effects.values() if each.plays(self.now()))
        return -self.full_torque * min(max(force / TOP, -1.0), 1.0)

    def hand(self) -> float:
        """Returns the position to which the hand pulls [rad]."""
        turn = self.center + 0.2 * math.sin(2 * math.pi * 0.8 * self.time_s)
        return turn + (self.jolt[1] if self.jolt and self.forces >= self.jolt[0] else 0.0)

    def step(self, duration_s: float) -> None:
        """Moves wheel and hand by a time."""
        self.time_s += duration_s
        substeps = math.ceil(SUBSTEPS * duration_s / STEP_S)
        for _ in range(substeps):
            pull = 20.0 * (self.hand() - self.position) - 0.3 * self.velocity
            drag = self.damping * self.velocity + self.friction * math.tanh(self.velocity / 0.01)
            self.velocity += (self.torque + pull - drag) / self.inertia * duration_s / substeps
            self.position += self.velocity * duration_s / substeps
        self.largest_torque = max(self.largest_torque, abs(self.torque))
        self.trace.append((self.position, self.torque))

    def axis_report(self) -> bytes:
        code = round(TOP * min(max(self.position / self.half_range, -1.0), 1.0))
        return struct.pack("<BQ8h", 1, 0, code, *[0] * 7)

    def state_report(self, *, paused: bool = False) -> bytes:
        return bytes([STATE_ID, paused | self.enabled << 1 | 8 | self.enabled << 4])

    def obey(self, report: bytes) -> list[bytes]:
        """Takes an output report; returns the input reports that answer it."""
        if self.deaf_after is not None and self.forces >= self.deaf_after:
            return []
        number, content = report[0], report[1:]
        if number == CONTROL_ID:
            self._control(content[0])
            return [self.state_report()]
        effect = self.effects.get(content[0])
        if effect is None:
            return []
        if number == EFFECT_ID:
            effect.kind = content[1]
            effect.duration_ms = struct.unpack_from("<H", content, 2)[0]
            effect.gain = content[10]
            effect.direction_deg = struct.unpack_from("<H", content, 13)[0] / 100.0
        elif number == OPERATION_ID:
            effect.started = None if content[1] == 3 else self.now()
        elif number == CONDITION_ID:
            if content[1] & 0x0F == 0:
                values = struct.unpack_from("<3h3H", content, 2)
                effect.center, effect.coefficients = values[0], values[1:3]
                effect.saturations, effect.dead_band = values[3:5], values[5]
            return self._moved()
        elif number == CONSTANT_ID:
            effect.magnitude = struct.unpack_from("<h", content, 1)[0]
            return self._moved()
        return []

    def _moved(self) -> list[bytes]:
        self.forces += 1
        if self.period_s is not None:
            self.step(self.period_s)
        paused = self.paused_after is not None and self.forces >= self.paused_after
        return [self.state_report(paused=True)] * paused + [self.axis_report()]

    def _control(self, bits: int) -> None:
        if bits & 0x0E:  # disable, stop all, reset
            self.enabled = False
            for effect in self.effects.values():
                effect.started = None
        if bits & 0x08:
            self.effects.clear()
        if bits & 0x01:
            self.enabled = True

    def create(self, report: bytes) -> None:
        if len(self.effects) >= self.memory:
            self.load = bytes([LOAD_ID, 0, 2, 0, 0])
            return
        index = next(k for k in range(1, MOST_EFFECTS + 1) if k not in self.effects)
        self.effects[index] = Effect(kind=report[1])
        self.load = bytes([LOAD_ID, index, 1]) + struct.pack("<H", self.memory - len(self.effects))

    def replies(self, message: bytes) -> list[bytes]:
        """Returns the messages that answer a message of the host."""
        kind, content = message[:1], message[1:]
        if kind == b"D":
            return [b"D" + open_ff_board(self.axes, spring=self.spring)[: self.cut]]
        if kind == b"F":
            if content[0] == CREATE_ID:
                self.create(content)
            return [b"F\0"]
        if kind == b"G":
            return [b"G" + self.load]
        return [b"I" + report for report in self.obey(content)]

    def serve(self, connection: socket.socket) -> None:
        """Answers the messages of one connection until it is closed."""
        with connection, contextlib.suppress(ConnectionError, BlockingIOError):
            connection.send(b"I" + self.axis_report())
            last = time.monotonic()
            while self.gone_after is None or self.forces < self.gone_after:
                wait = STEP_S if self.period_s is None else None
                ready = select.select([connection], [], [], wait)[0]
                if self.period_s is None and (passed := time.monotonic() - last) >= STEP_S:
                    self.step(min(passed, 0.05))
                    last += passed
                    connection.send(b"I" + self.axis_report(), socket.MSG_DONTWAIT)
                if ready and not answer_next(connection, self.replies):
                    return


if __name__ == "__main__":
    main(Wheel())
