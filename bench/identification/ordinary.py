# SPDX-License-Identifier: Apache-2.0
"""Judges models of ordinary recordings, such as a button on a tester or a knob in a hand, on the exact force.

python bench/identification/ordinary.py [--draws 397] [--seed 15920] [--added] [--each] [--json FILE]

Each draw is an object and an operator (motion and measuring chain) with random parameters and noise. Draws
below 1000 are for development; published results use draws from 1000 on. Draws before 13540 have the first
15 objects and 16 operators. With --added every draw has one of the further objects or operators.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.ordinary_objects import Array, Object
from bench.identification.ordinary_recordings import FIRST_PAIRS, PAIRS, Pair, Rows, drawn
from bench.identification.ordinary_recordings import settled as within_stroke
from bench.studies import count, markdown_table, write_results

import palpate
from palpate import InputError, Model, Recording
from palpate._core.model import play
from palpate.verdict import FORCE_JND
from palpate.verification.metrics import force_floor, normalised, root_mean_square

DRAWS = len(PAIRS)

FIRST = 15920
"""First draw of the published results"""

PUBLISHED = 1000
"""Smallest draw of published results"""

POINTS = 4001
"""Number of positions of a stroke at which a model is judged"""

PLACE = 0.01
"""Length of the smallest place of a stroke that is judged [share of the stroke]"""

REPORTED = ("left_out_nrmse", "shift_nrmse")
"""Notes of a model that report an error besides that on the rows of the fit"""

PROPOSED_LAG = re.compile(r"--force-late-s (\d+(\.\d+)?)")
"""Advice to correct a lag [s]"""

FIRST_PRESS = re.compile(r"first (press|stroke)")
"""Words with which a note or the verdict names a first press that differs from the later ones"""

LIMITS = {
    "late force": "a late force",
    "coarse force": "a late force",
    "backlash": "backlash",
    "drift": "a moved zero",
    "second zero": "a moved zero",
}
"""Operator -> what one loop can hide of its fault, as a decision on a model names it"""

ALLOWED_RATIO = 1.3
"""Largest true error divided by the reported error of a good model"""

OUTSIDE = 0.3
"""Range below and above the strokes in which the force is judged [share of the stroke]"""


@dataclass(frozen=True)
class Truth:
    """Exact force of an object along one press and one release at constant speed, from rest; an object that
    softens was pressed before. A mirrored recording has mirrored positions, directions and forces."""

    time: Array
    """(n,) [s]"""
    position: Array
    """(n,) [m or rad], evenly spaced"""
    side: Array
    """(n,) +1 press, -1 release"""
    speed: float
    """[m/s or rad/s]"""
    force: Array
    """(n,) [N or N*m]"""
    judged: NDArray[np.bool_]
    """(n,) False after each turn, while the friction of the object reverses"""
    object: Object

    @classmethod
    def of(cls, rows: Rows) -> Truth:
        """Returns the truth over the recorded strokes, at the median speed of the recording."""
        object, x = rows.object, rows.motion.x[rows.contact]
        lower = 0.0 if object.leaves else float(x.min())
        press = np.linspace(lower, float(x.max()), POINTS)
        position, side = np.r_[press, press[::-1]], np.repeat([1.0, -1.0], POINTS)
        velocity = float(np.median(np.abs(rows.motion.velocity[rows.contact & (rows.motion.side != 0)])))
        time = (press[1] - press[0]) / velocity * np.arange(2.0 * POINTS)
        before = np.r_[position[POINTS:], position]
        force = object.force(time, position, side, velocity * side) * object.share_left(before)[POINTS:]
        state, sign = object.state(before)[POINTS:], -1.0 if rows.mirrored else 1.0
        within = within_stroke(state, side)
        return cls(time, sign * position, sign * side, velocity, sign * force, within, object)

    def modelled(self, model: Model) -> Array:
        """Returns the force (n,) of a model along the same motion, in which its friction reverses over its
        play radius, as in a rendering."""
        if model.memory is not None:
            return np.asarray(model.force_over_time(self.time, self.position)[0])
        return _at_speed(model, self.position, self.state(model), self.speed * self.side)

    def state(self, model: Model) -> Array:
        """Returns the direction state (n,) of a model along the same motion."""
        if (radius := model.play_radius) is None:
            return self.side
        before = np.r_[self.position[POINTS:], self.position]
        return np.clip((before - play(before, radius))[POINTS:] / radius, -1.0, 1.0)

    def error(self, model: Model) -> float:
        """Returns the RMS error of a model divided by the standard deviation of the exact force."""
        error = (self.modelled(model) - self.force)[self.judged]
        return normalised(root_mean_square(error), self.force[self.judged])

    def worst_place(self, model: Model) -> float:
        """Returns the largest error that holds over a place of a stroke [just noticeable differences]."""
        allowed = np.maximum(FORCE_JND * np.abs(self.force), force_floor(self.force))
        error = np.abs(self.modelled(model) - self.force) / allowed * self.judged
        place = round(PLACE * POINTS)
        strokes = error.reshape(2, POINTS)
        windows = np.lib.stride_tricks.sliding_window_view(strokes, place, axis=1)
        return float(windows.min(axis=-1).max())

    def steepest(self, force: Array, judged: NDArray[np.bool_]) -> float:
        """Returns the largest |slope| of a force (n,) over the judged positions of a stroke [N/m or
        N*m/rad]."""
        steps = np.diff(force.reshape(2, POINTS), axis=1)
        inside = judged.reshape(2, POINTS)
        steps = steps[inside[:, 1:] & inside[:, :-1]]
        return float(np.abs(steps).max() / abs(self.position[1] - self.position[0]))

    def slope_ratio(self, model: Model, *, settled: bool = False) -> float:
        """Returns the steepest slope of a model divided by that of the exact force; if `settled`, without the
        ends of the strokes behind a turn, in which the friction of the object or of the model reverses."""
        within = self.judged & within_stroke(self.state(model), self.side)
        judged = within if settled else np.ones_like(self.judged)
        return self.steepest(self.modelled(model), judged) / self.steepest(self.force, judged)

    def pull(self, model: Model) -> float | None:
        """Returns the largest force with which a model pulls below and above the strokes [just noticeable
        differences]; None for an object that can pull."""
        if not self.object.leaves:
            return None
        lower, upper = self.position[0], self.position[POINTS - 1]
        beyond = np.linspace(0.0, OUTSIDE * (upper - lower), POINTS)
        position = np.r_[lower - beyond, upper + beyond]
        forces = [
            _at_speed(model, position, np.full(len(position), side), 0.0 * position) for side in (1.0, -1.0)
        ]
        return max(0.0, -float(np.min(self.side[0] * np.array(forces)))) / force_floor(self.force)


def _at_speed(model: Model, position: Array, state: Array, velocity: Array) -> Array:
    """Returns the force (n,) of a model without its memory, at positions (n,), direction states (n,) and
    velocities (n,)."""
    if model.dimension > 1:
        columns = [position, velocity, *([state] if model.hysteretic else [])]
        return np.asarray(model.predict(np.column_stack(columns)))
    return np.asarray(model.force(position, direction=state) + (model.damping or 0.0) * velocity)


def classes_of(model: Model) -> dict[str, bool]:
    """Returns the model classes of a model: name -> True if the model has it. Branches that slip are
    hysteresis."""
    memory = model.memory
    return {
        "hysteresis": model.hysteretic
        or (memory is not None and bool(np.isfinite(memory.yield_stretch).any())),
        "velocity": model.of_velocity or model.damping is not None,
        "memory": memory is not None and bool(np.isfinite(memory.time_constant_s).any()),
        "period": model.period is not None,
        "mass": model.mass is not None,
    }


def resolvable(rows: Rows) -> dict[str, bool]:
    """Returns True for each model class that the recording determines, present or not."""
    exists = rows.object.classes
    speeds = rows.timed and rows.varied
    unknown_loop = rows.loop or (exists["velocity"] and not speeds) or (exists["memory"] and not rows.held)
    return {
        "hysteresis": not unknown_loop,
        "velocity": not rows.loop and (speeds if exists["velocity"] else not exists["memory"] or rows.held),
        "memory": not rows.loop and (rows.held if exists["memory"] else not exists["velocity"] or speeds),
        "period": exists["period"],
        "mass": not rows.loop and (not exists["mass"] or (rows.timed and bool(rows.inertial.any()))),
    }


def reference(rows: Rows) -> Model:
    """Identifies a model from the clean rows of a recording with the true class."""
    exists, known = rows.object.classes, resolvable(rows)
    if exists["memory"] and rows.held:
        inputs = "auto"
    elif exists["velocity"] and rows.timed and rows.varied:
        inputs = "position,velocity"
    elif exists["hysteresis"] or exists["velocity"] or exists["memory"]:
        inputs = "position,hysteresis"
    else:
        inputs = "position"
    period = rows.object.period
    options = {} if period is None or not known["period"] else {"period": period * rows.object.travel}
    return palpate.identify(rows.clean(), inputs=inputs, **options)


def reported_error(model: Model) -> float:
    """Returns the largest NRMSE that a model reports."""
    return float(max(model.fit.nrmse, *(model.notes.get(name, 0.0) for name in REPORTED)))


def judged(model: Model, best: Model, rows: Rows) -> dict[str, Any]:
    """Returns what the exact force shows about a model, compared with the reference fit `best`."""
    truth, unmirrored = Truth.of(rows), Truth.of(replace(rows, mirrored=False))
    error, place, best_error = truth.error(model), truth.worst_place(model), unmirrored.error(best)
    found, known = classes_of(model), resolvable(rows)
    reported, softens = reported_error(model), rows.object.softening > 0.0
    stated = f"{model.verdict} {model.notes.get('identification', '')} {model.notes.get('rows', '')}"
    mass = rows.object.inertia * rows.object.scale / rows.object.travel
    return {
        "true_error": error,
        "reported_error": reported,
        "reference_error": best_error,
        "error_ratio": error / best_error if best_error > 0.0 else float(error > 0.0),
        "worst_place_jnd": place,
        "slope_ratio": truth.slope_ratio(model),
        "settled_slope_ratio": truth.slope_ratio(model, settled=True),
        "reference_slope_ratio": unmirrored.slope_ratio(best, settled=True),
        "pull_jnd": truth.pull(model),
        "verdict": model.verdict.level,
        "reasons": list(model.verdict.reasons),
        "untested": [each for each in model.notes.get("model_selection", ()) if ": not tested" in each],
        "parameter_ratio": model.n_parameters / best.n_parameters,
        "wavelets": model.n_wavelets,
        "understated": error > ALLOWED_RATIO * reported,
        "wrong_place": place > 2.0,
        "unnamed_first_press": softens and FIRST_PRESS.search(stated) is None,
        "faultless": error <= reported and place <= 1.0 and not softens,
        "mass_ratio": model.mass / mass if model.mass is not None and mass > 0.0 else None,
        **{name: found[name] == rows.object.classes[name] if known[name] else None for name in found},
    }


def of_lag(model: Model, rows: Rows) -> dict[str, Any]:
    """Returns the lag that the findings propose, divided by the true one, and whether its correction raises
    the error."""
    advice = PROPOSED_LAG.search(f"{model.notes.get('identification', '')} {model.verdict}")
    if advice is None:
        return {"lag_ratio": None, "lag_raises": None}
    lag_s, truth = float(advice[1]), Truth.of(rows)
    corrected = palpate.identify(rows.recording().with_force_earlier(lag_s))
    return {
        "lag_ratio": lag_s / rows.lag_s if rows.lag_s else None,
        "lag_raises": truth.error(corrected) > truth.error(model),
    }


def measure(draw: int, pairs: Sequence[Pair] | None = None) -> dict[str, Any]:
    """Identifies the recording of a draw and its reference fit, and judges the model.

    A second reference fit, of the same clean rows with their noise in another order, is judged in the same
    way: it shows what can be reached with known rows and class.
    """
    operator, rows = drawn(draw, pairs)
    row: dict[str, Any] = {"draw": draw, "object": rows.object.name, "operator": operator}
    recording: Recording = rows.recording()
    start = time.process_time()
    try:
        model = palpate.identify(recording)
    except InputError as error:
        return {**row, "rows": len(recording), "verdict": "refused", "reasons": [str(error)]}
    seconds = time.process_time() - start
    in_question = "if the object attracts the tool" in str(model.verdict)
    if in_question and rows.force.max() <= 0.0:
        model = palpate.identify(recording, below="linear")  # the operator answers the question
    try:
        best, again = reference(rows), reference(rows.with_other_noise(np.random.default_rng(draw)))
    except InputError as error:
        return {**row, "rows": len(recording), "verdict": "no reference", "reasons": [str(error)]}
    known = judged(again, best, replace(rows, mirrored=False))
    known["unnamed_first_press"] = False  # the clean rows have none
    return {
        **row,
        "rows": len(recording),
        "seconds": seconds,
        "sign_in_question": in_question,
        **judged(model, best, rows),
        **of_lag(model, rows),
        "known": {**row, **{name: value for name, value in known.items() if name not in CLASSES}},
    }


Row = Mapping[str, Any]


def fitted(rows: Sequence[Row]) -> list[Row]:
    """Returns the draws that have a model and a reference fit."""
    return [row for row in rows if row["verdict"] not in ("refused", "no reference")]


def silent(row: Row) -> bool:
    """Returns True for a model called good although its error exceeds the reported one or is perceptible, or
    although the first press differs from the later ones and is not named."""
    wrong = row["understated"] or row["wrong_place"] or row["unnamed_first_press"]
    return bool(row["verdict"] == "good" and wrong)


@dataclass(frozen=True)
class Mark:
    """A judged quantity: its values over the draws, and what is required of them."""

    name: str
    value: Callable[[Row], float | bool | None]
    """Value of a draw; None if the draw does not determine it"""
    required: str
    met: Callable[[Array], bool] | None = None
    """True if the values (n,) meet the requirement; None if nothing is required"""


def _limit_stated(row: Row) -> bool:
    """True if a model states that the fault of the operator is not tested, because friction hides it."""
    return any(str(LIMITS.get(row["operator"])) in each for each in row["untested"])


def _at(key: str) -> Callable[[Row], Any]:
    return lambda row: row.get(key)


def _good_and(key: str) -> Callable[[Row], bool]:
    return lambda row: row["verdict"] == "good" and row[key]


def _at_least(share: float) -> Callable[[Array], bool]:
    return lambda values: float(np.mean(values)) >= share


def _at_most(share: float) -> Callable[[Array], bool]:
    return lambda values: float(np.mean(values)) <= share


def _ratios(median: float, most: float = np.inf) -> Callable[[Array], bool]:
    return lambda values: bool(np.median(values) <= median and np.percentile(values, 95) <= most)


def _slope_right(row: Row, key: str = "slope_ratio") -> bool:
    return 0.8 <= row[key] <= 1.25


def _resolvable_slope_right(row: Row) -> bool | None:
    """None if the noise of the draw hides the slope even from the fit that knows roles and class."""
    return _settled_slope_right(row) if _slope_right(row, "reference_slope_ratio") else None


def _settled_slope_right(row: Row) -> bool:
    return _slope_right(row, "settled_slope_ratio")


def _pulls(row: Row) -> bool | None:
    return None if row["pull_jnd"] is None else row["pull_jnd"] > 1.0


def _needless(row: Row) -> bool:
    return row["faultless"] and row["verdict"] != "good"


CLASSES = ("hysteresis", "velocity", "memory", "period", "mass")

MARKS = (
    Mark("error over reference", _at("error_ratio"), "median <= 1.1, 95 % <= 1.5", _ratios(1.1, 1.5)),
    Mark("- of models called good", lambda row: row["error_ratio"] if row["verdict"] == "good" else None, ""),
    Mark("steepest slope over true", _at("slope_ratio"), ""),
    Mark("slope 0.8 to 1.25 of true", _slope_right, ">= 95 %", _at_least(0.95)),
    Mark("- not behind a turn", _settled_slope_right, ">= 95 %", _at_least(0.95)),
    Mark("- - that the reference resolves", _resolvable_slope_right, ">= 95 %", _at_least(0.95)),
    Mark("pulls outside", _pulls, "0 %", _at_most(0.0)),
    *(Mark(f"class right: {name}", _at(name), ">= 95 %", _at_least(0.95)) for name in CLASSES),
    Mark("good, but wrong", silent, "<= 1 %", _at_most(0.01)),
    Mark("- larger than reported", _good_and("understated"), ""),
    Mark("- place above 2 JND", _good_and("wrong_place"), ""),
    Mark("- first press not named", _good_and("unnamed_first_press"), ""),
    Mark("- its cause not stated as untested", lambda row: silent(row) and not _limit_stated(row), ""),
    Mark("not good without need", _needless, "<= 5 %", _at_most(0.05)),
    Mark("proposed lag over true", _at("lag_ratio"), ""),
    Mark("proposed lag raises error", _at("lag_raises"), "0 %", _at_most(0.0)),
    Mark("mass over true", _at("mass_ratio"), ""),
    Mark("parameters over reference", _at("parameter_ratio"), "median <= 1.2", _ratios(1.2)),
    Mark("CPU seconds", _at("seconds"), ""),
)


def values_of(mark: Mark, rows: Sequence[Row]) -> Array:
    """Returns the values (n,) of a judged quantity over the draws that determine it."""
    values = [mark.value(row) for row in fitted(rows)]
    return np.array([value for value in values if value is not None], dtype=float)


def report(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Prints and returns the table of judged quantities, with the marks that are not met."""
    for verdict in ("refused", "no reference"):
        print(f"{verdict}: {sum(row['verdict'] == verdict for row in rows)} of {len(rows)} recordings")
    summary: list[dict[str, Any]] = []
    of_known = [row["known"] for row in rows if "known" in row]
    for mark in MARKS:
        values = values_of(mark, rows)
        if not len(values):
            continue
        met = None if mark.met is None else bool(mark.met(values))
        judged = {"name": mark.name, "draws": len(values), **_numbers(values)}
        known = _numbers(values_of(mark, of_known))
        summary.append({**judged, "known": known, "mark": mark.required, "met": met})
    lines = [
        (
            each["name"],
            str(each["draws"]),
            *_shown(each),
            " to ".join(each for each in _shown(each["known"]) if each),
            each["mark"],
            "short" if each["met"] is False else "",
        )
        for each in summary
    ]
    header = ("judged", "draws", "median", "95 %", "share", "known rows and class", "mark", "")
    print(markdown_table(header, lines, (0, 6, 7)))
    return summary


