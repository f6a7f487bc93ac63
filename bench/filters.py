# SPDX-License-Identifier: Apache-2.0
"""The paper's filters against matched ones: the error of f from moving objects whose truth is known.

python bench/filters.py [--json FILE]

The paper's mode is told the true mass and damping, which it has to assume; the matched one finds them.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parent))

from moving import moved
from run import count, leave

from palpate import Model, SearchOptions, identify
from palpate.recording import sample_force
from palpate.recording.sample import LOWER, UPPER

MASS, DAMPING = 1e-3, 0.06
FASTEST_HZ = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Highest frequency of the hand; its lowest is a tenth of it."""

WAYS: dict[str, tuple[dict[str, float], dict[str, Any]]] = {
    "matched, mass": ({"mass": MASS}, {}),
    "paper (figure 11), mass": (
        {"mass": MASS},
        {"search": SearchOptions(filters="paper-implicit", assumed_mass=MASS)},
    ),
    "matched, mass and damping": ({"mass": MASS, "damping": DAMPING}, {}),
    "paper (figure 13), mass and damping": (
        {"mass": MASS, "damping": DAMPING},
        {"search": SearchOptions(filters="paper-explicit", assumed_mass=MASS, assumed_damping=DAMPING)},
    ),
}
"""What the object has beside its force, and how it is identified."""


def error(there: dict[str, float], options: dict[str, Any], fastest_hz: float, draw: int) -> float:
    """NRMSE of the identified f over the positions that were visited."""
    recording = moved(draw, seconds=20.0, slowest_hz=fastest_hz / 10.0, fastest_hz=fastest_hz, **there)
    model = identify(recording, **options)
    margin = 0.01 * (UPPER - LOWER)
    x = np.linspace(LOWER + margin, UPPER - margin, 2001)
    truth = sample_force(x)
    return float(np.sqrt(np.mean((mean_force(model, x) - truth) ** 2)) / np.std(truth))


def mean_force(model: Model, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """f, between press and release where a model tells them apart (and is wrong to do so here)."""
    if not model.hysteretic:
        return np.asarray(model.force(x))
    strokes = [np.asarray(model.force(x, direction=np.full(len(x), side))) for side in (1.0, -1.0)]
    return 0.5 * (strokes[0] + strokes[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(3))
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    speeds = FASTEST_HZ[-count(len(FASTEST_HZ)) :]
    print(f"{'nrmse of f, the hand up to [Hz]':38}" + "".join(f"{hz:>10g}" for hz in speeds), flush=True)
    results = []
    for name, (there, settings) in WAYS.items():
        errors = [median(error(there, settings, hz, draw) for draw in range(options.draws)) for hz in speeds]
        print(f"{name:38}" + "".join(f"{each:10.2e}" for each in errors), flush=True)
        results.append({"way": name, "fastest_hz": list(speeds), "nrmse": errors})
    leave(options.json, results)


if __name__ == "__main__":
    main()
