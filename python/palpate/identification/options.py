# SPDX-License-Identifier: Apache-2.0
"""The settings of an identification: every default lives here and nowhere else."""

import ast
import inspect
import math
import textwrap
from collections.abc import Mapping
from dataclasses import Field, dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np

from ..arguments import shown
from ..errors import InputError

RESERVED_INPUTS = ("auto", "position", "hysteresis", "velocity")
"""What `inputs` may hold beside the names of columns."""

CHOICES: dict[str, tuple[str, ...]] = {
    "criterion": ("bic", "aicc", "gcv", "fpe", "fresh", "perceptual"),
    "selection": ("orthogonal", "residual", "backward"),
    "refinement": ("projection", "quasi-newton"),
    "loss": ("squares", "huber"),
    "filters": ("matched", "paper-implicit", "paper-explicit"),
}
"""Settings that are words, and what each may be."""

COUPLING_SHARE = 0.9
"""Behind a coupling K_c a force can be compensated only while its slope stays below K_c: the margin."""


@dataclass(frozen=True)
class IdentifyOptions:
    """Settings of :func:`palpate.identify`; each field is a keyword of it.

    Raises
    ------
    palpate.InputError
        Naming the field, its value and what would be right.
    """

    inputs: str | tuple[str, ...] = "auto"
    """"auto": the ladder decides, over the position and the recording's further inputs. Or names, as a tuple
    or with commas between: position, then hysteresis, velocity (from time) or columns."""
    max_wavelets: int = 64
    """Largest network that is tried [-]"""
    criterion: str = "bic"
    """Stopping rule: bic, aicc, gcv, fpe, or on rows kept back: fresh, perceptual"""
    selection: str = "orthogonal"
    """How wavelets are taken from the frame: orthogonal, residual or backward"""
    rung_evidence: float = 10.0
    """Fall of the criterion that a more complex rung must show; 10 is called very strong evidence [-]"""
    patience: int = 3
    """Wavelets without improvement, for each input, after which growth stops [-]"""
    refine: bool = True
    """False: dilations and translations stay on the frame"""
    refinement: str = "projection"
    """How wavelets are refined: by variable projection, or all parameters by quasi-newton as published"""
    refine_steps: int = 8
    """Refinement steps after each wavelet that was added or removed [-]"""
    final_steps: int = 30
    """Refinement steps of the accepted network [-]"""
    frame_scale: float = 2.0
    """a0, the ratio of neighbouring dilations of the frame [-]"""
    frame_step: float = 0.5
    """b0, the translation step of the frame in units of 1/dilation [-]"""
    max_candidates: int = 4096
    """Members of the truncated frame at most [-]"""
    resolved_by: int = 7
    """Distinct positions, on every stroke, that a wavelet's core |u| <= sqrt(3) must hold [-]"""
    max_positions: int = 1024
    """Distinct positions that are kept apart, twice as many for each further input; more are gathered in as
    many cells [-]"""
    loss: str = "squares"
    """squares, or huber: rows far from the others pull no more than the others do"""
    filters: str = "matched"
    """matched, or as published: paper-implicit (figure 11), paper-explicit (figure 13)"""
    assumed_mass: float = 1e-3
    """m of the paper's figures [force/position s^2]"""
    assumed_damping: float = 0.5
    """B_o of its figure 13 [force/position s]"""
    hysteresis_nonnegative: bool = True
    """Impose h >= 0 over the domain, so that every loop loses energy"""
    slope_bounds: tuple[float, float] | None = None
    """(min, max) of df/dx, imposed over the domain [force/position]"""
    monotone: bool = False
    """Impose df/dx >= 0 over the domain"""
    fixed_force: tuple[float, float] | None = None
    """(position, force) that f goes through, with hysteresis the mean of both strokes [position, force]"""
    coupling_stiffness: float | None = None
    """K_c: df/dx <= 0.9 K_c is imposed over the domain [force/position]"""
    play_radius: tuple[float, ...] = (0.0025, 0.005, 0.01, 0.02, 0.05)
    """Play radii tried for hysteresis where a file does not tell directions; where it is there, the best
    one between the least and the largest is found [share of the travel]"""
    contact_share: float = 0.02
    """Where |f(lower)| is below this share of the force's range the object is left there: "free" below [-]"""
    period: float | None = None
    """Period of an environment that repeats, such as a knob [position]"""

    def __post_init__(self) -> None:
        if not isinstance(self.inputs, str):
            _require_names(self.inputs)
        if self.inputs != "auto":
            names = self.inputs.split(",") if isinstance(self.inputs, str) else self.inputs
            object.__setattr__(self, "inputs", tuple(name.strip() for name in names))
            if "position" not in self.inputs or "" in self.inputs or len(set(self.inputs)) < len(self.inputs):
                raise InputError(
                    f'inputs is {",".join(self.inputs)!r}; use "auto", or position and what else the force '
                    "depends on: hysteresis, velocity, columns"
                )
        for name, words in CHOICES.items():
            if not isinstance(value := getattr(self, name), str) or value not in words:
                raise InputError(f"{name} is {shown(value)}; it must be one of {', '.join(words)}")
        for name in _SWITCHES:
            if not isinstance(value := getattr(self, name), (bool, np.bool_)):
                raise InputError(f"{name} is {shown(value)}; it must be True or False")
        for name, least in _WHOLE_NUMBERS.items():
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < least:
                raise InputError(f"{name} is {shown(value)}; it must be a whole number of {least} or more")
        for name, above in _NUMBERS.items():
            _require_number(name, getattr(self, name), above)
        radii: object = self.play_radius
        if not isinstance(radii, (tuple, list)) or not radii:
            raise InputError(f"play_radius is {shown(radii)}; it must be a tuple of shares of the travel")
        for radius in radii:
            _require_number("play_radius", radius, 0.0)
        self._require_possible_slopes()

    @property
    def slope_limits(self) -> tuple[float, float] | None:
        """All slope settings as one (min, max), infinite where nothing is asked; None if neither is set."""
        low, high = self.slope_bounds or (-math.inf, math.inf)
        if self.monotone:
            low = max(low, 0.0)
        if self.coupling_stiffness is not None:
            high = min(high, COUPLING_SHARE * self.coupling_stiffness)
        return None if math.isinf(low) and math.isinf(high) else (low, high)

    def _require_possible_slopes(self) -> None:
        bounds: tuple[float, ...] | None = self.slope_bounds
        if bounds is not None and not (_is_pair(bounds) and bounds[0] < bounds[1]):
            raise InputError(
                f"slope_bounds is {shown(self.slope_bounds)}; it must be (min, max) with min below max"
            )
        limits = self.slope_limits
        if limits is not None and not limits[0] < limits[1]:
            raise InputError(
                f"slope_bounds, monotone and coupling_stiffness ask for a slope of {limits[0]:g} or more, "
                f"but allow no more than {limits[1]:g}"
            )
        fixed: tuple[float, ...] | None = self.fixed_force
        if fixed is not None and not (_is_pair(fixed) and all(map(math.isfinite, fixed))):
            raise InputError(f"fixed_force is {shown(self.fixed_force)}; it must be (position, force)")


