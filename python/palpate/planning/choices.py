# SPDX-License-Identifier: Apache-2.0
"""Proposes slopes, coupling, play, mass and damping for a device; the certificate decides if they hold."""

from __future__ import annotations

from .. import _core
from .._core.device import DeviceProfile
from .._core.model import ForceModel
from .._core.rendering import Scheme, explicit_object, fewest_encoder_steps_in_play
from .._core.stability import ForceBounds, certify_bounds, narrowest_play, stiffest_coupling
from .limited_network import sliding_bounds, sliding_slopes

SPARE = 0.95
"""Coupling stiffness where nothing else sets it [share of the stiffest that the device can hold]"""

LONGEST_PLAY = 0.1
"""Largest play radius [share of the travel]: a wider one is felt as play, not as hysteresis."""

_WANTED = 1.02
"""Slope for which a device is used [share of that of the model]: a network is fitted just below its limits"""

_STABLE_SHARES = (0.9, 0.75, 0.6, 0.45, 0.3, 0.15)
"""Coupling stiffness tried for the explicit structure, over the stiffest that the device can hold [-]"""
_STABLE_DAMPINGS = (0.1, 0.25, 0.5, 1.0)
"""T/m times the object damping tried for the explicit structure; the paper's choice is 0.5 [-]"""
_STABLE_RESERVES = (1.1, 1.5, 2.5, 5.0)
"""Slope limit of the explicit structure over the slope that it has to meet [-]"""


def renderable_slopes(
    device: DeviceProfile, stick: float = 0.0, model: ForceModel | None = None
) -> tuple[float, float]:
    """(lowest, highest) slope for which direct rendering is certified, divided according to the model.

    With hysteresis these are slopes while sliding, and a stick adds `stick` = h/r.
    """
    if model is None:
        return _core.stability.renderable_slopes(device, stick)
    low, high = sliding_slopes(model)
    return _core.stability.renderable_slopes(
        device, stick, rising=max(0.0, _WANTED * high), falling=max(0.0, -_WANTED * low)
    )


def coupling_for(device: DeviceProfile, damping: float, falling: float = 0.0) -> float:
    """Returns the stiffest coupling that the device can hold, less a reserve, for a given coupling damping.

    `falling` is the steepest fall of an object's force. 0 if the damping alone is too much.
    """
    return stiffest_coupling(damping=damping, falling=falling, device=device, share=SPARE)


def play_radius_for(model: ForceModel, device: DeviceProfile) -> float:
    """Narrowest certified play radius for direct rendering, at least 4 encoder steps.

    Infinite if none is certified up to `LONGEST_PLAY`.
    """
    longest = LONGEST_PLAY * float(model.upper[0] - model.lower[0])
    narrowest = fewest_encoder_steps_in_play * device.encoder_step
    radius = narrowest_play(sliding_bounds(model, device.force_limit), device, narrowest, longest)
    # Bounds are computed once more for the certificate, and rounded.
    return radius if radius == narrowest else 1.000001 * radius


def explicit_scheme(
    bounds: ForceBounds,
    device: DeviceProfile,
    *,
    mass: float | None = None,
    damping: float | None = None,
    coupling_stiffness: float | None = None,
    coupling_damping: float | None = None,
    play_radius: float,
) -> Scheme:
    """The explicit structure that is stable with the stiffest coupling, then with the least object damping.

    The last one tried if none is stable.
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
                limit = reserve * (max(0.0, bounds.slope_max) + K_c) - K_c
                m, _ = explicit_object(
                    limit, coupling_stiffness=K_c, coupling_damping=B_c, ratio=ratio, period_s=T
                )
                m = mass or m
                trials.append((damping if damping is not None else ratio * m / T, m))
        for object_damping, m in sorted(set(trials)):
            scheme = Scheme(
                structure="explicit",
                coupling_stiffness=K_c,
                coupling_damping=B_c,
                mass=m,
                damping=object_damping,
                play_radius=play_radius,
            )
            if not certify_bounds(bounds, scheme, device).refused:
                return scheme
    return scheme
