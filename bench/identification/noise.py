# SPDX-License-Identifier: Apache-2.0
"""Counts how often noise on a straight line is taken for structure: a wavelet, hysteresis, mass or damping.

python bench/identification/noise.py [--draws 100] [--json FILE]

Each draw has its own number of rows (500 to 5000), motion and noise (0.1 to 10 % of the range of the force).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import count, write_results

from palpate import Model, Recording, identify

Array = NDArray[np.float64]

DRAWS = 100
"""Number of draws of each case."""

HELD_ROWS = 5
"""Number of rows for which a row is repeated, or a force is held."""

CORRELATION = 0.9
"""Correlation of neighbouring rows of autoregressive noise of first order."""

FORCE_LEVELS = 256
"""Number of levels of the coarse force: 8 bits over its range."""


def line(x: Array) -> Array:
    return 3.0 * x + 0.1


def drawn(draw: int) -> tuple[np.random.Generator, Array, float]:
    """Returns the random numbers, the positions (n,) and the standard deviation of the noise of a draw."""
    random = np.random.default_rng([19, draw])
    n = HELD_ROWS * round(10.0 ** random.uniform(2.0, 3.0))
    cycles = random.uniform(4.0, 20.0)
    x = 0.3 - 0.3 * np.cos(2.0 * np.pi * cycles * np.cumsum(random.uniform(0.5, 1.5, n)) / n)
    return random, np.round(x / 1e-4) * 1e-4, 10.0 ** random.uniform(-3.0, -1.0) * 1.8


def recorded(x: Array, force: Array, *, time: bool = True) -> Recording:
    return Recording.from_arrays(x, force, time=1e-3 * np.arange(len(x)) if time else None)


def white(draw: int) -> Recording:
    random, x, noise = drawn(draw)
    return recorded(x, line(x) + random.normal(0.0, noise, len(x)))


def autoregressive(draw: int) -> Recording:
    random, x, noise = drawn(draw)
    white_noise = random.normal(0.0, noise * np.sqrt(1.0 - CORRELATION**2), len(x) + 100)
    return recorded(x, line(x) + lfilter([1.0], [1.0, -CORRELATION], white_noise)[100:])


def repeated_rows(draw: int) -> Recording:
    random, x, noise = drawn(draw)
    x = x[::HELD_ROWS]
    force = line(x) + random.normal(0.0, noise, len(x))
    return recorded(np.repeat(x, HELD_ROWS), np.repeat(force, HELD_ROWS))


def held_force(draw: int) -> Recording:
    random, x, noise = drawn(draw)
    force = line(x) + random.normal(0.0, noise, len(x))
    return recorded(x, np.repeat(force[::HELD_ROWS], HELD_ROWS))


def coarse_force(draw: int) -> Recording:
    random, x, noise = drawn(draw)
    force = line(x) + random.normal(0.0, noise, len(x))
    step = 1.8 / FORCE_LEVELS
    return recorded(x, np.round(force / step) * step, time=False)


def larger_noise_where_stiff(draw: int) -> Recording:
    random, x, noise = drawn(draw)
    return recorded(x, line(x) + random.normal(0.0, 1.0, len(x)) * noise * (0.05 + 1.9 * x / 0.6))


CASES: dict[str, Callable[[int], Recording]] = {
    "white noise": white,
    f"correlated noise, AR(1) with {CORRELATION:g}": autoregressive,
    f"each row {HELD_ROWS} times": repeated_rows,
    f"force held for {HELD_ROWS} rows": held_force,
    "8-bit force, no time": coarse_force,
    "noise that grows with position": larger_noise_where_stiff,
}
"""Name of a case -> function that simulates the recording of a draw."""


def identified(case: str, draw: int) -> tuple[bool, bool, bool]:
    """Returns True for a model without wavelets, without hysteresis, and without mass, damping and
    velocity."""
    model: Model = identify(CASES[case](draw))
    moving = model.damping is not None or model.mass is not None or "velocity" in model.inputs
    return model.n_wavelets == 0, not model.hysteretic, not moving


def measure(case: str, draws: int, jobs: int = -1) -> dict[str, object]:
    """Returns the counts of one case over draws."""
    found = np.array(Parallel(n_jobs=jobs)(delayed(identified)(case, draw) for draw in range(draws)))
    wavelets, hysteresis, velocity = (int(each) for each in found.sum(axis=0))
    wrong = [int(draw) for draw in np.flatnonzero(~found.all(axis=1))]
    return {
        "case": case,
        "draws": draws,
        "no_wavelet": wavelets,
        "no_hysteresis": hysteresis,
        "no_velocity": velocity,
        "wrong_draws": wrong,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(DRAWS))
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    print(
        f"{'straight line with':36}{'draws':>6}{'0 wavelets':>11}{'no hyst.':>9}{'no velocity':>12}",
        flush=True,
    )
    results = []
    for case in CASES:
        row = measure(case, options.draws)
        numbers = [row[key] for key in ("draws", "no_wavelet", "no_hysteresis", "no_velocity")]
        print(f"{case:36}" + "".join(f"{each:14}" for each in numbers) + f"  wrong in {row['wrong_draws']}")
        results.append(row)
    write_results(options.json, results)


if __name__ == "__main__":
    main()
