# SPDX-License-Identifier: Apache-2.0
"""Verdict on a result (good, usable, no), and the just noticeable difference of forces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

from .errors import InputError

if TYPE_CHECKING:  # the commands' help reads this file, and must not load numpy
    from ._typing import Float1D

Level = Literal["good", "usable", "no"]
"""Levels of a verdict, from best to worst."""

LEVELS: tuple[Level, ...] = get_args(Level)


@dataclass(frozen=True)
class Finding:
    """A defect of a result: its level, and a sentence with value, likely cause and cure."""

    level: Level
    sentence: str

    def __post_init__(self) -> None:
        for name, value in (("level", self.level), ("sentence", self.sentence)):
            if not isinstance(value, str):
                raise InputError(f"{name} is a {type(value).__name__}; it must be text")
        if self.level not in LEVELS:
            raise InputError(f"level is {self.level[:20]!r}; it must be one of {', '.join(LEVELS)}")


@dataclass(frozen=True)
class Verdict:
    """Judges a result by its findings; the most serious one sets the level.

    ``str(verdict)`` is ``"good"``, ``"usable: ..."`` or ``"no: ..."``. Semicolons join the sentences, and the
    most serious comes first. Every verb prints it first, and ends with exit code 1 if the level is "no".
    """

    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        given: object = self.findings
        if not isinstance(given, tuple) or not all(isinstance(one, Finding) for one in given):
            raise InputError(f"findings is a {type(given).__name__}; it must be a tuple of Finding")

    @property
    def level(self) -> Level:
        """Level of the most serious finding; "good" without findings."""
        return max((finding.level for finding in self.findings), key=LEVELS.index, default="good")

    @property
    def reasons(self) -> tuple[str, ...]:
        """Sentences of the findings, the most serious first, without repetitions."""
        ordered = sorted(self.findings, key=lambda finding: -LEVELS.index(finding.level))
        return tuple(dict.fromkeys(finding.sentence for finding in ordered))

    def __str__(self) -> str:
        return f"{self.level}: {'; '.join(self.reasons)}" if self.findings else self.level

    def __add__(self, other: Verdict) -> Verdict:
        """Returns one verdict that has the findings of both verdicts, without repetitions."""
        return Verdict(tuple(dict.fromkeys(self.findings + other.findings)))

    def accepted(self) -> Verdict:
        """Returns the verdict of a result that is used although it is "no": it is "usable", and says so."""
        return Verdict(
            tuple(
                usable(f"accepted although it is no: {finding.sentence}")
                if finding.level == "no"
                else finding
                for finding in self.findings
            )
        )

    def require_use(self, name: str, better: str, *, accepted: bool) -> Verdict:
        """Returns this verdict of a result that is going to be used. A "no" is refused, or if it is accepted
        it becomes "usable". `better` is the cure, a sentence without its full stop.

        Raises
        ------
        InputError
            The verdict is "no" and is not accepted.
        """
        if self.level == "no" and not accepted:
            raise InputError(
                f"the verdict of {name} is no: {self.reasons[0]}. {better}, or give --accept-model to use "
                "this one"
            )
        return self.accepted() if self.level == "no" else self

    def record(self) -> list[dict[str, str]]:
        """Returns the findings of the verdict as they are written to a model file."""
        return [{"level": finding.level, "sentence": finding.sentence} for finding in self.findings]

    @classmethod
    def from_record(cls, record: Iterable[Mapping[str, Any]]) -> Verdict:
        """Returns the verdict from the findings in a model file; invalid findings are ignored."""
        return cls(
            tuple(
                Finding(item["level"], str(item.get("sentence", "")))
                for item in record
                if item.get("level") in LEVELS
            )
        )


GOOD = Verdict()

FORCE_JND = 0.07
"""Just noticeable difference of force as a share of the force (Jones 1989: about 7 %)."""

FORCE_FLOOR = 0.01
"""Least just noticeable difference, as a share of the largest |force| of the recording.

Near zero force, a share of the local force would be less than a sensor or finger resolves. The floor is
relative to the recording, because recordings range from nanonewtons to kilogram-forces and are scaled before
they are rendered.
"""


def usable(sentence: str) -> Finding:
    """Returns a finding of the level "usable" with this sentence."""
    return Finding("usable", sentence)


def no(sentence: str) -> Finding:
    """Returns a finding of the level "no" with this sentence: the result must not be used."""
    return Finding("no", sentence)


def force_jnd(force: Float1D, floor: float) -> Float1D:
    """Returns the just noticeable difference of forces (n,): 7 % of each, but at least `floor`."""
    return (FORCE_JND * abs(force)).clip(min=floor)
