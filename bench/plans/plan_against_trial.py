# SPDX-License-Identifier: Apache-2.0
"""Compares the plan of each object with the best structure of an exhaustive trial.

    python bench/plans/plan_against_trial.py --to docs [--seconds 2] [--switches 5] [--grid 4]

The trial renders every structure in closed loop on three devices, with and without compensation, over a grid
of couplings, masses and dampings. It uses the identified model and, if the plan limited its slopes, also the
limited model. The objects are a spring with a wall, a switch that snaps through and, if PALPATE_DATA names
the measured data, real keyboard switches. The error is the RMS of the commanded force minus the force of the
identified model at the handle at the end of the tick, while a hand moves through the domain. Then hands
without damping press on the steepest part of the object.

Prints the tables of FOLDER/plan-against-trial.md, writes them there if that page exists, and writes all
numbers to FOLDER/figures/plan-against-trial.json. Exits with 1 if a plan does not come to rest or is worse
than 1.2 times the best certified candidate.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.plans.trial import Row, compare, measured_switches, objects
from bench.studies import fill_tables, markdown_table, where, write_json

WORST_RATIO = 1.2

ERROR_COLUMNS = (
    "object",
    "device",
    "plan",
    "error [% of range]",
    "best certified",
    "error",
    "plan / best",
    "best at rest, proved or not",
    "error",
)
LIMITED_PLAN_COLUMNS = (
    "object",
    "device",
    "force error, RMS [% of range]",
    "largest",
    "travel with unchanged force [%]",
    "largest error there",
    "plan",
    "direct",
)


def tables(rows: list[Row], omitted: str) -> dict[str, str]:
    """Returns the tables of the documentation page; a key is the name in the mark before the table."""
    errors, limited_plans = [], []
    for row in rows:
        percent_of_range = 100.0 / row.force_range
        errors.append(
            (
                row.object,
                row.device,
                row.plan,
                f"{percent_of_range * row.error:.3g}",
                row.best,
                f"{percent_of_range * row.best_error:.3g}",
                f"{row.ratio:.3f}",
                row.best_at_rest,
                f"{percent_of_range * row.best_at_rest_error:.3g}",
            )
        )
        if row.force_error_rms is not None:
            limited_plans.append(
                (
                    row.object,
                    row.device,
                    f"{percent_of_range * row.force_error_rms:.3g}",
                    f"{percent_of_range * row.force_error_largest:.3g}",
                    f"{100.0 * row.unchanged_share:.0f}",
                    f"{percent_of_range * row.unchanged_force_error:.2g}",
                    "oscillates" if row.oscillates else "at rest",
                    "oscillates" if row.direct_oscillates else "at rest",
                )
            )
    machine = where()
    return {
        "where": "Measured by `python bench/plans/plan_against_trial.py --to docs`: "
        f"palpate {machine['palpate']}, {machine['date']}, {machine['machine']}. "
        f"Worst of plan over best certified: {max(row.ratio for row in rows):.3f}.{omitted}\n",
        "errors": markdown_table(ERROR_COLUMNS, errors, text_columns=(0, 1, 2, 4, 7)),
        "weak": markdown_table(LIMITED_PLAN_COLUMNS, limited_plans, text_columns=(0, 1, 6, 7)),
    }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--switches", type=int, default=5)
    parser.add_argument("--grid", type=int, default=4)
    options = parser.parse_args()
    omitted = ""
    if len(measured_switches(options.switches)) < options.switches:
        omitted = " Omitted: the measured switches, which need the folder that PALPATE_DATA names."
    rows = []
    for name, model, devices in objects(options.switches):
        for device in devices:
            rows.append(compare(name, model, device, options.seconds, options.grid))
            print(f"{name} on {device.id}: plan / best {rows[-1].ratio:.3f}", file=sys.stderr, flush=True)
    page_tables = tables(rows, omitted)
    print("\n".join(page_tables.values()))
    write_json(options.to / "figures" / "plan-against-trial.json", [asdict(row) for row in rows])
    fill_tables(options.to / "plan-against-trial.md", page_tables)
    failed = [row for row in rows if not row.ratio <= WORST_RATIO or row.oscillates]
    for row in failed:
        reason = "does not come to rest" if row.oscillates else f"exceeds {WORST_RATIO} times the best error"
        print(f"{row.object} on {row.device}: the plan {reason}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
