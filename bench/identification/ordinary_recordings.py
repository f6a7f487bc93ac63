# SPDX-License-Identifier: Apache-2.0
"""Simulates how people record an object: 21 operators, each a motion and a measuring chain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any

import numpy as np
from bench.identification.ordinary_objects import ADDED_OBJECTS, OBJECTS, Array, Object
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.signal import sawtooth

from palpate import Recording
from palpate._core.model import play

ROUNDED_TO = 1e-5
"""Step of the stored numbers [travel or scale of the object]"""

CREEP = 0.5
"""Share of the friction that a pause removes, with the time constant CREEP_S"""

CREEP_S = 1.0

JERKS = 40.0
"""Number of slips in the travel of an object with stick-slip"""

ALL_FROM = 13540
"""First draw of all pairs of object and operator; earlier draws keep the pairs that they had"""


@dataclass(frozen=True)
class Motion:
    """Exact motion of a tool."""

    time: Array
    """(n,) [s]"""
    x: Array
    """(n,) [m or rad]"""
    velocity: Array
    """(n,) [m/s or rad/s]"""
    acceleration: Array
    """(n,) [m/s^2 or rad/s^2]; 0 along strokes at constant speed, also at their turns"""

    @property
    def side(self) -> NDArray[np.int8]:
        """(n,) +1 into the object, -1 out of it, 0 at rest"""
        return np.sign(self.velocity).astype(np.int8)


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Rows of a recording: exact values, unavoidable errors, and errors that a better operator avoids."""

    object: Object
    motion: Motion
    state: Array
    """(n,) direction state, between -1 and 1 while the friction reverses"""
    force: Array
    """(n,) exact [N or N*m]"""
    inertial: Array
    """(n,) part of the exact force that accelerates the object [N or N*m]"""
    position_noise: Array
    force_noise: Array
    position_error: Array
    """(n,) avoidable error: backlash"""
    force_error: Array
    """(n,) avoidable error: lag, drift, second zero, wrong sign, saturation, wrong readings"""
    wrong: NDArray[np.bool_]
    """(n,) True for readings without information"""
    timed: bool
    directed: bool
    loop: bool = False
    """True if the errors add a loop between press and release, so that the class cannot be judged"""
    varied: bool = False
    """True if the speed varies enough to determine damping"""
    held: bool = False
    """True if the tool was held long enough to determine a memory"""
    lag_s: float | None = 0.0
    """Lag of the force [s]; None if it varies"""
    mirrored: bool = False
    """True if position and force are stored with the opposite sign"""

    @property
    def stroke(self) -> NDArray[np.intp]:
        """(n,) number of the stroke of each row; a pause belongs to the stroke before it"""
        moving = np.flatnonzero(self.motion.side)
        turns = moving[1:][np.diff(self.motion.side[moving]) != 0]
        return np.searchsorted(turns, np.arange(len(self.force)), side="right")

    @property
    def contact(self) -> NDArray[np.bool_]:
        """(n,) True where the tool touches the object"""
        return self.motion.x > 0.0 if self.object.leaves else np.ones(len(self.force), dtype=bool)

    def take(self, rows: NDArray[Any]) -> Rows:
        """Returns some of the rows."""
        motion = Motion(*(getattr(self.motion, each.name)[rows] for each in fields(Motion)))
        arrays = {
            each.name: getattr(self, each.name)[rows]
            for each in fields(self)
            if isinstance(getattr(self, each.name), np.ndarray)
        }
        return replace(self, motion=motion, **arrays)

    def with_other_noise(self, random: Generator) -> Rows:
        """Returns the rows with their unavoidable errors in another order."""
        noise = (random.permutation(each) for each in (self.position_noise, self.force_noise))
        return replace(self, **dict(zip(("position_noise", "force_noise"), noise, strict=True)))

    def recording(self) -> Recording:
        """Returns the recording as `palpate.read_recording` gives it for the file of the operator."""
        return self._stored(
            self.motion.x + self.position_noise + self.position_error,
            self.force + self.force_noise + self.force_error,
            self.directed,
            -1.0 if self.mirrored else 1.0,
        )

    def clean(self) -> Recording:
        """Returns the recording of an operator without avoidable errors: strokes in contact, known direction.

        Rows while the friction reverses belong to neither stroke. An object with memory keeps its pauses,
        because only they determine its time constants. The force is that without inertia.
        """
        in_stroke = settled(self.state, self.motion.side) | (self.object.branch is not None)
        used = ~self.wrong & self.contact & in_stroke
        rows = self.take(used)
        force = rows.force - rows.inertial + rows.force_noise
        return rows._stored(rows.motion.x + rows.position_noise, force, True)

    def _stored(self, x: Array, force: Array, directed: bool, sign: float = 1.0) -> Recording:
        return Recording.from_arrays(
            sign * rounded(x, self.object.travel),
            sign * rounded(force, self.object.scale),
            self.motion.time if self.timed else None,
            sign * self.motion.side if directed else None,
            units=self.object.units,
        )


