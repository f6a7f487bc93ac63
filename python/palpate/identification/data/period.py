# SPDX-License-Identifier: Apache-2.0
"""Period of a force that repeats over position, as of a knob with detents, from its autocorrelation and a fit
of harmonics; or one revolution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..._typing import Float1D
from ...recording import Recording
from ...recording.conversion import MIN_ROWS
from ...recording.motion import directions_of
from .limits import LEAST_GAIN, standard_deviation

REVOLUTION = 2.0 * np.pi
"""Period of every force over the angle of a shaft that turns without end [rad]."""

SAME_STEP = 1e-3
"""Share of a step by which rounding in a file may change it [-]."""

HARMONICS = 6
"""Number of harmonics of the fit that refines a period; with 4 or 12 the period has the same error."""

BIWEIGHT = 4.685
"""Residual without weight [standard deviations]: 95 % efficiency for normal noise (Holland & Welsch 1977)."""


def period_of(recordings: Sequence[Recording]) -> float | None:
    """Returns the distance after which the force repeats [position]; None without at least two repeats.

    It is the shortest part of the distance with the largest autocorrelation at which the repeats differ as
    little as at this distance. The strokes of one direction are compared, because hysteresis has the same
    sign in them.
    """
    position, force, way = _strokes(recordings)
    press = way > 0.0
    # Fewer rows can also be those of a force that repeats between them.
    travel = float(np.ptp(position[press])) if np.count_nonzero(press) > 2 * MIN_ROWS else 0.0
    if not travel > 0.0:
        return None
    box, share = (position - position[press].min()) / travel, force / (float(np.abs(force).max()) or 1.0)
    # A wave shorter than two steps of the motion would only show which stroke a row belongs to.
    steps = np.abs(np.diff(box))
    cells = min(round(1.0 / float(np.median(steps[steps > 0.0]))), len(box))
    repeat = _repeat(_curve(box[press], share[press], cells))
    if repeat is None:
        return None

    def squared_error(period: float) -> float:
        return _squared_error(box, share, way, period, cells)

    (wave, count), orders = repeat, np.arange(1, HARMONICS + 1)
    wave, weight = _fitted(box, share, way, wave, orders, cells)
    # Friction that reverses at the same turns of each cycle looks like a longer period.
    box, share, way = (each[weight > 0.0] for each in (box, share, way))
    # Rounded positions shift the force of each row; where the rounding repeats, so does its error.
    curve = _curve(np.mod(box / wave, 1.0), share, max(round(cells * wave), 1))
    step = cells * float(np.median(np.diff(np.unique(box))))
    rounding = step**2 / 12.0 * float(np.mean(np.diff(curve) ** 2))
    allowed = max(squared_error(count * wave), rounding) / (1.0 - LEAST_GAIN)
    divisors = (each for each in range(1, count + 1) if count % each == 0)
    waves = next(each for each in divisors if squared_error(each * wave) <= allowed)
    period = waves * wave
    if waves > 1:
        period, _ = _fitted(box, share, way, period, np.append(waves * orders, orders), cells)
    if (revolution := revolution_of(recordings)) is not None:
        # The force repeats after a revolution, of which its period is exactly a part.
        part = revolution / travel / max(round(revolution / travel / period), 1)
        if (1.0 - LEAST_GAIN) * squared_error(part) <= squared_error(period):
            period = part
    return travel * period


def revolution_of(recordings: Sequence[Recording]) -> float | None:
    """Returns 2 pi if the angle of the strokes closes a revolution, else None.

    Then the gap between two angles is not larger where the revolution closes than somewhere along the
    strokes, and the force changes as little from angle to angle. The force of a torsion spring jumps there.
    """
    position, force, way = _strokes(recordings)
    if not len(position) or any(each.units["position"] != "rad" for each in recordings):
        return None
    for stroke in (way > 0.0, way < 0.0):
        force[stroke] -= force[stroke].mean() if stroke.any() else 0.0

    def steps(angle: Float1D, *end: float) -> tuple[float, float]:
        order = np.argsort(angle, kind="stable")
        gap = np.diff(angle[order], append=[angle[order[0]] + each for each in end])
        step = np.diff(force[order], append=[force[order[0]] for _ in end])
        return float(gap.max(initial=0.0)), float(step @ step)

    along, around = steps(position), steps(np.mod(position, REVOLUTION), REVOLUTION)
    closed = around[0] <= (1.0 + SAME_STEP) * along[0] and (1.0 - LEAST_GAIN) * around[1] <= along[1]
    return REVOLUTION if closed else None


def _strokes(recordings: Sequence[Recording]) -> tuple[Float1D, Float1D, Float1D]:
    """Returns positions, forces and directions of the rows of recordings in which the tool moves; empty if
    the direction is not known or the force has further inputs."""
    strokes = [np.zeros((3, 0))]
    for each in recordings:
        way = directions_of(each)
        if way is None or len(each.input_names):
            return np.zeros(0), np.zeros(0), np.zeros(0)
        moving = (way != 0) & each.motion.moving
        strokes.append(np.array([each.position, each.force, way])[:, moving])
    position, force, side = np.concatenate(strokes, axis=1)
    return position, force, side


def _squared_error(box: Float1D, force: Float1D, way: Float1D, period: float, cells: int) -> float:
    """Returns the mean squared difference between the force (n,) and its mean over all repeats at the same
    place and in the same direction."""
    places, squares, freedom = max(round(cells * period), 1), 0.0, 0
    for stroke in (way > 0.0, way < 0.0):
        if stroke.any():
            at = np.mod(box[stroke] / period, 1.0)
            curve = _curve(at, force[stroke], places)
            mean = np.interp(places * at, np.arange(places) + 0.5, curve, period=places)
            squares += float(np.sum((force[stroke] - mean) ** 2))
            freedom += len(at) - len(np.unique((places * at).astype(np.intp)))
    return squares / max(freedom, 1)


def _fitted(
    box: Float1D, force: Float1D, way: Float1D, period: float, orders: NDArray[np.intp], cells: int
) -> tuple[float, Float1D]:
    """Returns the period [travel] with which harmonics fit the force best, a sum for each direction, and the
    weight of each row (n,), 0 to 1.

    Gauss-Newton steps of the period, with the amplitudes eliminated (Golub & Pereyra 1973, in Kaufman's
    form). Each step adds an order, because a higher one needs a more precise period. Tukey's biweight leaves
    out the rows behind turns, in which friction reverses, and wrong readings.
    """
    resolved = [
        each for each in dict.fromkeys(orders.tolist()) if each <= max(0.5 * cells * period, orders[0])
    ]
    box, tiny = box - box.mean(), float(np.finfo(float).tiny)
    weight = np.ones(len(force))
    residual, slope = np.zeros(len(force)), np.zeros(len(force))
    for step in range(2 * HARMONICS):  # all orders of a wave and of its repeat
        order = np.array(resolved[: step + 1])
        waves = np.exp(2j * np.pi * box / period)[:, None] ** order
        for stroke in (way > 0.0, way < 0.0):
            cosine, sine, w = waves[stroke].real, waves[stroke].imag, weight[stroke, None]
            columns = np.column_stack([np.ones(len(cosine)), cosine, sine])
            found = np.linalg.lstsq(w * columns, weight[stroke] * force[stroke], rcond=None)[0]
            of_cosine, of_sine = order * found[1:].reshape(2, -1)
            turned = 2.0 * np.pi * box[stroke] / period**2 * (sine @ of_cosine - cosine @ of_sine)
            explained = columns @ np.linalg.lstsq(w * columns, weight[stroke] * turned, rcond=None)[0]
            residual[stroke], slope[stroke] = force[stroke] - columns @ found, turned - explained
        change = float(weight**2 * slope @ residual) / max(float(weight**2 * slope @ slope), tiny)
        # A tenth of a wave over the travel, so that the fit stays at its minimum.
        bound = 0.1 * period**2 / order[0]
        period += float(np.clip(change, -bound, bound))
        scale = max(BIWEIGHT * standard_deviation(residual), tiny)
        weight = np.maximum(1.0 - (residual / scale) ** 2, 0.0)
    return period, weight


def _curve(box: Float1D, force: Float1D, cells: int) -> Float1D:
    """Returns the force at the centre of each cell, between the mean positions and forces of the rows in
    cells."""
    cell = np.minimum((box * cells).astype(np.intp), cells - 1)
    count = np.bincount(cell, minlength=cells)
    known = np.flatnonzero(count)
    at, mean = (
        np.bincount(cell, each, minlength=cells)[known] / count[known] for each in (box * cells, force)
    )
    return np.asarray(np.interp(np.arange(cells) + 0.5, at, mean))


def _repeat(curve: Float1D) -> tuple[float, int] | None:
    """Returns the length of the strongest wave of a curve (n,) [n], and the number of these waves after which
    the curve is most similar to itself; None without a repeat."""
    n = len(curve)
    centred = curve - curve.mean()
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    squares = np.concatenate([[0.0], np.cumsum(centred**2)])
    lag = np.arange(n // 2 + 2)
    both = np.sqrt(squares[n - lag] * (squares[n] - squares[lag]))
    products = np.fft.irfft(power)[: len(lag)]
    correlation = np.divide(products, both, out=np.zeros(len(lag)), where=both > 0.0)
    inner, apart = correlation[1:-1], np.flatnonzero(correlation < 0.0)
    peaks = 1 + np.flatnonzero((inner >= correlation[:-2]) & (inner > correlation[2:]))
    # A smooth force is similar to itself at short distances; a repeat follows a distance at which it is not.
    peaks = peaks[peaks >= (apart[0] if len(apart) else n)]
    if not len(peaks) or correlation[peaks].max() < LEAST_GAIN:
        return None
    # The spectrum has a value for every half wave over the curve, which must hold at least two waves.
    waves = 2.0 + 0.5 * int(np.argmax(power[4:]))
    return 1.0 / waves, max(round(peaks[np.argmax(correlation[peaks])] / n * waves), 1)
