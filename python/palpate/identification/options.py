# SPDX-License-Identifier: Apache-2.0
"""Settings of an identification with all their defaults."""

import ast
import inspect
import math
import sys
import textwrap
from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from .._core.rendering import compensated_share
from ..arguments import first_sentence, shown
from ..errors import InputError, did_you_mean

RESERVED_INPUTS = ("auto", "position", "hysteresis", "velocity")
"""Values of the option `inputs` that do not name columns."""

CHOICES: dict[str, tuple[str, ...]] = {
    "criterion": ("bic", "aicc", "gcv", "fpe", "fresh", "perceptual"),
    "below": ("auto", "free", "linear"),
    "above": ("auto", "linear", "free"),
}
"""Options whose value is one of several words, and the allowed words of each."""


POSITION_FACTORS = (1, 2, 64)
"""Largest number of distinct positions over that of one input, with one, two, and three or more inputs [-]. A
regular grid over many inputs has few cells along each of them, so that the rows themselves are used there."""


@dataclass(frozen=True)
class SearchOptions:
    """Settings of the search for a network, which few identifications need to change.

    Raises
    ------
    palpate.InputError
        Naming the field, its value and the cure.
    """

    evidence: float = 10.0
    """Least decrease of the criterion for a more complex model class; 10 is very strong evidence [-]"""
    patience: int = 3
    """Growth of a network stops if this number of successive wavelets, times the number of inputs, was added
    without a lower criterion [-]"""
    refine_steps: int = 8
    """Largest number of refinement steps after each wavelet that was added or removed [-]"""
    final_steps: int = 30
    """Largest number of refinement steps of the accepted network [-]"""
    frame_scale: float = 2.0
    """a0, the ratio of neighbouring dilations of the frame [-]"""
    frame_step: float = 0.5
    """b0, the translation step of the frame in units of 1/dilation [-]"""
    max_candidates: int = 4096
    """Largest number of candidate wavelets in the frame [-]"""
    resolved_by: int = 7
    """Least number of distinct positions, on every stroke, in a wavelet's core |u| <= sqrt(3) [-]; 5 may
    suffice if the residual is not noise"""
    max_positions: int = 1024
    """Largest number of distinct positions with one input; twice as many with two inputs, 64 times as many
    with three or more. More positions are gathered in about this number of cells [-]"""
    play_radius: tuple[float, ...] = (0.0003, 0.001, 0.003, 0.01, 0.03, 0.06)
    """Play radii tried for hysteresis if a recording has time but no direction; the best radius between the
    smallest and the largest, of three or more, is searched [share of the travel]"""
    contact_share: float = 0.02
    """Largest |force| at the lower end of the domain, as a share of the force range, at which the tool leaves
    the object there: continuation "free" below the domain; at least the RMS error [-]"""

    def __post_init__(self) -> None:
        _require(self)
        radii: object = self.play_radius
        if not isinstance(radii, (tuple, list)) or not radii:
            raise InputError(f"play_radius is {shown(radii)}: must be a tuple of shares of the travel")
        for radius in radii:
            _require_number("play_radius", radius, 0.0)

    def cells(self, inputs: int) -> int:
        """Returns the largest number of distinct positions over a number of inputs."""
        return self.max_positions * POSITION_FACTORS[min(inputs, len(POSITION_FACTORS)) - 1]

    @classmethod
    def parsed(cls, given: Mapping[str, str]) -> "SearchOptions":
        """Returns the settings from texts, as given on a command line.

        Raises
        ------
        InputError
            A name is unknown, or a text is not a value of its type.
        """
        return cls(**{name: _parsed(name, text) for name, text in given.items()})


