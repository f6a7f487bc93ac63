# SPDX-License-Identifier: Apache-2.0
"""What a device and its handle do when it is pushed: sign, delay and mechanics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._typing import Float1D
from .mechanics import Mechanics, mechanics_of

_LARGE = 0.9
"""Pushes above this share of the largest one show the sign of the force: they move the handle alike [-]"""
_FEWEST_PUSHES = 3


@dataclass(frozen=True)
class Push:
    """How a handle answered."""

    moved: float
    """Mean way of a push in the direction that a right sign gives [m or rad]."""
    unsure: float
    """Standard error of that mean [m or rad]; infinite where it rests on less than three pushes."""
    obeyed: bool
    """Whether the force that the device says it made has the sign of the one that it was told to make."""
    delay_samples: int | None
    """Whole samples from command to force."""
    mechanics: Mechanics | None
    """Inertia, damping and friction; None where the motion does not tell."""
    unseen: str = ""
    """Why the motion does not tell the mechanics."""


def push_response(ticks: Mapping[str, Any], encoder_step: float = 0.0, friction: float | None = None) -> Push:
    """Read sign, delay and mechanics from the ticks of alternating pushes.

    A force F > 0 pushes towards smaller positions. How far a push moved the handle is counted from where the
    handle would have gone on to by itself, since a hand may be on it. Everything but the delay is in the
    device's own time: how late the host was does not matter.

    Parameters
    ----------
    ticks : mapping
        ``force`` (sent), ``applied``, ``position``, ``device_time``, ``sequence``: (n,) each.
    encoder_step : float
        [m or rad]
    friction : float, optional
        Coulomb friction of the device, where it is known [N or N*m].
    """
    fresh = np.concatenate(([True], np.diff(ticks["sequence"].astype(np.int64)) > 0))
    sent, applied, position, time = (
        np.asarray(ticks[name])[fresh] for name in ("force", "applied", "position", "device_time")
    )
    ways: list[float] = []
    sizes: list[float] = []
    obedience = 0.0
    # A reading tells the force that acted until it was taken: a push begins one reading before it is seen.
    pushing = applied != 0.0
    begins = np.flatnonzero(pushing[1:] & ~pushing[:-1])
    for begin in begins[begins > 2]:  # before the first push nobody knows where the handle goes
        held = int(np.argmin(pushing[begin + 1 :])) or len(pushing) - begin - 1
        told = float(np.sign(sent[max(0, begin + 1 - held) : begin + 1 + held].sum()))
        obedience += told * float(np.sign(applied[begin + 1]))
        ways.append(-told * _way(time, position, begin, held))
        sizes.append(float(np.abs(applied[begin + 1 : begin + 1 + held]).max()))
    large = [way for way, size in zip(ways, sizes, strict=True) if size >= _LARGE * max(sizes)]
    ways = large if len(large) >= _FEWEST_PUSHES else ways
    mechanics, unseen = mechanics_of(
        {"applied": applied, "position": position, "device_time": time}, encoder_step, friction
    )
    enough = len(ways) >= _FEWEST_PUSHES
    return Push(
        moved=float(np.mean(ways)) if ways else 0.0,
        unsure=float(np.std(ways, ddof=1)) / math.sqrt(len(ways)) if enough else math.inf,
        obeyed=obedience >= 0.0,
        delay_samples=_delay(ticks),
        mechanics=mechanics,
        unseen=unseen,
    )


def _way(time: Float1D, position: Float1D, begin: int, held: int) -> float:
    """How far a push moved the handle from where it was going: on a parabola, since hands are slow."""
    before, end = slice(max(0, begin - 2 * held), begin + 1), min(begin + held, len(position) - 1)
    hand = np.polynomial.Polynomial.fit(time[before], position[before], 2)
    return float(position[end] - hand(time[end]))


def _delay(ticks: Mapping[str, Any]) -> int | None:
    """Samples from a command to the first reading whose force is it, less the one that each command takes."""
    sent, applied = np.asarray(ticks["force"]), np.asarray(ticks["applied"])
    begins = np.flatnonzero((sent[1:] != 0.0) & (sent[:-1] == 0.0)) + 1
    delays = [int(np.argmax(applied[begin + 1 :] != 0.0)) for begin in begins if np.any(applied[begin + 1 :])]
    return int(np.median(delays)) if delays else None
