# SPDX-License-Identifier: Apache-2.0
"""Reads sign, delay, inertia, damping and Coulomb friction from the motion of a pushed handle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from .._typing import Float1D, Float2D

_LARGE = 0.9
"""Pushes above this share of the largest one show the sign of the force: they move the handle alike [-]"""
_FEWEST_PUSHES = 3

_SEEN = 10.0
"""A size of push counts where it moved the handle by so many encoder steps [-]"""

_SIZES_APART = 1.25
"""Ratio of the largest to the smallest push that separates friction from damping [-]"""

_MOST_LEFT = 0.03
"""Largest RMS residual, over the RMS motion, of mechanics that are believed [-]"""

_ROUNDING = 1.0
"""Residual that is always believed [encoder steps]"""

_RESERVE = 0.05
"""Share of the friction that is not counted on, because a real handle is not quite this simple [-]"""

_SURE = 3.0
"""Standard errors by which the friction may be less [-]"""

_WIDEST = 40.0
"""Range of the logarithms of J and b [-]"""

_STARTS = (0.05, 0.4)
"""Friction from which the search begins, over the largest push [-]"""


@dataclass(frozen=True)
class Mechanics:
    """What resists the motion of a handle."""

    inertia: float
    """J [kg or kg*m^2]"""
    damping: float
    """b, viscous [N*s/m or N*m*s/rad]"""
    friction: float
    """f_c, Coulomb [N or N*m]"""
    friction_unsure: float
    """Standard error of `friction`; 0 where it was known before [N or N*m]"""

    @property
    def friction_at_least(self) -> float:
        """The friction that a certificate may count on: less by what the fit can be off by."""
        if self.friction_unsure == 0.0:
            return self.friction
        return max(0.0, (1.0 - _RESERVE) * self.friction - _SURE * self.friction_unsure)


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
        ways.append(-told * _distance(time, position, begin, held))
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


def _distance(time: Float1D, position: Float1D, begin: int, held: int) -> float:
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


def mechanics_of(
    ticks: Mapping[str, Any], encoder_step: float, friction: float | None = None
) -> tuple[Mechanics | None, str]:
    """Fit J dv/dt = -F - b v - f_c sgn(v) to the ways of pushes that begin at rest.

    Parameters
    ----------
    ticks : mapping
        ``applied``, ``position``, ``device_time``: (n,) each, without repeated samples.
    encoder_step : float
        [m or rad]
    friction : float, optional
        f_c, where it is known: pushes of one size are then enough [N or N*m].

    Returns
    -------
    mechanics : Mechanics or None
        None where the pushes do not tell.
    reason : str
        Why they do not; empty where they do.
    """
    applied, moved, seconds = _windows(ticks)
    if len(applied) == 0:
        return None, "there was no whole push"
    size = np.abs(applied).max(axis=1)
    least = _SEEN * (encoder_step or 1e-9)
    moving = np.abs(moved).max(axis=1) >= least
    if not moving.any():
        return None, f"no push moved the handle by {_SEEN:g} encoder steps"
    if friction is None and size[moving].max() < _SIZES_APART * size[moving].min():
        return None, "no two sizes of push moved the handle, which separates friction from damping"
    applied, moved, seconds = applied[moving], moved[moving], seconds[moving]
    largest = float(size.max())

    def residuals(unknown: Float1D) -> Float1D:
        inertia, damping = np.exp(unknown[:2])
        rubbing = largest * unknown[2] if friction is None else friction
        left = moved - _way(applied, seconds, inertia, damping, rubbing)
        return np.asarray((left - left.mean(axis=1, keepdims=True)).ravel() / least)

    start = _start(applied, moved, seconds)
    starts = [[*start, share] for share in _STARTS] if friction is None else [[*start]]
    lower, upper = [-_WIDEST, -_WIDEST, 0.0], [_WIDEST, _WIDEST, 1.0]
    fits = [
        least_squares(residuals, each, bounds=(lower[: len(each)], upper[: len(each)])) for each in starts
    ]
    fit = min(fits, key=lambda each: float(each.cost))
    rms = least * np.sqrt(2.0 * fit.cost / fit.fun.size)
    spread = float(np.sqrt(np.mean((moved - moved.mean(axis=1, keepdims=True)) ** 2)))
    if rms > max(_MOST_LEFT * spread, _ROUNDING * encoder_step):
        return None, "inertia, damping and friction do not explain the motion; let go of the handle"
    inertia, damping = (float(value) for value in np.exp(fit.x[:2]))
    if friction is not None:
        return Mechanics(inertia, damping, friction, 0.0), ""
    variance = 2.0 * fit.cost / (fit.fun.size - fit.x.size)
    slopes = np.asarray(fit.jac, dtype=np.float64)
    covariance = variance * np.linalg.pinv(slopes.T @ slopes)
    unsure = largest * float(np.sqrt(covariance[2, 2]))
    return Mechanics(inertia, damping, largest * float(fit.x[2]), unsure), ""


def _windows(ticks: Mapping[str, Any]) -> tuple[Float2D, Float2D, Float2D]:
    """Force (p, n), way (p, n + 1) and duration (p, n) of the samples of each push and as long after it.

    A reading shows the force that acted until it was taken, so a push begins one reading before it is seen.
    """
    applied, position, time = (np.asarray(ticks[name]) for name in ("applied", "position", "device_time"))
    pushing = applied != 0.0
    begins = np.flatnonzero(pushing[1:] & ~pushing[:-1])
    ends = np.flatnonzero(~pushing[1:] & pushing[:-1])
    ends = ends[ends > begins[0]] if begins.size else ends
    length = 2 * int(np.median(ends - begins[: len(ends)])) if ends.size else 1
    begins = begins[(begins > 2) & (begins + length < len(position))]
    rows = begins[:, None] + np.arange(length + 1)
    return applied[rows][:, 1:], position[rows] - position[begins][:, None], np.diff(time[rows], axis=1)


def _start(applied: Float2D, moved: Float2D, seconds: Float2D) -> tuple[float, float]:
    """Logarithms of J and b, from the impulse of a push, its way and its duration."""
    impulse = float(np.median(np.abs((applied * seconds).sum(axis=1))))
    way = float(np.median(np.abs(moved).max(axis=1)))
    duration = float(np.median(seconds.sum(axis=1)))
    return float(np.log(0.25 * impulse * duration / way)), float(np.log(0.5 * impulse / way))


def _way(applied: Float2D, seconds: Float2D, inertia: float, damping: float, friction: float) -> Float2D:
    """Way (p, n + 1) of a handle at rest under forces (p, n) held for durations, in closed form for each."""
    way = np.zeros((len(applied), applied.shape[1] + 1))
    velocity = np.zeros(len(applied))
    decay = inertia / damping
    for k in range(applied.shape[1]):
        drive, duration = -applied[:, k], seconds[:, k]
        held = np.abs(drive) <= friction
        direction = np.where(velocity != 0.0, np.sign(velocity), np.where(held, 0.0, np.sign(drive)))
        final = np.where(direction == 0.0, 0.0, (drive - direction * friction) / damping)
        with np.errstate(divide="ignore", invalid="ignore"):
            until_rest = np.where(velocity * final < 0.0, decay * np.log1p(-velocity / final), np.inf)
        moves = np.minimum(duration, until_rest)
        approach = -np.expm1(-moves / decay)
        way[:, k + 1] = way[:, k] + final * moves + (velocity - final) * decay * approach
        velocity = np.where(until_rest <= duration, 0.0, velocity + (final - velocity) * approach)
    return way
