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

from bench.solvers.blocks import result_row, scaled, timed, write_results

from palpate import load_model

MODEL = Path(__file__).parent / "click_and_wall.json"


def main() -> None:
    model = load_model(MODEL)
    lower, upper = model.domain[0][0], model.domain[1][0]
    entries = np.linspace(lower, upper, 64)
    forces = model.force(entries)
    spline = make_interp_spline(entries, forces, k=3)
    position = 0.5 * (lower + upper)
    positions = np.random.default_rng(5).uniform(lower, upper, 1_000_000)

    u = model.alpha[:, 0] * (positions[:1000, None] - model.beta[:, 0])
    wavelet_sum = (u**2 - 1.0) * np.exp(-0.5 * u**2) @ model.weight
    expected = wavelet_sum + model.linear[0] * positions[:1000] + model.bias
    largest_error = float(np.abs(model.force(positions)[:1000] - expected).max())
    if not largest_error <= 1e-12 * float(np.abs(forces).max()):
        raise SystemExit(f"wrong by {largest_error}")

    rows = []
    single_calls = {
        "predict_one": lambda: model.force(position),
        "np_interp_one": lambda: np.interp(position, entries, forces),
        "bspline_one": lambda: spline(position),
    }
    array_calls = {
        "predict_many": lambda: model.force(positions),
        "np_interp_many": lambda: np.interp(positions, entries, forces),
        "bspline_many": lambda: spline(positions),
    }
    for calls in (single_calls, array_calls):
        for name, times in timed(calls, scaled(0.2)).items():
            rows += [result_row(name, each, max_error=largest_error) for each in times]
            print(f"{name:20} {median(times):14.1f} ns")
    write_results(Path(sys.argv[1]), rows)


if __name__ == "__main__":
    main()
