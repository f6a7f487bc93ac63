# SPDX-License-Identifier: Apache-2.0
"""P1 to P6: error, parameters and time of palpate and its rivals, measured in one run.

python bench/identification.py [P1 ...] [--draws 7] [--json FILE] [--only NAME ...]
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from pathlib import Path
from statistics import median

from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parent))

from peers.methods import METHODS, Method
from problems import NAMES, TITLES, draws, problem


def measured(method: Method, name: str, wanted: int) -> dict[str, object]:
    """Medians over the noise draws; why not, where it does not apply."""
    first = problem(name)
    if first.X.shape[1] not in method.inputs:
        return {"skipped": "one input only"}
    if len(first.y) > method.most_rows:
        return {"skipped": f"takes too long with {len(first.y)} rows"}
    found = []
    for draw in range(draws(name, wanted)):
        rows = problem(name, draw)
        try:
            fitted = method.fit(rows.X, rows.y)
        except ImportError as missing:
            return {"skipped": f"needs {missing.name}"}
        found.append((rows.nrmse(fitted.predict(rows.X_test)), fitted))
    return {
        "nrmse": median(error for error, _ in found),
        "worst": max(error for error, _ in found),
        "n_parameters": int(median(each.n_parameters for _, each in found)),
        "fit_s": median(each.fit_seconds for _, each in found),
        "tuning_s": median(each.tuning_seconds for _, each in found),
        "setting": found[0][1].setting,
        "draws": len(found),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("problems", nargs="*", default=list(NAMES), metavar="P1 ...")
    parser.add_argument("--draws", type=int, default=7)
    parser.add_argument("--only", nargs="*", default=None, help="names of methods")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    results = []
    with threadpool_limits(limits=1):
        for name in options.problems:
            print(f"\n{name}: {TITLES[name]}")
            print(f"{'':28}{'nrmse':>10}{'parameters':>12}{'fit s':>9}{'tuning s':>10}  setting", flush=True)
            for method in METHODS:
                if options.only and method.name not in options.only:
                    continue
                row = measured(method, name, options.draws)
                results.append({"problem": name, "method": method.name, **row})
                if "skipped" in row:
                    print(f"{method.name:28}  {row['skipped']}")
                else:
                    print(
                        f"{method.name:28}{row['nrmse']:10.2e}{row['n_parameters']:12d}{row['fit_s']:9.3f}"
                        f"{row['tuning_s']:10.2f}  {row['setting']}",
                        flush=True,
                    )
    if options.json is not None:
        machine = {"python": platform.python_version(), "machine": platform.machine(), "threads": 1}
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(
            json.dumps({"machine": machine, "results": results}, indent=1), encoding="utf-8"
        )


if __name__ == "__main__":
    main()
