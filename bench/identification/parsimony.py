# SPDX-License-Identifier: Apache-2.0
"""Counts how often the model class of simulated objects is identified correctly.

python bench/identification/parsimony.py [--draws 100] [--json FILE]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.moving import simulate_recording
from bench.studies import count, write_results

from palpate import Model, Recording, identify

MASS, DAMPING = 1e-3, 0.06
"""True mass and damping of the simulated moving object [N*m*s^2/rad, N*m*s/rad]."""

TOLERANCE = 0.05
"""Largest relative error with which an identified mass or damping counts as correct."""


def spring(draw: int) -> Recording:
    """Returns a recording of a linear spring: 100 to 3000 rows, noise of 0.01 to 100 % of the force range."""
    random = np.random.default_rng([7, draw])
    n = round(10.0 ** random.uniform(2.0, 3.5))
    x = 0.3 - 0.3 * np.cos(np.cumsum(random.uniform(0.5, 1.5, n)) * 40.0 / n)
    noise = 10.0 ** random.uniform(-4.0, 0.0) * 1.8
    force = 3.0 * x + 0.1 + random.normal(0.0, noise, n)
    return Recording.from_arrays(np.round(x / 1e-4) * 1e-4, force, time=1e-3 * np.arange(n))


def has_velocity(model: Model) -> bool:
    return model.damping is not None or "velocity" in model.inputs


def has_true_mass_and_damping(model: Model) -> bool:
    """Returns true if the identified mass and damping are close to the true values of the object."""
    return (
        model.mass is not None
        and model.damping is not None
        and abs(model.mass / MASS - 1.0) < TOLERANCE
        and abs(model.damping / DAMPING - 1.0) < TOLERANCE
    )


CLAIMS: dict[str, tuple[int, Callable[[int], Recording], Callable[[Model], bool]]] = {
    "linear spring: no wavelet": (
        100,
        spring,
        lambda model: model.n_wavelets == 0 and model.kind == "position" and not has_velocity(model),
    ),
    "velocity present: accepted": (100, lambda draw: simulate_recording(draw, damping=0.03), has_velocity),
    "velocity absent: rejected": (100, simulate_recording, lambda model: not has_velocity(model)),
    "hysteresis present: accepted": (
        100,
        lambda draw: simulate_recording(draw, hysteresis=0.1),
        lambda model: model.kind == "hysteresis",
    ),
    "hysteresis absent: rejected": (
        100,
        lambda draw: simulate_recording(draw, damping=0.03),
        lambda model: model.kind != "hysteresis",
    ),
    f"mass and damping from 60 s: within {100 * TOLERANCE:g} %": (
        20,
        lambda draw: simulate_recording(draw, seconds=60.0, mass=MASS, damping=DAMPING),
        has_true_mass_and_damping,
    ),
}
"""Claim -> (number of draws, function that simulates a draw's recording, function that checks the model)."""


def is_correct_draw(claim: str, draw: int) -> bool:
    """Returns true if the model identified from the recording of one draw is correct."""
    _, recording, is_correct = CLAIMS[claim]
    return is_correct(identify(recording(draw)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=None, help="largest number for each claim")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    results = []
    print(f"{'':44}{'correct':>7}{'of':>5}", flush=True)
    for claim, (all_draws, _, _) in CLAIMS.items():
        draws = min(options.draws or all_draws, count(all_draws))
        results_by_draw = Parallel(n_jobs=-1)(delayed(is_correct_draw)(claim, draw) for draw in range(draws))
        wrong = [draw for draw, each in enumerate(results_by_draw) if not each]
        reported = f"  wrong in draws {', '.join(map(str, wrong))}" if wrong else ""
        print(f"{claim:44}{draws - len(wrong):7d}{draws:5d}{reported}", flush=True)
        results.append({"claim": claim, "right": draws - len(wrong), "draws": draws})
    write_results(options.json, results)


if __name__ == "__main__":
    main()
