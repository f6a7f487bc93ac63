# SPDX-License-Identifier: Apache-2.0
"""The numbers that a device leaves room for: slopes, coupling, play, mass and damping.

They are proposals. Whether they hold is for the certificate to say.
"""

from __future__ import annotations

import math

from .. import _core
from .._core import DeviceProfile, ForceBounds, Scheme
from ..model import Model
from .slope_limit import sliding_bounds

SPARE = 0.95
"""Share of what the device allows that is used where nothing else sets a number [-]"""

LONGEST_PLAY = 0.1
"""Largest play radius [share of the travel]: a wider one would be felt as play, not as a loss."""

USUAL_PLAY = 0.01
"""Play radius where no proof asks for another [share of the travel]"""

_ENCODER_STEPS = 4
"""A narrower play would be switched by the encoder instead of by the hand [encoder steps]"""

_STABLE_SHARES = (0.9, 0.75, 0.6, 0.45, 0.3, 0.15)
"""Coupling stiffness tried for the explicit structure, over the stiffest that the device can hold [-]"""
_STABLE_DAMPINGS = (0.1, 0.25, 0.5, 1.0)
"""T B_o / m tried for the explicit structure; the paper's choice is 0.5 [-]"""
_STABLE_RESERVES = (1.1, 1.5, 2.5, 5.0)
"""Slope limit of the explicit structure over the slope that it has to meet [-]"""


def friction_slope(device: DeviceProfile, mean_force: float = 0.0) -> float:
    """Steepest slope whose encoder noise the device's friction swallows: f_c >= L Delta/2 + Delta_F/2."""
    if device.encoder_step == 0.0:
        return math.inf
    return 2.0 * (device.coulomb_friction - 0.5 * device.force_step - mean_force) / device.encoder_step


def renderable_slopes(device: DeviceProfile, stick: float = 0.0) -> tuple[float, float]:
    """(lowest, highest) slope that direct rendering is certified for: b >= T M/2 + n_d T L and friction.

    With hysteresis those of sliding: a stick adds `stick` = h/r, to M and L once and to friction twice.
    """
    held = device.viscous_damping / device.longest_period_s
    friction = friction_slope(device) - 2.0 * stick
    highest = min(held / (0.5 + device.late_samples) - stick, friction)
    return (-highest if device.late_samples else -friction), highest


def steepest_stick(device: DeviceProfile) -> float:
    """The slope h/r that leaves half of what the device holds to sliding; what is more of h is left out."""
    held = device.viscous_damping / device.longest_period_s / (0.5 + device.late_samples)
    return min(0.5 * held, 0.25 * friction_slope(device))


def coupling_for(device: DeviceProfile, damping: float) -> float:
    """Stiffest coupling that the device can hold, less a reserve, for a given coupling damping.

    0 where the damping alone is too much.
    """
    available = SPARE * device.viscous_damping / device.longest_period_s

    def fits(stiffness: float) -> bool:
        return _core.coupling_need(stiffness, damping, device.period_s, device.late_samples) <= available

    low, high = 0.0, 2.0 * available
    if high <= 0.0 or not fits(1e-9 * high):
        return 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def play_radius_for(model: Model, device: DeviceProfile) -> float:
    """Narrowest certified play radius r for direct rendering; infinite where there is none.

    r = max(4 Delta, max h / (2 b / T - max(g' + |h'|))), with the delay's and the encoder's share of damping
    and friction taken off as well.
    """
    sliding = sliding_bounds(model)
    delay = device.late_samples
    held = device.viscous_damping / device.longest_period_s
    room = (held - 0.5 * max(0.0, sliding.slope_max) - delay * sliding.sliding) / (0.5 + delay)
    room = min(room, 0.5 * (friction_slope(device, sliding.mean_force) - sliding.sliding))
    if room <= 0.0:
        return math.inf
    # A hair wider: bounds are computed once more for the certificate, and rounded.
    return max(_ENCODER_STEPS * device.encoder_step, 1.000001 * sliding.loss_max / room)


def usual_play_radius(model: Model, device: DeviceProfile) -> float:
    """Play radius where nothing is certified that depends on it; 0 without hysteresis or with one's own."""
    if not model.hysteretic or model.play_radius is not None:
        return 0.0
    travel = float(model.upper[0] - model.lower[0])
    return max(_ENCODER_STEPS * device.encoder_step, USUAL_PLAY * travel)


def explicit_scheme(
    bounds: ForceBounds,
    device: DeviceProfile,
    *,
    mass: float | None,
    damping: float | None,
    coupling_stiffness: float | None,
    coupling_damping: float | None,
    play_radius: float,
) -> Scheme:
    """Coupling, mass and damping for the explicit structure: stable with the stiffest coupling, and for that
    coupling with the least damping, which is what is felt most.

    Where none of those tried is stable, the last of them.
    """
    T = device.period_s
    stiffest = coupling_for(device, 0.0)
    scheme = Scheme(structure="explicit")
    for share in _STABLE_SHARES if coupling_stiffness is None else (1.0,):
        K_c = coupling_stiffness if coupling_stiffness is not None else max(share * stiffest, 1e-9)
        B_c = coupling_damping if coupling_damping is not None else 0.1 * device.viscous_damping
        trials = []
        for ratio in _STABLE_DAMPINGS:
            for reserve in _STABLE_RESERVES:
                needed = reserve * (max(0.0, bounds.slope_max) + K_c) + 2.0 * B_c / T
                m = mass if mass else needed * T**2 / (4.0 - 2.0 * ratio)
                B_o = damping if damping is not None else ratio * m / T
                trials.append((B_o, m))
        for B_o, m in sorted(set(trials)):
            scheme = Scheme(
                structure="explicit",
                coupling_stiffness=K_c,
                coupling_damping=B_c,
                mass=m,
                damping=B_o,
                play_radius=play_radius,
            )
            if not _core.certify_bounds(bounds, scheme, device).refused:
                return scheme
    return scheme