@dataclass(frozen=True)
class IdentifyOptions:
    """Settings of :func:`palpate.identify`; each field is a keyword argument of this function.

    Raises
    ------
    palpate.InputError
        Naming the field, its value and the cure.
    """

    inputs: str | tuple[str, ...] = "auto"
    """auto, or position,hysteresis,velocity,COLUMN. "auto": the model selection decides, with position and
    the further inputs of the recording. Or names, as a tuple or separated by commas: position, then
    hysteresis, velocity (from time) or columns."""
    max_wavelets: int = 64
    """Largest number of wavelets [-]. An order of the harmonics of a periodic force counts as one."""
    criterion: str = "bic"
    """Criterion to stop adding wavelets. It also compares models. From the fitted rows: bic, aicc, gcv, fpe
    (Bayesian, corrected Akaike, generalised cross-validation, final prediction error). From the error on
    held-out rows: fresh (error as force) or perceptual (error in just noticeable differences)"""
    hysteresis_nonnegative: bool = True
    """Impose that every loop loses energy. The hysteresis is h >= 0 over the domain."""
    slope_bounds: tuple[float, float] | None = None
    """Smallest and largest slope imposed [N/m or N*m/rad]. They bound df/dx over the domain."""
    monotone: bool = False
    """The force never falls with position. The slope is df/dx >= 0 over the domain."""
    fixed_force: tuple[float, float] | None = None
    """Position and force that the model goes through [m or rad, N or N*m]. With hysteresis this is the mean
    force of both strokes."""
    coupling_stiffness: float | None = None
    """Impose a slope below 0.9 of this stiffness [N/m or N*m/rad]. It is the stiffness K_c of the virtual
    coupling, and 0.9 is `compensated_share`."""
    period: float | None = None
    """Period of a repeating force [m or rad]; searched if not given. It is the change of position after which
    the force repeats, such as one revolution of a knob. The search needs inputs="auto" and two periods in
    one direction, or an angle that closes a revolution."""
    below: str = "auto"
    """Force below the recorded positions: free, linear or auto. free falls to zero, because the tool leaves.
    linear continues straight, because the object holds or attracts the tool. auto is free, unless the
    recording shows a pull."""
    above: str = "auto"
    """Force above the recorded positions: linear, free or auto. auto is linear, unless the tool presses
    towards smaller positions and leaves there."""
    search: SearchOptions = field(default_factory=SearchOptions)
    """Settings of the search, which few identifications need to change."""

    def __post_init__(self) -> None:
        if not isinstance(self.inputs, str):
            _require_names(self.inputs)
        if self.inputs != "auto":
            names = self.inputs.split(",") if isinstance(self.inputs, str) else self.inputs
            object.__setattr__(self, "inputs", tuple(name.strip() for name in names))
            if "position" not in self.inputs or "" in self.inputs or len(set(self.inputs)) < len(self.inputs):
                example = " (position,velocity; velocity needs time)" if "velocity" in self.inputs else ""
                raise InputError(
                    f'inputs is {",".join(self.inputs)!r}; use "auto", or position and the further inputs '
                    f"of the force: hysteresis, velocity, columns{example}"
                )
        _require(self)
        given: object = self.search
        if given is None:
            object.__setattr__(self, "search", SearchOptions())
        elif not isinstance(given, SearchOptions):
            raise InputError(f"search is {shown(given)}: must be a SearchOptions")
        self._require_possible_slopes()

    @property
    def slope_limits(self) -> tuple[float, float] | None:
        """Slope limits (min, max) from all slope settings, infinite if not limited; None without slope
        settings."""
        low, high = self.slope_bounds or (-math.inf, math.inf)
        if self.monotone:
            low = max(low, 0.0)
        if self.coupling_stiffness is not None:
            high = min(high, compensated_share * self.coupling_stiffness)
        return None if math.isinf(low) and math.isinf(high) else (low, high)

    def _require_possible_slopes(self) -> None:
        bounds: tuple[float, ...] | None = self.slope_bounds
        if bounds is not None and not (_is_pair(bounds) and bounds[0] < bounds[1]):
            raise InputError(f"slope_bounds is {shown(self.slope_bounds)}: must be (min, max) with min < max")
        limits = self.slope_limits
        if limits is not None and not limits[0] < limits[1]:
            raise InputError(
                f"slope_bounds, monotone and coupling_stiffness require a slope of at least {limits[0]:g} "
                f"and at most {limits[1]:g}: the first must be smaller"
            )
        fixed: tuple[float, ...] | None = self.fixed_force
        if fixed is not None and not (_is_pair(fixed) and all(map(math.isfinite, fixed))):
            raise InputError(f"fixed_force is {shown(self.fixed_force)}: must be (position, force)")


_LEAST_WHOLE = {
    "max_wavelets": 0,
    "patience": 1,
    "refine_steps": 1,
    "final_steps": 0,
    "max_candidates": 1,
    "resolved_by": 3,
    "max_positions": 16,
}
"""Options that are whole numbers, and the least allowed value of each."""

_LOWER_BOUND = {
    "evidence": -math.inf,
    "frame_scale": 1.0,
    "frame_step": 0.0,
    "contact_share": -math.inf,
    "coupling_stiffness": 0.0,
    "period": 0.0,
}
"""Options that are real numbers, and the number that each must exceed."""


