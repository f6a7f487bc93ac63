# SPDX-License-Identifier: Apache-2.0
"""Small recording files for tests, and the error message if a file is refused."""

import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from palpate import InputError, read_recording

Write = Callable[..., Path]

HEADER = "depth_mm,force_gf,direction"


def rows(n: int = 12) -> list[str]:
    return [f"{0.5 * k},{10 * k},press" for k in range(n)]


def timed_rows(n: int = 12) -> list[str]:
    return [f"{10 * k},{0.5 * k},{2 * k}" for k in range(n)]


def refusal(path: Path, **options: object) -> str:
    """Returns the error message of reading a file, which must be one sentence, without the file's folder."""
    with pytest.raises(InputError) as refused:
        read_recording(path, **options)  # type: ignore[arg-type]
    sentence = str(refused.value)
    assert "\n" not in sentence
    return sentence.replace(f"{path.parent}/", "")


def options_in(sentence: str, given: dict[str, object] | None = None) -> dict[str, object]:
    """Returns the options of reading that an error message suggests, as arguments of `read_recording`."""
    options = dict(given or {})
    if "add: " not in sentence:
        assert "--invalid drop" in sentence, sentence
        return options | {"invalid": "drop"}
    words = shlex.split(sentence.split("add: ")[1])
    for option, value in zip(words[::2], words[1::2], strict=True):
        if option == "--units":
            column, _, symbol = value.rpartition("=")
            units = options.get("units", {})
            assert isinstance(units, dict)
            options["units"] = {**units, column: symbol}
        elif option == "--columns":
            options["columns"] = value.split(",")
        else:
            options[option.removeprefix("--")] = value
    return options
