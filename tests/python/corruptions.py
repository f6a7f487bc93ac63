# SPDX-License-Identifier: Apache-2.0
"""Corrupted recordings of a known force law: one seed of the random numbers gives one case.

python tests/python/corruptions.py [--first 0] [--count 300] [--kind KIND] [--each]

PALPATE_DATA names the folder of measured recordings; without it the recordings are synthetic.
"""

from __future__ import annotations

import argparse
import importlib
import re
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

import palpate
from conftest import measured_data
from palpate.recording.sample import sample_recording

sys.path.append(str(Path(__file__).parents[2] / "bench" / "identification"))
problems = importlib.import_module("problems")

Array = NDArray[np.float64]

SEED = 20261122

LARGEST_ERROR_RATIO = 1.2
"""A warning is required if the true NRMSE divided by the reported NRMSE is larger."""

DATA = measured_data() or Path("without measured data")

MEASURED = (
    "keyswitches/clicky__cherry_mx_blue.csv",
    "keyswitches/linear__cherry_mx_red.csv",
    "keyswitches/tactile__invyr_holy_panda.csv",
    "rubber_domes/topre_r1_45g__run1.csv",
    "rubber_domes/astro_domes_shiner_35g__run1.csv",
    "switch_springs/linear_housing_tx_short_45g.csv",
    "switch_springs/tactile_housing_sprit_supreme_63p5g.csv",
    "magnet_attraction/magnet_cylinder_quarter_inch_attract_25C.csv",
    "vhb4910_viscoelastic/loadunload_rate_0d05_1d5_1.csv",
)


@dataclass(frozen=True)
class Rows:
    """Columns of one recording, in which the tests place errors (corrupt it)."""

    x: Array
    f: Array
    t: Array | None
    d: NDArray[np.int8] | None
    units: dict[str, str]

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> Rows:
        return replace(
            self,
            x=self.x[rows],
            f=self.f[rows],
            t=None if self.t is None else self.t[rows],
            d=None if self.d is None else self.d[rows],
        )

    def recording(self) -> palpate.Recording:
        return palpate.Recording.from_arrays(self.x, self.f, self.t, self.d, units=self.units)


@dataclass
class Case:
    """One case: corrupted recordings, and the clean recordings by which the identified model is judged."""

    seed: int
    base: str
    kinds: tuple[str, ...]
    strength: list[str] = field(default_factory=list)
    corrupted: list[Rows] = field(default_factory=list)
    clean: list[Rows] = field(default_factory=list)

    def __str__(self) -> str:
        return f"seed {self.seed}, {self.base}, {' and '.join(self.strength)}"


# ------------------------------------------------------------------------------------ clean recordings


_ANGLE = {"position": "rad", "force": "N*m"}
_LENGTH = {"position": "m", "force": "N"}


def _sample(random: Generator) -> Rows:
    recording = sample_recording(int(random.integers(1, 10**6)), 5.0)
    assert recording.time is not None
    return Rows(recording.position.copy(), recording.force.copy(), recording.time.copy(), None, _ANGLE)


def _p1(random: Generator) -> Rows:
    x = problems.hand(random, 5000, 0.0, 0.6)
    f = problems.spring_wall(x) + random.normal(0.0, 0.02, len(x))
    return Rows(x, f, None, None, _ANGLE)


def _p2(random: Generator) -> Rows:
    x = problems.hand(random, 5000, 0.0, 4e-3)
    f = problems.tactile_switch(1e3 * x) + random.normal(0.0, 5e-3, len(x))
    return Rows(x, f, 1e-3 * np.arange(len(x)), None, _LENGTH)


def _loop(random: Generator) -> Rows:
    """Returns press and release force at evenly spaced positions, as a tensile test machine records them."""
    x = np.linspace(0.0, 4e-3, 800)
    x, d = np.r_[x, x[::-1]], np.repeat([1, -1], 800).astype(np.int8)
    h = 0.05 + 0.1 * np.exp(-(((1e3 * x - 1.5) / 0.5) ** 2))
    f = problems.tactile_switch(1e3 * x) + d * h + random.normal(0.0, 3e-3, len(x))
    return Rows(x, f, None, d, _LENGTH)


