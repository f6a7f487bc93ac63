# SPDX-License-Identifier: Apache-2.0
"""Measures error and time of palpate and other methods on forces of two, three and six inputs.

python bench/identification/several_inputs.py [2000 20000 100000] [--draws 12] [--json FILE] [--only NAME ...]

Arguments are numbers of rows. The four forces, the methods and their settings are the functions of this file.
Every draw has different positions and noise; the noise is 2 % of the standard deviation of the force. All
methods run one after the other in every draw. The Gaussian process runs in the first draws only, because its
time and its error do not depend on the number of rows.
"""

from __future__ import annotations

import argparse
import ast
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.kernel_approximation import Nystroem
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.compare_methods import PALPATE, header, line, measure
from bench.identification.methods import Array, Fitted, Method, Predict, network_method, tuned
from bench.identification.problems import Problem
from bench.studies import SCALE, count, markdown_table, write_results

from palpate import WaveletNetworkRegressor
from palpate.cli.figures import figure_file
from palpate.plotting.look import grid

INPUTS = (2, 3, 6)

ROWS = (2_000, 20_000, 100_000) if SCALE >= 0.1 else (200,)

NOISE = 0.02
"""Standard deviation of the noise divided by that of the force"""

TEST_ROWS = 5_000

MOST_TUNING_ROWS = 4_000
"""The settings of the Nystrom method are tuned on at most this number of rows"""

GAUSSIAN_PROCESS_ROWS = 2_000

LENGTH_SCALE_ROWS = 500
"""The length scales of the Gaussian process are fitted on this number of rows"""


def sine_product(x: Array) -> Array:
    """A product of waves over two inputs, and a plane over the others."""
    return np.sin(2.0 * np.pi * x[:, 0]) * np.cos(np.pi * x[:, 1]) + 0.5 * x[:, 2:].sum(axis=1)


def contact(x: Array) -> Array:
    """A contact of exponent 1.5, stiffer with the second input; products with the others."""
    depth = np.maximum(x[:, 0] - 0.4, 0.0)
    force = (4.0 * depth) ** 1.5 * (1.0 + 0.6 * (x[:, 1] - 0.5))
    return np.asarray(force + 0.3 * x[:, 0] * x[:, 2:].sum(axis=1))


def friedman(x: Array) -> Array:
    """Friedman's first function, cut to the number of inputs; a sixth input has no effect."""
    force = 10.0 * np.sin(np.pi * x[:, 0] * x[:, 1])
    if x.shape[1] > 2:
        force = force + 20.0 * (x[:, 2] - 0.5) ** 2
    if x.shape[1] > 4:
        force = force + 10.0 * x[:, 3] + 5.0 * x[:, 4]
    return np.asarray(force)


def step_and_bump(x: Array) -> Array:
    """A steep step, a product of two inputs and a narrow bump."""
    bump = np.exp(-0.5 * ((x[:, 0] - 0.3) ** 2 + (x[:, 1] - 0.7) ** 2) / 0.15**2)
    return np.asarray(np.tanh(6.0 * (x[:, 0] - 0.5)) + x[:, 1] * x[:, -1] + 0.7 * bump)


FORCES: dict[str, Callable[[Array], Array]] = {
    "sine product": sine_product,
    "contact": contact,
    "Friedman 1": friedman,
    "step and bump": step_and_bump,
}


def several(force: str, inputs: int, rows: int, draw: int) -> Problem:
    """Returns noisy rows and exact test rows, all uniform in the unit cube."""
    random = np.random.default_rng([list(FORCES).index(force), inputs, rows, draw])
    X, X_test = random.uniform(size=(rows, inputs)), random.uniform(size=(TEST_ROWS, inputs))
    exact = FORCES[force](X)
    y = exact + random.normal(0.0, NOISE * exact.std(), rows)
    return Problem(f"{force}, {inputs} inputs, {rows} rows", X, y, X_test, FORCES[force](X_test))


def boosted_trees(X: Array, y: Array) -> Fitted:
    """Fits trees of at most 31 leaves until a tenth of the rows shows no progress; the number of parameters
    is the number of leaves."""
    start = time.perf_counter()
    model = HistGradientBoostingRegressor(
        learning_rate=0.05, max_iter=1000, early_stopping=True, n_iter_no_change=20, random_state=0
    )
    model.fit(X, y)
    seconds = time.perf_counter() - start
    return Fitted(model.predict, 31 * model.n_iter_, seconds, 0.0, f"{model.n_iter_} trees")


