# SPDX-License-Identifier: Apache-2.0
"""Compares models of measured joints with regressions over position and velocity.

python bench/identification/joints.py [--files 12] [--json FILE]

Every fifth row is held out. palpate has its default options; the other methods have the velocity that palpate
computes from the whole motion. PALPATE_DATA names the folder of measured recordings.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor, RandomForestRegressor

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.methods import Array, Predict, gaussian_process, spline_ridge
from bench.identification.real_data import EVERY, SETS
from bench.studies import count, markdown_table, measured_data, write_results

import palpate
from palpate import Recording
from palpate.baselines import comparable
from palpate.recording.motion import velocity
from palpate.verification.metrics import normalised, root_mean_square

MOST_ROWS = 800
"""Largest number of rows of a Gaussian process."""


def _process(X: Array, y: Array) -> Predict:
    some = np.linspace(0, len(y) - 1, min(MOST_ROWS, len(y))).astype(int)
    return gaussian_process(X[some], y[some]).predict


def _trees(regressor: Callable[..., Any], X: Array, y: Array) -> Predict:
    fitted: Any = regressor(random_state=0).fit(X, y)
    predict: Predict = fitted.predict
    return predict


METHODS: dict[str, Callable[[Array, Array], Predict]] = {
    "splines": lambda X, y: spline_ridge(X, y).predict,
    "boosted trees": partial(
        _trees, partial(HistGradientBoostingRegressor, max_iter=400, early_stopping=True)
    ),
    "random forest": partial(_trees, partial(RandomForestRegressor, 200, min_samples_leaf=3)),
    f"Gaussian process, {MOST_ROWS} rows": _process,
}


def errors_of(recording: Recording) -> dict[str, float]:
    """Returns the NRMSE of palpate and of each method on the same held-out rows."""
    train, _ = recording.split(EVERY)
    check = palpate.verify(palpate.identify(train), recording)
    speed, known = velocity(recording)
    held_out = np.arange(len(recording)) % EVERY == EVERY - 1
    compared = held_out & comparable(recording) & check.rows & known
    inputs, force = np.column_stack([recording.position, speed]), recording.force
    fitted = ~held_out & known
    residuals = {"palpate": check.residual[compared[check.rows]]} | {
        name: fit(inputs[fitted], force[fitted])(inputs[compared]) - force[compared]
        for name, fit in METHODS.items()
    }
    return {
        name: float(normalised(root_mean_square(each), force[compared])) for name, each in residuals.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=count(12))
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    if (folder := measured_data()) is None:
        return
    joints = SETS["davinci_grip"]
    found = {
        path.stem: errors_of(palpate.read_recording(path, **joints.reading))
        for path in sorted((folder / "davinci_grip").glob(joints.pattern))[: options.files]
    }
    ratios = {
        name: each["palpate"] / min(error for method, error in each.items() if method != "palpate")
        for name, each in found.items()
    }
    lines = [
        (name, *(f"{error:.4f}" for error in each.values()), f"{ratios[name]:.2f}")
        for name, each in found.items()
    ]
    print(markdown_table(("joint", "palpate", *METHODS, "ratio to the best"), lines, (0,)))
    print(f"ratio: median {median(ratios.values()):.2f}, worst {max(ratios.values()):.2f}")
    write_results(options.json, {"errors": found, "ratios": ratios})


if __name__ == "__main__":
    main()
