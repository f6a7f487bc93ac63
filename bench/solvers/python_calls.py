# SPDX-License-Identifier: Apache-2.0
"""Compares the time of a prediction with NumPy and SciPy: python bench/solvers/python_calls.py FILE.json

Predicts one position as a number, and 10^6 in an array. The references are a lookup table of 64 entries and a
cubic spline through them. The prediction is checked against eq. 4 in NumPy.
"""

from __future__ import annotations

import sys
from pathlib import Path
from statistics import median

import numpy as np
from scipy.interpolate import make_interp_spline

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.solvers.blocks import row, scaled, timed, write_results

from palpate import load_model

MODEL = Path(__file__).parent / "click_and_wall.json"


def main() -> None:
    model = load_model(MODEL)
    low, high = model.domain[0][0], model.domain[1][0]
    entries = np.linspace(low, high, 64)
    forces = model.force(entries)
    spline = make_interp_spline(entries, forces, k=3)
    x = 0.5 * (low + high)
    many = np.random.default_rng(5).uniform(low, high, 1_000_000)

    design = model.alpha[:, 0] * (many[:1000, None] - model.beta[:, 0])
    waves = (design**2 - 1.0) * np.exp(-0.5 * design**2) @ model.weight
    plain = waves + model.linear[0] * many[:1000] + model.bias
    worst = float(np.abs(model.force(many)[:1000] - plain).max())
    if not worst <= 1e-12 * float(np.abs(forces).max()):
        raise SystemExit(f"wrong by {worst}")

    rows = []
    one = {
        "predict_one": lambda: model.force(x),
        "np_interp_one": lambda: np.interp(x, entries, forces),
        "bspline_one": lambda: spline(x),
    }
    batch = {
        "predict_many": lambda: model.force(many),
        "np_interp_many": lambda: np.interp(many, entries, forces),
        "bspline_many": lambda: spline(many),
    }
    for calls in (one, batch):
        for name, times in timed(calls, scaled(0.2)).items():
            rows += [row(name, each, max_error=worst) for each in times]
            print(f"{name:20} {median(times):14.1f} ns")
    write_results(Path(sys.argv[1]), rows)


if __name__ == "__main__":
    main()
