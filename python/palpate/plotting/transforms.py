# SPDX-License-Identifier: Apache-2.0
"""Transforms of a force history (paper section 2): power spectrum, short-time transform, wavelet transform.

All transforms need samples at even distances. With time the history is the force over time. Without time it
is the force over the position of the longest press stroke, or over the row number if the rows have no order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import scipy

from .._typing import Float1D, Float2D
from ..errors import InputError
from ..recording import Recording
from ..recording.conversion import MIN_ROWS
from ..recording.motion import GAP_RATIO, LARGEST_STEP_DEVIATION, directions_of
from ..recording.units import Unit

MOST_SAMPLES = 2**20
"""Largest number of samples of a history; a longer recording gets a longer step."""

MOST_SHORT_TIME_SAMPLES, MOST_WAVELET_SAMPLES = 2**20, 2**16
"""Largest numbers of samples of the two transforms; a longer history is low-passed and decimated."""

MOST_SEGMENT_SAMPLES = 8192
"""Largest number of samples of a segment of the power spectrum; the spectra of all segments are averaged."""

WINDOWS = 16
"""Length of a history divided by the usual window of the short-time transform [-]."""

LEAST_WINDOW_SAMPLES, MOST_WINDOW_SAMPLES = 16, 1024
"""Least and largest usual number of samples in a window of the short-time transform."""

WAVELETS_PER_OCTAVE = 8
"""Number of dilations per octave of the wavelet transform [-]"""

FEWEST_OSCILLATIONS = 2.0
"""Number of oscillations in the history at the lowest frequency of the wavelet transform [-]"""

PEAK = np.sqrt(2.0)
"""Angular frequency at which the Fourier transform of the Mexican hat is largest [rad/dilated unit]"""

_UNIT = {"time": "s", "row": "row"}
"""Unit of the axis of a history; the position has that of the recording."""


@dataclass(frozen=True)
class History:
    """Force at even distances along an axis: time, position of one press stroke, or row number."""

    axis: Literal["time", "position", "row"]
    unit: str
    """Unit of the axis: s, that of the position, or row"""
    at: Float1D
    """(n,) places on the axis [unit]"""
    force: Float1D
    """(n,) force [N*m, N or A]"""
    step: float
    """Distance of two samples [unit]"""
    gaps: tuple[tuple[float, float], ...] = ()
    """Start and end of each interval without rows, in which the force is interpolated [unit]"""
    notes: tuple[str, ...] = ()
    """Sentences about the choice of the axis and interpolated samples"""
    file_units: Mapping[str, Unit] = field(default_factory=dict)
    """Units of "position" and "force" in the file; a missing one is chosen by the values"""


@dataclass(frozen=True)
class Plane:
    """Amplitude over an axis and over frequency."""

    at: Float1D
    """(n,) places on the axis of the history [unit]"""
    frequency: Float1D
    """(k,) frequencies, increasing [1/unit]; the first one of a short-time transform is 0"""
    value: Float2D
    """(k, n) amplitude of a sine with this frequency that gives the same value [force]"""
    window: float | None = None
    """Length of the window of a short-time transform [unit]"""


def history_of(recording: Recording) -> History:
    """Returns the force of a recording at even distances in time, else in position, else in rows.

    Raises
    ------
    InputError
        The recording has too few rows.
    """
    return replace(_history(recording), file_units=recording.file_units)


def _history(recording: Recording) -> History:
    if len(recording) < MIN_ROWS:
        raise InputError(f"the recording has {len(recording)} rows; its transforms need at least {MIN_ROWS}")
    if recording.time is not None:
        return _over_time(recording.time, recording.force)
    direction = directions_of(recording)
    rows = None if direction is None else _longest_press(recording.position, direction > 0)
    missing = "the recording has no time, so no frequency is known in Hz; spectrum and transforms are over "
    if rows is None:
        note = f"{missing}the row number"
        return History(
            "row",
            _UNIT["row"],
            np.arange(len(recording), dtype=np.float64),
            recording.force,
            1.0,
            (),
            (note,),
        )
    position, force = recording.position[rows], recording.force[rows]
    at, place, counts = np.unique(position, return_inverse=True, return_counts=True)
    mean = np.bincount(place, weights=force) / counts
    grid = np.linspace(at[0], at[-1], len(at))
    note = f"{missing}the position of the longest press stroke (rows {rows.start} to {rows.stop - 1})"
    return History(
        "position",
        recording.units["position"],
        grid,
        np.interp(grid, at, mean),
        float(grid[1] - grid[0]),
        (),
        (note,),
    )


def _over_time(time: Float1D, force: Float1D) -> History:
    steps = np.diff(time)
    step, duration = float(np.median(steps)), float(time[-1] - time[0])
    wide = np.flatnonzero(steps > GAP_RATIO * step)
    gaps = tuple((float(time[k]), float(time[k + 1])) for k in wide)
    if np.all(np.abs(steps - step) <= LARGEST_STEP_DEVIATION * step):
        return History("time", _UNIT["time"], time, force, duration / (len(time) - 1))
    usual = float(steps[steps <= GAP_RATIO * step].max())
    notes = [
        f"the time steps are uneven, from {steps.min():.3g} s to {steps.max():.3g} s: the force is "
        f"interpolated to steps of {step:.3g} s, and above {0.5 / usual:.3g} Hz it can be wrong"
    ]
    if gaps:
        notes.append(
            f"{len(gaps)} gap{'s' * (len(gaps) > 1)} in time, grey in the figure: no force is known there"
        )
    if duration / step > MOST_SAMPLES:
        step = duration / MOST_SAMPLES
        notes.append(f"the recording is long: its history has steps of {step:.3g} s")
    grid = time[0] + step * np.arange(int(duration / step + 1e-9) + 1)
    return History("time", _UNIT["time"], grid, np.interp(grid, time, force), step, gaps, tuple(notes))


def _longest_press(position: Float1D, press: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> slice | None:
    """Returns the rows of the press stroke with the largest travel, or None without a stroke of MIN_ROWS
    positions."""
    edges = np.flatnonzero(np.diff(press, prepend=False, append=False)).reshape(-1, 2)
    strokes = [slice(int(start), int(stop)) for start, stop in edges]
    enough = [rows for rows in strokes if len(np.unique(position[rows])) >= MIN_ROWS]
    return max(enough, key=lambda rows: float(np.ptp(position[rows])), default=None)


def power_spectrum(history: History) -> tuple[Float1D, Float1D]:
    """Returns frequencies (k,) [1/unit] and power (k,) [force^2]; a sine of amplitude a has the power a^2/2.

    Welch's method with a Hann window; the mean force is subtracted.
    """
    segment = min(len(history.force), MOST_SEGMENT_SAMPLES)
    frequency, power = scipy.signal.welch(
        history.force, fs=1.0 / history.step, window="hann", nperseg=segment, scaling="spectrum"
    )
    return np.asarray(frequency), np.asarray(power)


def short_time_transform(history: History) -> Plane:
    """Returns the short-time Fourier transform with a Hann window of constant length.

    The mean force is subtracted. At both ends the force is mirrored.
    """
    force, step = _decimated(history, MOST_SHORT_TIME_SAMPLES)
    n = len(force)
    m = min(n, int(np.clip(n // WINDOWS, LEAST_WINDOW_SAMPLES, MOST_WINDOW_SAMPLES)))
    transform = scipy.signal.ShortTimeFFT(
        scipy.signal.windows.hann(m, sym=False),
        hop=max(1, m // 8, n // 2000),
        fs=1.0 / step,
        mfft=4 * m,
        fft_mode="onesided2X",
        scale_to="magnitude",
    )
    value = np.abs(transform.stft(force, padding="even"))
    at = history.at[0] + transform.t(n)
    inside = (at >= history.at[0]) & (at <= history.at[-1])
    return Plane(at[inside], np.asarray(transform.f), value[:, inside], m * step)


def wavelet_transform(history: History) -> Plane:
    """Returns the continuous wavelet transform with the Mexican hat, widest wavelets first (paper eq. 1).

    The value is w(s, b) = c/s * integral of f(x) psi((x - b)/s) dx. The factor c makes the largest |w| of a
    sine equal to its amplitude, at the frequency 2^(1/2)/(2 pi s). The mean force is subtracted. At both ends
    the force is mirrored, so values within 1/(pi frequency) of an end are uncertain.

    Raises
    ------
    InputError
        PyWavelets is not installed.
    """
    try:
        import pywt
    except ImportError:
        raise InputError(
            "the wavelet transform needs PyWavelets; install it with pip install 'palpate[analysis]'"
        ) from None
    force, step = _decimated(history, MOST_WAVELET_SAMPLES)
    n = len(force)
    widest = max(1.0, PEAK / (2.0 * np.pi) * n / FEWEST_OSCILLATIONS)
    scales = 2.0 ** (np.arange(int(WAVELETS_PER_OCTAVE * np.log2(widest)) + 1) / WAVELETS_PER_OCTAVE)[::-1]
    mirrored = min(n - 1, int(4.0 * widest) + 1)
    wide, _ = pywt.cwt(np.pad(force, mirrored, mode="reflect"), scales, "mexh", method="fft")
    # The largest value of the Fourier transform of psi; pywt multiplies by s^(-1/2) in place of 1/s.
    peak = 2.0 / np.sqrt(3.0) * np.pi**-0.25 * np.sqrt(2.0 * np.pi) * PEAK**2 * np.exp(-0.5 * PEAK**2)
    value = wide[:, mirrored : mirrored + n] / (peak * np.sqrt(scales))[:, None]
    return Plane(history.at[0] + step * np.arange(n), PEAK / (2.0 * np.pi * scales * step), value)


def _decimated(history: History, most: int) -> tuple[Float1D, float]:
    """Returns the force minus its mean at at most `most` samples, and their distance."""
    every = -(-len(history.force) // most)
    force = history.force - history.force.mean()
    if every > 1:
        force = scipy.signal.resample_poly(force, 1, every, padtype="line")
    return force, every * history.step
