# SPDX-License-Identifier: Apache-2.0
"""Measured objects: palpate beside the baselines, every fifth row held out, fitted and judged in one run.

python bench/real_data.py [SET ...] [--files 5] [--json FILE]      PALPATE_DATA names the folder of recordings
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from run import SCALE, count, leave

import palpate
from palpate.baselines import Compared, PerStroke, SmoothingSpline, compare
from palpate.recording.motion import velocity

EVERY = 5
"""Rows i with i mod 5 = 4 are held out."""

LIMIT = 1.3
"""No file may be worse than this many times its own two-spline error."""

MOST_FILES = 16
"""Of a set."""


@dataclass(frozen=True)
class Set:
    """How the recordings of one folder are read and identified."""

    pattern: str = "*.csv"
    reading: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)


SETS = {
    "keyswitches": Set(),
    "rubber_domes": Set(),
    "switch_springs": Set(),
    "motor_cogging": Set("map_*.csv"),
    "organ_probing": Set(
        reading={
            "position": "depth_mm",
            "force": "normal_force_N",
            "inputs": ("contact_x_mm", "contact_y_mm"),
        }
    ),
    "davinci_grip": Set(
        reading={"position": "back_angle_rad", "force": "back_torque_Nm"},
        options={"inputs": "position,velocity"},
    ),
    "afm_indentation": Set(reading={"position": "tip_position_um"}),
    "vhb4910_viscoelastic": Set("loadunload_*.csv"),
    "magnet_attraction": Set(),
}


def ours(train: palpate.Recording, test: palpate.Recording, options: Mapping[str, Any]) -> dict[str, Any]:
    """palpate on the kept rows, judged on the held-out ones."""
    start = time.perf_counter()
    model = palpate.identify(train, **options)
    seconds = time.perf_counter() - start
    check = palpate.verify(model, test)
    return {
        "nrmse": check.nrmse,
        "n_parameters": model.n_parameters,
        "n_wavelets": model.n_wavelets,
        "rung": model.fit.rung,
        "seconds": seconds,
        "finite": bool(np.isfinite(check.nrmse) and check.nrmse < 1.5),
    }


PASSIVE = "smoothing spline, two strokes, h >= 0"
"""What no passive model can be expected to beat."""


def passive_splines(train: palpate.Recording, test: palpate.Recording) -> dict[str, Any] | None:
    """Two splines that meet in their mean where release would lie above press; None without strokes."""
    if train.direction is None or test.direction is None or not {-1, 1} <= set(train.direction.tolist()):
        return None
    start = time.perf_counter()
    used = train.direction != 0
    pair = PerStroke(SmoothingSpline()).fit(
        np.column_stack([train.position, train.direction])[used].astype(float), train.force[used]
    )
    seconds = time.perf_counter() - start
    rows = test.direction != 0
    x, side, force = test.position[rows][:, None], test.direction[rows], test.force[rows]
    press, release = pair.press_.predict(x), pair.release_.predict(x)
    modelled = 0.5 * (press + release) + side * 0.5 * np.maximum(press - release, 0.0)
    nrmse = float(np.sqrt(np.mean((modelled - force) ** 2)) / np.std(force))
    return {"nrmse": nrmse, "n_parameters": pair.n_parameters_, "seconds": seconds}


def row_of(path: Path, kind: Set) -> dict[str, Any]:
    """One file: ours, and every baseline on the same rows."""
    reading = dict(kind.reading)
    try:
        recording = palpate.read_recording(path, **reading)
    except palpate.InputError as first:
        # files of one folder differ in a column: let the reader choose
        reading.pop("position", None)
        try:
            recording = palpate.read_recording(path, **reading)
        except palpate.InputError:
            return {"file": path.stem, "refused": str(first)}
    if "velocity" in kind.options.get("inputs", ""):
        # derived before rows are held out: a derivative needs its neighbours in time
        speed, _ = velocity(recording)
        recording = replace(recording, inputs=speed[:, None], input_names=("velocity",))
    train, test = recording.split(EVERY)
    try:
        found = ours(train, test, kind.options)
    except palpate.InputError as error:
        found = {"refused": str(error)}
    others = {each.name: each for each in compare([recording], EVERY)}
    splines = others["smoothing spline" if "smoothing spline" in others else "smoothing spline, two strokes"]
    baselines = {name: _numbers(each) for name, each in others.items()}
    if (passive := passive_splines(train, test)) is not None:
        baselines[PASSIVE] = passive
    return {
        "file": path.stem,
        **found,
        "splines": {"nrmse": splines.nrmse, "n_parameters": splines.n_parameters},
        "baselines": baselines,
    }


def _numbers(each: Compared) -> dict[str, Any]:
    return {"nrmse": each.nrmse, "n_parameters": each.n_parameters, "seconds": each.seconds}


def report(name: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """The medians of one set, and whatever is not as it should be."""
    good = [row for row in rows if "nrmse" in row]
    for row in rows:
        if "refused" in row:
            print(f"  {row['file']} is refused: {row['refused']}")
    if not good:
        return
    told = [
        ("palpate", [(row["nrmse"], row["n_parameters"], row["seconds"]) for row in good]),
        *(
            (
                baseline,
                [
                    (each["nrmse"], each["n_parameters"], each["seconds"])
                    for each in (row["baselines"][baseline] for row in good if baseline in row["baselines"])
                    if np.isfinite(each["nrmse"])
                ],
            )
            for baseline in dict.fromkeys(key for row in good for key in row["baselines"])
        ),
    ]
    title = f"median of {len(good)} files"
    print(f"  {title:40}{'nrmse':>9}{'worst':>9}{'parameters':>12}{'seconds':>9}")
    for method, numbers in told:
        if numbers:
            nrmse, parameters, seconds = zip(*numbers, strict=True)
            print(
                f"  {method:40}{median(nrmse):9.4f}{max(nrmse):9.4f}"
                f"{median(parameters):12.0f}{median(seconds):9.2f}"
            )
    _report_ratios("the splines'", {row["file"]: row["nrmse"] / row["splines"]["nrmse"] for row in good})
    passive = {row["file"]: row["baselines"].get(PASSIVE) for row in good}
    ratios = {row["file"]: row["nrmse"] / each["nrmse"] for row in good if (each := passive[row["file"]])}
    if ratios:
        _report_ratios("that of the splines with h >= 0", ratios)
    diverged = [row["file"] for row in good if not row["finite"]]
    print(f"  diverged: {', '.join(diverged) if diverged else 'none'}")


def _report_ratios(than: str, ratios: Mapping[str, float]) -> None:
    """How palpate's error compares, file by file."""
    worst = max(ratios, key=lambda file: ratios[file])
    over = sum(ratio > LIMIT for ratio in ratios.values())
    print(
        f"  error over {than}: median {median(ratios.values()):.2f}, worst {ratios[worst]:.2f} ({worst}); "
        f"above {LIMIT}: {over} of {len(ratios)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    chosen = SETS if SCALE >= 0.1 else ("switch_springs",)
    parser.add_argument("sets", nargs="*", default=list(chosen), metavar="SET ...")
    parser.add_argument(
        "--files", type=int, default=count(MOST_FILES), help="of each set at most, evenly spread"
    )
    parser.add_argument("--each", action="store_true", help="print a line for each file")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    folder = os.environ.get("PALPATE_DATA")
    if folder is None or not Path(folder).is_dir():
        print("skipped: needs measured data, set PALPATE_DATA")
        return
    results: dict[str, list[dict[str, Any]]] = {}
    for name in options.sets:
        files = sorted((Path(folder) / name).glob(SETS[name].pattern))
        files = files[:: max(1, -(-len(files) // options.files))]
        print(f"\n{name}", flush=True)
        results[name] = []
        for path in files:
            row = row_of(path, SETS[name])
            results[name].append(row)
            if options.each and "nrmse" in row:
                print(
                    f"  {row['file'][:48]:50}{row['nrmse']:9.4f}{row['n_parameters']:6d} {row['rung']:12}"
                    f"{row['seconds']:7.2f} s   splines {row['splines']['nrmse']:.4f} "
                    f"{row['splines']['n_parameters']:5d}",
                    flush=True,
                )
        report(name, results[name])
    leave(options.json, results)


if __name__ == "__main__":
    main()
