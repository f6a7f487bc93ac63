# SPDX-License-Identifier: Apache-2.0
"""Repeats identifications with one rule switched off at a time, and prints what each rule changes.

python bench/identification/ablation.py [--draws 24] [--seed 0] [--files 4] [--jobs 2] [--each] [--json FILE]

A rule is a function or a constant of the identification that is replaced, so that the rule has no effect. The
fits are draws of the bench of ordinary recordings and noise on a straight line, judged on the exact force,
and measured objects, judged on rows or recordings that are left out. PALPATE_DATA names the folder of
measured recordings.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import reduce
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import numpy as np
from joblib import Parallel, delayed

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.noise import CASES, line
from bench.identification.ordinary import ALLOWED_RATIO, Truth, reported_error
from bench.identification.ordinary_objects import Array
from bench.identification.ordinary_recordings import FIRST_PAIRS, PAIRS, Pair, drawn
from bench.identification.problems import problem, spring_wall
from bench.identification.real_data import EVERY, SETS
from bench.studies import count, markdown_table, measured_data, write_results

import palpate
from palpate import InputError, Model, Recording
from palpate._core.model import play
from palpate.baselines import comparable
from palpate.identification.classes.causes import _Strokes
from palpate.recording import checks
from palpate.recording.checks import Check
from palpate.recording.motion import strokes_from_order, velocity, waits
from palpate.recording.roles import Informative
from palpate.verdict import Finding
from palpate.verification.metrics import normalised, root_mean_square

DRAWS = 24

FILES = 4
"""Largest number of files of each set, evenly spread"""

LOST = (0.3, 0.6)
"""Positions without rows in a draw with a gap [share of the travel]"""

SHOWN = (
    *(10199, 10206, 10229, 10236, 10261, 10280, 10323, 10363, 10382, 10388, 10441, 10908, 10952, 11611),
    *(13951, 14318, 14392, 14686, 15254, 15403, 15526),
)
"""Draws that show a rule which other draws seldom show"""

SHOWN_FIFTH = (14725,)
"""The same among the draws of which every fifth row is kept"""

SHOWN_ADDED = (10924, 10925, 10938, 10953, 10985)
"""The same among the draws with a further object or operator"""

CHANGED_RATIO = 1.02
"""Ratio of two errors, true or stated, of the same class and size, above which a fit has changed"""

MEASURED = {
    "keyswitches": FILES,
    "switch_springs": FILES,
    "rubber_domes": 2,
    "davinci_grip": 2,
    "motor_cogging": 2,
}
"""Sets of measured objects and the number of files of each"""

SILICONES = ("EF10_0T_A", "EF30_37_5T_A")
"""Silicones with five recordings each: the last one is left out"""


@dataclass(frozen=True)
class Rule:
    """Function or constant of the package that can be switched off."""

    name: str
    module: str
    """Module that uses it, without the name of the package"""
    attribute: str
    without: Any
    """Replacement, with which the rule has no effect"""

    @property
    def place(self) -> tuple[Any, str]:
        """Module or class that has the function or constant, and its name there."""
        *owners, name = self.attribute.split(".")
        return reduce(getattr, owners, import_module(f"palpate.{self.module}")), name

    @contextmanager
    def off(self) -> Iterator[None]:
        """Switches the rule off.

        Raises
        ------
        AttributeError
            The package has no such function or constant.
        """
        with patch.object(*self.place, self.without):
            yield

    @contextmanager
    def watched(self, effective: set[str]) -> Iterator[None]:
        """Adds the name of the rule to a set if its replacement returns another value in any call, or if it
        is a constant."""
        function = getattr(*self.place)
        if not callable(function):
            effective.add(self.name)
            yield
            return

        def both(*given: Any, **named: Any) -> Any:
            value = function(*given, **named)
            if self.name not in effective and not _same(value, self.without(*given, **named)):
                effective.add(self.name)
            return value

        with patch.object(*self.place, both):
            yield


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, (tuple, list)) and isinstance(other, (tuple, list)):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, (np.ndarray, float, str)) and isinstance(other, (np.ndarray, float, str)):
        return bool(np.array_equal(one, other))
    return one is other or (isinstance(one, Finding) and one == other)


def _none(values: Any, *_: Any) -> Any:
    return np.zeros(len(values), dtype=bool)


def _first(value: Any, *_: Any, **__: Any) -> Any:
    return value


def _second(_: Any, value: Any, *__: Any) -> Any:
    return value


def _zeros(residual: Any, position: Any, rows: Any) -> Any:
    return np.zeros(np.count_nonzero(rows))


def _nothing(*_: Any, **__: Any) -> Any:
    return None


def _zero(*_: Any, **__: Any) -> float:
    return 0.0


def _one(*_: Any, **__: Any) -> float:
    return 1.0


def _no_orders(problem: Any, start: Any, **_: Any) -> Any:
    return [problem.solve(start)]


def _no_findings(*_: Any, **__: Any) -> Any:
    return []


def _no_wrong_readings(motion: Any, position: Any, *_: Any) -> Any:
    return _none(position)


def _in_part(strokes: Any, wholly: bool, again: Any = _Strokes.again) -> Any:
    return wholly | again(strokes, wholly=False)


def _whole(path: Any, *_: Any) -> Any:
    return np.ones(len(path))


class OfForces(Informative):
    """Recordings whose wrong readings are found in the forces alone."""

    def drop_wrong_readings(self, residuals: Any = None) -> bool:
        return residuals is None and super().drop_wrong_readings()


def _no_waits(position: Any, time: Any = None) -> Any:
    return None if strokes_from_order(position) is None else _none(position)


def constant(function: str, name: str, value: float, place: str = "") -> Rule:
    """Returns the rule that a constant has its value, not another one, in the calls of a function.

    Parameters
    ----------
    function : str
        Function that uses the constant, and the module that calls it: "recording.roles.contact_at".
    name : str
        Name of the constant.
    value : float
        Other value.
    place : str
        Module of the constant; by default that of the call.
    """
    module, attribute = function.rsplit(".", 1)
    home = import_module(f"palpate.{place or module}")
    original = getattr(import_module(f"palpate.{module}"), attribute)

    def without(*given: Any, **named: Any) -> Any:
        with patch.object(home, name, value):
            return original(*given, **named)

    return Rule(f"{name} {getattr(home, name):g}, not {value:g}", module, attribute, without)


def without_check(check: Check) -> Rule:
    """Returns the rule that a check of the recording is one of `CHECKS`."""
    others = tuple(other for other in checks.CHECKS if other is not check)

    def without(*given: Any, **named: Any) -> Any:
        with patch.object(checks, "CHECKS", others):
            return checks.findings_of(*given, **named)

    return Rule(f"check: {check.defect}", f"{CLASSES}.findings", "findings_of", without)


CHECKS = "recording.checks"

DATA, CLASSES, SEARCH = (f"identification.{folder}" for folder in ("data", "classes", "search"))

RULES = (
    Rule("rows that wait are not fitted", "recording.conversion", "waits", _no_waits),
    Rule("approach is not fitted", "recording.roles", "contact_at", lambda x, f: float(x.min())),
    Rule("positions of a fit are in whole steps", f"{DATA}.rows", "stepped", _first),
    Rule("hum is subtracted", "recording.roles", "without_hum", lambda recording: (recording, [])),
    Rule("wrong readings are dropped", "recording.roles", "wrong_readings", _no_wrong_readings),
    Rule("period is found", "identification.identify", "period_of", _nothing),
    Rule("period is fitted", f"{DATA}.period", "_fitted", lambda x, f, way, period, orders, cells: period),
    Rule("closed revolution is a period", f"{DATA}.period", "revolution_of", _nothing),
    Rule("harmonics", f"{SEARCH}.growth", "select_orders", _no_orders),
    Rule("usual gap bounds the orders", f"{DATA}.rows", "Rows._usual_gap", _zero),
    Rule(
        "repeated rows are dropped",
        "recording.roles",
        "repeated_rows",
        lambda recording: _none(recording.force),
    ),
    Rule("rows of a slower sensor", f"{CHECKS}.wrong_readings", "_rows_held", _one),
    Rule("residuals show wrong readings", "identification.identify", "Informative", OfForces),
    Rule("first strokes that differ are not fitted", "identification.identify", "first_strokes", _nothing),
    Rule("stroke mostly over new places is a first one", f"{CLASSES}.causes", "_Strokes.again", _in_part),
    Rule("other strokes show errors of the model", f"{CHECKS}.wrong_readings", "_of_other_strokes", _zeros),
    Rule("waits are judged by time", "recording.conversion", "waits", lambda x, time=None: waits(x)),
    Rule("play follows over a gap", f"{DATA}.rows", "ordered_strokes", _nothing),
    Rule("copies count once", f"{DATA}.rows", "repeated", lambda x, f, side: (_none(f), "")),
    Rule("force step hides errors", f"{DATA}.rows", "force_step", _zero),
    Rule("correlated noise", f"{CLASSES}.model_selection", "correlated_noise", _first),
    Rule("noise where candidates differ", f"{SEARCH}.evidence", "local_noise_ratio", _one),
    Rule("finer wavelets", f"{SEARCH}.growth", "LEAST_CORE_POSITIONS", np.inf),
    Rule("pruning", f"{SEARCH}.growth", "MOST_PRUNE_TRIALS", 0),
    Rule("weight penalty", "identification.network.separable", "SeparableProblem.with_prior", _first),
    Rule("regrowth with constraints", f"{CLASSES}.class_selection", "REGROWTH_ERROR_RATIO", np.inf),
    Rule("single-valued rival", f"{CLASSES}.hysteresis", "Hysteresis._single_valued", _second),
    Rule("radius of strokes without reversals", f"{CLASSES}.hysteresis", "PlaySearch.settled", _second),
    Rule("reversals end after 12 %, not 24 %", f"{CLASSES}.hysteresis", "REVERSAL", 0.24),
    Rule("largest radius needs turns apart", f"{CLASSES}.hysteresis", "PlaySearch._turns_apart", _one),
    Rule("search of the play radius", f"{CLASSES}.hysteresis", "PlaySearch.with_best_radius", _second),
    Rule("rows behind turns share an error", f"{DATA}.strokes", "weights_behind_turns", _whole),
    Rule("rows next to turns of a tool that leaves", f"{DATA}.strokes", "NEXT_TO_TURN", 0),
    Rule("weights in the stated error", f"{CLASSES}.findings", "_judged_error", lambda best, _: best.error),
    Rule("weights of rows behind turns settle", f"{CLASSES}.hysteresis", "REWEIGHTINGS", 1),
    Rule("growth with the play radius", f"{CLASSES}.hysteresis", "FIRST_MAX_WAVELETS", 64),
    Rule("rows around the seam", f"{SEARCH}.evidence", "around_seam", _first),
    Rule("velocity needs a part of the residual", f"{CLASSES}.dynamics", "Dynamics.share_of_velocity", _one),
    Rule("gain by velocity", f"{CLASSES}.model_selection", "LEAST_GAIN", 1e-9),
    Rule("gain by memory", f"{CLASSES}.memory", "LEAST_GAIN", 0.0),
    Rule("terms explain more than an object that changes", f"{CLASSES}.causes", "Judged.changed", 0.0),
    Rule("memory explains more than later strokes alone", f"{CLASSES}.memory", "first_strokes", _nothing),
    Rule("spread of the speeds", f"{CLASSES}.dynamics", "LEAST_SPEED_SPREAD", 0.0),
    Rule("error on rows left out", f"{CLASSES}.findings", "left_out_residual", lambda of: of.best.residual),
    *map(without_check, checks.CHECKS),
    Rule("shift of the strokes", f"{CLASSES}.findings", "shift_of", _nothing),
    Rule("steps of the search for a shift", f"{CLASSES}.shift", "REFINEMENTS", 1),
    Rule(
        "LONGEST_LAG_S 0.1, not 0.005", f"{CLASSES}.shift", "LAGS_S", 0.005 * 2.0 ** np.arange(-7.0, 0.5, 0.5)
    ),
    Rule("velocity is compared with a shift", f"{CLASSES}.model_selection", "shift_of", _nothing),
    Rule("check: damping below zero", f"{CLASSES}.dynamics", "Dynamics._noticed", lambda *_: False),
    Rule("check of waits", f"{CLASSES}.findings", "wait_findings", _no_findings),
    Rule("check of drift", f"{CLASSES}.findings", "drift_findings", _no_findings),
    Rule("check of places", f"{CLASSES}.findings", "place_findings", _no_findings),
    Rule("force near the recorded forces", f"{CLASSES}.class_selection", "FORCE_MARGIN", 1e9),
    Rule("force may exceed the recorded forces", f"{CLASSES}.class_selection", "FORCE_MARGIN", 0.0),
    constant("recording.roles.without_hum", "HUM_RATIO", 1.0, "recording.hum"),
    constant("recording.roles.without_hum", "MAINS_TOLERANCE", 0.0, "recording.hum"),
    constant("recording.roles.wrong_readings", "WRONG_RATIO", 16.0, f"{CHECKS}.wrong_readings"),
    constant("recording.roles.wrong_readings", "LEAST_WRONG", 0.0, f"{CHECKS}.wrong_readings"),
    constant("recording.roles.roles_of", "AIR_MARGIN", 1.0),
    constant("recording.roles.contact_at", "FORCE_FLOOR", 1.0, "recording.contact"),
    constant("identification.identify.period_of", "LEAST_GAIN", 0.999, f"{DATA}.period"),
    constant("recording.motion.gaps_of", "SHORT_WAY", 0.0),
    constant(f"{CLASSES}.model_selection.correlated_noise", "LEAST_INDEPENDENT_SHARE", 0.0),
    constant(f"{CLASSES}.findings.place_findings", "PLACES", 200, f"{CLASSES}.causes"),
    constant(f"{CLASSES}.findings.place_findings", "PLACE_ERRORS", 0.0),
    constant(f"{CLASSES}.findings.place_findings", "MOST_JND", 1.0),
)


@dataclass(frozen=True)
class Fit:
    """Recordings of an identification, its options, and the error of its model."""

    recordings: Sequence[Recording]
    error: Callable[[Model], float]
    """True error, or error on what was left out, divided by the standard deviation of the force [-]"""
    options: dict[str, Any]


def of_draw(draw: int, pairs: Sequence[Pair] | None = None) -> Fit:
    """Returns a draw of the bench of ordinary recordings, or of some of its pairs of object and operator."""
    _, rows = drawn(draw, pairs)
    return Fit([rows.recording()], Truth.of(rows).error, {})


def against(truth: Array, force: Callable[[Model], Array]) -> Callable[[Model], float]:
    """Returns the error of the forces (n,) of a model, divided by the spread of the true ones."""
    return lambda model: float(normalised(root_mean_square(force(model) - truth), truth))


def _both_strokes(model: Model, at: Array) -> Array:
    return np.concatenate([model.force(at, direction=np.full(len(at), way)) for way in (1.0, -1.0)])


def of_noise(case: str, draw: int) -> Fit:
    """Returns a straight line with noise."""
    recording = CASES[case](draw)
    x = np.linspace(recording.position.min(), recording.position.max(), 1000)

    def at_rest(model: Model) -> Array:
        return model.predict(np.column_stack([x, 0.0 * x])) if model.of_velocity else model.force(x)

    return Fit([recording], against(line(x), at_rest), {})


def joined_to_itself(draw: int) -> Recording:
    """Returns a file that holds the rows of a spring with a wall five times."""
    x, force = _wall(draw)
    return Recording.from_arrays(np.tile(x, 5), np.tile(force, 5))


def six_bits(draw: int) -> Recording:
    """Returns a spring with a wall whose force was stored with 6 bits."""
    x, force = _wall(draw)
    step = float(np.ptp(force)) / 2**6
    return Recording.from_arrays(x, step * np.round(force / step))


def not_zeroed(draw: int) -> Recording:
    """Returns a press through air on a spring with a wall, with a sensor that was not set to zero."""
    x, force = _wall(draw)
    order, air = np.argsort(x), np.linspace(-0.2, 0.0, 400, endpoint=False)
    noise = np.random.default_rng([41, draw]).normal(0.0, 0.002, len(air))
    return Recording.from_arrays(np.append(air, x[order]), np.append(noise, force[order]) + 0.5)


def without_read_time(draw: int) -> Recording:
    """Returns a spring with a wall from a file whose time has no known unit."""
    return replace(Recording.from_arrays(*_wall(draw)), unread_time="column t has no known unit")


def in_millimetres(draw: int) -> Recording:
    """Returns a spring with a wall whose positions in mm are stored in a column of metres."""
    return Recording.from_arrays(*_wall(draw), units={"position": "m", "force": "N"})


def _wall(draw: int) -> tuple[Array, Array]:
    x = problem("P1", draw).X[:2000, 0]
    return x, spring_wall(x) + np.random.default_rng([39, draw]).normal(0.0, 0.002, len(x))


STORED = (joined_to_itself, six_bits, not_zeroed, without_read_time, in_millimetres)
"""Recordings of a spring with a wall, stored in ways that look like structure or have a defect"""


def of_stored(stored: Callable[[int], Recording], draw: int) -> Fit:
    """Returns a spring with a wall, stored in one of the ways `STORED`."""
    recording = stored(draw)
    x = np.linspace(recording.position.min(), recording.position.max(), 1000)
    truth = np.where(x > 0.0, spring_wall(x), 0.0)
    return Fit([recording], against(truth, lambda model: model.force(x)), {})


def of_kinks(draw: int) -> Fit:
    """Returns a function with kinks and without noise (P4)."""
    given = problem("P4", draw)
    recording = Recording.from_arrays(given.X[:, 0], given.y)
    return Fit([recording], lambda model: given.nrmse(model.force(given.X_test[:, 0])), {})


def of_preload(draw: int) -> Fit:
    """Returns a gas spring with friction that a load cell with 10 readings a second meets six times."""
    random = np.random.default_rng(draw)
    preload, friction = random.uniform(150.0, 400.0), random.uniform(8.0, 20.0)
    half = 104.5 / 12.0
    time = np.arange(0.0, 6.0 * half, 0.1) + random.uniform(0.0, 0.1)
    x = -9.5 + 12.0 * (half - np.abs(time % (2.0 * half) - half))

    def law(x: Array, way: Array | float) -> Array:
        return np.clip(x / 0.5, 0.0, 1.0) * (preload / (1.0 - 0.0025 * np.maximum(x, 0.0)) + friction * way)

    force = law(x, np.where(time % (2.0 * half) < half, 1.0, -1.0)) + random.normal(0.0, 0.5, len(x))
    recording = Recording.from_arrays(np.round(x, 2), 10.0 * np.round(10.2 * force))
    at = np.linspace(-9.0, 94.0, 4000)
    truth = 102.0 * np.concatenate([law(at, 1.0), law(at, -1.0)])
    return Fit([recording], against(truth, lambda model: _both_strokes(model, at)), {})


def of_changes(draw: int) -> Fit:
    """Returns a spring with friction whose rows were stored at each change of the force."""
    random = np.random.default_rng([42, draw])
    time = np.linspace(0.0, 8.0, 80_001)
    x = np.abs((time / 2.0 + 1.0) % 2.0 - 1.0)
    force = 10.0 * x + (x - play(x, 0.005)) / 0.005
    rows = np.flatnonzero(np.diff(np.floor(force / random.uniform(0.05, 0.2)), prepend=np.nan))
    noise = random.normal(0.0, 0.01, len(rows))
    recording = Recording.from_arrays(x[rows], force[rows] + noise, time[rows])
    at = np.linspace(0.02, 0.98, 1000)
    truth = np.concatenate([10.0 * at + 1.0, 10.0 * at - 1.0])
    return Fit([recording], against(truth, lambda model: _both_strokes(model, at)), {})


def of_hum(draw: int) -> Fit:
    """Returns slow presses on a spring with a wall, with the hum of the mains in its force."""
    random = np.random.default_rng([43, draw])
    time = np.arange(20_000) / 1000.0
    x = 0.5 - 0.5 * np.cos(2.0 * np.pi * time / random.uniform(4.0, 9.0))
    height, hertz = random.uniform(0.005, 0.04), 50.0 * random.uniform(0.996, 1.004)
    hum = height * np.ptp(spring_wall(x)) * np.sin(2.0 * np.pi * (hertz * time + random.uniform()))
    force = spring_wall(x) + random.normal(0.0, 0.002, len(x)) + hum
    at = np.linspace(0.0, 1.0, 1000)
    error = against(spring_wall(at), lambda model: model.force(at))
    return Fit([Recording.from_arrays(x, force, time)], error, {})


def of_slots(draw: int, turns: int = 1) -> Fit:
    """Returns the torque of a motor with seven poles and twelve slots over some turns, identified with the
    period of one pole for one turn, else with the period that is found."""
    random, angle = np.random.default_rng([40, draw]), 2.0 * np.pi * turns * np.arange(512) / 512

    def torque(angle: Array) -> Array:
        return np.sin(7.0 * angle) + 0.3 * np.cos(12.0 * angle)

    recording = Recording.from_arrays(angle, torque(angle) + random.normal(0.0, 0.01, 512))
    between = random.uniform(0.0, 2.0 * np.pi, 1000)
    error = against(torque(between), lambda model: model.force(between))
    return Fit([recording], error, {"period": 2.0 * np.pi / 7.0} if turns == 1 else {})


def of_gap(draw: int) -> Fit:
    """Returns a draw of the bench of ordinary recordings that has no rows in a part of the travel."""
    _, rows = drawn(draw)
    share = (rows.motion.x - rows.motion.x.min()) / np.ptp(rows.motion.x)
    return _part_of(rows, np.flatnonzero((share < LOST[0]) | (share > LOST[1])))


def of_fifth_rows(draw: int) -> Fit:
    """Returns every fifth row of a draw of the bench of ordinary recordings."""
    _, rows = drawn(draw)
    return _part_of(rows, np.arange(0, len(rows.force), 5))


def _part_of(rows: Any, kept: Any) -> Fit:
    return Fit([rows.take(kept).recording()], Truth.of(rows).error, {})


def of_file(path: Path, name: str) -> Fit:
    """Returns a recording of a set of measured objects; every fifth row is left out."""
    options = dict(SETS[name].options)
    recording = palpate.read_recording(path, **SETS[name].reading)
    if "velocity" in options.get("inputs", ""):
        recording = replace(recording, inputs=velocity(recording)[0][:, None], input_names=("velocity",))
    return Fit([recording.split(EVERY)[0]], lambda model: _left_out(model, recording, EVERY), options)


def of_silicone(folder: Path, name: str) -> Fit:
    """Returns the recordings of a silicone; the last one is left out."""
    *given, left = map(palpate.read_recording, sorted((folder / "silicone_compression").glob(f"{name}*.csv")))
    return Fit(given, lambda model: _left_out(model, left, 1), {})


def _left_out(model: Model, recording: Recording, every: int) -> float:
    """Returns the NRMSE on every n-th row of a recording."""
    check = palpate.verify(model, recording)
    rows = comparable(recording) & check.rows & (np.arange(len(recording)) % every == every - 1)
    return float(normalised(root_mean_square(check.residual[rows[check.rows]]), recording.force[rows]))


def result_of(fit: Fit, *changes: AbstractContextManager[None]) -> dict[str, Any]:
    """Identifies with changes of the package, and judges the model without them."""
    try:
        with ExitStack() as stack:
            for change in changes:
                stack.enter_context(change)
            recordings = [replace(each) for each in fit.recordings]  # without the waits found before
            model = palpate.identify(recordings, **fit.options)
    except InputError as error:
        return {"verdict": "refused", "refused": str(error)}
    return {
        "verdict": model.verdict.level,
        "model_class": model.fit.model_class,
        "parameters": model.n_parameters,
        "error": fit.error(model),
        "reported": reported_error(model),
    }


def measure(name: str, fit_of: Callable[..., Fit], *given: Any) -> dict[str, Any]:
    """Identifies one set of recordings with all rules, and without each rule that has an effect on it."""
    fit, effective = fit_of(*given), set[str]()
    every = result_of(fit, *(rule.watched(effective) for rule in RULES))
    without = {rule.name: _without(fit, rule) if rule.name in effective else every for rule in RULES}
    return {"fit": name, "all": every, "without": without}


def _without(fit: Fit, rule: Rule) -> dict[str, Any]:
    try:
        return result_of(fit, rule.off())
    except Exception as error:  # a rule can prevent any error
        return {"verdict": "fails", "failure": repr(error)}


def tasks(draws: int, files: int, seed: int = 0) -> list[tuple[Any, ...]]:
    """Returns the arguments of `measure` for all fits: `draws` draws of the bench of ordinary recordings from
    number `seed` on, and a fifth of them with a gap; `files` is also the number of draws of each noise."""
    found: list[tuple[Any, ...]] = [(f"draw {draw}", of_draw, draw) for draw in range(seed, seed + draws)]
    found += [(f"draw {draw}", of_draw, draw) for draw in SHOWN[:draws]]
    found += [(f"draw {draw}, every fifth row", of_fifth_rows, draw) for draw in SHOWN_FIFTH[:draws]]
    added = PAIRS[len(FIRST_PAIRS) :]
    found += [(f"draw {draw}, added", of_draw, draw, added) for draw in SHOWN_ADDED[:draws]]
    found += [(f"{case}, draw {draw}", of_noise, case, draw) for case in CASES for draw in range(files)]
    for draw in range(files):
        found += [(f"{form.__name__}, draw {draw}", of_stored, form, draw) for form in STORED]
        found.append((f"poles and slots, draw {draw}", of_slots, draw))
        found.append((f"kinks without noise, draw {draw}", of_kinks, draw))
        found.append((f"preload, draw {draw}", of_preload, draw))
        found.append((f"stored by change, draw {draw}", of_changes, draw))
        found.append((f"hum, draw {draw}", of_hum, draw))
        found.append((f"poles and slots over three turns, draw {draw}", of_slots, draw, 3))
    found += [(f"draw {draw} with a gap", of_gap, draw) for draw in range(seed + 2, seed + draws, 5)]
    if (folder := measured_data()) is None:
        return found
    for name, most in MEASURED.items():
        paths = sorted((folder / name).glob(SETS[name].pattern))
        paths = paths[:: max(1, -(-len(paths) // min(most, files)))]
        found += [(f"{name}, {path.stem}", of_file, path, name) for path in paths]
    return found + [(name, of_silicone, folder, name) for name in SILICONES[: min(len(SILICONES), files)]]


def changed(every: Mapping[str, Any], without: Mapping[str, Any]) -> bool:
    """Returns True if the class, the number of parameters or, by more than 2 %, the true or the stated error
    differ."""
    if "error" not in every or "error" not in without:
        return every["verdict"] != without["verdict"]
    if any(every[key] != without[key] for key in ("model_class", "parameters")):
        return True
    errors = (sorted((float(every[key]), float(without[key]))) for key in ("error", "reported"))
    return any(larger > CHANGED_RATIO * smaller for smaller, larger in errors)


def _understated(result: dict[str, Any]) -> bool:
    return bool(result["verdict"] == "good" and result["error"] > ALLOWED_RATIO * result["reported"])


def report(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Prints and returns what each rule changes: fits, errors, sizes and verdicts."""
    summary: list[dict[str, Any]] = []
    for rule in RULES:
        pairs = [(row["all"], row["without"][rule.name]) for row in rows]
        fitted = [pair for pair in pairs if "error" in pair[0] and "error" in pair[1]]
        ratios = [without["error"] / every["error"] for every, without in fitted if every["error"] > 0.0]
        verdicts = Counter(
            f"{every['verdict']} to {without['verdict']}"
            for every, without in pairs
            if every["verdict"] != without["verdict"]
        )
        summary.append(
            {
                "rule": rule.name,
                "fits": len(pairs),
                "changed": sum(changed(*pair) for pair in pairs),
                "median": median(ratios) if ratios else None,
                "least": min(ratios, default=None),
                "worst": max(ratios, default=None),
                "parameters": sum(without["parameters"] for _, without in fitted)
                / max(1, sum(every["parameters"] for every, _ in fitted)),
                "verdicts": dict(sorted(verdicts.items())),
                "understated": [sum(map(_understated, side)) for side in zip(*fitted, strict=True)],
            }
        )
    print(f"{len(rows)} fits; error: true, or on what was left out")
    header = (
        "without the rule",
        "changed",
        "median",
        "least",
        "worst",
        "parameters",
        "understated",
        "verdict",
    )
    print(markdown_table(header, list(map(_line, summary)), (0, 7)))
    unused = [each["rule"] for each in summary if not each["changed"] and not each["verdicts"]]
    print(f"no change: {', '.join(unused) or 'none'}")
    return summary