def settled(state: Array, side: NDArray[Any]) -> NDArray[np.bool_]:
    """Returns True where the direction state (n,) has reached the direction (n,) of the stroke."""
    return np.asarray(state * side > 0.999)


def rounded(values: Array, size: float) -> Array:
    """Returns numbers rounded as a file with five digits stores them."""
    return np.asarray(np.round(values / (ROUNDED_TO * size)) * (ROUNDED_TO * size))


def along(knots: Array, at: Array, step: float) -> Motion:
    """Returns the motion through the positions `at` (k,) at the times `knots` (k,) [s], a row every `step`
    [s]."""
    time = np.arange(0.0, knots[-1], step)
    segment = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    velocity = (np.diff(at) / np.diff(knots))[segment]
    return Motion(time, np.interp(time, knots, at), velocity, np.zeros(len(time)))


def strokes(
    object: Object,
    random: Generator,
    *,
    rows: float | None = None,
    hold_s: float = 0.0,
    approach: float = 0.0,
    wait: int = 0,
    speeds: tuple[float, ...] = (1.0,),
    leaving: float = 1.0,
) -> Motion:
    """Returns one to three cycles of press and release at constant speed, two or three if the object softens.

    Parameters
    ----------
    object : Object
    random : Generator
    rows : float, optional
        Rows of a stroke; by default 150 to 800.
    hold_s : float
        Pause at each turn [s].
    approach : float
        Way through air before and after the strokes [travels].
    wait : int
        Rows at rest before the first stroke.
    speeds : tuple of float
        Relative speeds, each of which has all cycles.
    leaving : float
        Relative speed of the releases.
    """
    travel, seconds = object.travel, 10.0 ** random.uniform(0.0, 1.0)
    rows = rows or 10.0 ** random.uniform(2.2, 2.9)
    lower = -random.uniform(0.01, 0.05) if object.leaves else object.lower
    step = seconds * (1.0 - object.lower) / rows
    way, now = [(0.0, lower - approach)], max(wait, 1) * step
    way.append((now, lower - approach))
    cycles = max(random.integers(1, 4), 2 if object.softening > 0.0 or leaving > 1.0 else 1)
    for speed in np.repeat(speeds, cycles):
        for end, faster in ((1.0, speed), (lower, speed * leaving)):
            now += seconds * abs(end - way[-1][1]) / faster
            way += [(now, end), (now + hold_s, end)]
            now += hold_s
    way.append((now + seconds * approach + step, lower - approach))
    knots, at = np.array(way).T
    moving = np.r_[True, np.diff(knots) > 0.0]
    return along(knots[moving], travel * at[moving], step)


def hand_motion(object: Object, random: Generator) -> Motion:
    """Returns a hand that presses three to ten times at a varying frequency, between 0.2 and 3 Hz, or between
    1 and 6 Hz if the object has an inertia."""
    slowest, fastest = (0.0, 0.78) if object.inertia > 0.0 else (-0.7, 0.48)
    cycles, frequency = random.integers(3, 11), 10.0 ** random.uniform(slowest, fastest)
    step = max(1e-3, 0.5 / frequency / 10.0 ** random.uniform(2.0, 2.6))
    time = np.arange(0.0, cycles / frequency, step)
    knots = np.linspace(0.0, time[-1], cycles + 1)
    speed = np.interp(time, knots, random.uniform(0.5, 1.5, cycles + 1))
    phase = 2.0 * np.pi * frequency * step * np.cumsum(speed)
    depth = np.interp(time, knots, random.uniform(0.9, 1.0, cycles + 1))
    lower = -0.03 if object.leaves else object.lower
    x = object.travel * (lower + (1.0 - lower) * depth * (0.5 - 0.5 * np.cos(phase)))
    velocity = np.gradient(x, time)
    return Motion(time, x, velocity, np.gradient(velocity, time))


