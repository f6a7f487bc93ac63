# SPDX-License-Identifier: Apache-2.0
"""The settings of an identification: every default lives here and nowhere else."""

import math
from dataclasses import dataclass, fields
from typing import Any

from ..errors import InputError
from .stopping import CRITERIA

RUNG_INPUTS = ("position", "hysteresis")
"""Inputs that the ladder knows; "auto" tries them in this order and keeps what earns its place."""


@dataclass(frozen=True)
class IdentifyOptions:
    """Settings of :func:`palpate.identify`; each field is a keyword of it.

    Raises
    ------
    palpate.InputError
        Naming the field, the value and what would be right.
    """

    inputs: str | tuple[str, ...] = (
        "auto"  # "auto": the ladder decides; or ("position",), ("position", "hysteresis")
    )
    max_wavelets: int = 64  # largest network tried [-]
    criterion: str = "bic"  # stopping rule, a key of stopping.CRITERIA
    rung_evidence: float = (
        10.0  # fall of the criterion that a more complex rung must show ("very strong": 10) [-]
    )
    patience: int = 3  # growth steps without improvement before growth stops [-]
    refine: bool = True  # False: frame selection only, dilations and translations stay on the frame
    refine_steps: int = 8  # refinement steps after each added or removed wavelet [-]
    final_steps: int = 30  # refinement steps on the accepted network [-]
    frame_scale: float = 2.0  # a0: ratio of neighbouring dilations of the frame [-]
    frame_step: float = 0.5  # b0: translation step in units of 1/dilation [-]
    resolved_by: int = (
        5  # distinct positions, of every stroke, that a wavelet's core |u| <= sqrt(3) must hold [-]
    )
    max_positions: int = 2048  # distinct positions a stroke kept unmerged; beyond, positions are binned [-]
    hysteresis_nonnegative: bool = True  # impose h >= 0, so that every loop loses energy
    slope_bounds: tuple[float, float] | None = (
        None  # (min, max) of df/dx imposed over the domain [force/position]
    )
    coupling_stiffness: float | None = (
        None  # K_c: df/dx <= 0.9 K_c is imposed over the domain [force/position]
    )
    play_radius: tuple[float, ...] = (
        0.0025,
        0.005,
        0.01,
        0.02,
        0.05,
    )  # radii tried without a direction [share of travel]
    contact_share: float = 0.02  # |f(lower)| below this share of the force range is contact: "free" below [-]
    period: float | None = None  # period of a periodic environment (a knob) [position]

    def __post_init__(self) -> None:
        if isinstance(self.inputs, str) and self.inputs != "auto":
            object.__setattr__(self, "inputs", tuple(name.strip() for name in self.inputs.split(",")))
        if self.inputs != "auto":
            unknown = [name for name in self.inputs if name not in RUNG_INPUTS]
            if unknown or "position" not in self.inputs:
                raise InputError(
                    f'inputs is {self.inputs!r}; it must be "auto" or hold "position", with "hysteresis" if wanted'
                )
        if self.criterion not in CRITERIA:
            raise InputError(f"criterion is {self.criterion!r}; it must be one of {', '.join(CRITERIA)}")
        for name, lowest in (
            ("max_wavelets", 0),
            ("patience", 1),
            ("refine_steps", 1),
            ("final_steps", 0),
            ("resolved_by", 3),
            ("max_positions", 16),
        ):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < lowest:
                raise InputError(f"{name} is {value!r}; it must be a whole number of {lowest} or more")
        _require_finite("rung_evidence", self.rung_evidence, least=0.0)
        _require_finite("contact_share", self.contact_share, least=0.0)
        _require_finite("frame_step", self.frame_step, above=0.0)
        _require_finite("frame_scale", self.frame_scale, above=1.0)
        for optional in ("coupling_stiffness", "period"):
            if getattr(self, optional) is not None:
                _require_finite(optional, getattr(self, optional), above=0.0)
        for radius in self.play_radius:
            _require_finite("play_radius", radius, above=0.0)
        if self.slope_bounds is not None:
            if len(self.slope_bounds) != 2 or not self.slope_bounds[0] < self.slope_bounds[1]:
                raise InputError(
                    f"slope_bounds is {self.slope_bounds!r}; it must be (min, max) with min below max"
                )
            if (
                self.coupling_stiffness is not None
                and self.slope_bounds[0] >= COUPLING_SHARE * self.coupling_stiffness
            ):
                raise InputError(
                    f"slope_bounds asks for a slope of at least {self.slope_bounds[0]:g}, but coupling_stiffness "
                    f"{self.coupling_stiffness:g} allows at most {COUPLING_SHARE * self.coupling_stiffness:g}"
                )

    @property
    def slope_limits(self) -> tuple[float, float] | None:
        """Both slope settings as one (min, max), -inf and inf where nothing is asked; None when neither is set."""
        low, high = self.slope_bounds if self.slope_bounds is not None else (-math.inf, math.inf)
        if self.coupling_stiffness is not None:
            high = min(high, COUPLING_SHARE * self.coupling_stiffness)
        return None if math.isinf(low) and math.isinf(high) else (low, high)


COUPLING_SHARE = 0.9
"""A force behind a coupling K_c can be compensated exactly only while its slope stays below K_c; this is the margin."""


def options_from(keywords: dict[str, Any]) -> IdentifyOptions:
    """Options from keywords, with one sentence for a keyword that does not exist."""
    known = [field.name for field in fields(IdentifyOptions)]
    for name in keywords:
        if name not in known:
            raise InputError(f"identify has no option {name!r}; the options are {', '.join(known)}")
    return IdentifyOptions(**keywords)


def _require_finite(name: str, value: float, *, least: float = -math.inf, above: float = -math.inf) -> None:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or value < least or value <= above:
        bound = f"above {above:g}" if math.isfinite(above) else f"{least:g} or more"
        raise InputError(f"{name} is {value!r}; it must be a finite number {bound}")