def _line(each: dict[str, Any]) -> tuple[str, ...]:
    if not each["changed"] and not each["verdicts"]:
        return each["rule"], "no change", *[""] * 6
    before, after = each["understated"] or (0, 0)
    return (
        each["rule"],
        str(each["changed"]),
        *("" if each[key] is None else f"{each[key]:.2f}" for key in ("median", "least", "worst")),
        f"{each['parameters']:.2f}",
        f"{before} to {after}" if before != after else "",
        ", ".join(f"{change} {number}" for change, number in each["verdicts"].items()),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=count(DRAWS))
    parser.add_argument("--seed", type=int, default=0, help="first draw")
    parser.add_argument(
        "--files", type=int, default=count(FILES), help="largest number of each set and noise"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--each", action="store_true", help="print a line for each fit")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    rows = []
    for row in Parallel(n_jobs=options.jobs, return_as="generator")(
        delayed(measure)(*task) for task in tasks(options.draws, options.files, options.seed)
    ):
        rows.append(row)
        if options.each:
            different = [name for name, each in row["without"].items() if changed(row["all"], each)]
            print(f"{row['fit']}: {', '.join(different) or 'no change'}", flush=True)
    write_results(options.json, {"rules": report(rows), "fits": rows})


if __name__ == "__main__":
    main()