def nystrom(X: Array, y: Array) -> Fitted:
    """Fits a ridge regression over 1000 features of a radial kernel, which approximates KernelRidge."""

    def fit(setting: tuple[float, float], X: Array, y: Array) -> tuple[Predict, int]:
        gamma, penalty = setting
        features = Nystroem(gamma=gamma, n_components=min(1000, len(y) // 2), random_state=0)
        return make_pipeline(features, Ridge(penalty)).fit(X, y).predict, features.n_components

    settings = [(gamma, penalty) for gamma in (0.1, 0.3, 1.0, 3.0, 10.0) for penalty in (1e-6, 1e-3)]
    found = tuned(fit, settings, X[:MOST_TUNING_ROWS], y[:MOST_TUNING_ROWS])
    if len(y) <= MOST_TUNING_ROWS:
        return found
    start = time.perf_counter()
    gamma, penalty = ast.literal_eval(found.setting)
    predict, size = fit((gamma, penalty), X, y)
    return Fitted(predict, size, time.perf_counter() - start, found.seconds, found.setting)


def gaussian_process(X: Array, y: Array) -> Fitted:
    """Fits a Gaussian process with a length scale for each input to 2000 rows."""
    start = time.perf_counter()
    kernel = ConstantKernel(1.0, (1e-3, 1e6)) * RBF(np.ones(X.shape[1]), (1e-2, 1e2)) + WhiteKernel(1e-3)
    few = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=2, random_state=0)
    with warnings.catch_warnings():
        # a length scale reaches its bound if the force does not depend on the input
        warnings.simplefilter("ignore", ConvergenceWarning)
        few.fit(X[:LENGTH_SCALE_ROWS], y[:LENGTH_SCALE_ROWS])
    found = GaussianProcessRegressor(few.kernel_, optimizer=None, normalize_y=True)
    found.fit(X[:GAUSSIAN_PROCESS_ROWS], y[:GAUSSIAN_PROCESS_ROWS])
    seconds = time.perf_counter() - start
    return Fitted(found.predict, min(len(y), GAUSSIAN_PROCESS_ROWS), seconds, 0.0, "")


METHODS = (
    Method(PALPATE, network_method(WaveletNetworkRegressor), inputs=INPUTS),
    Method("HistGradientBoosting", boosted_trees, inputs=INPUTS),
    Method("Nystrom + Ridge", nystrom, inputs=INPUTS),
    Method("Gaussian process", gaussian_process, inputs=INPUTS, most_draws=3),
)

MARKERS = (("o", "black"), ("^", "white"), ("s", "0.6"), ("D", "white"))
"""Marker and its color for each method"""


def percent(share: float) -> str:
    """Returns a share in percent with two digits."""
    return f"{100.0 * share:.2g}"


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """Returns a table row for each force, number of inputs and number of rows: median and range of NRMSE, and
    median time of each method."""
    lines = []
    for problem in dict.fromkeys(row["problem"] for row in results):
        of = {row["method"]: row for row in results if row["problem"] == problem}
        found = [of[method.name] for method in METHODS if method.name in of]
        lines.append(
            (
                f"{problem} ({of[PALPATE]['draws']} draws)",
                *(
                    f"{percent(row['nrmse'])} ({' to '.join(map(percent, row['nrmse_range']))})"
                    for row in found
                ),
                str(of[PALPATE]["n_parameters"]),
                *(f"{row['fit_s'] + row['tuning_s']:.2g}" for row in found),
            )
        )
    names = [method.name for method in METHODS]
    errors, times = [f"NRMSE of {name} [%]" for name in names], [f"{name} [s]" for name in names]
    return markdown_table(("problem", *errors, "parameters of palpate", *times), lines)


def _rows(row: Mapping[str, Any]) -> int:
    """Returns the number of rows of a result."""
    return int(row["problem"].split()[-2])


def draw(path: Path, results: Sequence[Mapping[str, Any]]) -> None:
    """Draws error over time of all methods, a panel for each number of inputs; larger marks: more rows."""
    sizes = sorted({_rows(row) for row in results})
    measured = [each for each in INPUTS if any(f", {each} inputs, " in row["problem"] for row in results)]
    with figure_file(path, height_inches=1.0 + 1.5 * len(measured), rows=[1.0] * len(measured)) as panels:
        for axes, inputs in zip(panels, measured, strict=True):
            for method, (marker, color) in zip(METHODS, MARKERS, strict=True):
                rows = [
                    row
                    for row in results
                    if row["method"] == method.name and f", {inputs} inputs, " in row["problem"]
                ]
                axes.scatter(
                    [row["fit_s"] + row["tuning_s"] for row in rows],
                    [row["nrmse"] for row in rows],
                    [5.0 * (1 + sizes.index(_rows(row))) ** 1.5 for row in rows],
                    marker=marker,
                    facecolor=color,
                    edgecolor="black",
                    linewidth=0.6,
                    label=method.name,
                    zorder=3 if method.name == PALPATE else 2,
                )
            axes.set_xscale("log")
            axes.set_yscale("log")
            grid(axes)
            axes.set_ylabel(f"NRMSE, {inputs} inputs")
        panels[-1].set_xlabel("time of the fit with tuning [s]")
        handles, names = panels[0].get_legend_handles_labels()
        panels[0].figure.legend(handles, names, frameon=False, loc="outside lower center", ncols=2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", type=int, default=list(ROWS))
    parser.add_argument("--inputs", nargs="*", type=int, default=list(INPUTS if SCALE >= 0.1 else INPUTS[:1]))
    parser.add_argument("--draws", type=int, default=count(12))
    parser.add_argument("--only", nargs="*", default=None, help="names of methods")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    methods = [each for each in METHODS if not options.only or each.name in options.only]
    results: list[dict[str, Any]] = []
    with threadpool_limits(limits=1):
        for n_rows in options.rows:
            for inputs in options.inputs:
                for force in FORCES:
                    draws = (several(force, inputs, n_rows, draw) for draw in range(options.draws))
                    found = measure(draws, methods)
                    print(f"\n{found[0]['problem']}\n{header()}", *map(line, found), sep="\n", flush=True)
                    results.extend(found)
                    write_results(options.json, results)


if __name__ == "__main__":
    main()
