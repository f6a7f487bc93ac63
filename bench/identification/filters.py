# SPDX-License-Identifier: Apache-2.0
"""Compares the filters of the paper with matched filters on moving objects with known force.

python bench/identification/filters.py [--json FILE]

The filters of the paper receive the true mass and damping, because they must assume them. The matched filters
identify them.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import median

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.moving import simulate_recording
from bench.studies import count, write_results

from palpate import Model, identify
from palpate.baselines import paper_force
from palpate.recording import sample_force
from palpate.recording.sample import LOWER, UPPER

MASS, DAMPING = 1e-3, 0.06
FASTEST_HZ = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Compared highest frequencies of the hand motion [Hz]; the lowest frequency is a tenth of the highest."""

CASES: dict[str, tuple[bool, dict[str, float]]] = {
    "matched, mass": (False, {"mass": MASS}),
    "paper (figure 11), mass": (True, {"mass": MASS}),
    "matched, mass and damping": (False, {"mass": MASS, "damping": DAMPING}),
    "paper (figure 13), mass and damping": (True, {"mass": MASS, "damping": DAMPING}),
}
"""Name of a case -> (True for the filters of the paper, mass and damping of the simulated object)."""


def error(of_paper: bool, object_properties: dict[str, float], fastest_hz: float, draw: int) -> float:
    """Returns the NRMSE of the identified force f against the true force at positions of the recording."""
    recording = simulate_recording(
        draw, seconds=20.0, slowest_hz=fastest_hz / 10.0, fastest_hz=fastest_hz, **object_properties
    )
    if of_paper:
        force = paper_force(recording, **object_properties)
        model = identify(recording.position, force, inputs="position")
    else:
        model = identify(recording)
    margin = 0.01 * (UPPER - LOWER)
    x = np.linspace(LOWER + margin, UPPER - margin, 2001)
    truth = sample_force(x)
    return float(np.sqrt(np.mean((mean_force(model, x) - truth) ** 2)) / np.std(truth))


def mean_force(model: Model, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns the model force; for a model with (wrong) hysteresis the mean of press and release force."""
    if not model.hysteretic:
        return np.asarray(model.force(x))
    strokes = [np.asarray(model.force(x, direction=np.full(len(x), direction))) for direction in (1.0, -1.0)]
    return 0.5 * (strokes[0] + strokes[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(3))
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    speeds = FASTEST_HZ[-count(len(FASTEST_HZ)) :]
    print(f"{'nrmse of f, the hand up to [Hz]':38}" + "".join(f"{hz:>10g}" for hz in speeds), flush=True)
    results = []
    for name, (of_paper, object_properties) in CASES.items():
        errors = [
            median(error(of_paper, object_properties, hz, draw) for draw in range(options.draws))
            for hz in speeds
        ]
        print(f"{name:38}" + "".join(f"{each:10.2e}" for each in errors), flush=True)
        results.append({"way": name, "fastest_hz": list(speeds), "nrmse": errors})
    write_results(options.json, results)


if __name__ == "__main__":
    main()
