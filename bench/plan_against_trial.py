# SPDX-License-Identifier: Apache-2.0
"""Is the plan's structure as good as the best that trial finds?

Every structure, with and without compensation, over a grid of couplings, masses and dampings, is rendered on
three devices in closed loop, as the plan is, each with the identified model and with the one whose slopes the
plan limited: for a spring that meets a wall, a switch that snaps through and, where PALPATE_DATA names the
measured data, real keyboard switches. The error is the commanded force less the identified model's at the
handle at the end of the tick, RMS, while a hand sweeps the domain to and fro. Each is then leaned on, where
the object is steepest, by hands that damp nothing.

Prints both tables of FOLDER/plan-against-trial.md, puts them there, writes all numbers to
FOLDER/figures/plan-against-trial.json, and ends with 1 where a plan is left shaking or is worse than 1.2
times the best candidate that is certified.

    python bench/plan_against_trial.py --to docs [--seconds 2] [--switches 5] [--grid 4]
"""

from __future__ import annotations

import argparse
import datetime
import json
import platform
import sys
from dataclasses import asdict
from pathlib import Path

from trial import Row, compare, measured_switches, objects

from palpate import _core
from palpate.cli.pages import with_tables

WORST_RATIO = 1.2


def tables(rows: list[Row], left_out: str) -> dict[str, str]:
    """The page's tables by their marks."""
    worst = max(row.ratio for row in rows)
    errors = [
        "| object | device | plan | error [% of range] | best certified | error | plan / best "
        "| best at rest, proved or not | error |\n",
        "| --- | --- | --- | ---: | --- | ---: | ---: | --- | ---: |\n",
    ]
    weak = [
        "| object | device | loss, RMS [% of range] | largest | travel left alone [%] | departure there "
        "| the plan | plain direct |\n",
        "| --- | --- | ---: | ---: | ---: | ---: | --- | --- |\n",
    ]
    for row in rows:
        percent = 100.0 / row.force_range
        errors.append(
            f"| {row.object} | {row.device} | {row.plan} | {percent * row.error:.3g} | {row.best} "
            f"| {percent * row.best_error:.3g} | {row.ratio:.3f} | {row.best_at_rest} "
            f"| {percent * row.best_at_rest_error:.3g} |\n"
        )
        if row.loss_rms is not None:
            weak.append(
                f"| {row.object} | {row.device} | {percent * row.loss_rms:.3g} "
                f"| {percent * row.loss_largest:.3g} | {100.0 * row.kept:.0f} "
                f"| {percent * row.kept_departure:.2g} | {'shakes' if row.shakes else 'rests'} "
                f"| {'shakes' if row.direct_shakes else 'rests'} |\n"
            )
    where = (
        f"Measured by `python bench/plan_against_trial.py --to docs`: palpate {_core.__version__}, "
        f"{datetime.datetime.now(datetime.timezone.utc).date().isoformat()}, {platform.machine()}. "
        f"Worst of plan over best certified: {worst:.3f}.{left_out}\n"
    )
    return {"where": where, "errors": "".join(errors), "weak": "".join(weak)}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--switches", type=int, default=5)
    parser.add_argument("--grid", type=int, default=4)
    given = parser.parse_args()
    page = given.to / "plan-against-trial.md"
    text = page.read_text(encoding="utf-8")
    left_out = ""
    if len(measured_switches(given.switches)) < given.switches:
        left_out = " Left out: the measured switches, which need the folder that PALPATE_DATA names."
    rows = []
    for name, model, devices in objects(given.switches):
        for device in devices:
            rows.append(compare(name, model, device, given.seconds, given.grid))
            print(f"{name} on {device.id}: plan / best {rows[-1].ratio:.3f}", file=sys.stderr, flush=True)
    written = tables(rows, left_out)
    print("\n".join(written.values()))
    text = with_tables(text, page, written)
    page.write_text(text, encoding="utf-8")
    numbers = json.dumps([asdict(row) for row in rows], indent=1)
    (given.to / "figures" / "plan-against-trial.json").write_text(numbers + "\n", encoding="utf-8")
    missed = [row for row in rows if not row.ratio <= WORST_RATIO or row.shakes]
    for row in missed:
        print(f"{row.object} on {row.device}: the plan misses", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