def _sweeps(random: Generator) -> Rows:
    """Returns strokes over time of a spring with friction, whose friction force follows a play operator."""
    t = 4e-3 * np.arange(3000)
    x = 0.01 * (1.0 - np.cos(2 * np.pi * 0.5 * t)) / 2 * (1.0 + 0.05 * np.sin(0.7 * t))
    d = np.where(np.gradient(x) >= 0, 1, -1)
    f = 150.0 * x + 2e4 * x**2 + 0.15 * d * (1.0 - np.exp(-x / 1e-3)) + random.normal(0.0, 0.01, len(x))
    return Rows(x, f, t, None, _LENGTH)


SYNTHETIC: dict[str, Callable[[Generator], Rows]] = {
    "sample": _sample,
    "P1": _p1,
    "P2": _p2,
    "loop": _loop,
    "sweeps": _sweeps,
}


@cache
def _measured(name: str) -> Rows:
    # positions must increase into the object, here towards the magnet
    negate = ("position",) if name.startswith("magnet") else ()
    found = palpate.read_recording(DATA / name, negate=negate)
    time, direction = found.time, found.direction
    return Rows(
        found.position.copy(),
        found.force.copy(),
        None if time is None else time.copy(),
        None if direction is None else direction.copy(),
        dict(found.units),
    )


def base_names() -> list[str]:
    """Returns the names of clean recordings; measured ones if they exist."""
    return [*SYNTHETIC, *(name for name in MEASURED if (DATA / name).is_file())]


def base(name: str, random: Generator) -> Rows:
    """Returns the recording of this name before any corruption.

    A measured one is read from its file; the noise of a simulated one comes from the generator `random`.
    """
    return SYNTHETIC[name](random) if name in SYNTHETIC else _measured(name)


# ----------------------------------------------------------------------------------------- corruptions

Corruption = Callable[[Generator, Rows, Case], list[Rows]]


def _restarted(rows: Rows, after: float) -> Rows:
    """Returns the columns with all times shifted, so that the first time is after the given time."""
    return rows if rows.t is None else replace(rows, t=rows.t - rows.t[0] + after)