def measured(object: Object, random: Generator, motion: Motion, **given: Any) -> Rows:
    """Returns the rows that a careful operator stores: exact force and unavoidable noise.

    Stick-slip is part of the noise, because it differs between strokes.
    """
    time, x, n = motion.time, motion.x, len(motion.x)
    last_moving = np.maximum.accumulate(np.where(motion.side != 0, time, 0.0))
    state = object.state(x) * (1.0 - CREEP * (1.0 - np.exp((last_moving - time) / CREEP_S)))
    inertial = object.scale * object.inertia * motion.acceleration / object.travel
    force = object.force(time, x, state, motion.velocity) * object.share_left(x) + inertial
    clean = Rows(
        object=object,
        motion=motion,
        state=state,
        force=force,
        inertial=inertial,
        position_noise=random.normal(0.0, 10.0 ** random.uniform(-5.0, -3.7) * object.travel, n),
        force_noise=random.normal(0.0, 10.0 ** random.uniform(-3.0, -2.2) * np.ptp(force), n),
        position_error=np.zeros(n),
        force_error=np.zeros(n),
        wrong=(x >= np.maximum.accumulate(x)) & (object.softening > 0.0),  # not yet softened
        **{"timed": random.random() < 0.7, "directed": random.random() < 0.4, **given},
    )
    phase = JERKS * x / object.travel + random.random(n)[clean.stroke]
    slip = object.scale * object.jerk * state * sawtooth(2.0 * np.pi * phase)
    return replace(clean, force_noise=clean.force_noise + slip)


def tester(object: Object, random: Generator) -> Rows:
    return measured(object, random, strokes(object, random))


def hand(object: Object, random: Generator) -> Rows:
    return measured(object, random, hand_motion(object, random), timed=True, directed=False, varied=True)


def tester_or_hand(object: Object, random: Generator) -> Rows:
    return (tester if random.random() < 0.6 else hand)(object, random)


def tester_with_holds(object: Object, random: Generator) -> Rows:
    hold_s = 10.0 ** random.uniform(-0.5, 1.0)
    held = object.branch is not None and hold_s > object.branch[1]
    rows = measured(object, random, strokes(object, random, hold_s=hold_s))
    return replace(rows, held=held and rows.timed)


def robot_with_approach(object: Object, random: Generator) -> Rows:
    approach = 10.0 ** random.uniform(-0.7, 1.0) if object.leaves else 0.0
    few = 10.0 ** random.uniform(2.0, 2.5)
    motion = strokes(object, random, rows=few, hold_s=random.uniform(0.0, 3.0), approach=approach)
    return measured(object, random, motion, timed=True)


def recorder_started_early(object: Object, random: Generator) -> Rows:
    wait = int(10.0 ** random.uniform(2.0, 3.7))
    return measured(object, random, strokes(object, random, wait=wait))


def variable_rate(object: Object, random: Generator) -> Rows:
    """Stores a row when force or position has changed enough."""
    rows = tester(object, random)
    range_, share = np.ptp(rows.force), random.uniform(0.005, 0.02)
    kept, force = [0], rows.force + rows.force_noise
    for row in range(1, len(force)):
        moved = abs(rows.motion.x[row] - rows.motion.x[kept[-1]]) / object.travel
        if abs(force[row] - force[kept[-1]]) > share * range_ or moved > 2.0 * share:
            kept.append(row)
    return rows.take(np.array(kept))


def coarse_encoder(object: Object, random: Generator) -> Rows:
    rows = tester_or_hand(object, random)
    step = object.travel / random.uniform(40.0, 200.0)
    stored = np.round((rows.motion.x + rows.position_noise) / step) * step
    return replace(rows, position_noise=stored - rows.motion.x)


