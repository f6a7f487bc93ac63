# SPDX-License-Identifier: Apache-2.0
"""Plan: how a model is to be rendered."""

from __future__ import annotations

from dataclasses import dataclass

from .._core import DeviceProfile, Scheme, solver_name
from ..errors import InputError
from ..model import Model

_PLAY_ENCODER_STEPS = 4
"""A play radius below four encoder steps would be switched by the encoder's noise instead of by the hand."""

_PLAY_SHARE_OF_TRAVEL = 0.01


@dataclass(frozen=True)
class Plan:
    """A model, and the structure and numbers with which it is rendered.

    Nothing here is chosen or proved: a plan states what its author wants, and `certificate` is None until
    something has certified it for a device.

    Raises
    ------
    InputError
        The scheme does not fit the model; the message names the field and what would be right.
    """

    model: Model
    scheme: Scheme
    certificate: None = None
    refused: tuple[str, ...] = ()
    """Simpler structures that were refused, each with its reason."""

    def __post_init__(self) -> None:
        if self.model.units["force"] == "A":
            raise InputError(
                "the model's force is a motor current in A; identify it again with --torque-constant-Nm-per-A"
            )
        try:
            self.scheme.validate(self.model)
        except InputError:
            raise
        except ValueError as error:
            raise InputError(str(error)) from None

    @property
    def structure(self) -> str:
        """direct, massless, implicit or explicit."""
        return self.scheme.structure

    @property
    def solver(self) -> str | None:
        """How the load line is solved at 1 kHz: table or newton; None where there is nothing to solve."""
        return solver_name(self.model, self.scheme, DeviceProfile().period_s)

    def check_for(self, device: DeviceProfile) -> None:
        """Refuse what is sure to diverge on this device.

        Raises
        ------
        InputError
            The explicit structure's slope limit is below the model's steepest slope.
        """
        if self.structure != "explicit":
            return
        # While a hysteresis model sticks, h / r is part of its slope.
        radius = (self.scheme.play_radius or self.model.play_radius) if self.model.hysteretic else None
        steepest = self.model.slope_range(radius)[1] + self.scheme.coupling_stiffness
        limit = explicit_slope_limit(self.scheme, device.period_s)
        if steepest >= limit:
            raise InputError(
                f"the explicit structure diverges: steepest slope and coupling stiffness are {steepest:.4g} "
                f"together, and must be below {limit:.4g} = (4 m - 2 (B_o + B_c) T) / T^2"
            )


def explicit_slope_limit(scheme: Scheme, period_s: float) -> float:
    """Slope, coupling stiffness included, up to which the explicit structure is stable at a held device.

    Zhang & Benveniste's environments are implemented in the paper's figure 14 with a delayed integrator;
    linearised at an equilibrium, its poles stay inside the unit circle while
    K + K_c < (4 m - 2 (B_o + B_c) T) / T^2.
    """
    damping = scheme.damping + scheme.coupling_damping
    limit: float = (4.0 * scheme.mass - 2.0 * damping * period_s) / period_s**2
    return limit


def play_radius_for(model: Model, device: DeviceProfile) -> float:
    """Play radius with which a model is rendered [m or rad]: its own where it has one, 0 without hysteresis.

    Files that only say press or release leave it to the rendering: then four encoder steps or one per cent of
    the travel, whichever is more.
    """
    if not model.hysteretic or model.play_radius is not None:
        return 0.0
    travel = float(model.upper[0] - model.lower[0])
    return max(_PLAY_ENCODER_STEPS * device.encoder_step, _PLAY_SHARE_OF_TRAVEL * travel)
