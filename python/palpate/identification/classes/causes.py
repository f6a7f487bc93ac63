# SPDX-License-Identifier: Apache-2.0
"""Rival causes of a force that differs between strokes in the same direction over the same place.

Each cause is fitted to the residuals of the same rows. It adds to the force or scales it, for press and
release on their own. The cause with the best BIC is named.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D, Float2D
from ...recording.motion import TURN_SHARE, at_rows, least_error_low_pass, strokes_from_order
from ...verdict import FORCE_FLOOR
from ..data.limits import neighbour_correlation
from ..data.rows import Rows
from ..network.constraints import COMPARED_POSITIONS
from ..network.separable import TINY
from ..options import SearchOptions
from ..search.evidence import deviance
from .dynamics import LEAST_SPEED_SPREAD, friction_sign, spread_of_speeds

PLACES = 100
"""Number of places of the travel; in each of them the mean residual of each stroke is compared with a just
noticeable difference."""

PLACE_ERRORS = 2.0
"""Part of a mean residual that can be random [standard errors]."""

MOST_JND = 2.0
"""Mean residual of a place above which a hand feels a wrong force there [just noticeable differences]."""

FASTER = (
    "at the same position and stroke the force {} with the speed, from the slowest to the fastest by {}: it "
    "depends on the velocity, or the object changed at the same time. Alternate slow and fast strokes, or "
    "give --inputs position,velocity"
)
"""Sentence on strokes that differ by their speed, with the way of the change and its size"""

TURNED = (
    "the force depends on the position of the last turn{pinched}: at the same position and stroke it {} with "
    "that position, by {}. Cure: identify the cycles of each amplitude separately, with --rows"
)
"""Sentence on strokes that differ by the turn before them"""

FIRST_CURE = "Press the object several times before the recording, or leave out the first strokes with --rows"

FIRST = (
    "behind the first stroke over a position the force there {} by {}: the object, the zero of the force or "
    f"its sign changed. {FIRST_CURE}"
)
"""Sentence on a first stroke that differs from the later ones"""

LATER = (
    "from the first row to the last the force at the same position and stroke {} by {}{pinched}: the zero of "
    "the force{speed} or the object changed. Let both warm up, press the object several times first, do not "
    "set the force to zero while recording, or identify the parts of the recording separately with --rows"
)
"""Sentence on strokes that differ by their time"""


LEAST_MOMENT = 1e-6
"""Least moment of a property at the places of the strokes [share of the largest]; smaller ones are rounding
errors"""


def places_of(box: Float2D, side: NDArray[Any] | None, places: int | None = None) -> NDArray[np.intp]:
    """Returns the number of the place and the direction (n,) of positions (n, d) in the unit box, of 2 PLACES
    by default."""
    places = PLACES if places is None else places
    place = np.minimum((box[:, 0] * places).astype(np.intp), places - 1)
    return place if side is None else place + places * (side < 0)


def means_at(place: NDArray[np.intp], weight: Float1D, *values: Float1D) -> list[Float1D]:
    """Returns the weighted means (2 PLACES,) of values (n,) in each place and direction; 0 without rows."""
    total = np.bincount(place, weight, 2 * PLACES)
    total = np.where(total > 0.0, total, 1.0)
    return [np.bincount(place, weight * each, 2 * PLACES) / total for each in values]


@dataclass(frozen=True)
class Judged:
    """Model on whose residuals strokes and places are compared."""

    data: Rows
    residual: Float1D
    """(n,) force of each row minus that of the model [force]"""
    weight: Float1D
    """(n,) weight of each row; 0 for a row that is not judged"""
    side: Float1D | None
    """(n,) direction of each row; None if press and release have one force"""
    inputs: str
    """What the force of the model depends on, in words"""
    hysteresis: Callable[[Float2D], Float1D] | None = None
    """Returns the hysteresis (k,) at positions (k, 1) in the unit box; None for a model without it"""
    passive: bool = False
    """True if the hysteresis must not be below 0"""

    @cached_property
    def strokes(self) -> _Strokes | None:
        """Rows of strokes in recorded order; None without strokes."""
        return _Strokes.of(self)

    @cached_property
    def cause(self) -> Cause | None:
        """Cause of what differs between strokes over the same place; None if no cause lowers BIC."""
        return _cause_of(self)

    @property
    def changed(self) -> float:
        """Share of the squared residual that a zero or an object that changes explains [-]: a term that is
        harder to render must explain more. 0 if nothing changes."""
        return self.cause.explained if self.cause is not None and self.cause.by in (FIRST, LATER) else 0.0

    @property
    def floor(self) -> float:
        """Smallest just noticeable difference of the force of the rows [force]."""
        return FORCE_FLOOR * float(np.abs(self.data.force[self.weight > 0.0]).max(initial=0.0))

    @property
    def pinched(self) -> str:
        """Clause on loops that are narrower inside than at both sides; empty for other loops.

        The height of a loop of plays in parallel has no minimum inside the loop (Masing 1926).
        """
        if self.hysteresis is None:
            return ""
        height = self.hysteresis(np.linspace(0.0, 1.0, COMPARED_POSITIONS)[:, None])
        sides = np.maximum.accumulate(height), np.maximum.accumulate(height[::-1])[::-1]
        if np.max(np.minimum(*sides) - height) <= MOST_JND * self.floor:
            return ""
        return ", and the loops narrow inside (pinching)"


@dataclass(frozen=True)
class Cause:
    """Property of the strokes that explains most of what differs between strokes over the same place."""

    sentence: str
    by: str
    """Sentence on the property: FASTER, TURNED, FIRST or LATER"""
    share: float
    """Share of the squared difference that it explains [-]"""
    explained: float
    """Share of the squared residual of all passages that it explains [-]"""
    noticed: float
    """Change of the force by it, without its random part, in just noticeable differences"""

    @property
    def perceptible(self) -> bool:
        return self.noticed > 1.0


@dataclass(frozen=True)
class _Strokes:
    """Rows of strokes, to compare those in the same direction over the same place.

    The mean of the rows of a stroke at a place counts once: the rows of a slow stroke are not independent.
    A stroke has a row in each place on average: two strokes have few narrower places in common.
    """

    best: Judged
    places: int
    """Number of places of the travel"""
    rows: NDArray[np.intp]
    """(k,) indices of the rows with a weight"""
    weight: Float1D
    """(k,)"""
    passage: NDArray[np.intp]
    """(k,) number of the passage of a stroke through a place, of m passages"""
    group: NDArray[np.intp]
    """(k,) number of the place and the direction"""
    number: NDArray[np.intp]
    """(k,) number of the stroke"""
    begin: NDArray[np.intp]
    """(k,) row at which the stroke begins"""
    end: NDArray[np.intp]
    """(k,) row at which it ends"""

    @classmethod
    def of(cls, best: Judged) -> _Strokes | None:
        """Returns the rows of strokes in recorded order; None without strokes."""
        x = best.data.path[:, 0]
        if (direction := strokes_from_order(x)) is None:
            return None
        every = np.flatnonzero(direction)
        edges = np.flatnonzero(np.diff(direction[every], prepend=0))
        rows = np.flatnonzero((best.weight > 0.0) & (direction != 0))
        number = np.searchsorted(every[edges], rows, side="right") - 1
        ends = np.append(edges[1:], len(every)) - 1
        distance = np.minimum(np.abs(x[every[ends]] - x[every[edges]]), 1.0)
        places = int(min(PLACES, max(1.0, len(rows) / distance.sum())))
        group = places_of(best.data.box[rows], direction[rows], places)
        return cls(
            best,
            places,
            rows,
            best.weight[rows],
            np.unique(number * 2 * places + group, return_inverse=True)[1],
            group,
            number,
            every[edges][number],
            every[ends][number],
        )

    def properties(self) -> Iterator[tuple[str, Float1D, float, list[Float1D]]]:
        """Yields the properties in which strokes over the same place can differ: a sentence, the value (k,)
        of each row, the change of the value whose effect the sentence states, and the fitted functions."""
        data = self.best.data
        x = data.path[:, 0]
        again = self.again(wholly=False).astype(float)
        yield FIRST, again, 1.0, [again]
        if data.parts:
            velocity, known = at_rows(data.parts, least_error_low_pass(data.parts, order=1), 1, len(x))
            time = np.concatenate([piece.row_time for piece in data.parts])
            distance, lasting = (
                (x[self.end] - x[self.begin]) * data.reach[0],
                time[self.end] - time[self.begin],
            )
            mean = np.divide(distance, lasting, out=np.zeros(len(lasting)), where=lasting > 0.0)
            moving = np.where(known[self.rows], velocity[self.rows], mean)
            if spread_of_speeds(moving) >= LEAST_SPEED_SPREAD:
                speed = np.abs(moving)
                yield FASTER, speed, float(np.ptp(speed)), [speed, np.abs(friction_sign(moving))]
        ends = x[self.begin], x[np.maximum(self.begin - 1, 0)]  # before and behind the turn
        press = self.group < self.places
        turn = np.where(press, np.minimum(*ends), np.maximum(*ends))
        moved = [float(np.ptp(self.centred(turn * side))) for side in (press, ~press)]
        turn = turn * np.where(press, *(each > TURN_SHARE for each in moved))
        if turn.any():
            yield TURNED, turn, max(moved), [turn]
        middle = 0.5 * (self.begin + self.end) / len(x)
        yield LATER, middle, 1.0, [middle]

    def again(self, wholly: bool) -> NDArray[np.bool_]:
        """Returns True (k,) for a row at a place that is within the earlier strokes, wholly or in part."""
        data = self.best.data
        x = data.path[:, 0]
        low, high = np.minimum.accumulate(x)[self.begin], np.maximum.accumulate(x)[self.begin]
        place = np.rint(x - data.box[:, 0])[self.rows] * self.places + self.group % self.places
        first, last = (place, place + 1.0) if wholly else (place + 1.0, place)
        return np.asarray((low * self.places <= first) & (last <= high * self.places))

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """(m,) index of the first row of each passage"""
        return np.unique(self.passage, return_index=True)[1]

    @cached_property
    def share(self) -> Float1D:
        """(m,) mean weight of the rows of each passage"""
        return np.bincount(self.passage, self.weight) / np.bincount(self.passage)

    def mean(self, values: Float1D) -> Float1D:
        """Returns the weighted means (m,) of values (k,) in each passage."""
        return np.bincount(self.passage, self.weight * values) / np.bincount(self.passage, self.weight)

    def centred(self, values: Float1D) -> Float1D:
        """Returns the weighted means (m,) of values (k,) in each passage, minus their weighted mean at each
        place and direction."""
        mean, place = self.mean(values), self.group[self.first]
        return np.asarray(mean - means_at(place, self.share, mean)[0][place])

    def within(self, weighted: Float1D) -> Float1D:
        """Returns weighted values (m,) without the weighted mean of each stroke."""
        root, stroke = np.sqrt(self.share), np.unique(self.number[self.first], return_inverse=True)[1]
        mean = np.bincount(stroke, root * weighted) / np.bincount(stroke, self.share)
        return weighted - root * mean[stroke]


def first_strokes(best: Judged) -> NDArray[np.bool_] | None:
    """Returns True for the rows (n,) at which a stroke is the first over its place and differs perceptibly
    from a later one in the same direction; None if another cause explains the difference."""
    if best.cause is None or best.cause.by != FIRST or not best.cause.perceptible:
        return None
    strokes, first = best.strokes, np.zeros(len(best.weight), dtype=bool)
    assert strokes is not None
    again = strokes.again(wholly=False)
    # A stroke mostly over new places is a first one also at those that it has in part in common.
    new = np.bincount(strokes.number, ~again) > 0.5 * np.bincount(strokes.number)
    alone = ~again | (new[strokes.number] & ~strokes.again(wholly=True))
    for way in (strokes.group < strokes.places, strokes.group >= strokes.places):
        later = strokes.group[way & again]
        within = (later.min(initial=2 * PLACES) <= strokes.group) & (strokes.group <= later.max(initial=0))
        first[strokes.rows[way & alone & within]] = True
    # A wait belongs to the stroke before it.
    return np.asarray(first[np.maximum.accumulate(np.where(best.weight > 0.0, np.arange(len(first)), 0))])


def _cause_of(best: Judged) -> Cause | None:
    """Returns the cause of what differs between strokes over the same place.

    Causes that a hand notices are preferred. The one with the least BIC is taken, or an earlier one of the
    list if its BIC is higher by less than the evidence for a model class: two strokes show the same for most
    causes.
    """
    data = best.data
    if len(data.names) > 1 or data.repeats is not None or (strokes := best.strokes) is None:
        return None
    root, way_of_row = np.sqrt(strokes.share), strokes.group // strokes.places
    way = way_of_row[strokes.first]
    force = (data.force - best.residual)[strokes.rows] / (np.abs(data.force).max() or 1.0)
    residual = root * strokes.centred(best.residual[strokes.rows])
    tables = []
    for sentence, value, span, functions in strokes.properties():
        scales = (1.0, force)
        if sentence != FIRST:
            scales = tuple(scale * (way_of_row == side) for scale in scales for side in (0, 1))
        columns = [root * strokes.centred(each * scale) for each in functions for scale in scales]
        sizes = np.array([float(np.linalg.norm(each)) for each in columns])
        known = sizes > LEAST_MOMENT * float(np.linalg.norm(value))
        if known.any():
            table = np.column_stack(columns)[:, known] / sizes[known]
            tables.append((sentence, value, span, table))
    fits = [each @ np.linalg.lstsq(each, residual, rcond=LEAST_MOMENT)[0] for *_, each in tables]
    before = float(residual @ residual)
    whole = float(np.sum(strokes.share * strokes.mean(best.residual[strokes.rows] ** 2)))
    if not fits or not before > 0.0:
        return None
    left = [float(np.sum((residual - effect) ** 2)) for effect in fits]
    noise = residual - fits[int(np.argmin(left))]
    free = len(residual) - len(np.unique(strokes.group)) - max(each.shape[1] for *_, each in tables)
    # A difference between whole strokes is not noise.
    n = free * (1.0 - max(neighbour_correlation(strokes.within(noise)), 0.0))
    if n < 1.0:
        return None
    floor, found = best.floor or 1.0, []
    for (sentence, value, span, table), effect, rss in zip(tables, fits, left, strict=True):
        moment, changes = root * strokes.centred(value), [(0.0, 0.0)]
        for rows in (way == 0, way == 1):
            square = float(moment[rows] @ moment[rows])
            if square > LEAST_MOMENT**2 * float(moment @ moment):
                change = span * float(moment[rows] @ effect[rows]) / square
                random = PLACE_ERRORS * span * float(np.sqrt(rss / square / n))
                changes.append(((abs(change) - random) / floor, change))
        noticed, change = max(changes)
        amount = f"{data.force_unit.text(abs(change))}, {noticed:.2g} just noticeable differences"
        way_of_change = "rises" if change > 0.0 else "falls"
        speed = "" if data.parts else ", the speed"
        text = sentence.format(way_of_change, amount, pinched=best.pinched, speed=speed)
        criterion = deviance("bic", max(rss, TINY * before), n, table.shape[1])
        cause = Cause(text, sentence, 1.0 - rss / before, (before - rss) / whole, noticed)
        found.append((criterion, cause))
    found = [each for each in found if each[1].perceptible] or found
    least = min(criterion for criterion, _ in found)
    if least >= deviance("bic", before, n, 0):
        return None
    return next(cause for criterion, cause in found if criterion <= least + SearchOptions.evidence)
