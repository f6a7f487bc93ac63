# SPDX-License-Identifier: Apache-2.0
"""Period of a force that repeats over position, as of a knob with detents, from its autocorrelation and a fit
of harmonics; or one revolution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._typing import Float1D
from ...recording import Recording
from ...recording.motion import directions_of

LEAST_CORRELATION = 0.5
"""Correlation of the force with itself, one period apart, from which a periodic model is tried [-]."""

REVOLUTION = 2.0 * np.pi
"""Period of every force over the angle of a shaft that turns without end [rad]."""

SAME_STEP = 1e-3
"""Share of a step by which rounding in a file may change it [-]."""

SAME_PEAK = 0.95
"""Share of the largest correlation from which the correlation at a shorter distance is that of the period
[-]: the force repeats after two periods as well."""

HARMONICS = 6
"""Number of harmonics of the fit that refines a period; with 4 or 12 the period has the same error."""

FIT_STEPS = 8
"""Number of steps of the fit that refines a period: enough from an error of a tenth of a period."""

BIWEIGHT = 4.685
"""Residual without weight [standard deviations]: 95 % efficiency for normal noise (Holland & Welsch 1977)."""


def period_of(recordings: Sequence[Recording]) -> float | None:
    """Returns the distance after which the force repeats [position]; None without at least two repeats.

    The strokes of one direction are compared, because hysteresis has the same sign in them.
    """
    position, force, way = _strokes(recordings)
    press = way > 0.0
    if not press.any():
        return None
    least, travel, cells = position[press].min(), float(np.ptp(position[press])), int(press.sum()) // 2
    if not travel > 0.0:
        return None
    box, share = (position - least) / travel, force / (float(np.abs(force).max()) or 1.0)
    peak = _first_peak(_autocorrelation(_curve(box[press], share[press], cells)))
    return None if peak is None else travel * _fitted(box, share, way, peak / cells)


def revolution_of(recordings: Sequence[Recording]) -> float | None:
    """Returns 2 pi if the angle of the press strokes closes a revolution, else None.

    Then neither the gap between two angles nor the step of the force is larger where the revolution closes
    than somewhere along the strokes. The force of a torsion spring jumps there.
    """
    position, force, way = _strokes(recordings)
    position, force = position[way > 0.0], force[way > 0.0]
    if not len(position) or any(each.units["position"] != "rad" for each in recordings):
        return None

    def largest_steps(angle: Float1D, *end: float) -> tuple[float, float]:
        order = np.argsort(angle, kind="stable")
        gap = np.diff(angle[order], append=[angle[order[0]] + each for each in end])
        step = np.diff(force[order], append=[force[order[0]] for _ in end])
        return float(gap.max(initial=0.0)), float(np.abs(step).max(initial=0.0))

    along, around = largest_steps(position), largest_steps(np.mod(position, REVOLUTION), REVOLUTION)
    closed = around[0] <= (1.0 + SAME_STEP) * along[0] and around[1] <= (1.0 + SAME_STEP) * along[1]
    return REVOLUTION if closed else None


def _strokes(recordings: Sequence[Recording]) -> tuple[Float1D, Float1D, Float1D]:
    """Returns positions, forces and directions of the rows of recordings in which the tool moves; empty if
    the direction is not known or the force has further inputs."""
    ways = [directions_of(each) for each in recordings]
    if any(way is None or len(each.input_names) for way, each in zip(ways, recordings, strict=True)):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    way = np.concatenate([way for way in ways if way is not None])
    position, force = (
        np.concatenate([getattr(each, name) for each in recordings])[way != 0.0]
        for name in ("position", "force")
    )
    return position, force, way[way != 0.0]


def _fitted(box: Float1D, force: Float1D, way: Float1D, period: float) -> float:
    """Returns the period [travel] with which harmonics fit the force best, a sum for each direction.

    Gauss-Newton steps of the period, with the amplitudes eliminated (Golub & Pereyra 1973, in Kaufman's
    form). Tukey's biweight leaves out the rows behind turns, in which friction reverses, and wrong readings.
    """
    box, tiny = box - box.mean(), float(np.finfo(float).tiny)
    order, weight = np.arange(1, HARMONICS + 1), np.ones(len(force))
    residual, slope = np.zeros(len(force)), np.zeros(len(force))
    for _ in range(FIT_STEPS):
        waves = np.exp(2j * np.pi * box / period)[:, None] ** order
        for stroke in (way > 0.0, way < 0.0):
            cosine, sine, w = waves[stroke].real, waves[stroke].imag, weight[stroke, None]
            columns = np.column_stack([np.ones(len(cosine)), cosine, sine])
            found = np.linalg.lstsq(w * columns, weight[stroke] * force[stroke], rcond=None)[0]
            of_cosine, of_sine = order * found[1:].reshape(2, -1)
            turned = 2.0 * np.pi * box[stroke] / period**2 * (sine @ of_cosine - cosine @ of_sine)
            explained = columns @ np.linalg.lstsq(w * columns, weight[stroke] * turned, rcond=None)[0]
            residual[stroke], slope[stroke] = force[stroke] - columns @ found, turned - explained
        step = float(weight**2 * slope @ residual) / max(float(weight**2 * slope @ slope), tiny)
        # A tenth of a period over the travel, so that the fit stays at its minimum.
        period += float(np.clip(step, -0.1 * period**2, 0.1 * period**2))
        scale = max(BIWEIGHT * 1.4826 * float(np.median(np.abs(residual))), tiny)
        weight = np.maximum(1.0 - (residual / scale) ** 2, 0.0)
    return period


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


def _autocorrelation(curve: Float1D) -> Float1D:
    """Returns the correlation of a curve (n,) with itself at distances of 0 to n/2 - 1 cells, from the cells
    that both have."""
    n = len(curve)
    centred = curve - curve.mean()
    spectrum = np.fft.rfft(centred, 2 * n)
    products = np.fft.irfft(spectrum * spectrum.conj())[: n // 2]
    squares = np.concatenate([[0.0], np.cumsum(centred**2)])
    lag = np.arange(n // 2)
    both = np.sqrt(squares[n - lag] * (squares[n] - squares[lag]))
    return np.asarray(np.divide(products, both, out=np.zeros(n // 2), where=both > 0.0))


def _first_peak(correlation: Float1D) -> float | None:
    """Returns the distance of the first repeat, refined by the last one [cells]; None without a repeat."""
    inner, apart = correlation[1:-1], np.flatnonzero(correlation < 0.0)
    peaks = 1 + np.flatnonzero((inner >= correlation[:-2]) & (inner > correlation[2:]))
    # A smooth force is similar to itself at short distances; a repeat follows a distance at which it is not.
    peaks = peaks[peaks >= (apart[0] if len(apart) else len(correlation))]
    if not len(peaks) or correlation[peaks].max() < LEAST_CORRELATION:
        return None
    first = float(peaks[correlation[peaks] >= SAME_PEAK * correlation[peaks].max()][0])
    for repeat in range(1, int((len(correlation) - 1) / first) + 1):
        around = np.arange(int(repeat * first - 0.25 * first), int(repeat * first + 0.25 * first) + 1)
        around = around[(around > 0) & (around < len(correlation) - 1)]
        if not len(around):
            break
        first = int(around[np.argmax(correlation[around])]) / repeat
    return first
