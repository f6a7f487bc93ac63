# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks of one run say about each claim: python bench/ratios.py build/bench

Printed, and written to ratios.json beside them.

Times are medians over the interleaved repetitions of one run, so that what the machine did meanwhile happened
to both sides of a ratio.
"""

import json
import statistics
import sys
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple


class Run(NamedTuple):
    """The repetitions of one benchmark."""

    ns: float
    counters: dict[str, float]


class Claim(NamedTuple):
    text: str
    most: float
    measured: Callable[[dict[str, Run]], float]


_NS = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}


def runs(folder: Path) -> dict[str, Run]:
    """Every benchmark of every JSON file in the folder, by name."""
    found: defaultdict[str, list[dict[str, Any]]] = defaultdict(list)
    for path in sorted(folder.glob("bench_*.json")):
        for entry in json.loads(path.read_text(encoding="utf-8"))["benchmarks"]:
            if entry.get("run_type", "iteration") == "iteration" and not entry.get("error_occurred"):
                found[entry.get("run_name", entry["name"])].append(entry)
    return {
        name: Run(
            statistics.median(e["cpu_time"] * _NS[e["time_unit"]] for e in entries),
            {
                key: statistics.median(e[key] for e in entries)
                for key, value in entries[0].items()
                if isinstance(value, int | float)
            },
        )
        for name, entries in found.items()
    }


def ratio(name: str, yardstick: str) -> Callable[[dict[str, Run]], float]:
    return lambda run: run[name].ns / run[yardstick].ns


def per_item(name: str, yardstick: str) -> Callable[[dict[str, Run]], float]:
    return lambda run: run[yardstick].counters["items_per_second"] / run[name].counters["items_per_second"]


def counter(name: str, key: str) -> Callable[[dict[str, Run]], float]:
    return lambda run: run[name].counters[key]


def spread(names: list[str]) -> Callable[[dict[str, Run]], float]:
    return lambda run: max(run[n].ns for n in names) / min(run[n].ns for n in names)


def worst(prefix: str, key: str) -> Callable[[dict[str, Run]], float]:
    """The largest of a counter, over the benchmarks of that name that have it."""
    return lambda run: max(
        one.counters[key] for name, one in run.items() if name.startswith(prefix) and key in one.counters
    )


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
          lambda run: run["compile/wavelets:128"].ns / 1e6),
    Claim("network value and slope / std::exp loop, 16 wavelets", 0.45,
          ratio("latency<Network>/wavelets:16", "latency<ExpLoop>/wavelets:16")),
    Claim("network in batches / std::exp loop in batches, 16 wavelets", 0.2,
          per_item("throughput_batch/wavelets:16", "throughput<ExpLoop>/wavelets:16")),
    Claim("two inputs, value and gradient / std::exp loop, 16 wavelets", 0.45,
          ratio("latency_of_inputs<Radial>/wavelets:16/inputs:2",
                "latency_of_inputs<RadialExpLoop>/wavelets:16/inputs:2")),
    Claim("99.9th percentile of a whole tick [ns]", 500.0, worst("tick/", "p999_ns")),
    Claim("proved slope bound of 64 wavelets [ms]", 1.0, lambda run: run["slope_bound/wavelets:64"].ns / 1e6),
    Claim("proved gradient bound of 64 wavelets, two inputs [ms]", 1.0,
          lambda run: run["gradient_bound_two_inputs/wavelets:64"].ns / 1e6),
    Claim("excess of any proved slope bound, of the steepest slope", 0.01,
          lambda run: max(worst("slope_bound", "excess")(run),
                          worst("gradient_bound", "excess")(run))),
    Claim("one prediction from Python / np.interp", 1.0, ratio("predict_one", "np_interp_one")),
    Claim("10^6 predictions from Python / SciPy's BSpline", 1.0, ratio("predict_many", "bspline_many")),
]  # fmt: skip


def main() -> None:
    folder = Path(sys.argv[1])
    run = runs(folder)
    found = []
    print(f"{'':66} {'measured':>10} {'asked':>10}")
    for claim in CLAIMS:
        try:
            measured = claim.measured(run)
        except (KeyError, ValueError):
            print(f"{claim.text:66} {'not run':>10} {claim.most:10.4g}")
            continue
        verdict = "" if measured <= claim.most else "  <- missed"
        print(f"{claim.text:66} {measured:10.4g} {claim.most:10.4g}{verdict}")
        found.append({"name": claim.text, "measured": measured, "most": claim.most})
    (folder / "ratios.json").write_text(
        json.dumps({"context": {}, "benchmarks": found}, indent=1), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
