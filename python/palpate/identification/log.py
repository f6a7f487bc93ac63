# SPDX-License-Identifier: Apache-2.0
"""What an identification reports besides the force law: tested networks, decisions, sentences, findings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

from ..verdict import Finding

_WORDS = {
    "constant": "constant force",
    "linear": "straight line",
    "position": "curve over position",
    "velocity": "curve over position and velocity",
    "network": "curve over all inputs",
}
"""Model classes whose name alone does not explain them, in words."""

_ROUNDED = 100.0
"""Absolute value from which a number is written without decimals [-]: three digits are enough to compare."""


@dataclass(frozen=True)
class Decision:
    """Decision on one model class, printed as ``straight line: accepted (lowers BIC by 426)``."""

    model_class: str
    """Name of the model class in words"""
    outcome: Literal["accepted", "not accepted", "not tested"]
    reason: str

    @property
    def accepted(self) -> bool:
        return self.outcome == "accepted"

    def __str__(self) -> str:
        return f"{self.model_class}: {self.outcome} ({self.reason})"


@dataclass(frozen=True)
class PathPoint:
    """Network that the model selection tested: its RMS error [force], and its criterion (a smaller value is
    better)."""

    model_class: str
    n_wavelets: int
    rmse: float
    criterion: float


@dataclass
class Log:
    """What an identification reports, in order."""

    path: list[PathPoint] = field(default_factory=list)
    """Networks that the model selection tested"""
    decisions: list[Decision] = field(default_factory=list)
    """Decisions on model classes, each with its reason"""
    rows: list[str] = field(default_factory=list)
    """Sentences on rows that are not fitted"""
    notes: list[str] = field(default_factory=list)
    """All other sentences, such as the rise of the error by constraints"""
    findings: list[Finding] = field(default_factory=list)
    """Findings that can lower the verdict"""

    def extend(self, later: Log) -> None:
        """Adds the entries of a later stage."""
        for mine, its in zip(vars(self).values(), vars(later).values(), strict=True):
            mine.extend(its)


def in_words(model_class: str) -> str:
    """Returns the name of a model class for messages."""
    return _WORDS.get(model_class, model_class)


def decided(model_class: str, accepted: bool, reason: str) -> Decision:
    """Returns the decision on a model class that was tested."""
    return Decision(in_words(model_class), "accepted" if accepted else "not accepted", reason)


def latest(decisions: Iterable[Decision]) -> tuple[list[Decision], list[Decision]]:
    """Returns the last decision on each model class, in order of first decisions, and the replaced earlier
    decisions."""
    last: dict[str, Decision] = {}
    replaced: list[Decision] = []
    for decision in decisions:
        if decision.model_class in last:
            replaced.append(last[decision.model_class])
        last[decision.model_class] = decision
    return list(last.values()), replaced


def not_tested(model_class: str, decisions: Iterable[Decision]) -> list[Decision]:
    """Returns the decisions that a model class is not tested."""
    return [each for each in decisions if each.model_class == model_class and each.outcome == "not tested"]


def lowered(quantity: str, decrease: float) -> str:
    """Returns the change of a quantity in words, as "lowers BIC by 1455" or "raises BIC by 2"."""
    return f"{_verb(decrease)} {quantity} by {_short(decrease)}"


def shifted_strokes(timed: bool, lag_s: float | None = None) -> str:
    """Returns the causes and cures of strokes that are shifted against each other, for a recording with or
    without time; `lag_s` is the lag of the force, if it is known."""
    value = "SECONDS, the delay of the force" if lag_s is None else f"{lag_s:.3g}"
    cure = f"give --force-late-s {value}" if timed else "record the time"
    return f"backlash or a late force shifts the strokes so: mount the object without backlash, or {cure}"


def causes_of_crossing(timed: bool) -> str:
    """Returns the causes and cures of a release above the press, for a recording with or without time."""
    return f"{shifted_strokes(timed)}; for a latch or a stored spring, give --no-hysteresis-nonnegative"


def _verb(decrease: float) -> str:
    return "lowers" if decrease >= 0.0 else "raises"


def _short(value: float) -> str:
    """Returns the absolute value as text: at most three digits below 100, else without decimals."""
    return f"{abs(value):.0f}" if abs(value) >= _ROUNDED else f"{abs(value):.3g}"


def squared_error_change(share: float, error: float) -> str:
    """Returns the relative decrease of the squared error on held-out sections, with the standard error of
    this share, for messages."""
    if share < -1.0:
        return f"raises the squared error on held-out sections to {_short(1.0 - share)} times"
    size = f"{_short(100.0 * share)} +- {100.0 * error:.2g} %"
    return f"{_verb(share)} the squared error on held-out sections by {size}"
