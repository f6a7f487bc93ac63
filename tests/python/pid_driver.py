# SPDX-License-Identifier: Apache-2.0
"""Reports that the PID driver of Linux (hid-pidff) sends, by its rules, for a report descriptor.

The rules are written from the behaviour of the driver, without palpate: which report, which value, and how a
number is scaled. A number of the kernel has the range -0x8000 to 0x7FFF, or 0 to 0xFFFF.
"""

from __future__ import annotations

from dataclasses import dataclass, field

PID = 0x0F


@dataclass
class Item:
    """Values of one main item: place, size, range and usages."""

    kind: str
    report: int
    bit: int
    bits: int
    count: int
    low: int
    high: int
    variable: bool
    constant: bool
    unit: int
    exponent: int
    usages: list[int]
    inside: list[int] = field(default_factory=list)


def parse(descriptor: bytes) -> list[Item]:
    """Reads a report descriptor (HID 1.11, section 6.2.2)."""
    state: dict[str, int] = {"page": 0, "low": 0, "high": 0, "bits": 0, "count": 0, "report": 0, "unit": 0}
    state["exponent"] = 0
    usages: list[int] = []
    inside: list[int] = []
    used: dict[tuple[str, int], int] = {}
    items: list[Item] = []
    least = 0
    at = 0
    while at < len(descriptor):
        head = descriptor[at]
        size = (0, 1, 2, 4)[head & 3]
        data = descriptor[at + 1 : at + 1 + size]
        value, number = int.from_bytes(data, "little"), int.from_bytes(data, "little", signed=True)
        at += 1 + size
        tag = head & 0xFC
        usage = value if size == 4 else state["page"] << 16 | value
        names = {0x04: "page", 0x74: "bits", 0x94: "count", 0x84: "report", 0x64: "unit"}
        if tag in names:
            state[names[tag]] = value
        elif tag in (0x14, 0x24, 0x54):
            state[{0x14: "low", 0x24: "high", 0x54: "exponent"}[tag]] = number
        elif tag == 0x08:
            usages.append(usage)
        elif tag == 0x18:
            least = usage
        elif tag == 0x28:
            usages.extend(range(least, usage + 1))
        elif tag == 0xA0:
            inside.append(usages[-1] if usages else 0)
            usages = []
        elif tag == 0xC0:
            inside.pop()
            usages = []
        elif tag in (0x80, 0x90, 0xB0):
            kind = {0x80: "input", 0x90: "output", 0xB0: "feature"}[tag]
            place = used.get((kind, state["report"]), 0)
            own = (
                state["bits"],
                state["count"],
                state["low"],
                state["high"],
                bool(value & 2),
                bool(value & 1),
            )
            tail = (state["unit"], state["exponent"], usages, list(inside))
            items.append(Item(kind, state["report"], place, *own, *tail))
            used[kind, state["report"]] = place + state["bits"] * state["count"]
            usages = []
    return items


class Driver:
    """Writes the reports of the driver for one device."""

    def __init__(self, descriptor: bytes) -> None:
        self.items = parse(descriptor)

    def item(self, kind: str, collection: int, usage: int, *, listed: bool = False) -> tuple[Item, int]:
        """Returns the item with a usage, or with the collection of this usage, and the place of the usage."""
        for item in self.items:
            if item.kind != kind or PID << 16 | collection not in item.inside:
                continue
            if listed and PID << 16 | usage in item.inside and item.usages:
                return item, 0
            if not listed and item.variable and PID << 16 | usage in item.usages:
                return item, item.usages.index(PID << 16 | usage)
        raise KeyError(f"{collection:#x} {usage:#x}")

    def blank(self, item: Item) -> bytearray:
        own = [each for each in self.items if (each.kind, each.report) == (item.kind, item.report)]
        bits = max(each.bit + each.bits * each.count for each in own)
        return bytearray([item.report]) + bytearray(-(-bits // 8))

    @staticmethod
    def put(report: bytearray, item: Item, place: int, value: int) -> None:
        first = item.bit + place * item.bits
        for k in range(item.bits):
            byte, bit = 1 + (first + k) // 8, (first + k) % 8
            report[byte] = report[byte] & ~(1 << bit) | (value >> k & 1) << bit

    @staticmethod
    def unsigned(item: Item, value: int, top: int = 0xFFFF) -> int:
        """Scales 0 to `top` to the range of the value, rounded down."""
        return value * (item.high - item.low) // top + item.low

    @staticmethod
    def signed(item: Item, value: int) -> int:
        """Scales -0x8000 to 0x7FFF to the range of the value, rounded to zero."""
        if value >= 0:
            return value * item.high // 0x7FFF
        return -(-value * -item.low // 0x8000)

    def choice(self, report: bytearray, kind: str, collection: int, usage: int, chosen: int) -> None:
        item, _ = self.item(kind, collection, usage, listed=True)
        place = item.usages.index(PID << 16 | chosen)
        self.put(report, item, place if item.variable else 0, 1 if item.variable else place + 1)

    def create(self, effect: int) -> bytes:
        item, _ = self.item("feature", 0xAB, 0x25, listed=True)
        report = self.blank(item)
        self.choice(report, "feature", 0xAB, 0x25, effect)
        return bytes(report)

    def control(self, command: int) -> bytes:
        item, _ = self.item("output", 0x96, 0x96, listed=True)
        report = self.blank(item)
        self.choice(report, "output", 0x96, 0x96, command)
        return bytes(report)

    def gain(self) -> bytes:
        item, place = self.item("output", 0x7D, 0x7E)
        report = self.blank(item)
        self.put(report, item, place, self.unsigned(item, 0xFFFF))
        return bytes(report)

    def start(self, index: int) -> bytes:
        item, place = self.item("output", 0x77, 0x22)
        report = self.blank(item)
        self.put(report, item, place, index)
        self.choice(report, "output", 0x77, 0x78, 0x79)
        self.put(report, *self.item("output", 0x77, 0x7C), 1)
        return bytes(report)

    def set_effect(self, index: int, effect: int, duration_ms: int, direction: int = 0x4000) -> bytes:
        item, place = self.item("output", 0x21, 0x22)
        report = self.blank(item)
        self.put(report, item, place, index)
        self.choice(report, "output", 0x21, 0x25, effect)
        self.put(report, *self.item("output", 0x21, 0x50), duration_ms)
        gain, place = self.item("output", 0x21, 0x52)
        self.put(report, gain, place, gain.high)
        self.put(report, *self.item("output", 0x21, 0x56), 1)
        way, _ = self.item("output", 0x21, 0x57, listed=True)
        self.put(report, way, 0, self.unsigned(way, direction))
        return bytes(report)

    def constant(self, index: int, level: int) -> bytes:
        item, place = self.item("output", 0x73, 0x22)
        report = self.blank(item)
        self.put(report, item, place, index)
        magnitude, place = self.item("output", 0x73, 0x70)
        self.put(report, magnitude, place, self.signed(magnitude, level))
        return bytes(report)

    def spring(self, index: int, center: int, coefficient: int, saturation: int) -> bytes:
        item, place = self.item("output", 0x5F, 0x22)
        report = self.blank(item)
        self.put(report, item, place, index)
        for usage, value in ((0x60, center), (0x61, coefficient), (0x62, coefficient)):
            own, place = self.item("output", 0x5F, usage)
            self.put(report, own, place, self.signed(own, value))
        for usage in (0x63, 0x64):
            own, place = self.item("output", 0x5F, usage)
            self.put(report, own, place, self.unsigned(own, saturation))
        return bytes(report)
