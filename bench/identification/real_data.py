# SPDX-License-Identifier: Apache-2.0
"""Compares palpate with the baselines on measured objects; every fifth row is held out.

python bench/identification/real_data.py [SET ...] [--files 5] [--json FILE]

PALPATE_DATA names the folder of recordings.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.figures import WORST_SPLINE_RATIO
from bench.studies import SCALE, count, measured_data, write_results

import palpate
from palpate.baselines import PASSIVE_SPLINE, Compared, comparable, compare
from palpate.recording.motion import velocity
from palpate.verification.metrics import normalised, root_mean_square

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

EVERY = 5
"""Number n: the rows i with i mod n = n - 1 of a recording are held out."""

MOST_FILES = 16
"""Largest number of files of one folder that are identified."""


AT_TURN = 0.01
"""Width of the part of the travel next to the reversal from press to release [share of the travel]"""


@dataclass(frozen=True)
class Set:
    """Options for reading and identifying the recordings of one folder."""

    pattern: str = "*.csv"
    reading: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    folder: str = ""
    """Name of the folder, if it differs from the name of the set of recordings"""
    with_baselines: bool = True
    """False if the baselines are fitted to the same files in another set, with the same results"""


SETS = {
    "keyswitches": Set(),
    "rubber_domes": Set(),
    "rubber_domes_h_of_any_sign": Set(
        options={"hysteresis_nonnegative": False}, folder="rubber_domes", with_baselines=False
    ),
    "rubber_domes_force_25_ms_earlier": Set(reading={"force_late_s": 0.025}, folder="rubber_domes"),
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


@dataclass(frozen=True)
class Crossing:
    """Excess of release force over press force in a recording, which no passive model can fit."""

    floor: float
    """NRMSE of the best force with h >= 0: the measured strokes, replaced by their mean where they cross. It
    is fitted to the judged rows with their noise."""
    excess: float
    """Largest release force minus press force at equal position [unit of the recording]"""
    at_turn: Rows
    """(n,) true for rows in the hundredth of the travel next to the reversal from press to release"""

    @staticmethod
    def of(recording: palpate.Recording, compared: Rows) -> Crossing | None:
        """Compares release and press force in the rows `compared` (n,); None if one stroke is missing."""
        x, direction, force = recording.position, recording.direction, recording.force
        if direction is None or not {-1, 1} <= set(direction.tolist()):
            return None
        press, release = (_stroke(recording, side) for side in (1, -1))
        in_both_strokes = (x >= max(press[0][0], release[0][0])) & (x <= min(press[0][-1], release[0][-1]))
        excess = np.where(
            in_both_strokes, np.maximum(np.interp(x, *release) - np.interp(x, *press), 0.0), 0.0
        )
        floor = float(np.sqrt(np.mean(excess[compared] ** 2))) / 2.0 / float(np.std(force[compared]))
        return Crossing(floor, float(excess.max()), x > x.max() - AT_TURN * np.ptp(x))


def _stroke(recording: palpate.Recording, side: int) -> tuple[Array, Array]:
    """Returns the distinct positions of one stroke and the mean recorded force at each of them."""
    assert recording.direction is not None
    in_stroke = recording.direction == side
    positions, index_of_position = np.unique(recording.position[in_stroke], return_inverse=True)
    return positions, np.bincount(index_of_position, recording.force[in_stroke]) / np.bincount(
        index_of_position
    )


def fit_palpate(
    recording: palpate.Recording, train: palpate.Recording, options: Mapping[str, Any]
) -> dict[str, Any]:
    """Identifies a model from the rows that are not held out, and tests the rows held out for the baselines.

    The test uses the whole motion, because velocity and play need the rows between. Only the force of the
    held-out rows is unknown to the model.
    """
    start = time.perf_counter()
    model = palpate.identify(train, **options)
    seconds = time.perf_counter() - start
    check = palpate.verify(model, recording)
    held_out = np.arange(len(recording)) % EVERY == EVERY - 1
    compared = held_out & comparable(recording) & check.rows
    error = check.residual[compared[check.rows]]
    nrmse = normalised(root_mean_square(error), recording.force[compared])
    crossing_numbers: dict[str, float] = {}
    if (crossing := Crossing.of(recording, compared)) is not None:
        error_at_turn = error[crossing.at_turn[compared]]
        crossing_numbers = {
            "floor": crossing.floor,
            "release_above_press": crossing.excess,
            "share_at_turn": float(error_at_turn @ error_at_turn / (error @ error)),
        }
    return {
        "nrmse": nrmse,
        "n_parameters": model.n_parameters,
        "n_wavelets": model.n_wavelets,
        "model_class": model.fit.model_class,
        "seconds": seconds,
        "finite": bool(np.isfinite(nrmse) and nrmse < 1.5),
        **crossing_numbers,
    }


def row_of(path: Path, recording_set: Set) -> dict[str, Any]:
    """Returns the errors, sizes and times of palpate and of every baseline method on the rows of one file."""
    reading = dict(recording_set.reading)
    try:
        recording = palpate.read_recording(path, **reading)
    except palpate.InputError as first_error:
        # The named position column is missing in this file, so `read_recording` chooses one.
        reading.pop("position", None)
        try:
            recording = palpate.read_recording(path, **reading)
        except palpate.InputError:
            return {"file": path.stem, "refused": str(first_error)}
    if "velocity" in recording_set.options.get("inputs", ""):
        # velocity is computed before rows are held out, because a derivative needs neighbouring rows
        speed, _ = velocity(recording)
        recording = replace(recording, inputs=speed[:, None], input_names=("velocity",))
    train, _ = recording.split(EVERY)
    try:
        numbers = fit_palpate(recording, train, recording_set.options)
    except palpate.InputError as error:
        numbers = {"refused": str(error)}
    baselines = {each.name: each for each in compare([recording], EVERY)}
    splines = baselines[
        "smoothing spline" if "smoothing spline" in baselines else "smoothing spline, two strokes"
    ]
    return {
        "file": path.stem,
        **numbers,
        "splines": _numbers(splines),
        "passive_splines": _numbers(baselines[PASSIVE_SPLINE]) if PASSIVE_SPLINE in baselines else None,
        "baselines": {name: _numbers(each) for name, each in baselines.items()}
        if recording_set.with_baselines
        else {},
    }


def _numbers(each: Compared) -> dict[str, Any]:
    numbers = {"nrmse": each.nrmse, "n_parameters": each.n_parameters, "seconds": each.seconds}
    return numbers if each.refused is None else {**numbers, "refused": each.refused}


def report(name: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Prints one set of files: median error of each method, refused files, and models that diverged."""
    measured_rows = [row for row in rows if "nrmse" in row]
    for row in rows:
        for prefix, numbers in (
            ("", row),
            *((f"{name}: ", each) for name, each in row.get("baselines", {}).items()),
        ):
            if "refused" in numbers:
                print(f"  {row['file']} is refused, {prefix}{numbers['refused']}")
    if not measured_rows:
        return
    title = f"median of {len(measured_rows)} files"
    print(f"  {title:52}{'nrmse':>9}{'worst':>9}{'parameters':>12}{'seconds':>9}")
    _report_line("palpate", measured_rows, len(measured_rows))
    for method in dict.fromkeys(key for row in measured_rows for key in row["baselines"]):
        results = [row["baselines"][method] for row in measured_rows if method in row["baselines"]]
        _report_line(method, [each for each in results if np.isfinite(each["nrmse"])], len(measured_rows))
    _report_ratios("the splines'", {row["file"]: (row, row["splines"]) for row in measured_rows})
    passive = {row["file"]: (row, row["passive_splines"]) for row in measured_rows if row["passive_splines"]}
    _report_ratios("that of the splines with h >= 0", passive)
    diverged = [row["file"] for row in measured_rows if not row["finite"]]
    print(f"  diverged: {', '.join(diverged) if diverged else 'none'}")


