# SPDX-License-Identifier: Apache-2.0
"""First rows of a column: text, clock times or numbers; conversion of clock times to seconds."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._typing import Float1D
from ..frames import pd
from .rows import direction_of
from .table import MISSING, Cells, parse_with

LOOK_ROWS = 1000
"""Number of first rows from which a column is described."""

_CLOCK = re.compile(r"\d:\d\d")
_TIME_OF_DAY = re.compile(r"(\d+):(\d\d):(\d\d(?:\.\d*)?)")
_MINUTES = re.compile(r"(\d+):(\d\d\.\d+)")
_DECIMAL_COMMA = re.compile(r"(:\d\d),(\d+)")

_DAY_S = 86400.0


@dataclass(frozen=True)
class Look:
    """Description of the first rows of a column; without rows, of a column of numbers about which nothing is
    known."""

    text: bool = False
    """True if a cell holds neither a number nor a missing value"""
    clock: bool = False
    """True if every cell with text is a date with a time or a clock time"""
    steady: bool = False
    """True if the column has only one or two distinct values"""
    counter: bool = False
    """True if the column numbers the rows: each value is the one before plus one"""
    rises: bool = False
    """True if every value is larger than the one before, or is the first one again"""
    least: float = np.nan
    largest: float = np.nan
    turns: int = 0
    """Number of changes from rising to falling or back"""
    directions: frozenset[int] = frozenset()
    """Directions of the stroke that the cells state; empty if one of them states none"""
    example: str = ""
    """First cell with text, if there is one"""

    @property
    def seen(self) -> bool:
        """True if cells were read"""
        return bool(self.example) or bool(np.isfinite(self.least))

    @staticmethod
    def of(cells: Sequence[Any], marks: str) -> Look:
        """Describes the first cells of a column, which are numbers or texts.

        Parameters
        ----------
        cells : sequence of (float or str)
        marks : str
            Decimal mark of numbers in text, and mark between thousands, as in :func:`parse_with`.
        """
        words = [cell.strip() if isinstance(cell, str) else cell for cell in cells[:LOOK_ROWS]]
        numbers = [parse_with(each, marks) if isinstance(each, str) else each for each in words]
        texts = [
            word
            for word, number in zip(words, numbers, strict=True)
            if number is None and word is not None and word not in MISSING
        ]
        values = np.array([np.nan if each is None else float(each) for each in numbers])
        finite = values[np.isfinite(values)]
        clock = bool(texts) and all(_CLOCK.search(text) for text in texts)
        return Look(
            text=bool(texts),
            clock=clock and not np.isnan(clock_seconds(np.array(texts, dtype=object))).any(),
            steady=len(set(words)) < 3,
            counter=len(finite) == len(values) > 2 and bool((np.diff(finite) == 1.0).all()),
            rises=len(finite) == len(values) > 2 and _rises(finite),
            least=float(finite.min()) if finite.size else np.nan,
            largest=float(finite.max()) if finite.size else np.nan,
            turns=_turns(finite),
            directions=_directions(set(words)),
            example=texts[0] if texts else "",
        )

    def __str__(self) -> str:
        rises = " (rises)" if self.rises else ""
        return "text" if self.text else f"{self.least:.4g} to {self.largest:.4g}{rises}"


NO_LOOK = Look()
"""Description of a column whose rows are not known."""


def clock_seconds(words: Cells) -> Float1D:
    """Returns the times in texts as seconds since the first; NaN for a text without a time.

    A text is a date with a time (``2025-11-14 19:48:05.1``, ``14.11.2025 19:48:05,100``), a time of the day
    or a duration (``19:48:05.1``, ``0:00:05``), or minutes and seconds (``01:02.5``). A time of the day that
    falls by more than twelve hours belongs to the next day.
    """
    texts = (
        pd.Series(words, dtype=object)
        .astype(str)
        .str.strip()
        .str.replace(_DECIMAL_COMMA, r"\1.\2", regex=True)
    )
    seconds = _of_day(texts)
    dated = seconds.isna() & texts.str.contains(_CLOCK)
    if dated.any():
        day_first = bool(texts[dated].str.match(r"\d{1,2}\.").all())
        kind = "ISO8601" if bool(texts[dated].str.match(r"\d{4}-").all()) else "mixed"
        times = pd.to_datetime(texts[dated], format=kind, dayfirst=day_first, errors="coerce", utc=True)
        seconds[dated] = (times - times.min()) / pd.Timedelta(seconds=1)
    else:
        seconds += _DAY_S * (seconds.ffill().diff() < -_DAY_S / 2).cumsum()
    found: Float1D = np.asarray(seconds, dtype=np.float64)
    first = np.flatnonzero(np.isfinite(found))[:1]
    return np.subtract(found, found[first[0]]) if first.size else found


def _of_day(texts: pd.Series[str]) -> pd.Series[float]:
    """Returns the seconds of times without a date; NaN for other texts."""
    hours = texts.str.extract(rf"^{_TIME_OF_DAY.pattern}$").astype(float)
    minutes = texts.str.extract(rf"^{_MINUTES.pattern}$").astype(float)
    seconds = 3600.0 * hours[0] + 60.0 * hours[1] + hours[2]
    return seconds.fillna(60.0 * minutes[0] + minutes[1])


def cure_of_header(rows: Sequence[Sequence[Any]]) -> str:
    """Describes the columns of a table without a header by its first rows, and returns the option that names
    them.

    If there are three columns that change, one that never falls, or only to its first value, is the time. Of
    the others, the position is the one that turns less often.
    """
    looks = [Look.of(column, ".,") for column in zip(*rows, strict=True)]
    described = ", ".join(f"{k}: {look}" for k, look in enumerate(looks, 1))
    changing = [k for k, look in enumerate(looks) if not look.text and look.least < look.largest]
    time = next((k for k in changing if (looks[k].rises or looks[k].turns == 0) and len(changing) > 2), None)
    others = sorted((k for k in changing if k != time), key=lambda k: looks[k].turns)[:2]
    if len(others) < 2:
        return f"The columns are {described}"
    roles = {others[0]: ("position_mm", "the position in mm"), others[1]: ("force_N", "the force in N")}
    if time is not None:
        roles[time] = ("time_s", "the time in s")
    assumed = " and ".join(f"column {k + 1} is {roles[k][1]}" for k in sorted(roles))
    names = ",".join(roles.get(k, (f"column_{k + 1}", ""))[0] for k in range(len(looks)))
    return f"The columns are {described}. If {assumed}, add: --columns {names}"


def _directions(words: Collection[Any]) -> frozenset[int]:
    """Returns the directions that all of the words or numbers state; empty if one of them states none."""
    found = [direction_of(str(word)) for word in words]
    return frozenset(each for each in found if each is not None) if None not in found else frozenset()


def _rises(values: Float1D) -> bool:
    steps = np.diff(values)
    return bool(((steps > 0.0) | ((steps < 0.0) & (values[1:] == values[0]))).all())


def _turns(values: Float1D) -> int:
    """Returns the number of changes from rising to falling or back."""
    steps = np.sign(np.diff(values))
    steps = steps[steps != 0]
    return int(np.count_nonzero(np.diff(steps)))