def _require(options: IdentifyOptions | SearchOptions) -> None:
    """Checks the values of settings that are words, True or False, or numbers."""
    for each in fields(options):
        name, value = each.name, getattr(options, each.name)
        if name in CHOICES:
            if not isinstance(value, str) or value not in CHOICES[name]:
                raise InputError(f"{name} is {shown(value)}: must be one of {', '.join(CHOICES[name])}")
        elif isinstance(each.default, bool):
            if not isinstance(value, (bool, np.bool_)):
                raise InputError(f"{name} is {shown(value)}: must be True or False")
        elif name in _LEAST_WHOLE:
            if not isinstance(value, int) or isinstance(value, bool) or value < _LEAST_WHOLE[name]:
                raise InputError(f"{name} is {shown(value)}: must be a whole number >= {_LEAST_WHOLE[name]}")
        elif name in _LOWER_BOUND:
            _require_number(name, value, _LOWER_BOUND[name])


def _parsed(name: str, text: str) -> Any:
    """Returns the value of a search setting from its text; refuses an unknown setting or a wrong type."""
    known = {each.name: each.default for each in fields(SearchOptions)}
    if name not in known:
        cure = did_you_mean(name, known) or f"; its settings are {', '.join(known)}"
        raise InputError(f"search has no setting {name!r}{cure}")
    default = known[name]
    try:
        if isinstance(default, tuple):
            return tuple(float(part) for part in text.split(","))
        return int(text) if isinstance(default, int) else float(text)
    except ValueError:
        kinds = {tuple: "numbers joined by commas", int: "a whole number", float: "a number"}
        raise InputError(f"{name} is {text!r}: must be {kinds[type(default)]}") from None


def kind_of(each: Field[Any]) -> str:
    """Returns the type of a field as text."""
    return each.type if isinstance(each.type, str) else inspect.formatannotation(each.type)


def default_of(each: Field[Any]) -> Any:
    """Returns the default of a field of the options."""
    return each.default if each.default_factory is MISSING else each.default_factory()


@cache
def _source() -> ast.Module:
    """Returns the source of this file; empty if the file is missing."""
    try:
        return ast.parse(inspect.getsource(sys.modules[__name__]))
    except (OSError, SyntaxError):
        return ast.Module([], [])


def field_texts(kind: type[IdentifyOptions | SearchOptions] = IdentifyOptions) -> dict[str, str]:
    """Returns the docstring of each field of options, by name; empty if the source file is missing."""
    return {
        ast.unparse(each.target): inspect.cleandoc(ast.literal_eval(text.value))
        for found in _source().body
        if isinstance(found, ast.ClassDef) and found.name == kind.__name__
        for each, text in pairwise(found.body)
        if isinstance(each, ast.AnnAssign) and isinstance(text, ast.Expr)
    }


def summaries() -> dict[str, str]:
    """Returns the first sentence of the docstring of each field of `IdentifyOptions`, by name."""
    return {name: first_sentence(text) for name, text in field_texts().items()}


def described_fields(kind: type[IdentifyOptions | SearchOptions] = IdentifyOptions) -> str:
    """Returns the fields of options as a parameter list for a docstring, from the docstrings of the
    fields."""
    texts = field_texts(kind)
    return "".join(
        f"{each.name} : {kind_of(each)}, default {default_of(each)!r}\n"
        + textwrap.indent(texts.get(each.name, "") + "\n", "    ")
        for each in fields(kind)
    )


def options_from(keywords: Mapping[str, Any]) -> IdentifyOptions:
    """Returns options from keyword arguments; an unknown keyword is refused."""
    known = [field.name for field in fields(IdentifyOptions)]
    for name in keywords:
        if name not in known:
            cure = f"its options are {', '.join(known)}"
            if name in {field.name for field in fields(SearchOptions)}:
                cure = f"give search=SearchOptions({name}=...)"
            raise InputError(f"identify has no option {name!r}; {cure}")
    return IdentifyOptions(**keywords)


def _require_number(name: str, value: Any, above: float) -> None:
    if value is None and name in ("coupling_stiffness", "period"):
        return
    number = math.nan if isinstance(value, bool) or not isinstance(value, (int, float)) else float(value)
    if not math.isfinite(number) or not number > above:
        bound = f" > {above:g}" if math.isfinite(above) else ""
        raise InputError(f"{name} is {shown(value)}: must be a finite number{bound}")


def _require_names(inputs: object) -> None:
    if not isinstance(inputs, (tuple, list)) or not all(isinstance(name, str) for name in inputs):
        raise InputError(f'inputs is {shown(inputs)}: must be "auto" or a tuple of names')


def _is_pair(values: object) -> bool:
    """True if the value is a pair of real numbers."""
    is_number = (int, float, np.integer, np.floating)
    return (
        isinstance(values, (tuple, list))
        and len(values) == 2
        and all(isinstance(value, is_number) and not math.isnan(value) for value in values)
    )


for _options in (IdentifyOptions, SearchOptions):
    _options.__doc__ = f"""{inspect.cleandoc(_options.__doc__ or "")}

Parameters
----------
{described_fields(_options)}"""
