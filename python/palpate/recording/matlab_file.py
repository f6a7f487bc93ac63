# SPDX-License-Identifier: Apache-2.0
"""Structure of a MATLAB file of version 5: scipy.io.loadmat crashes on some elements that are damaged."""

from __future__ import annotations

import struct

HEADER = 128
"""Bytes before the first element."""

MATRIX, COMPRESSED = 14, 15
"""Types of elements that hold an array, and a compressed one, which has a checksum."""

ITEM_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 14: 1, 15: 1, 16: 1, 17: 2, 18: 4}
"""Bytes of an item of each type of element."""

NUMERIC = range(6, 16)
"""Classes of arrays of numbers: they hold flags, dimensions, name, values, and imaginary parts if complex."""

COMPLEX = 1 << 11
"""Bit of the flags of an array."""


def refuse_damaged(content: bytes) -> None:
    """Refuse a file of version 5 whose elements do not fit into each other; others pass.

    Raises
    ------
    ValueError
        Names the byte at which the first such element begins.
    """
    if len(content) < HEADER or 0 in content[:4] or content[125] + content[124] != 1:
        return
    _walk(content, HEADER, len(content), "<" if content[126:128] == b"IM" else ">")


def _walk(content: bytes, at: int, end: int, order: str) -> list[tuple[int, int]]:
    """Check the elements from one byte to another; returns the type and first byte of the data of each."""
    found = []
    while at < end:
        start = at
        if at + 8 > end:
            raise _damaged(start)
        kind, size = struct.unpack_from(f"{order}II", content, at)
        data = at + 8
        if kind >> 16:  # a small element: type, size and data share 8 bytes
            kind, size, data = kind & 0xFFFF, kind >> 16, at + 4
            at += 8
        else:
            at = data + (size if kind == COMPRESSED else -(-size // 8) * 8)
        room = (start + 8 if data == start + 4 else end) - data
        if kind not in ITEM_BYTES or size % ITEM_BYTES[kind] or size > room:
            raise _damaged(start)
        if kind == MATRIX and size:
            inside = _walk(content, data, data + size, order)
            first = inside[0][1]
            flags = int.from_bytes(content[first : first + 4], "little" if order == "<" else "big")
            if flags & 0xFF in NUMERIC and len(inside) != (5 if flags & COMPLEX else 4):
                raise _damaged(start)
        found.append((kind, data))
    return found


def _damaged(at: int) -> ValueError:
    return ValueError(f"the element at byte {at} is damaged")
