# SPDX-License-Identifier: Apache-2.0
"""Ranges of position and force that no object has in the stated units."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...errors import command_word
from ...verdict import Finding, usable
from .cells import Checked

Bounds = tuple[float, float]


def implausible_range(
    checked: Checked, *, travels: Mapping[str, Bounds], microscope_travel: float, microscope_force: float
) -> list[Finding]:
    """Returns findings on an implausible travel, and on a large force over a tiny travel.

    Only an SI unit in the name of a column is checked: a program may have written it above values in other
    units. A unit that the caller states is certain.

    Parameters
    ----------
    travels
        Least and largest plausible travel by unit: from a microscope tip to an arm or 50 revolutions.
    microscope_travel : float
        Travel below which the recording is taken to be from a force microscope [m].
    microscope_force : float
        Largest plausible range of its force [N].
    """
    recording, travel = checked.recording, checked.travel
    column = recording.source.columns.get("position", "position")
    position, force = recording.file_unit("position"), recording.file_unit("force")
    if position.factor != 1.0 or recording.unit_is_certain:
        return []
    low, high = travels.get(position.si, (0.0, math.inf))
    of_force = float(np.ptp(recording.force))
    if 0.0 < travel < low or travel > high:
        side, bound = ("below", low) if travel < low else ("above", high)
        seen = f"travel is {position.text(travel)}, {side} {position.text(bound)}"
    elif (
        (position.si, force.si) == ("m", "N")
        and 0.0 < travel < microscope_travel
        and of_force > microscope_force
    ):
        seen = (
            f"range of the force is {force.text(of_force)} over a travel of {position.text(travel)}, above "
            f"{force.text(microscope_force)}"
        )
    else:
        return []
    return [
        usable(
            f"the {seen}: the unit of position or force is probably wrong; state the right one, for example "
            f"--units {command_word(f'{column}={position.symbol}')} if it is {position.symbol}"
        )
    ]
