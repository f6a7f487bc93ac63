# SPDX-License-Identifier: Apache-2.0
"""Compares the estimated lag of the force with the true lag of simulated recordings, and of measured domes.

python bench/identification/force_lag.py [--draws 200] [--json FILE]

Each draw has one object, one of three noise levels and a lag of 0 to 60 ms. The noise of every second draw is
autoregressive with a correlation of 0.9 of neighbouring rows. A hand moves most objects. A test machine
presses at one speed, so that only the turns of the motion count.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import count, measured_data, write_results

from palpate import Recording, _core, read_recording
from palpate.recording.lag import lag_of

Array = NDArray[np.float64]

DRAWS = 200
"""Number of simulated recordings."""

LONGEST_S = 0.06
"""Largest true lag [s]."""

NOISE_LEVELS = (0.001, 0.005, 0.02)
"""Standard deviation of the noise of the force [share of its range]."""

CORRELATION = 0.9
"""Correlation of neighbouring rows of the autoregressive noise."""

ENCODER_STEP = 5e-4
"""Step of the recorded position [share of the travel]."""

HAND_ROWS, HAND_PERIOD_S = 10_000, 1e-3
"""Rows and sample period of a recording of a hand [s]."""

MACHINE_ROWS, MACHINE_PERIOD_S, MACHINE_STROKES = 4000, 0.01, 8
"""Rows, sample period [s] and strokes of a recording of a test machine."""


def detents(x: Array) -> Array:
    return 0.3 * x + 0.1 * np.sin(12.0 * np.pi * x)


def switch(x: Array) -> Array:
    """Returns the force of a key switch: spring, click near 0.3, wall near 0.95."""
    click = 0.25 / (1.0 + np.exp((x - 0.3) / 0.01))
    return 0.3 * x + click * x / 0.3 + 0.05 * np.logaddexp(0.0, (x - 0.95) / 0.005)


def play(x: Array, radius: float) -> Array:
    """Returns the direction state of a motion."""
    return np.clip((x - _core.model.play(x, radius, start=float(x[0]))) / radius, -1.0, 1.0)


@dataclass(frozen=True)
class Case:
    """Simulated object and the motion of its recording."""

    force: Callable[[Array, Array], Array]
    """Force of position and velocity"""
    by_hand: bool = True


CASES: Mapping[str, Case] = {
    "spring with detents": Case(lambda x, v: detents(x)),
    "switch": Case(lambda x, v: switch(x)),
    "hysteretic, detents": Case(lambda x, v: detents(x) + (0.03 + 0.03 * x) * play(x, 0.01)),
    "viscous, detents": Case(lambda x, v: detents(x) + 0.02 * v),
    "Hunt-Crossley contact": Case(lambda x, v: x**1.5 * (1.0 + 0.1 * v)),
    "soft spring": Case(lambda x, v: x + x**3),
    "hysteretic switch, one speed": Case(lambda x, v: switch(x) + 0.03 * play(x, 0.01), by_hand=False),
}
"""Name of a simulated object -> its force and its motion."""


def hand(random: np.random.Generator, time: Array) -> Array:
    """Returns positions from 0 to 1 of a hand that moves to and fro at 0.2 to 2 Hz."""
    wander = np.sin(2.0 * np.pi * (0.31 * time[:, None] * [0.1, 0.23, 0.41] + random.uniform(0, 1, 3)))
    phase = 2.0 * np.pi * HAND_PERIOD_S * np.cumsum(0.2 * 10.0 ** ((1.0 + wander.mean(axis=1)) / 2.0))
    amplitude = 0.9 - 0.1 * np.sin(2.0 * np.pi * 0.11 * time + random.uniform(0.0, 2.0 * np.pi))
    return np.asarray(0.5 - 0.5 * amplitude * np.cos(phase + random.uniform(0.0, 2.0 * np.pi)))


def machine(random: np.random.Generator, time: Array) -> Array:
    """Returns positions from 0 to 1 of strokes at one speed."""
    place = MACHINE_STROKES * time / time[-1] + random.uniform(0.0, 0.5)
    return np.asarray(1.0 - np.abs(place % 2.0 - 1.0))


def simulated(draw: int) -> tuple[str, float, float, Recording]:
    """Returns object, noise level, true lag and recording of a draw."""
    random = np.random.default_rng([5, draw])
    name = list(CASES)[draw % len(CASES)]
    level = NOISE_LEVELS[draw // len(CASES) % len(NOISE_LEVELS)]
    rows, period = (HAND_ROWS, HAND_PERIOD_S) if CASES[name].by_hand else (MACHINE_ROWS, MACHINE_PERIOD_S)
    before = math.ceil(LONGEST_S / period)
    time: Array = period * np.arange(rows + before)
    x = (hand if CASES[name].by_hand else machine)(random, time)
    force = CASES[name].force(x, np.gradient(x, period))
    late = random.uniform(0.0, LONGEST_S)
    noise = random.normal(0.0, 1.0, len(x))
    if draw % 2:
        noise = lfilter([math.sqrt(1.0 - CORRELATION**2)], [1.0, -CORRELATION], noise)
    recorded = np.interp(time - late, time, force) + level * np.ptp(force) * noise
    x = np.round(x / ENCODER_STEP) * ENCODER_STEP
    return name, level, late, Recording.from_arrays(x[before:], recorded[before:], time=time[before:])


@dataclass(frozen=True)
class Estimate:
    """Lag of one recording [s]; the true lag is NaN for a measured recording."""

    name: str
    noise: float
    true_s: float
    late_s: float
    lower_s: float
    upper_s: float
    known: bool


def estimated(draw: int) -> Estimate:
    """Returns the estimate for the recording of one draw."""
    name, level, late, recording = simulated(draw)
    found = lag_of([recording])
    return Estimate(name, level, late, found.late_s, found.lower_s, found.upper_s, found.known)


def summary(estimates: Sequence[Estimate]) -> dict[str, float]:
    """Returns the numbers of known lags, their bias, RMS error and half width [ms], and the coverage."""
    known = [each for each in estimates if each.known]
    errors = 1e3 * np.array([each.late_s - each.true_s for each in known])
    half = [500.0 * (each.upper_s - each.lower_s) for each in known]
    inside = [each.lower_s <= each.true_s <= each.upper_s for each in known]
    return {
        "recordings": len(estimates),
        "known": len(known),
        "bias_ms": float(errors.mean()) if known else math.nan,
        "rms_error_ms": float(np.sqrt(np.mean(errors**2))) if known else math.nan,
        "half_width_ms": float(np.median(half)) if known else math.nan,
        "inside": int(np.sum(inside)),
    }


def domes() -> list[Estimate]:
    """Returns the estimates of all domes of one test machine with a time column, and last of all together."""
    if (data := measured_data()) is None:
        return []
    files = sorted((data / "rubber_domes").glob("*.csv"))[: count(100)]
    read = {file.stem: read_recording(file) for file in files}
    timed = {name: each for name, each in read.items() if each.time is not None}
    found = {name: lag_of([each]) for name, each in timed.items()}
    found[f"all {len(timed)} together"] = lag_of(list(timed.values()))
    return [
        Estimate(name, math.nan, math.nan, each.late_s, each.lower_s, each.upper_s, each.known)
        for name, each in found.items()
    ]


def printed(name: str, of: Mapping[str, float]) -> None:
    print(
        f"{name:36}{of['recordings']:6.0f}{of['known']:7.0f}{of['bias_ms']:9.3f}{of['rms_error_ms']:9.3f}"
        f"{of['half_width_ms']:9.3f}{of['inside']:5.0f} of {of['known']:.0f}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(DRAWS))
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    estimates: list[Estimate] = Parallel(n_jobs=-1)(delayed(estimated)(draw) for draw in range(options.draws))
    columns = ("draws", "known", "bias", "RMS", "half", "inside")
    print(f"{'lags in ms':36}" + "".join(f"{each:>8}" for each in columns))
    groups: dict[str, Any] = {}
    for name in CASES:
        groups[name] = summary([each for each in estimates if each.name == name])
    for level in NOISE_LEVELS:
        groups[f"noise {100 * level:g} %"] = summary([each for each in estimates if each.noise == level])
    groups["all"] = summary(estimates)
    for name, each in groups.items():
        printed(name, each)
    measured = domes()
    for each in measured:
        lower, late, upper = (1e3 * value for value in (each.lower_s, each.late_s, each.upper_s))
        print(
            f"{each.name:50}{late:7.1f} ms ({lower:.1f} to {upper:.1f}){'' if each.known else ' not known'}"
        )
    results = {
        "groups": [{"name": name, **each} for name, each in groups.items()],
        "draws": [asdict(each) for each in estimates],
        "domes": [asdict(each) for each in measured],
    }
    write_results(options.json, results)


if __name__ == "__main__":
    main()
