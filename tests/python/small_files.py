# SPDX-License-Identifier: Apache-2.0
"""Small recordings to read, and the sentence with which one is refused."""

from collections.abc import Callable
from pathlib import Path

import pytest

from palpate import InputError, read_recording

Write = Callable[..., Path]

HEADER = "depth_mm,force_gf,direction"


def rows(n: int = 12) -> list[str]:
    return [f"{0.5 * k},{10 * k},press" for k in range(n)]


def timed(n: int = 12) -> list[str]:
    return [f"{10 * k},{0.5 * k},{2 * k}" for k in range(n)]


def refusal(path: Path, **options: object) -> str:
    """The one sentence with which a file is refused, without its folder."""
    with pytest.raises(InputError) as refused:
        read_recording(path, **options)  # type: ignore[arg-type]
    sentence = str(refused.value)
    assert "\n" not in sentence
    return sentence.replace(f"{path.parent}/", "")