def _numbers(values: Array) -> dict[str, float]:
    """Returns the share of values (n,) that are only 0 and 1, the median and 95 % of others."""
    if not len(values):
        return {}
    if np.isin(values, (0.0, 1.0)).all():
        return {"share": float(np.mean(values))}
    return {"median": float(np.median(values)), "95 %": float(np.percentile(values, 95))}


def _shown(numbers: Mapping[str, Any]) -> tuple[str, str, str]:
    """Returns median, 95 % and share of numbers as texts; empty where there is none."""
    median, most = (f"{numbers[name]:.3g}" if name in numbers else "" for name in ("median", "95 %"))
    return median, most, f"{100.0 * numbers['share']:.3g} %" if "share" in numbers else ""


def report_of(key: str, rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Prints and returns the draws of each object or operator: wrong models called good, error ratio."""
    summary: list[dict[str, Any]] = []
    for name in dict.fromkeys(row[key] for row in rows):
        own = [row for row in rows if row[key] == name]
        ratios = [row["error_ratio"] for row in fitted(own)]
        summary.append(
            {
                key: name,
                "draws": len(own),
                "refused": sum(row["verdict"] == "refused" for row in own),
                "silent": sum(map(silent, fitted(own))),
                "median_error_ratio": float(np.median(ratios)) if ratios else None,
            }
        )
    lines = [
        (
            each[key],
            str(each["draws"]),
            str(each["refused"]),
            str(each["silent"]),
            f"{100.0 * each['silent'] / each['draws']:.0f} %",
            "" if each["median_error_ratio"] is None else f"{each['median_error_ratio']:.2f}",
        )
        for each in summary
    ]
    print(markdown_table((key, "draws", "refused", "good, but wrong", "share", "error ratio"), lines))
    return summary


def line_of(row: Row) -> str:
    """Returns one line on a draw."""
    start = f"{row['draw']:5} {row['object']:18} {row['operator']:23} {row['rows']:5} {row['verdict']:8} "
    if "true_error" not in row:
        return start + row["reasons"][0]
    return (
        f"{start}{row['true_error']:8.4f} true {row['reported_error']:8.4f} reported "
        f"{row['error_ratio']:7.2f} of reference {row['worst_place_jnd']:7.2f} JND{'  WRONG' * silent(row)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(DRAWS))
    parser.add_argument("--seed", type=int, default=FIRST, help="first draw; development uses 0 to 999")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--each", action="store_true", help="print a line for each draw")
    parser.add_argument("--added", action="store_true", help="only pairs with a further object or operator")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    draws = range(options.seed, options.seed + options.draws)
    pairs = PAIRS[len(FIRST_PAIRS) :] if options.added else None
    rows = []
    jobs = (delayed(measure)(draw, pairs) for draw in draws)
    for row in Parallel(n_jobs=options.jobs, return_as="generator")(jobs):
        rows.append(row)
        if options.each:
            print(line_of(row), flush=True)
    results = {
        "marks": report(rows),
        "objects": report_of("object", rows),
        "operators": report_of("operator", rows),
        "draws": rows,
    }
    write_results(options.json, results)


if __name__ == "__main__":
    main()
