# SPDX-License-Identifier: Apache-2.0
"""Measures error, parameters and time of palpate and other methods on P1 to P6.

python bench/identification/compare_methods.py [P1 ...] [--draws 12] [--json FILE] [--only NAME ...]

Each draw has different positions and noise. Numbers are medians of the draws; error, wavelets and parameters
also have their range. All methods run one after the other in every draw, so a busy machine slows all of them.
The slowest run in the first draws only. "over palpate" is the median ratio of a method's fit and tuning time
to the time of palpate.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.methods import METHODS, Fitted, Method
from bench.identification.problems import NAMES, TITLES, Problem, problem
from bench.studies import SCALE, count, write_results

PALPATE = METHODS[0].name

SLOW_TIME_RATIO = 5.0
"""A method whose computing time divided by that of palpate is larger gets only DRAWS_OF_SLOW_METHODS draws"""

DRAWS_OF_SLOW_METHODS = 3


def reason_to_skip(method: Method, rows: Problem) -> str | None:
    """Returns the reason why a method is not applied to a problem; None if the method is applied."""
    if rows.X.shape[1] not in method.inputs:
        return "one input only"
    if len(rows.y) > method.most_rows:
        return f"takes too long with {len(rows.y)} rows"
    return None


def measure(draws: Iterable[Problem], methods: Sequence[Method]) -> list[dict[str, Any]]:
    """Returns medians and ranges of each method's results in all draws of a problem, or why the method was
    skipped."""
    results: dict[str, list[tuple[float, Fitted]]] = {method.name: [] for method in methods}
    reasons: dict[str, str] = {}
    name = ""
    for rows in draws:
        name = rows.name
        for method in methods:
            if (reason := reasons.get(method.name) or reason_to_skip(method, rows)) is not None:
                reasons[method.name] = reason
                continue
            done = results[method.name]
            if len(done) >= method.most_draws or is_skipped_as_slow(done, results.get(PALPATE)):
                continue
            try:
                fitted = method.fit(rows.X, rows.y)
            except ImportError as missing:
                reasons[method.name] = f"needs {missing.name}"
                continue
            results[method.name].append((rows.nrmse(fitted.predict(rows.X_test)), fitted))
    return [
        {"problem": name, "method": method.name, "skipped": reasons[method.name]}
        if method.name in reasons
        else {"problem": name, "method": method.name, **_medians(results[method.name], results.get(PALPATE))}
        for method in methods
    ]


def is_skipped_as_slow(
    results: Sequence[tuple[float, Fitted]], palpate_results: Sequence[tuple[float, Fitted]] | None
) -> bool:
    """Returns true if a method is so slow that it is not run on further draws of a problem."""
    return (
        len(results) >= DRAWS_OF_SLOW_METHODS
        and palpate_results is not None
        and _medians(results, palpate_results)["time_over_palpate"] > SLOW_TIME_RATIO
    )


def _medians(
    results: Sequence[tuple[float, Fitted]], palpate_results: Sequence[tuple[float, Fitted]] | None
) -> dict[str, Any]:
    time_ratios = [
        each.seconds / reference.seconds
        for (_, each), (_, reference) in zip(results, palpate_results or results, strict=False)
    ]
    errors = [error for error, _ in results]
    sizes = [each.n_parameters for _, each in results]
    wavelets = [each.n_wavelets for _, each in results if each.n_wavelets is not None]
    return {
        "nrmse": median(errors),
        "nrmse_range": [min(errors), max(errors)],
        "n_parameters": int(median(sizes)),
        "n_parameters_range": [min(sizes), max(sizes)],
        "n_wavelets": int(median(wavelets)) if wavelets else None,
        "n_wavelets_range": [min(wavelets), max(wavelets)] if wavelets else None,
        "fit_s": median(each.fit_seconds for _, each in results),
        "tuning_s": median(each.tuning_seconds for _, each in results),
        "time_over_palpate": median(time_ratios),
        "setting": results[0][1].setting,
        "draws": len(results),
    }


def header() -> str:
    return (
        f"{'':28}{'nrmse':>10}{'range':>23}{'wavelets':>16}{'parameters':>16}{'fit s':>9}"
        f"{'tuning s':>10}{'over palpate':>13}{'draws':>7}  setting"
    )


def line(row: dict[str, Any]) -> str:
    if "skipped" in row:
        return f"{row['method']:28}  {row['skipped']}"
    low, high = row["nrmse_range"]
    return (
        f"{row['method']:28}{row['nrmse']:10.2e}{f'{low:.2e} to {high:.2e}':>23}"
        f"{_with_range(row, 'n_wavelets'):>16}{_with_range(row, 'n_parameters'):>16}{row['fit_s']:9.3f}"
        f"{row['tuning_s']:10.2f}{row['time_over_palpate']:13.2f}{row['draws']:7d}  {row['setting']}"
    )


def _with_range(row: dict[str, Any], key: str) -> str:
    """Returns as text the median, least and largest value of a count in the random draws of a problem."""
    if row[key] is None:
        return ""
    low, high = row[f"{key}_range"]
    return f"{row[key]} ({low} to {high})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default_problems = NAMES if SCALE >= 0.1 else ("P1", "P4")
    parser.add_argument("problems", nargs="*", default=list(default_problems), metavar="P1 ...")
    parser.add_argument("--draws", type=int, default=count(12))
    parser.add_argument("--only", nargs="*", default=None, help="names of methods")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    methods = [each for each in METHODS if not options.only or each.name in options.only]
    results = []
    with threadpool_limits(limits=1):
        for name in options.problems:
            print(f"\n{name}: {TITLES[name]}\n{header()}", flush=True)
            rows = measure((problem(name, draw) for draw in range(options.draws)), methods)
            results.extend(rows)
            print("\n".join(map(line, rows)), flush=True)
            write_results(options.json, results)


if __name__ == "__main__":
    main()
