# SPDX-License-Identifier: Apache-2.0
"""Measures how often a recording that is changed without new information gives the same model.

python bench/identification/invariances.py [NAME ...] [--draws 20] [--seed 1000] [--jobs 2] [--json FILE]

The recordings are those of a tester at constant speed, one for each object of `ordinary_objects.py`. A
measure is judged if the rows resolve it: fits that know roles and class agree in it on the recording and on
its changed rows. If a change has another noise, they must agree on other draws of the noise too. The last
column is the share of draws in which they agree in all measures.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from numpy.random import Generator
from scipy.constants import g

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.ordinary import PUBLISHED, Truth, classes_of, reference
from bench.identification.ordinary_objects import OBJECTS, Array
from bench.identification.ordinary_recordings import CREEP, CREEP_S, Rows, tester, with_wrong_readings
from bench.studies import count, markdown_table, write_results

import palpate
from palpate import InputError, Model, Recording
from palpate.verification.metrics import force_floor

DRAWS = 20

FEWEST_ROWS, MOST_ROWS = 30, 80
"""Numbers of rows of a stroke in a recording with few rows"""

MEASURES = ("size", "error", "slope", "force", "class", "verdict")

NOISES = 2
"""Number of further draws of the noise"""


@dataclass(frozen=True)
class Changed:
    """Recordings with the information of another one, their rows, and the difference of their zeros."""

    rows: Rows
    """With the errors that no fit can avoid as noise"""
    stored: Recording | list[Recording] | None = None
    """The recordings, if not those of the rows"""
    zero: float = 0.0
    """Position at which the other recording has 0 [m or rad]"""

    @property
    def recordings(self) -> Recording | list[Recording]:
        return self.rows.recording() if self.stored is None else self.stored


def drawn(draw: int) -> tuple[Rows, Generator]:
    """Returns the rows of a draw, with time and without direction, and random numbers for a change."""
    random = np.random.default_rng([37, draw])
    rows = tester(OBJECTS[draw % len(OBJECTS)](random), random)
    return replace(rows, timed=True, directed=False), random


def inserted(rows: Rows, random: Generator, at: int, n: int, force: Array | None = None) -> Rows:
    """Returns rows with n waiting rows after row `at`, before the first row if `at` is -1.

    Parameters
    ----------
    force : (n,), optional
        Exact force of the waiting rows [N or N*m]; by default that of row `at`.
    """
    index = np.insert(np.arange(len(rows.force)), at + 1, np.full(n, max(at, 0)))
    waiting = np.zeros(len(index), dtype=bool)
    waiting[at + 1 : at + 1 + n] = True
    longer, time = rows.take(index), rows.motion.time
    step = float(np.median(np.diff(time)))
    motion = replace(
        longer.motion,
        time=longer.motion.time + step * (np.cumsum(waiting) - (at < 0) * waiting),
        velocity=np.where(waiting, 0.0, longer.motion.velocity),
    )
    exact, noises = longer.force.copy(), {}
    if force is not None:
        exact[waiting] = force
    for name in ("position_noise", "force_noise"):
        noise = getattr(longer, name).copy()
        noise[waiting] = random.normal(0.0, np.std(getattr(rows, name)), n)
        noises[name] = noise
    return replace(longer, motion=motion, force=exact, **noises)


def turns(rows: Rows) -> list[int]:
    """Returns the last row of each stroke except the last."""
    return np.flatnonzero(np.diff(rows.stroke)).tolist()


def waiting_rows(rows: Rows, random: Generator) -> Changed:
    """Adds 30 to 20 000 waiting rows before, between or after the strokes."""
    place = random.choice([-1, *turns(rows)[1::2], len(rows.force) - 1])
    return Changed(inserted(rows, random, place, int(10.0 ** random.uniform(1.5, 4.3))))


def repeated_rows(rows: Rows, random: Generator) -> Changed:
    """Repeats each row."""
    recording = rows.recording()
    time = rows.motion.time
    twice = np.interp(
        np.arange(2 * len(time)) / 2.0, np.arange(len(time) + 1), np.r_[time, 2 * time[-1] - time[-2]]
    )
    x, force = (np.repeat(values, 2) for values in (recording.position, recording.force))
    return Changed(rows, Recording.from_arrays(x, force, twice, units=recording.units))


def half_the_rate(rows: Rows, random: Generator) -> Changed:
    """Leaves out every second row."""
    return Changed(rows.take(np.arange(0, len(rows.force), 2)))


def stored_by_change(rows: Rows, random: Generator) -> Changed:
    """Stores a row only if force or position has changed by one or two rows of the mean motion."""
    moved = np.cumsum(np.abs(np.diff(rows.motion.x, prepend=rows.motion.x[0]))) / rows.object.travel
    forced = np.cumsum(np.abs(np.diff(rows.force, prepend=rows.force[0]))) / np.ptp(rows.force)
    way = np.maximum(moved / moved[-1], forced / forced[-1])
    return Changed(rows.take(np.unique(np.searchsorted(way, np.arange(0.0, 1.0, 1.0 / len(way))))))


def pauses(rows: Rows, random: Generator) -> Changed | None:
    """Adds a pause of one row to 60 s at each turn, in which half of the friction relaxes.

    None for an object whose force depends on time or speed.
    """
    if rows.object.branch is not None or rows.object.damping:
        return None
    step = float(np.median(np.diff(rows.motion.time)))
    seconds = step * (60.0 / step) ** random.random()
    n = max(1, round(seconds / step))
    kept = 1.0 - CREEP * (1.0 - np.exp(-step * np.arange(n) / CREEP_S))
    for at in reversed(turns(rows)):
        still, x = np.zeros(n), np.full(n, rows.motion.x[at])
        rows = inserted(rows, random, at, n, rows.object.force(still, x, rows.state[at] * kept, still))
    return Changed(rows)


def through_air(rows: Rows, random: Generator) -> Changed | None:
    """Adds an approach and a retraction of up to 100 travels through air; None if the tool cannot leave."""
    if not rows.object.leaves:
        return None
    n, way = int(10.0 ** random.uniform(1.5, 3.5)), rows.object.travel * 10.0 ** random.uniform(-1.0, 2.0)
    end = len(rows.force) - 1
    longer = inserted(inserted(rows, random, end, n), random, -1, n)
    depth = np.interp(np.arange(len(longer.force)), [0, n, end + n, end + 2 * n], [way, 0.0, 0.0, way])
    velocity = longer.motion.velocity - np.gradient(depth, longer.motion.time)
    motion = replace(longer.motion, x=longer.motion.x - depth, velocity=velocity)
    return Changed(replace(longer, motion=motion))


def wrong_readings(rows: Rows, random: Generator) -> Changed:
    """Replaces up to 3 % of the forces by wrong readings."""
    return Changed(with_wrong_readings(rows, random, random.uniform(0.0, 0.03)))


def with_direction(rows: Rows, random: Generator) -> Changed:
    """Stores the direction and no time."""
    return Changed(replace(rows, timed=False, directed=True))


def order_alone(rows: Rows, random: Generator) -> Changed:
    """Stores neither time nor direction."""
    return Changed(replace(rows, timed=False, directed=False))


def one_file_a_stroke(rows: Rows, random: Generator) -> Changed:
    """Stores each stroke as one file."""
    numbers = range(rows.stroke[-1] + 1)
    return Changed(rows, [rows.take(np.flatnonzero(rows.stroke == number)).recording() for number in numbers])


def without_the_end(rows: Rows, random: Generator) -> Changed:
    """Leaves out the last hundredth of the travel."""
    x = rows.motion.x
    return Changed(rows.take(np.flatnonzero(x < x.max() - 0.01 * np.ptp(x))))


def other_units(rows: Rows, random: Generator) -> Changed:
    """Stores the columns in units of a file: mm or deg, gf or mN*m, and ms."""
    recording, rotary = rows.recording(), rows.object.rotary
    columns = {
        "time_ms": 1e3 * rows.motion.time,
        "angle_deg" if rotary else "travel_mm": recording.position * (180.0 / np.pi if rotary else 1e3),
        "torque_mNm" if rotary else "force_gf": recording.force * (1e3 if rotary else 1e3 / g),
    }
    return Changed(rows, Recording.from_frame(pd.DataFrame(columns)))


def other_zero(rows: Rows, random: Generator) -> Changed:
    """Moves the zero of the position."""
    recording, offset = rows.recording(), random.uniform(-10.0, 10.0) * rows.object.travel
    return Changed(rows, replace(recording, position=recording.position + offset), offset)


def release_first(rows: Rows, random: Generator) -> Changed | None:
    """Starts the recording behind the first press, which is repeated behind the last release; None for an
    object with memory."""
    if rows.object.branch is not None:
        return None
    first = turns(rows)[0] + 1
    moved = rows.take(np.r_[first : len(rows.force), 0:first])
    # A repeated press begins with the friction that the release before left.
    state = rows.object.state(np.r_[rows.motion.x, rows.motion.x[:first]])[first:]
    time, x, velocity = rows.motion.time, moved.motion.x, moved.motion.velocity
    left, before = (
        rows.object.force(time, x, each, velocity) * rows.object.share_left(x)
        for each in (state, moved.state)
    )
    motion = replace(moved.motion, time=time)
    return Changed(replace(moved, motion=motion, state=state, force=moved.force + left - before))


def small_drift(rows: Rows, random: Generator) -> Changed:
    """Moves the zero of the force by up to a just noticeable difference during the recording."""
    drift = random.uniform(-1.0, 1.0) * force_floor(rows.force) * np.linspace(0.0, 1.0, len(rows.force))
    return Changed(replace(rows, force_noise=rows.force_noise + drift))


def few_rows(rows: Rows, random: Generator) -> Changed:
    """Keeps 30 to 80 rows of a stroke."""
    n = random.uniform(FEWEST_ROWS, MOST_ROWS) * (rows.stroke[-1] + 1)
    return Changed(rows.take(np.linspace(0, len(rows.force) - 1, int(n)).astype(int)))


def another_noise(rows: Rows, random: Generator) -> Rows:
    """Draws the noise again, from the same values."""
    position, force = (random.permutation(noise) for noise in (rows.position_noise, rows.force_noise))
    return replace(rows, position_noise=position, force_noise=force)


CHANGES: tuple[Callable[[Rows, Generator], Changed | None], ...] = (
    waiting_rows,
    repeated_rows,
    half_the_rate,
    stored_by_change,
    pauses,
    through_air,
    wrong_readings,
    with_direction,
    order_alone,
    one_file_a_stroke,
    without_the_end,
    other_units,
    other_zero,
    release_first,
    small_drift,
    few_rows,
)
"""Functions that change a recording without new information on its object; None if they do not apply"""

OTHER_NOISE = (half_the_rate, stored_by_change, wrong_readings, without_the_end, small_drift, few_rows)
"""Changes with another noise or without some rows"""

COARSER = (few_rows,)
"""Changes that lower the resolution: only class and verdict must stay the same"""


def compared(model: Model, truth: Truth, other: Model, other_truth: Truth) -> dict[str, bool]:
    """Returns True for each of MEASURES in which two models agree.

    The size may differ by one wavelet, the true error by 5 % (of the reported error, if that is larger), the
    steepest slope where friction does not reverse by 10 %, and the force at each place by a just noticeable
    difference.
    """
    error, other_error = truth.error(model), other_truth.error(other)
    slope, other_slope = (
        each.slope_ratio(found, settled=True) for each, found in ((truth, model), (other_truth, other))
    )
    return {
        "size": abs(other.n_wavelets - model.n_wavelets) <= 1,
        "error": abs(other_error - error) <= 0.05 * max(error, model.fit.nrmse),
        "slope": abs(other_slope / slope - 1.0) <= 0.1,
        "force": replace(other_truth, force=truth.modelled(model)).worst_place(other) <= 1.0,
        "class": classes_of(other) == classes_of(model),
        "verdict": other.verdict.level == model.verdict.level,
    }


def measure(draw: int, names: Sequence[str]) -> dict[str, dict[str, bool]]:
    """Returns for each change whether the models of a draw and of its changed recording agree in the measures
    that are judged, and in "resolved" whether the fits agree that know roles and class."""
    rows, _ = drawn(draw)
    model, known, truth = palpate.identify(rows.recording()), reference(rows), Truth.of(rows)
    _, random = drawn(draw)
    noises = [compared(known, truth, reference(another_noise(rows, random)), truth) for _ in range(NOISES)]
    noise = {name: all(each[name] for each in noises) for name in MEASURES}
    found = {another_noise.__name__: noise}
    for change in CHANGES:
        if change.__name__ not in names or (changed := change(*drawn(draw))) is None:
            continue
        moved = replace(truth, position=truth.position + changed.zero)
        limit = compared(known, truth, reference(changed.rows), truth)
        if change in OTHER_NOISE:
            limit = {name: limit[name] and noise[name] for name in MEASURES}
        try:
            agreed = compared(model, truth, palpate.identify(changed.recordings), moved)
        except InputError:
            agreed = dict.fromkeys(MEASURES, False)
        judged = ("class", "verdict") if change in COARSER else MEASURES
        found[change.__name__] = {
            **{name: agreed[name] for name in judged if limit[name]},
            "resolved": all(limit[name] for name in judged),
        }
    return found


def main() -> None:
    known = [change.__name__ for change in CHANGES]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", default=known, metavar="NAME", help=", ".join(known))
    parser.add_argument("--draws", type=int, default=count(DRAWS))
    parser.add_argument("--seed", type=int, default=PUBLISHED, help="first draw; development uses 0 to 999")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    if unknown := sorted(set(options.names) - set(known)):
        parser.error(f"no change is called {unknown[0]}; use {', '.join(known)}")
    draws = range(options.seed, options.seed + options.draws)
    found = Parallel(n_jobs=options.jobs)(delayed(measure)(draw, options.names) for draw in draws)
    results: list[dict[str, Any]] = []
    for name in (*options.names, another_noise.__name__):
        agreed = [each[name] for each in found if name in each]
        shares = {
            key: float(np.mean(values))
            for key in (*MEASURES, "resolved")
            if (values := [each[key] for each in agreed if key in each])
        }
        lost = {
            draw: failed
            for draw, each in zip(draws, found, strict=True)
            if (failed := [key for key in MEASURES if not each.get(name, {}).get(key, True)])
        }
        kept = 1.0 - len(lost) / len(agreed) if agreed else None
        results.append({"change": name, "draws": len(agreed), **shares, "all": kept, "not_kept": lost})
    lines = [
        (
            each["change"].replace("_", " "),
            str(each["draws"]),
            *(
                f"{100.0 * each[key]:.0f} %" if each.get(key) is not None else ""
                for key in (*MEASURES, "all", "resolved")
            ),
            "short" if each["all"] is not None and each["all"] < 0.95 else "",
        )
        for each in results
    ]
    print(markdown_table(("change", "draws", *MEASURES, "all", "resolved", ""), lines))
    write_results(options.json, results)


if __name__ == "__main__":
    main()
