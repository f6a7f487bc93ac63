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
"""Name of a benchmark -> its row in one of the result files."""


class Claim(NamedTuple):
    text: str
    required: float
    measured: Callable[[Runs], float]


def ratio(name: str, reference: str) -> Callable[[Runs], float]:
    return lambda runs: nanoseconds(runs[name]) / nanoseconds(runs[reference])


def per_item(name: str, reference: str) -> Callable[[Runs], float]:
    return lambda runs: runs[reference]["items_per_second"] / runs[name]["items_per_second"]


def counter(name: str, key: str) -> Callable[[Runs], float]:
    return lambda runs: runs[name][key]


def slowest_over_fastest(names: list[str]) -> Callable[[Runs], float]:
    return lambda runs: max(nanoseconds(runs[n]) for n in names) / min(nanoseconds(runs[n]) for n in names)


def largest_counter(prefix: str, key: str) -> Callable[[Runs], float]:
    """Returns a function: the largest counter `key` of all benchmarks whose names begin with this prefix."""
    return lambda runs: max(row[key] for name, row in runs.items() if name.startswith(prefix) and key in row)


_SPRING_WALL_STEP = "step<SpringWall>/wavelets:16"
_SNAP_THROUGH_STEP = "step<SnapThrough>/wavelets:16"

CLAIMS = [
    Claim("implicit step by table / explicit step, spring-wall", 1.0,
          ratio("implicit_table<SpringWall>/wavelets:16", f"explicit_{_SPRING_WALL_STEP}")),
    Claim("implicit step by Newton / explicit step, spring-wall", 1.4,
          ratio("implicit_newton<SpringWall>/wavelets:16", f"explicit_{_SPRING_WALL_STEP}")),
    Claim("evaluations a step by Newton, spring-wall", 1.05,
          counter("implicit_newton<SpringWall>/wavelets:16", "evaluations")),
    Claim("implicit step by table / explicit step, snap-through", 1.1,
          ratio("implicit_table<SnapThrough>/wavelets:16", f"explicit_{_SNAP_THROUGH_STEP}")),
    Claim("massless step by table / explicit step, snap-through", 1.1,
          ratio("massless_table<SnapThrough>/wavelets:16", f"explicit_{_SNAP_THROUGH_STEP}")),
    Claim("error of any tabulated solution, of the travel", 1e-12,
          lambda runs: max(largest_counter("implicit_table", "position_error")(runs),
                          largest_counter("massless_table", "position_error")(runs))),
    Claim("compiled value and slope / std::exp loop, 16 wavelets", 1 / 6,
          ratio("latency<Compiled>/wavelets:16", "latency<ExpLoop>/wavelets:16")),
    Claim("compiled value and slope, slowest / fastest of 8 to 128 wavelets", 1.1,
          slowest_over_fastest([f"latency<Compiled>/wavelets:{n}" for n in (8, 16, 32, 64, 128)])),
    Claim("largest error of compiled curves [N*m]", 1e-12, largest_counter("latency<Compiled>", "max_error")),
    Claim("build of a compiled curve of 128 wavelets [ms]", 20.0,
          lambda runs: nanoseconds(runs["compile/wavelets:128"]) / 1e6),
    Claim("network value and slope / std::exp loop, 16 wavelets", 0.45,
          ratio("latency<Network>/wavelets:16", "latency<ExpLoop>/wavelets:16")),
    Claim("network in batches / std::exp loop in batches, 16 wavelets", 0.2,
          per_item("throughput_batch/wavelets:16", "throughput<ExpLoop>/wavelets:16")),
    Claim("two inputs, value and gradient / std::exp loop, 16 wavelets", 0.45,
          ratio("latency_of_inputs<Radial>/wavelets:16/inputs:2",
                "latency_of_inputs<RadialExpLoop>/wavelets:16/inputs:2")),
    Claim("99.9th percentile of a whole tick [ns]", 500.0, largest_counter("tick/", "p999_ns")),
    Claim("proved slope bound of 64 wavelets [ms]", 1.0,
          lambda runs: nanoseconds(runs["slope_bound/wavelets:64"]) / 1e6),
    Claim("proved gradient bound of 64 wavelets, two inputs [ms]", 1.0,
          lambda runs: nanoseconds(runs["gradient_bound_two_inputs/wavelets:64"]) / 1e6),
    Claim("excess of any proved slope bound, of the steepest slope", 0.01,
          lambda runs: max(largest_counter("slope_bound", "excess")(runs),
                          largest_counter("gradient_bound", "excess")(runs))),
    Claim("one prediction from Python / np.interp", 1.0, ratio("predict_one", "np_interp_one")),
    Claim("10^6 predictions from Python / SciPy's BSpline", 1.0, ratio("predict_many", "bspline_many")),
]  # fmt: skip


def measured_claims(folder: Path) -> list[tuple[str, float | None, float]]:
    """Returns each claim's text, its measured value (None: benchmark did not run) and its required value."""
    paths = sorted(folder.glob("bench_*.json"))
    runs = {str(row["name"]): row for path in paths for row in BenchmarkResults(folder, path.stem).rows}
    measured_values: list[tuple[str, float | None, float]] = []
    for claim in CLAIMS:
        try:
            measured_values.append((claim.text, claim.measured(runs), claim.required))
        except (KeyError, ValueError):
            measured_values.append((claim.text, None, claim.required))
    return measured_values


def main() -> None:
    print(f"{'':66} {'measured':>10} {'required':>10}")
    for text, measured, required in measured_claims(Path(sys.argv[1])):
        value = "not run" if measured is None else f"{measured:.4g}"
        is_missed = measured is not None and not measured <= required
        print(f"{text:66} {value:>10} {required:10.4g}{'  <- missed' if is_missed else ''}")


if __name__ == "__main__":
    main()
