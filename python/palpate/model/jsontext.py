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


def read_json(path: Path) -> Any:
    """The content of a JSON file."""
    require_file(path)
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}, line {error.lineno}: this is not JSON: {error.msg}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not JSON: it is not text") from None
    except RecursionError:
        raise InputError(f"{path} is not a model: its lists are nested too deeply") from None


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
