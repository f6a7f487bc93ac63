# SPDX-License-Identifier: Apache-2.0
"""The ladder of structures: the simplest that is certified for a model on a device."""

from __future__ import annotations

from dataclasses import replace

from .._core import DeviceProfile
from ..errors import InputError
from ..model import Model
from .plan import Plan
from .rungs import RUNGS, Wishes

_FORCE_UNIT = {"rad": "N*m", "m": "N"}


def plan(
    model: Model,
    device: DeviceProfile,
    *,
    coupling: bool = False,
    coupling_stiffness: float | None = None,
    coupling_damping: float | None = None,
    mass: float | None = None,
    damping: float | None = None,
    play_radius: float | None = None,
) -> Plan:
    """Choose the simplest structure that is certified for a model on a device.

    Direct; direct with the slope limited to what the device can render; massless behind a coupling, when one
    is asked for; implicit, when the object has mass or dynamics, energy-consistent where it falls too steeply
    for that; explicit, which is stable at best. What is not given is chosen from the device.

    Parameters
    ----------
    model : Model
        A model of one position, or of position and velocity; a plan that stands in it is ignored.
    device : DeviceProfile
        In the model's unit.
    coupling : bool
        Render through a virtual coupling, also where that is not needed.
    coupling_stiffness, coupling_damping : float, optional
        K_c and B_c [force/position, force*s/position]; either asks for a coupling.
    mass, damping : float, optional
        Of the object [force*s^2/position, force*s/position]; the model's own where not given, and 0 leaves
        them out.
    play_radius : float, optional
        r of a model with hysteresis [position].

    Returns
    -------
    Plan
        Its certificate says what was proved. Where no structure holds, it is the last that was tried, and
        ``plan.certificate.refused`` is true.

    Raises
    ------
    InputError
        The model cannot be rendered at all, or not on a device of this unit.
    """
    unit = model.units["position"]
    if unit not in ("", device.position_unit):
        raise InputError(
            f"the device {device.id} moves in {device.position_unit}, the model in {unit}; "
            f"a force over {unit} needs a device whose position_unit is {unit}"
        )
    if model.units["force"] not in ("", _FORCE_UNIT[device.position_unit], "A"):
        raise InputError(
            f"the device {device.id} makes {_FORCE_UNIT[device.position_unit]}, the model's force is in "
            f"{model.units['force']}"
        )
    content = model.to_dict()
    content.update(plan=None, certificate=None)
    wishes = Wishes(
        coupling=coupling or coupling_stiffness is not None or coupling_damping is not None,
        coupling_stiffness=coupling_stiffness,
        coupling_damping=coupling_damping,
        mass=model.mass if mass is None else mass,
        damping=model.damping if damping is None else damping,
        play_radius=play_radius,
    )
    bare = Model.from_dict(content)
    if bare.of_velocity and (wishes.coupling or wishes.dynamic):
        raise InputError(
            "a force of position and velocity is rendered directly: behind a coupling, or with a mass or "
            "damping beside it, no bound is known"
        )
    refused: list[str] = []
    last: Plan | None = None
    for name, rung in RUNGS.items():
        outcome = rung(bare, device, wishes)
        if isinstance(outcome, str):
            refused.append(f"{name}: {outcome}")
            continue
        last = replace(outcome, refused=tuple(refused))
        assert outcome.certificate is not None
        if not outcome.certificate.refused:
            return last
        refused.append(f"{name}: {outcome.certificate.why}")
    assert last is not None  # the explicit rung always proposes something
    return replace(last, refused=tuple(refused))
