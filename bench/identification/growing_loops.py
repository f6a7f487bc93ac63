# SPDX-License-Identifier: Apache-2.0
"""Identifies objects whose loops grow with the distance moved: Masing, Bouc-Wen, and Bouc-Wen with pinching.

python bench/identification/growing_loops.py [--draws 12] [--json FILE]

A tester moves the object over cycles of growing amplitude, as in a test of a damper or of a joint. Each draw
has random parameters and noise of 1 % of the spread of the force. Errors are also those of a further motion
with other amplitudes, without noise.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import count, markdown_table, write_results

import palpate
from palpate import Recording
from palpate._core.model import play

Array = NDArray[np.float64]

NOISE = 0.01
"""Standard deviation of the force noise divided by that of the force"""

ROWS_PER_TRAVEL = 250.0
"""Rows of a motion over the largest amplitude"""

SUBSTEPS = 8
"""Steps of the integration of the Bouc-Wen equation between two rows"""


def motion(amplitudes: Array) -> Array:
    """Returns positions (n,) of cycles between -a and a for each amplitude a, at constant speed."""
    turns = [0.0]
    for amplitude in amplitudes:
        turns += [amplitude, -amplitude]
    turns.append(0.0)
    at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)))])
    moved = np.arange(0.0, at[-1], 1.0 / ROWS_PER_TRAVEL)
    return np.asarray(np.interp(moved, at, turns))


def masing(random: Generator) -> Callable[[Array], Array]:
    """Returns a spring in parallel with ten sliders, whose slip forces follow a random curve."""
    slips = np.geomspace(0.02, 0.7, 10)
    stiffness = random.dirichlet(np.ones(len(slips))) / slips
    slope, bow = random.uniform(0.1, 0.5), random.uniform(0.0, 0.3)

    def force(x: Array) -> Array:
        slipping = sum(k * (x - play(x, slip, start=0.0)) for k, slip in zip(stiffness, slips, strict=True))
        return np.asarray(slope * x + bow * x**3 + slipping)

    return force


def bouc_wen(random: Generator) -> Callable[[Array], Array]:
    """Returns f = a x + (1 - a) z, dz = (1 - |z / Y|^n (1/2 sgn(z dx) + 1/2)) dx, with the yield displacement
    Y (Bouc 1967, Wen 1976)."""
    share, most, power = random.uniform(0.05, 0.3), random.uniform(0.1, 0.4), random.uniform(1.0, 4.0)
    return lambda x: share * x + (1.0 - share) * _internal(x, most, power)


def _internal(x: Array, most: float, power: float) -> Array:
    z = np.zeros(len(x))
    for row in range(1, len(x)):
        value, step = z[row - 1], (x[row] - x[row - 1]) / SUBSTEPS
        for _ in range(SUBSTEPS):
            value += step * (1.0 - abs(value / most) ** power * (0.5 + 0.5 * np.sign(value * step)))
        z[row] = value
    return z


def pinched(random: Generator) -> Callable[[Array], Array]:
    """Returns a Bouc-Wen object whose loop narrows at its middle, more so after larger amplitudes (Baber and
    Noori 1985)."""
    whole, width, depth = bouc_wen(random), random.uniform(0.1, 0.25), random.uniform(0.5, 0.9)

    def force(x: Array) -> Array:
        most = np.maximum.accumulate(np.abs(x))
        narrow = 1.0 - depth * np.exp(-((x / (width * np.maximum(most, 1e-9))) ** 2))
        return narrow * whole(x)

    return force


OBJECTS = {"Masing": masing, "Bouc-Wen": bouc_wen, "Bouc-Wen, pinched": pinched}


def measured(kind: str, draw: int) -> dict[str, Any]:
    """Identifies one object and returns the errors of the model on a further motion."""
    random = np.random.default_rng([37, draw])
    force = OBJECTS[kind](random)
    x = motion(np.linspace(0.15, 1.0, int(random.integers(4, 8))))
    exact = force(x)
    noisy = exact + NOISE * exact.std() * random.standard_normal(len(x))
    start = time.process_time()
    model = palpate.identify(Recording.from_arrays(1e-3 * x, noisy))
    seconds = time.process_time() - start
    other = motion(random.uniform(0.1, 1.0, 6))
    fresh = Recording.from_arrays(1e-3 * other, force(other))
    found = palpate.verify(model, fresh)
    return {
        "kind": kind,
        "draw": draw,
        "class": model.fit.model_class,
        "branches": 0 if model.memory is None else len(model.memory.stiffness),
        "parameters": model.n_parameters,
        "nrmse": model.fit.nrmse,
        "fresh": found.nrmse,
        "verdict": model.verdict.level,
        "reason": next(iter(model.verdict.reasons), ""),
        "seconds": seconds,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(12))
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    rows = [measured(kind, draw) for kind in OBJECTS for draw in range(options.draws)]
    lines = []
    for kind in OBJECTS:
        own = [row for row in rows if row["kind"] == kind]
        spread = [
            "{:.3g} ({:.3g} to {:.3g})".format(*np.percentile([row[key] for row in own], [50, 0, 100]))
            for key in ("nrmse", "fresh", "branches", "parameters", "seconds")
        ]
        good = sum(row["verdict"] == "good" for row in own)
        lines.append((kind, *spread, f"{good} of {len(own)}"))
    print(
        markdown_table(
            (
                "object",
                "NRMSE",
                "NRMSE on a further motion",
                "branches",
                "parameters",
                "CPU [s]",
                "called good",
            ),
            lines,
        )
    )
    write_results(options.json, rows)


if __name__ == "__main__":
    main()