def _report_line(method: str, each: Sequence[Mapping[str, Any]], n_files: int) -> None:
    """Prints NRMSE, parameters and time of one method, and the number of files if it did not fit all."""
    if each:
        name = method if len(each) == n_files else f"{method} ({len(each)} files)"
        nrmse, sizes, seconds = ([row[key] for row in each] for key in ("nrmse", "n_parameters", "seconds"))
        print(f"  {name:52}{median(nrmse):9.4f}{max(nrmse):9.4f}{median(sizes):12.0f}{median(seconds):9.2f}")


def _report_ratios(reference: str, pairs: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]]) -> None:
    """Prints statistics of all files: NRMSE of palpate divided by NRMSE of the reference method."""
    ratios = {
        file: palpate_row["nrmse"] / spline_row["nrmse"]
        for file, (palpate_row, spline_row) in pairs.items()
        if spline_row["nrmse"] > 0.0
    }
    if not ratios:
        return
    worst = max(ratios, key=lambda file: ratios[file])
    n_above = sum(ratio > WORST_SPLINE_RATIO for ratio in ratios.values())
    print(
        f"  error over {reference}: median {median(ratios.values()):.2f}, "
        f"worst {ratios[worst]:.2f} ({worst}); "
        f"above {WORST_SPLINE_RATIO}: {n_above} of {len(ratios)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    chosen = SETS if SCALE >= 0.1 else ("switch_springs",)
    parser.add_argument("sets", nargs="*", default=list(chosen), metavar="SET ...")
    parser.add_argument(
        "--files", type=int, default=count(MOST_FILES), help="largest number for each set, evenly spread"
    )
    parser.add_argument("--each", action="store_true", help="print a line for each file")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    if (folder := measured_data()) is None:
        return
    results: dict[str, list[dict[str, Any]]] = {}
    for name in options.sets:
        files = sorted((folder / (SETS[name].folder or name)).glob(SETS[name].pattern))
        files = files[:: max(1, -(-len(files) // options.files))]
        print(f"\n{name}", flush=True)
        results[name] = []
        for path in files:
            row = row_of(path, SETS[name])
            results[name].append(row)
            if options.each and "nrmse" in row:
                passive = row["passive_splines"]
                print(
                    f"  {row['file'][:48]:50}{row['nrmse']:9.4f}{row['n_parameters']:6d} "
                    f"{row['model_class']:12}"
                    f"{row['seconds']:7.2f} s   splines {row['splines']['nrmse']:.4f} "
                    f"{row['splines']['n_parameters']:5d}"
                    + (f", with h >= 0 {passive['nrmse']:.4f}" if passive else "")
                    + (f"; floor {row['floor']:.4f}" if "floor" in row else "")
                    + (f", at the turn {100 * row['share_at_turn']:.0f} %" if "floor" in row else ""),
                    flush=True,
                )
        report(name, results[name])
    write_results(options.json, results)


if __name__ == "__main__":
    main()