def coarse_force(object: Object, random: Generator) -> Rows:
    """Stores the force with 8 bits, or as the converter HX711 does: a new value 10 or 80 times a second."""
    rows = tester_or_hand(object, random)
    force = rows.force + rows.force_noise
    if random.random() < 0.5:
        step = random.uniform(1.0, 2.0) * np.ptp(force) / 256.0
        return replace(rows, force_noise=np.round(force / step) * step - rows.force)
    time = rows.motion.time
    rate = random.choice([10.0, 80.0])
    converted = np.searchsorted(time, np.floor(time * rate) / rate, side="right") - 1
    return replace(rows, force_noise=force[converted] - rows.force, loop=True, lag_s=None)


def late_force(object: Object, random: Generator) -> Rows:
    rows, lag_s = tester_or_hand(object, random), random.uniform(0.0, 0.05)
    time = rows.motion.time
    late = np.interp(time - lag_s, time, rows.force) - rows.force
    return replace(rows, force_error=late, timed=True, loop=True, lag_s=lag_s)


def backlash(object: Object, random: Generator) -> Rows:
    """Measures the position on the side of the motor, 5 to 50 um before or behind the tool."""
    rows = replace(tester_or_hand(object, random), loop=True)
    gap = min(random.uniform(5e-6, 50e-6) if not object.rotary else np.inf, 0.01 * object.travel)
    return replace(rows, position_error=rows.motion.x - play(rows.motion.x, gap / 2.0))


def drift(object: Object, random: Generator) -> Rows:
    rows = replace(tester_or_hand(object, random), loop=True)
    size = random.choice([-1.0, 1.0]) * random.uniform(0.01, 0.08) * np.ptp(rows.force)
    return replace(rows, force_error=size * np.linspace(0.0, 1.0, len(rows.force)))


def second_zero(object: Object, random: Generator) -> Rows:
    """Sets the force to zero again at a turn."""
    rows = replace(tester_or_hand(object, random), loop=True)
    size = random.choice([-1.0, 1.0]) * random.uniform(0.03, 0.15) * np.ptp(rows.force)
    first = random.integers(1, rows.stroke[-1] + 1)
    return replace(rows, force_error=np.where(rows.stroke >= first, size, 0.0))


def wrong_sign(object: Object, random: Generator) -> Rows:
    rows = replace(tester_or_hand(object, random), loop=True)
    mirrored = rows.stroke == random.integers(0, rows.stroke[-1] + 1)
    return replace(rows, force_error=np.where(mirrored, -2.0 * (rows.force + rows.force_noise), 0.0))


def saturation(object: Object, random: Generator) -> Rows:
    rows = tester_or_hand(object, random)
    force = rows.force + rows.force_noise
    most = force.min() + random.uniform(0.6, 0.95) * np.ptp(force)
    return replace(rows, force_error=np.minimum(most - force, 0.0), wrong=rows.wrong | (force > most))


def few_rows(object: Object, random: Generator) -> Rows:
    return measured(object, random, strokes(object, random, rows=random.uniform(30.0, 80.0)))


def wrong_readings(object: Object, random: Generator) -> Rows:
    rows = tester_or_hand(object, random)
    return with_wrong_readings(rows, random, 10.0 ** random.uniform(np.log10(0.002), np.log10(0.03)))


def with_wrong_readings(rows: Rows, random: Generator, share: float) -> Rows:
    """Returns the rows with a share of wrong readings: one value, any values, moderate, zeros or pairs."""
    n, size = len(rows.force), float(np.ptp(rows.force))
    wrong = random.choice(n - 1, max(1, round(share * n)), replace=False)
    kind = random.choice(["value", "any", "moderate", "zero", "pairs"])
    force = rows.force + rows.force_noise
    reading = force.copy()
    if kind in ("value", "pairs"):
        wrong = np.r_[wrong, wrong + 1] if kind == "pairs" else wrong
        reading[wrong] = force.min() + random.uniform(1.5, 10.0) * size
    elif kind == "any":
        reading[wrong] = force.min() + random.uniform(-2.0, 10.0, len(wrong)) * size
    elif kind == "moderate":
        sign = random.choice([-1.0, 1.0], len(wrong))
        reading[wrong] += sign * random.uniform(0.05, 1.0, len(wrong)) * size
    else:
        reading[wrong] = 0.0
    is_wrong = rows.wrong.copy()
    is_wrong[wrong] = True
    return replace(rows, force_error=reading - force, wrong=is_wrong)


