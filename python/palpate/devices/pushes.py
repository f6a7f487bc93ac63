# SPDX-License-Identifier: Apache-2.0
"""Sign, delay, inertia, damping and Coulomb friction from the motion of a pushed handle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from .._typing import Float1D, Float2D

_LARGE_PUSH_SHARE = 0.9
"""Least force of a push that is used to judge the sign of the force [share of the largest push's force]"""
_FEWEST_PUSHES = 3
"""Least number of pushes from which a standard error is computed"""

_LEAST_FITTED_STEPS = 10.0
"""Least displacement by a push from which inertia, damping and friction are fitted [encoder steps]"""

_LEAST_SIZE_RATIO = 1.25
"""Least ratio of the forces of the strongest and the weakest push that separates friction from damping [-]"""

_LARGEST_RESIDUAL_SHARE = 0.03
"""Largest RMS error of the fitted displacement that is accepted [share of the RMS displacement]"""

_ROUNDING_STEPS = 1.0
"""RMS error of the fitted displacement that is always accepted [encoder steps]"""

_FRICTION_RESERVE_SHARE = 0.05
"""Share of the fitted friction that is subtracted from it, because a real handle differs from the law [-]"""

_FRICTION_RESERVE_ERRORS = 3.0
"""Number of standard errors of the fitted friction that are subtracted from it for a certificate [-]"""

_LARGEST_LOGARITHM = 40.0
"""Largest |logarithm| of the inertia J and of the damping b that the fit may reach, both in SI units [-]"""

_START_FRICTION_SHARES = (0.05, 0.4)
"""Friction values from which the fit begins, divided by the force of the largest push [-]"""


@dataclass(frozen=True)
class Mechanics:
    """Inertia, damping and friction of a handle."""

    inertia: float
    """Inertia J of the handle [kg or kg*m^2]"""
    damping: float
    """Viscous damping b of the handle [N*s/m or N*m*s/rad]"""
    friction: float
    """Coulomb friction f_c of the handle [N or N*m]"""
    friction_standard_error: float
    """Standard error of `friction` [N or N*m]; 0 if the caller gave the friction"""

    @property
    def friction_lower_bound(self) -> float:
        """Lower bound of the friction for a certificate, reduced by the uncertainty of the fit."""
        if self.friction_standard_error == 0.0:
            return self.friction
        return max(
            0.0,
            (1.0 - _FRICTION_RESERVE_SHARE) * self.friction
            - _FRICTION_RESERVE_ERRORS * self.friction_standard_error,
        )


@dataclass(frozen=True)
class Push:
    """Response of a handle to pushes: displacement, sign, delay and mechanics."""

    displacement: float
    """Mean displacement of the handle by a push; > 0 if the sign of the force is correct [m or rad]"""
    standard_error: float
    """Standard error of the mean displacement [m or rad]; infinite for fewer than three pushes"""
    reported_sign_agrees: bool
    """True if the force that the device reports has the sign of the commanded force"""
    delay_samples: int | None
    """Number of whole samples from the command of a force until the force acts; None if it was not found"""
    mechanics: Mechanics | None
    """Inertia, damping and friction of the handle; None if they cannot be fitted"""
    mechanics_problem: str = ""
    """Reason why inertia, damping and friction cannot be fitted"""


def push_response(ticks: Mapping[str, Any], encoder_step: float = 0.0, friction: float | None = None) -> Push:
    """Computes sign of the force, delay, and mechanics of the handle from the ticks of alternating pushes.

    A force F > 0 pushes towards smaller positions. A displacement is the position minus the position expected
    without the push, because a hand may hold the handle. All results except the delay use the device's clock,
    so a late host has no effect.

    Parameters
    ----------
    ticks : mapping
        ``force`` (sent), ``applied``, ``position``, ``device_time``, ``sequence``: (n,) each.
    encoder_step : float
        [m or rad]
    friction : float, optional
        Coulomb friction of the device, if known [N or N*m].
    """
    new_samples = np.concatenate(([True], np.diff(ticks["sequence"].astype(np.int64)) > 0))
    sent, applied, position, time = (
        np.asarray(ticks[name])[new_samples] for name in ("force", "applied", "position", "device_time")
    )
    displacements: list[float] = []
    sizes: list[float] = []
    agreement = 0.0
    # A sample reports the force that acted before the sample: a push begins one sample earlier.
    pushing = applied != 0.0
    begins = np.flatnonzero(pushing[1:] & ~pushing[:-1])
    for begin in begins[begins > 2]:  # three samples before a push show the handle's motion without the push
        samples = int(np.argmin(pushing[begin + 1 :])) or len(pushing) - begin - 1
        commanded = float(np.sign(sent[max(0, begin + 1 - samples) : begin + 1 + samples].sum()))
        agreement += commanded * float(np.sign(applied[begin + 1]))
        displacements.append(-commanded * _push_displacement(time, position, begin, samples))
        sizes.append(float(np.abs(applied[begin + 1 : begin + 1 + samples]).max()))
    large = [
        displacement
        for displacement, size in zip(displacements, sizes, strict=True)
        if size >= _LARGE_PUSH_SHARE * max(sizes)
    ]
    displacements = large if len(large) >= _FEWEST_PUSHES else displacements
    mechanics, mechanics_problem = _mechanics(applied, position, time, encoder_step, friction)
    enough = len(displacements) >= _FEWEST_PUSHES
    return Push(
        displacement=float(np.mean(displacements)) if displacements else 0.0,
        standard_error=float(np.std(displacements, ddof=1)) / math.sqrt(len(displacements))
        if enough
        else math.inf,
        reported_sign_agrees=agreement >= 0.0,
        delay_samples=_delay(ticks),
        mechanics=mechanics,
        mechanics_problem=mechanics_problem,
    )


def _push_displacement(time: Float1D, position: Float1D, begin: int, samples: int) -> float:
    """Returns the handle's displacement by a push: position minus a parabola that continues the motion before
    the push."""
    before, end = slice(max(0, begin - 2 * samples), begin + 1), min(begin + samples, len(position) - 1)
    previous_motion = np.polynomial.Polynomial.fit(time[before], position[before], 2)
    return float(position[end] - previous_motion(time[end]))


def _delay(ticks: Mapping[str, Any]) -> int | None:
    """Returns the number of samples between a command and the first one that reports its force, or None."""
    sent, applied = np.asarray(ticks["force"]), np.asarray(ticks["applied"])
    begins = np.flatnonzero((sent[1:] != 0.0) & (sent[:-1] == 0.0)) + 1
    delays = [int(np.argmax(applied[begin + 1 :] != 0.0)) for begin in begins if np.any(applied[begin + 1 :])]
    return int(np.median(delays)) if delays else None


def _mechanics(
    applied: Float1D, position: Float1D, time: Float1D, encoder_step: float, friction: float | None
) -> tuple[Mechanics | None, str]:
    """Fits J dv/dt = -F - b v - f_c sgn(v) to the displacements of the handle by pushes that begin at rest.

    v is the velocity, F the force of a push, J the inertia, b the damping and f_c the Coulomb friction.

    Parameters
    ----------
    applied, position, time : (n,) array
        Samples of the device without repeated ones.
    encoder_step : float
        [m or rad]
    friction : float, optional
        Coulomb friction f_c, if it is known; pushes of one size are then enough [N or N*m].

    Returns
    -------
    mechanics : Mechanics or None
        Inertia, damping and friction; None if they cannot be fitted.
    reason : str
        Reason why they cannot be fitted; empty if they are fitted.
    """
    applied, moved, seconds = _windows(applied, position, time)
    if len(applied) == 0:
        return None, "no complete push was recorded"
    size = np.abs(applied).max(axis=1)
    least = _LEAST_FITTED_STEPS * (encoder_step or 1e-9)
    moving = np.abs(moved).max(axis=1) >= least
    if not moving.any():
        return None, f"no push moved the handle by at least {_LEAST_FITTED_STEPS:g} encoder steps"
    if friction is None and size[moving].max() < _LEAST_SIZE_RATIO * size[moving].min():
        return None, "pushes of two sizes must move the handle to separate friction from damping"
    applied, moved, seconds = applied[moving], moved[moving], seconds[moving]
    largest = float(size.max())

    def residuals(unknown: Float1D) -> Float1D:
        inertia, damping = np.exp(unknown[:2])
        friction_force = largest * unknown[2] if friction is None else friction
        residual = moved - _displacement(applied, seconds, inertia, damping, friction_force)
        return np.asarray((residual - residual.mean(axis=1, keepdims=True)).ravel() / least)

    start = _start_values(applied, moved, seconds)
    starts = [[*start, share] for share in _START_FRICTION_SHARES] if friction is None else [[*start]]
    lower, upper = (
        [-_LARGEST_LOGARITHM, -_LARGEST_LOGARITHM, 0.0],
        [_LARGEST_LOGARITHM, _LARGEST_LOGARITHM, 1.0],
    )
    fits = [
        scipy.optimize.least_squares(residuals, each, bounds=(lower[: len(each)], upper[: len(each)]))
        for each in starts
    ]
    fit = min(fits, key=lambda each: float(each.cost))
    rms = least * np.sqrt(2.0 * fit.cost / fit.fun.size)
    spread = float(np.sqrt(np.mean((moved - moved.mean(axis=1, keepdims=True)) ** 2)))
    if rms > max(_LARGEST_RESIDUAL_SHARE * spread, _ROUNDING_STEPS * encoder_step):
        return None, "inertia, damping and friction do not explain the motion; take the hand off the handle"
    inertia, damping = (float(value) for value in np.exp(fit.x[:2]))
    if friction is not None:
        return Mechanics(inertia, damping, friction, 0.0), ""
    variance = 2.0 * fit.cost / (fit.fun.size - fit.x.size)
    slopes = np.asarray(fit.jac, dtype=np.float64)
    covariance = variance * np.linalg.pinv(slopes.T @ slopes)
    standard_error = largest * float(np.sqrt(covariance[2, 2]))
    return Mechanics(inertia, damping, largest * float(fit.x[2]), standard_error), ""


def _windows(applied: Float1D, position: Float1D, time: Float1D) -> tuple[Float2D, Float2D, Float2D]:
    """Returns forces (p, n), displacements (p, n + 1) and time steps (p, n) in windows around p pushes.

    Each window holds one push and an equal time after it.
    """
    pushing = applied != 0.0
    begins = np.flatnonzero(pushing[1:] & ~pushing[:-1])
    ends = np.flatnonzero(~pushing[1:] & pushing[:-1])
    ends = ends[ends > begins[0]] if begins.size else ends
    length = 2 * int(np.median(ends - begins[: len(ends)])) if ends.size else 1
    begins = begins[(begins > 2) & (begins + length < len(position))]
    rows = begins[:, None] + np.arange(length + 1)
    return applied[rows][:, 1:], position[rows] - position[begins][:, None], np.diff(time[rows], axis=1)


def _start_values(applied: Float2D, moved: Float2D, seconds: Float2D) -> tuple[float, float]:
    """Returns first estimates of log J and log b (inertia J, damping b) from impulse and motion of a push."""
    impulse = float(np.median(np.abs((applied * seconds).sum(axis=1))))
    displacement = float(np.median(np.abs(moved).max(axis=1)))
    duration = float(np.median(seconds.sum(axis=1)))
    return float(np.log(0.25 * impulse * duration / displacement)), float(
        np.log(0.5 * impulse / displacement)
    )


def _displacement(
    applied: Float2D, seconds: Float2D, inertia: float, damping: float, friction: float
) -> Float2D:
    """Returns the displacement (p, n + 1) of a handle, first at rest, under p series of held forces. It is
    exact except for a reversal within a sample, which begins with the next sample."""
    displacement = np.zeros((len(applied), applied.shape[1] + 1))
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
        displacement[:, k + 1] = displacement[:, k] + final * moves + (velocity - final) * decay * approach
        velocity = np.where(until_rest <= duration, 0.0, velocity + (final - velocity) * approach)
    return displacement
