# SPDX-License-Identifier: Apache-2.0
"""Measures model error over size and over the time of an evaluation.

python bench/solvers/model_error.py FILE.json

Compares wavelet networks of at most N wavelets and the baselines with several settings on two problems with
known force. An evaluation is one of 10^4 positions in an array, on one thread.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.problems import TITLES, problem
from bench.solvers.blocks import result_row, scaled, timed, write_results
from bench.studies import SCALE

from palpate import WaveletNetworkRegressor
from palpate.baselines import HuntCrossley, LinearZones, LookupTable, SmoothingSpline, TissueParameters

PROBLEMS = ("P1", "P2")
WAVELETS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 32) if SCALE >= 0.1 else (1, 2, 4)

BASELINES = {
    "lookup table": [LookupTable(size) for size in (4, 8, 16, 32, 64, 128, 256, 512)],
    "smoothing spline": [SmoothingSpline(smoothing) for smoothing in (30.0, 10.0, 3.0, 1.5, 1.1, 1.0, 0.9)],
    "linear zones": [LinearZones(threshold) for threshold in (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)],
    "tissue parameters": [TissueParameters()],
    "Hunt-Crossley": [HuntCrossley()],
}

Predict = Callable[[np.ndarray], np.ndarray]


def models(X: np.ndarray, y: np.ndarray) -> Iterator[tuple[str, int, int, Predict]]:
    """Yields (name of the method, number of wavelets or 0, number of parameters, prediction function)."""
    used_sizes = set()
    for max_wavelets in WAVELETS:
        network = WaveletNetworkRegressor(max_wavelets=max_wavelets).fit(X, y)
        if network.n_wavelets_ in used_sizes:
            continue
        used_sizes.add(network.n_wavelets_)
        force = network.network_.force
        yield (
            "wavelet network",
            network.n_wavelets_,
            network.n_parameters_,
            lambda rows, force=force: force(rows[:, 0]),
        )
    for name, settings in BASELINES.items():
        for setting in settings:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    fitted = setting.fit(X, y)
            except (ValueError, np.linalg.LinAlgError) as refused:
                print(f"{name}: {refused}")
                continue
            yield name, 0, fitted.n_parameters_, fitted.predict


def main() -> None:
    rows = []
    start = time.perf_counter()
    for name in PROBLEMS:
        rows_of_problem = problem(name)
        methods = list(models(rows_of_problem.X, rows_of_problem.y))
        calls = {str(k): partial(each[3], rows_of_problem.X_test) for k, each in enumerate(methods)}
        times = timed(calls, scaled(0.02), time.process_time_ns)
        print(f"{name}: {TITLES[name]}")
        for k, (method, wavelets, parameters, predict) in enumerate(methods):
            ns = median(times[str(k)]) / len(rows_of_problem.truth)
            error = rows_of_problem.nrmse(predict(rows_of_problem.X_test))
            rows.append(
                result_row(
                    f"{TITLES[name].split(',')[0]}/{method}/{k}",
                    ns,
                    nrmse=error,
                    n_parameters=parameters,
                    n_wavelets=wavelets,
                )
            )
            print(
                f"  {method:20} {wavelets:4d} wavelets {parameters:5d} parameters {error:10.2e} {ns:8.1f} ns"
            )
    write_results(Path(sys.argv[1]), rows)
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