_SWITCHES = ("refine", "hysteresis_nonnegative", "monotone")
"""Settings that are on or off."""

_WHOLE_NUMBERS = {
    "max_wavelets": 0,
    "patience": 1,
    "refine_steps": 1,
    "final_steps": 0,
    "max_candidates": 1,
    "resolved_by": 3,
    "max_positions": 16,
}
"""Whole-number settings and the least that makes sense."""

_NUMBERS = {
    "rung_evidence": -math.inf,
    "frame_scale": 1.0,
    "frame_step": 0.0,
    "contact_share": -math.inf,
    "assumed_mass": 0.0,
    "assumed_damping": 0.0,
    "coupling_stiffness": 0.0,
    "period": 0.0,
}
"""Real settings and what they must lie above."""


def kind_of(field: Field[Any]) -> str:
    """The type of a field as text."""
    return field.type if isinstance(field.type, str) else inspect.formatannotation(field.type)


def described_fields() -> str:
    """The fields of :class:`IdentifyOptions` as a list of parameters, from the texts beneath them."""
    try:
        tree = ast.parse(inspect.getsource(IdentifyOptions)).body[0]
    except (OSError, SyntaxError):  # an installation without its source
        tree = ast.Pass()
    texts: dict[str, str] = {}
    for field, text in pairwise(tree.body if isinstance(tree, ast.ClassDef) else []):
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
            texts[ast.unparse(field.target)] = inspect.cleandoc(ast.literal_eval(text.value))
    return "".join(
        f"{each.name} : {kind_of(each)}, default {each.default!r}\n"
        + textwrap.indent(texts.get(each.name, "") + "\n", "    ")
        for each in fields(IdentifyOptions)
    )


IdentifyOptions.__doc__ = f"""{inspect.cleandoc(IdentifyOptions.__doc__ or "")}

Parameters
----------
{described_fields()}"""


def options_from(keywords: Mapping[str, Any]) -> IdentifyOptions:
    """Options from keywords; a keyword that does not exist is told in one sentence."""
    known = [field.name for field in fields(IdentifyOptions)]
    for name in keywords:
        if name not in known:
            raise InputError(f"identify has no option {name!r}; it has {', '.join(known)}")
    return IdentifyOptions(**keywords)


def _require_number(name: str, value: Any, above: float) -> None:
    if value is None and name in ("coupling_stiffness", "period"):
        return
    number = math.nan if isinstance(value, bool) or not isinstance(value, (int, float)) else float(value)
    if not math.isfinite(number) or not number > above:
        bound = f" above {above:g}" if math.isfinite(above) else ""
        raise InputError(f"{name} is {shown(value)}; it must be a finite number{bound}")


def _require_names(inputs: object) -> None:
    if not isinstance(inputs, (tuple, list)) or not all(isinstance(name, str) for name in inputs):
        raise InputError(f'inputs is {shown(inputs)}; it must be "auto" or a tuple of names')


def _is_pair(values: object) -> bool:
    """True for two real numbers."""
    is_number = (int, float, np.integer, np.floating)
    return (
        isinstance(values, (tuple, list))
        and len(values) == 2
        and all(isinstance(value, is_number) and not math.isnan(value) for value in values)
    )