def encoder_steps(object: Object, random: Generator) -> Rows:
    """Stores 4 to 30 steps of an encoder in a detent, or 200 to 4000 in the travel."""
    rows = tester_or_hand(object, random)
    if object.period is None:
        share = 10.0 ** -random.uniform(2.3, 3.6)
    else:
        share = object.period / object.strongest / random.uniform(4.0, 30.0)
    step = np.ceil(share / ROUNDED_TO) * ROUNDED_TO * object.travel  # equal steps in the stored numbers
    stored = np.round((rows.motion.x + rows.position_noise) / step) * step
    return replace(rows, position_noise=stored - rows.motion.x)


def quick_leaving(object: Object, random: Generator) -> Rows:
    """Presses, waits, leaves the object 10 to 50 times faster, and returns after another wait."""
    hold_s, leaving = 10.0 ** random.uniform(-0.5, 0.5), 10.0 ** random.uniform(1.0, 1.7)
    held = object.branch is not None and hold_s > object.branch[1]
    motion = strokes(object, random, rows=10.0 ** random.uniform(2.7, 3.2), hold_s=hold_s, leaving=leaving)
    rows = measured(object, random, motion)
    return replace(rows, held=held and rows.timed)


def jumping_angle(object: Object, random: Generator) -> Rows:
    """Stores the angle of an encoder that starts again after each revolution; the first row is right."""
    rows = tester_or_hand(object, random)
    x, revolution = rows.motion.x + rows.position_noise, 2.0 * np.pi
    least = object.lower * object.travel
    zero = least + random.uniform(0.1, 0.9) * min(object.travel - least, revolution)
    return replace(rows, position_error=zero - revolution + np.mod(x - zero, revolution) - x)


def mirrored(object: Object, random: Generator) -> Rows:
    """Stores position and force with the opposite sign."""
    return replace(tester_or_hand(object, random), mirrored=True)


def two_speeds(object: Object, random: Generator) -> Rows:
    """Presses at one speed, then three to ten times faster."""
    rows, fast = 10.0 ** random.uniform(2.5, 3.0), 10.0 ** random.uniform(0.5, 1.0)
    return measured(object, random, strokes(object, random, rows=rows, speeds=(1.0, fast)), varied=True)


OPERATORS: tuple[Callable[[Object, Generator], Rows], ...] = (
    tester,
    hand,
    tester_with_holds,
    robot_with_approach,
    recorder_started_early,
    variable_rate,
    coarse_encoder,
    coarse_force,
    late_force,
    backlash,
    drift,
    second_zero,
    wrong_sign,
    saturation,
    few_rows,
    wrong_readings,
)
"""Functions that record an object with random motion, noise and errors"""


ADDED_OPERATORS = (encoder_steps, quick_leaving, jumping_angle, mirrored, two_speeds)
"""Further operators, which follow in the list of pairs"""

Pair = tuple[Callable[[Generator], Object], Callable[[Object, Generator], Rows]]


def _applies(pair: Pair) -> bool:
    """Returns True if the object of a pair can be left, or has an angle, where the operator needs it."""
    known = pair[0](np.random.default_rng(0))
    return {quick_leaving: known.leaves, jumping_angle: known.rotary}.get(pair[1], True)


FIRST_PAIRS: tuple[Pair, ...] = tuple(
    (OBJECTS[draw % len(OBJECTS)], OPERATORS[draw % len(OPERATORS)])
    for draw in range(len(OBJECTS) * len(OPERATORS))
)
"""Pairs of the draws before ALL_FROM. The numbers of objects and operators have no common divisor, so that
successive draws contain every pair once."""

PAIRS: tuple[Pair, ...] = FIRST_PAIRS + tuple(
    pair
    for pair in product((*OBJECTS, *ADDED_OBJECTS), (*OPERATORS, *ADDED_OPERATORS))
    if pair not in FIRST_PAIRS and _applies(pair)
)


def drawn(draw: int, pairs: Sequence[Pair] | None = None) -> tuple[str, Rows]:
    """Returns the name of the operator and the rows of a draw: successive draws contain each pair once."""
    pairs = pairs or (PAIRS if draw >= ALL_FROM else FIRST_PAIRS)
    random = np.random.default_rng([36, draw])
    object, operator = pairs[draw % len(pairs)]
    return operator.__name__.replace("_", " "), operator(object(random), random)
