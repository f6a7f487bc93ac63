# SPDX-License-Identifier: Apache-2.0
"""Hum of the mains in the force: lines at multiples of 50 and 60 Hz, which are noise and not the object.

A hum is a function of time, but one press and release show it as a ripple over position. Its frequency
distinguishes it from the object.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .._typing import Float1D, Float2D
from .checks.wrong_readings import repeated_rows

if TYPE_CHECKING:
    from .recording import Recording

MAINS_HZ = 50.0, 60.0
"""Frequencies of mains [Hz]."""

MAINS_TOLERANCE = 0.004
"""Deviation of the frequency of mains and of the clock of a recorder together [share of the frequency]."""

HUM_RATIO = 4.0
"""Power of a line above which it is a hum [largest power of the frequencies nearby, which the object and the
noise have]."""


@np.errstate(over="ignore", invalid="ignore")  # huge values, refused later, may overflow
def without_hum(recording: Recording) -> tuple[Recording, list[str]]:
    """Returns a recording with the hum subtracted from its force, and a note on each line of it.

    The second difference of the force over time is compared, in which the motion has as much power at low
    frequencies as at high ones; a Hann window keeps each line apart from the others. A line must be higher
    than all others within a quarter of the frequency of the mains: the lines of an object that is pressed
    periodically are as high as their neighbours. If the position has the line as well, the tool moves, and
    the force is that of the object. Recordings without time, or with more pauses than rows, are returned as
    they are.
    """
    measured = recording.without(repeated_rows(recording))
    rows, step = measured.time, measured.sample_period
    if recording.time is None or rows is None or step is None or not np.ptp(rows) < 2.0 * step * len(rows):
        return recording, []
    time = np.arange(rows[0], rows[-1], step)
    if len(time) < 3:
        return recording, []
    taper = np.hanning(len(time))[1:-1]

    def bent(values: Float1D) -> Float1D:
        return taper * np.diff(np.interp(time, rows, values), 2)

    power, of_position = (
        np.abs(np.fft.rfft(bent(each))) ** 2 for each in (measured.force, measured.position)
    )
    frequency, around = np.fft.rfftfreq(len(taper), step), MAINS_HZ[0] / 4.0
    force, notes = recording.force, []
    for hertz in sorted(
        {each for mains in MAINS_HZ for each in np.arange(mains, 0.5 / step - around, mains)}
    ):
        distance, width = np.abs(frequency - hertz), 2.0 * frequency[1]
        lines = np.flatnonzero(distance <= MAINS_TOLERANCE * hertz + width / 2.0)
        nearby = (distance > MAINS_TOLERANCE * hertz + width) & (distance < around)
        if np.count_nonzero(nearby) <= len(lines) + 2:
            continue
        hums, moves = (each[lines].max() > HUM_RATIO * each[nearby].max() for each in (power, of_position))
        if moves or not hums:
            continue
        top = lines[np.argmax(power[lines])]
        left, middle, right = np.log(power[top - 1 : top + 2])
        hertz = frequency[1] * (top + 0.5 * (left - right) / (left - 2.0 * middle + right))
        seen = np.stack([bent(each) for each in _waves(hertz, rows)], axis=1)
        heights = np.linalg.lstsq(seen, bent(measured.force))[0]
        force = force - heights @ _waves(hertz, recording.time)
        size = recording.file_unit("force").text(float(np.hypot(*heights)))
        notes.append(
            f"A hum of {hertz:.4g} Hz with an amplitude of {size} was subtracted from the force: it comes "
            "from the mains; ground the sensor, and shield its cable."
        )
    return (replace(recording, force=force) if notes else recording), notes


def _waves(hertz: float, time: Float1D) -> Float2D:
    """Returns cosine and sine (2, n) of a line at each time (n,)."""
    phase = 2.0 * np.pi * hertz * time
    return np.stack([np.cos(phase), np.sin(phase)])
