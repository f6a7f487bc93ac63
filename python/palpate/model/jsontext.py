# SPDX-License-Identifier: Apache-2.0
"""JSON in and out: numbers to the last bit, one line for each field, and one sentence when it is not JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..recording.files import replacing, require_file

_OPENED = ("network", "fit", "plan", "certificate")
"""Objects whose fields get a line each, as those of the file do."""

DEEPEST = 100
"""Lists and objects inside each other; the C++ reader has the same limit."""

_TOO_DEEP = f"the file is nested more than {DEEPEST} levels deep"
_LONGEST_INTEGER = 25
"""Digits: more than 64 bits hold."""

_CURE = "a model is a .json file that palpate identify writes"


def read_json(path: Path) -> Any:
    """Returns the content of a JSON file, as strict as the C++ reader.

    Raises
    ------
    InputError
        The file is not there or not JSON (RFC 8259), or holds what readers of other languages read
        differently: a byte order mark, NUL bytes, repeated keys, unpaired surrogates, or more than 100
        levels.
    """
    require_file(path)
    try:
        text = path.read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not JSON: byte {error.start} is not UTF-8; {_CURE}") from None
    if text.startswith("\ufeff"):
        raise InputError(f"{path}: the file begins with a byte order mark: save it as UTF-8 without one")
    if "\0" in text:
        raise InputError(f"{path}: the file holds a NUL byte: it is damaged, or not UTF-8")
    try:
        content = json.loads(text, object_pairs_hook=_distinct, parse_int=_whole)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}, line {error.lineno}: this is not JSON: {error.msg}; {_CURE}") from None
    except _RefusedError as reason:
        raise InputError(f"{path}: {reason}") from None
    except RecursionError:
        raise InputError(f"{path}: {_TOO_DEEP}") from None
    if _depth(content) > DEEPEST:
        raise InputError(f"{path}: {_TOO_DEEP}")
    if "\\u" in text and not _is_text(content):
        raise InputError(f"{path}: this is not JSON: a text holds half of a surrogate pair")
    return content


class _RefusedError(Exception):
    """What the parser met, as a sentence."""


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for key, value in pairs:
        if key in content:
            raise _RefusedError(f"the key {key!r} stands twice in one object")
        content[key] = value
    return content


def _whole(digits: str) -> int | float:
    """Return an integer, or a double where it has more than 64 bits, as the C++ reader does."""
    if len(digits) < _LONGEST_INTEGER and -(2**63) <= (value := int(digits)) < 2**64:
        return value
    return float(digits)


def _depth(content: Any) -> int:
    """How many lists and objects stand inside each other."""
    depth, level = 0, [content]
    while level := [item for item in level if isinstance(item, (dict, list))]:
        depth += 1
        level = [inner for item in level for inner in (item.values() if isinstance(item, dict) else item)]
    return depth


def _is_text(content: Any) -> bool:
    try:
        json.dumps(content, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def write_json(path: Path, content: dict[str, Any]) -> Path:
    """Write `content` so that a person can read it; a half-written file never stands at `path`."""
    with replacing(path) as temporary:
        temporary.write_text(f"{_lines(content, '')}\n", encoding="utf-8")
    return path


def _lines(content: dict[str, Any], indent: str) -> str:
    inner = indent + "  "
    fields = []
    for key, value in content.items():
        opened = key in _OPENED and not indent and value is not None
        text = _lines(value, inner) if opened else json.dumps(value, allow_nan=False)
        fields.append(f"{inner}{json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(fields) + f"\n{indent}}}"