def _spikes(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    x, f = rows.x.copy(), rows.f.copy()
    if random.random() < 0.5:
        count = int(random.integers(1, 6))
        size = 10.0 ** random.uniform(1.0, 6.0)
        at = random.choice(len(rows), count, replace=False)
        x[at] += random.choice([-1.0, 1.0], count) * size * np.ptp(rows.x)
        case.strength.append(f"{count} position spikes of {size:.3g} travels")
    else:
        count = max(1, round(len(rows) * 10.0 ** random.uniform(-3.5, -2.0)))
        size = 10.0 ** random.uniform(0.5, 3.0)
        at = random.choice(len(rows), count, replace=False)
        f[at] += random.choice([-1.0, 1.0], count) * size * np.ptp(rows.f)
        case.strength.append(f"{count} force spikes of {size:.3g} ranges")
    return [replace(rows, x=x, f=f)]


def _repeats(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    times = int(random.integers(2, 11))
    case.strength.append(f"each row {times} times")
    many = rows.take(np.repeat(np.arange(len(rows)), times))
    if rows.t is None:
        return [many]
    t = np.interp(np.arange(len(many)) / times, np.arange(len(rows)), rows.t)
    t[-times:] = rows.t[-1] + np.arange(times) * float(np.median(np.diff(rows.t))) / times
    return [replace(many, t=t)]


def _held(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    times = int(random.integers(2, 16))
    rows_held = times * (np.arange(len(rows)) // times)
    target = str(random.choice(["both", "force", "position"]))
    case.strength.append(f"{target} held for {times} rows")
    x = rows.x[rows_held] if target != "force" else rows.x
    f = rows.f[rows_held] if target != "position" else rows.f
    return [replace(rows, x=x, f=f)]


def _thinning(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    kept_rows = int(12 * (200 / 12) ** random.random())
    case.strength.append(f"{kept_rows} of {len(rows)} rows left")
    if random.random() < 0.5:
        return [rows.take(np.unique(np.linspace(0, len(rows) - 1, kept_rows).astype(int)))]
    return [rows.take(np.sort(random.choice(len(rows), kept_rows, replace=False)))]


def _reversed(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    target = str(random.choice(["force", "position"] + ["direction"] * (rows.d is not None)))
    case.strength.append(f"{target} reversed")
    if target == "force":
        return [replace(rows, f=-rows.f)]
    if target == "position":
        return [replace(rows, x=-rows.x)]
    assert rows.d is not None
    return [replace(rows, d=-rows.d)]


UNIT_RATIOS = (1e3, 1e6, 9.80665, 25.4, 10.0, 4.4482, 101.97, 57.29578)
"""Ratios of two units that users often confuse in files: milli, micro, kgf, inch, cm, lbf, gf and degree."""


def _unit(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    """Changes the unit of one of two recordings; a single recording is scaled by an implausible factor."""
    ratio = float(random.choice(UNIT_RATIOS)) ** float(random.choice([-1, 1]))
    role = str(random.choice(["position", "force"]))
    if case.base in SYNTHETIC and random.random() < 0.6:
        other = base(case.base, random)
        case.clean.append(other)
        case.strength.append(f"second recording: {role} times {ratio:.4g}")
        wrong = replace(other, x=ratio * other.x) if role == "position" else replace(other, f=ratio * other.f)
        return [rows, wrong]
    # A key switch force multiplied by 1000 is a plausible force of another object, so no warning is possible.
    role, ratio = "position", float(random.choice([1e-3, 1e3] if rows.units["position"] == "m" else [1e3]))
    case.strength.append(f"{role} times {ratio:g}")
    return [replace(rows, x=ratio * rows.x)]


def _merged(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    kind = str(random.choice(["stiffer", "offset", "shifted", "again"]))
    part = random.uniform(0.3, 1.0)
    factor = float(10.0 ** (random.choice([-1.0, 1.0]) * random.uniform(0.15, 0.7)))
    second = (
        rows.take(np.arange(len(rows)) < part * len(rows))
        if kind != "again" and random.random() < 0.3
        else rows
    )
    if kind == "stiffer":
        second = replace(second, f=factor * second.f)
        case.strength.append(f"another object appended, {factor:.3g} times as stiff, {len(second)} rows")
    elif kind == "offset":
        share = random.uniform(0.1, 1.0) * random.choice([-1, 1])
        second = replace(second, f=second.f + share * np.ptp(rows.f))
        case.strength.append(f"appended with a force offset of {share:.2f} ranges, {len(second)} rows")
    elif kind == "shifted":
        share = random.uniform(0.05, 0.4) * random.choice([-1, 1])
        second = replace(second, x=second.x + share * np.ptp(rows.x))
        case.strength.append(f"appended with the position shifted by {share:.2f} travels, {len(second)} rows")
    else:
        case.strength.append("appended to itself")
    t = None
    if rows.t is not None:
        time_continues = random.random() < 0.8
        after = rows.t[-1] + float(np.median(np.diff(rows.t))) if time_continues else 0.0
        case.strength[-1] += "" if time_continues else ", time restarts"
        t = np.r_[rows.t, _restarted(second, after).t]
    d = None if rows.d is None else np.r_[rows.d, second.d]
    return [replace(rows, x=np.r_[rows.x, second.x], f=np.r_[rows.f, second.f], t=t, d=d)]


def _gaps(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    kept = np.ones(len(rows), dtype=bool)
    if random.random() < 0.5:
        count, share = int(random.integers(1, 6)), random.uniform(0.02, 0.15)
        for start in random.uniform(0.0, 1.0 - share, count):
            kept[int(start * len(rows)) : int((start + share) * len(rows))] = False
        case.strength.append(f"{count} stretches of {share:.0%} of the rows lost")
    else:
        share = random.uniform(0.03, 0.4)
        start = random.uniform(0.05, 0.95 - share)
        u = (rows.x - rows.x.min()) / np.ptp(rows.x)
        kept &= (u < start) | (u > start + share)
        case.strength.append(f"positions from {start:.0%} to {start + share:.0%} of the travel lost")
    return [rows.take(kept)]


def _saturation(random: Generator, rows: Rows, case: Case) -> list[Rows]:
    target = str(random.choice(["force", "force", "both", "position", "stuck"]))
    share = random.uniform(0.6, 0.97)
    low, reach = rows.f.min(), np.ptp(rows.f)
    if target == "force":
        case.strength.append(f"force clipped at {share:.0%} of its range")
        return [replace(rows, f=np.minimum(rows.f, low + share * reach))]
    if target == "both":
        case.strength.append(f"force clipped at {1 - share:.0%} and {share:.0%} of its range")
        return [replace(rows, f=np.clip(rows.f, low + (1 - share) * reach, low + share * reach))]
    if target == "position":
        case.strength.append(f"position clipped at {share:.0%} of its travel")
        return [replace(rows, x=np.minimum(rows.x, rows.x.min() + share * np.ptp(rows.x)))]
    x = rows.x.copy()
    start, length = int(random.uniform(0.0, 0.8) * len(x)), max(5, int(random.uniform(0.02, 0.15) * len(x)))
    x[start : start + length] = x[start]
    case.strength.append(f"position stuck in rows {start} to {start + length - 1} of {len(x)}")
    return [replace(rows, x=x)]


KINDS: dict[str, Corruption] = {
    "spikes": _spikes,
    "repeats": _repeats,
    "held samples": _held,
    "thinning": _thinning,
    "reversed sign": _reversed,
    "wrong unit": _unit,
    "merged files": _merged,
    "gaps": _gaps,
    "saturation": _saturation,
}

CAUSES = {
    "spikes": r"spike|outlier|outside|single row|stretch|far from|few rows",
    "repeats": r"repeat|identical|held|same row",
    "held samples": r"held|hold|repeat|resolution|steps|delay|late|hysteresis",
    "thinning": r"rows|positions|parameters|gap",
    "reversed sign": r"negate|sign|direction|energy",
    "wrong unit": r"unit|scale|factor|differ|spike|stretch",
    "merged files": r"merge|two objects|part|recordings|drift|apart|restart|repeat|time",
    "gaps": r"gap|without rows|no rows|interval|interpolat",
    "saturation": r"satur|clip|range of the sensor|stuck|is constant|limit",
}
"""Words that a finding must contain to name a plausible cause, by kind of corruption."""

PAIR_SHARE = 0.25


def case_of(seed: int, kind: str | None = None) -> Case:
    """Returns the test case of a seed, with one kind of corruption; a quarter of the cases has two kinds."""
    random = np.random.default_rng([SEED, seed])
    names = list(KINDS)
    first = kind or names[seed % len(names)]
    second = str(random.choice([name for name in names if name != first]))
    kinds = (first, second) if random.random() < PAIR_SHARE else (first,)
    case = Case(seed, str(random.choice(base_names())), kinds)
    rows = base(case.base, random)
    case.clean.append(rows)
    case.corrupted = [rows]
    for name in kinds:
        changed = KINDS[name](random, case.corrupted[0], case)
        case.corrupted = [*changed, *case.corrupted[1:]]
    return case


# -------------------------------------------------------------------------------------------- outcomes


@dataclass
class Outcome:
    """Result of identifying a corrupted case: reported and true error, verdict or error message."""

    case: Case
    reported: float = float("nan")
    true: float = float("nan")
    level: str = ""
    reasons: tuple[str, ...] = ()
    refused: str = ""
    crashed: str = ""
    size: str = ""
    seconds: float = 0.0

    @property
    def correct_error(self) -> bool:
        """True if the true NRMSE is not much larger than the reported NRMSE."""
        return bool(self.reported >= self.true / LARGEST_ERROR_RATIO)

    @property
    def warned(self) -> bool:
        """True if identification refused the recordings, or if its verdict is not good."""
        return bool(self.refused) or self.level not in ("", "good")

    @property
    def names_cause(self) -> bool:
        """True if the error message or a finding names a cause that fits the kind of corruption."""
        text = " ".join((self.refused, *self.reasons))
        return any(re.search(CAUSES[kind], text, re.IGNORECASE) for kind in self.case.kinds)

    @property
    def unreported(self) -> bool:
        """True if the reported NRMSE is far below the true NRMSE and no warning names a plausible cause."""
        return bool(self.crashed) or not (self.correct_error or (self.warned and self.names_cause))


def true_nrmse(model: palpate.Model, clean: Sequence[Rows]) -> float:
    """Returns the NRMSE of a model on the clean rows inside the model's domain."""
    errors, forces = [], []
    for rows in clean:
        check = palpate.verify(model, rows.recording())
        x = rows.x[check.rows]
        inside = (x >= model.lower[0]) & (x <= model.upper[0])
        errors.append(check.residual[inside])
        forces.append(rows.f[check.rows][inside])
    error, force = np.concatenate(errors), np.concatenate(forces)
    if not len(error):
        return float("inf")
    spread = float(np.std(np.concatenate([rows.f for rows in clean])))
    return float(np.sqrt(np.mean(error**2)) / spread) if len(force) else float("inf")


def outcome_of(case: Case) -> Outcome:
    """Identifies a model from corrupted recordings, and computes its error on the uncorrupted recordings."""
    found = Outcome(case)
    start = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = palpate.identify([rows.recording() for rows in case.corrupted])
    except palpate.InputError as error:
        found.refused = str(error)
        return found
    except Exception as error:
        found.crashed = f"{type(error).__name__}: {error}"
        return found
    found.seconds = time.perf_counter() - start
    found.reported = model.fit.nrmse
    verdict = model.verdict
    found.level, found.reasons = verdict.level, verdict.reasons
    found.size = f"{model.fit.model_class}, {model.n_wavelets} wavelets"
    try:
        found.true = true_nrmse(model, case.clean)
    except palpate.InputError as error:
        found.true, found.size = float("inf"), f"{found.size}; not verifiable: {error}"
    return found


def described(found: Outcome) -> str:
    """Returns one line of text: the result of identifying a corrupted case."""
    if found.refused:
        return f"{found.case}: refused: {found.refused}"
    if found.crashed:
        return f"{found.case}: {found.crashed}"
    reasons = "; ".join(reason[:90] for reason in found.reasons)
    errors = f"reported {found.reported:.3g}, true {found.true:.3g}"
    return f"{found.case}: {errors}, {found.size}, {found.level}: {reasons}"


def table(outcomes: Sequence[Outcome]) -> str:
    """Returns a table of results, one row for each kind of corruption; two kinds count as the first one."""
    lines = [f"{'kind':16}{'cases':>7}{'correct':>8}{'warned':>8}{'cause named':>13}{'unreported':>12}"]
    for kind in (*KINDS, "all"):
        group = [each for each in outcomes if kind in ("all", each.case.kinds[0])]
        warned = [each for each in group if each.warned]
        lines.append(
            f"{kind:16}{len(group):7d}{sum(each.correct_error for each in group):8d}{len(warned):8d}"
            f"{sum(each.names_cause for each in warned):13d}{sum(each.unreported for each in group):12d}"
        )
    return "\n".join(lines)


def clean_outcome(name: str) -> Outcome:
    """Returns the result of identifying a recording without corruption."""
    rows = base(name, np.random.default_rng([SEED, base_names().index(name)]))
    return outcome_of(Case(-1, name, (), ["clean"], [rows], [rows]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--kind", choices=list(KINDS))
    parser.add_argument("--seeds", type=int, nargs="*")
    parser.add_argument("--each", action="store_true", help="print every case")
    parser.add_argument("--no-clean", action="store_true")
    options = parser.parse_args()
    if not options.no_clean:
        print("clean recordings:")
        for name in base_names():
            print("   ", described(clean_outcome(name)), flush=True)
    seeds = options.seeds or range(options.first, options.first + options.count)
    outcomes = []
    for seed in seeds:
        found = outcome_of(case_of(seed, options.kind))
        outcomes.append(found)
        if options.each or found.unreported or found.seconds > 20:
            print(
                "UNREPORTED " if found.unreported else "           ",
                described(found),
                f"({found.seconds:.1f} s)",
                flush=True,
            )
    print(table(outcomes))
    print(Counter(each.level or "refused" for each in outcomes))


if __name__ == "__main__":
    sys.exit(main())
