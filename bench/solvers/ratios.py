# SPDX-License-Identifier: Apache-2.0
"""Prints each measured ratio with the required one: python bench/solvers/ratios.py build/bench

Times are medians over the interleaved repetitions of one run, so both sides of a ratio have the same load.
"""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.solvers.results import BenchmarkResults, Row, nanoseconds

Runs = Mapping[str, Row]
"""Benchmarks of all files by their names."""


class Claim(NamedTuple):
    text: str
    most: float
    measured: Callable[[Runs], float]


def ratio(name: str, yardstick: str) -> Callable[[Runs], float]:
    return lambda run: nanoseconds(run[name]) / nanoseconds(run[yardstick])


def per_item(name: str, yardstick: str) -> Callable[[Runs], float]:
    return lambda run: run[yardstick]["items_per_second"] / run[name]["items_per_second"]


def counter(name: str, key: str) -> Callable[[Runs], float]:
    return lambda run: run[name][key]


def spread(names: list[str]) -> Callable[[Runs], float]:
    return lambda run: max(nanoseconds(run[n]) for n in names) / min(nanoseconds(run[n]) for n in names)


def worst(prefix: str, key: str) -> Callable[[Runs], float]:
    """Returns the largest value of a counter over all benchmarks with this prefix."""
    return lambda run: max(row[key] for name, row in run.items() if name.startswith(prefix) and key in row)


_WALL = "step<SpringWall>/wavelets:16"
_SNAP = "step<SnapThrough>/wavelets:16"

CLAIMS = [
    Claim("implicit step by table / explicit step, spring-wall", 1.0,
          ratio("implicit_table<SpringWall>/wavelets:16", f"explicit_{_WALL}")),
    Claim("implicit step by Newton / explicit step, spring-wall", 1.4,
          ratio("implicit_newton<SpringWall>/wavelets:16", f"explicit_{_WALL}")),
    Claim("evaluations a step by Newton, spring-wall", 1.05,
          counter("implicit_newton<SpringWall>/wavelets:16", "evaluations")),
    Claim("implicit step by table / explicit step, snap-through", 1.1,
          ratio("implicit_table<SnapThrough>/wavelets:16", f"explicit_{_SNAP}")),
    Claim("massless step by table / explicit step, snap-through", 1.1,
          ratio("massless_table<SnapThrough>/wavelets:16", f"explicit_{_SNAP}")),
    Claim("error of any tabulated solution, of the travel", 1e-12,
          lambda run: max(worst("implicit_table", "position_error")(run),
                          worst("massless_table", "position_error")(run))),
    Claim("compiled value and slope / std::exp loop, 16 wavelets", 1 / 6,
          ratio("latency<Compiled>/wavelets:16", "latency<ExpLoop>/wavelets:16")),
    Claim("compiled value and slope, slowest / fastest of 8 to 128 wavelets", 1.1,
          spread([f"latency<Compiled>/wavelets:{n}" for n in (8, 16, 32, 64, 128)])),
    Claim("largest error of compiled curves [N*m]", 1e-12, worst("latency<Compiled>", "max_error")),
    Claim("build of a compiled curve of 128 wavelets [ms]", 20.0,
          lambda run: nanoseconds(run["compile/wavelets:128"]) / 1e6),
    Claim("network value and slope / std::exp loop, 16 wavelets", 0.45,
          ratio("latency<Network>/wavelets:16", "latency<ExpLoop>/wavelets:16")),
    Claim("network in batches / std::exp loop in batches, 16 wavelets", 0.2,
          per_item("throughput_batch/wavelets:16", "throughput<ExpLoop>/wavelets:16")),
    Claim("two inputs, value and gradient / std::exp loop, 16 wavelets", 0.45,
          ratio("latency_of_inputs<Radial>/wavelets:16/inputs:2",
                "latency_of_inputs<RadialExpLoop>/wavelets:16/inputs:2")),
    Claim("99.9th percentile of a whole tick [ns]", 500.0, worst("tick/", "p999_ns")),
    Claim("proved slope bound of 64 wavelets [ms]", 1.0,
          lambda run: nanoseconds(run["slope_bound/wavelets:64"]) / 1e6),
    Claim("proved gradient bound of 64 wavelets, two inputs [ms]", 1.0,
          lambda run: nanoseconds(run["gradient_bound_two_inputs/wavelets:64"]) / 1e6),
    Claim("excess of any proved slope bound, of the steepest slope", 0.01,
          lambda run: max(worst("slope_bound", "excess")(run),
                          worst("gradient_bound", "excess")(run))),
    Claim("one prediction from Python / np.interp", 1.0, ratio("predict_one", "np_interp_one")),
    Claim("10^6 predictions from Python / SciPy's BSpline", 1.0, ratio("predict_many", "bspline_many")),
]  # fmt: skip


def measured_claims(folder: Path) -> list[tuple[str, float | None, float]]:
    """Returns text, measured and required value of each claim; None if its benchmark did not run."""
    paths = sorted(folder.glob("bench_*.json"))
    runs = {str(row["name"]): row for path in paths for row in BenchmarkResults(folder, path.stem).rows}
    found: list[tuple[str, float | None, float]] = []
    for claim in CLAIMS:
        try:
            found.append((claim.text, claim.measured(runs), claim.most))
        except (KeyError, ValueError):
            found.append((claim.text, None, claim.most))
    return found


def main() -> None:
    print(f"{'':66} {'measured':>10} {'required':>10}")
    for text, measured, most in measured_claims(Path(sys.argv[1])):
        value = "not run" if measured is None else f"{measured:.4g}"
        missed = measured is not None and not measured <= most
        print(f"{text:66} {value:>10} {most:10.4g}{'  <- missed' if missed else ''}")


if __name__ == "__main__":
    main()
