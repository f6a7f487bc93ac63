# SPDX-License-Identifier: Apache-2.0
"""Rows of an identification: selects usable rows and inputs, and moves positions of a periodic force law into
one repeat length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..._core.model import most_wavelets
from ..._typing import Float1D, Float2D, Int8Vector
from ...errors import InputError
from ...recording import Recording
from ...recording.conversion import MIN_POSITIONS, MIN_ROWS, Motion
from ...recording.motion import Piece, gaps_of, ordered_strokes, pieces, resolution_of, velocities
from ...recording.roles import Role, roles_of
from ...recording.units import UNSTATED_UNIT, Unit
from ...verdict import Finding, no, usable
from ..log import Log
from ..options import IdentifyOptions
from .compression import held_out_rows
from .limits import NO_LIMITS, STEP_ERROR, ForceScale, RowLimits, force_step, repeated, stepped
from .repeats import Repeats
from .strokes import stated_strokes, strokes_of

LARGEST_MAGNITUDE = 1e100
"""Largest accepted absolute value of position and force, and inverse of the smallest accepted travel and
force: the square of such a value does not overflow."""


def require_in_range(name: str, values: Float1D) -> None:
    """Refuses values (n,), n >= 1, whose squares would overflow."""
    if (largest := float(np.abs(values).max())) > LARGEST_MAGNITUDE:
        raise InputError(
            f"{name} reaches {largest:.3g}: must be at most {LARGEST_MAGNITUDE:g}. Use another unit"
        )


@dataclass(frozen=True)
class Rows:
    """Rows of all recordings in sequence, and the smallest box around their positions (the unit box)."""

    names: tuple[str, ...]
    """(d,) names of the inputs; the first one is position"""
    positions: Float2D
    """(n, d)"""
    force: Float1D
    """(n,)"""
    side: Float1D | None = None
    """(n,) direction: +1 press, -1 release, 0 neither; None if the direction is not known"""
    order: Float1D | None = None
    """(n,) direction of each row from the order of rows, where `side` is not known but a play operator can be
    used; None if the order shows no strokes"""
    starts: Sequence[int] | None = None
    """Indices of the rows at which a motion without gaps in time starts, for the play operator (only for one
    input)"""
    parts: Sequence[Piece] = ()
    """Motions without gaps in time (only for one input); their row numbers count the rows of all
    recordings"""
    weight: Float1D | None = None
    """(n,) number of recorded rows that each row represents in the fit; None: 1 each"""
    within: float = 0.0
    """Sum of squared differences of recorded forces from the mean force of the row that represents them
    [force^2]"""
    period: float | None = None
    """Repeat length of a periodic force law [position]; None if the force law is not periodic"""
    log: Log = field(default_factory=Log)
    """Decisions, sentences and findings from before the model selection"""
    counted: Float1D | None = None
    """(n,) number of recorded rows that each row represents in the reported error; None: 1 each"""
    limits: RowLimits = NO_LIMITS
    """Limits of the information in the rows"""
    corners: tuple[Float1D, Float1D] | None = None
    """(d,) smallest and largest position of the unit box; None: those of the rows"""
    role: Int8Vector | None = None
    """(n,) number of the :class:`Role` of each row; None: all rows are moving"""
    repeats: Repeats | None = None
    """Recording and object of each row; None for one recording"""
    position_unit: Unit = UNSTATED_UNIT
    """Unit of position in messages"""
    force_unit: Unit = UNSTATED_UNIT
    """Unit of force in messages"""

    @cached_property
    def lower(self) -> Float1D:
        """(d,) smallest position of the unit box [position]."""
        return self.positions.min(axis=0) if self.corners is None else self.corners[0]

    @cached_property
    def reach(self) -> Float1D:
        """(d,) side lengths of the unit box [position]."""
        if self.period is not None:
            return np.array([self.period])
        return np.asarray(
            np.ptp(self.positions, axis=0) if self.corners is None else self.corners[1] - self.lower
        )

    @cached_property
    def path(self) -> Float2D:
        """(n, d) positions minus the smallest position, divided by the side lengths of the unit box; those of
        a periodic force law may be outside [0, 1)."""
        return stepped((self.positions - self.lower) / self.reach)

    @cached_property
    def box(self) -> Float2D:
        """(n, d) positions in the unit box."""
        return self.path if self.period is None else modulo(self.path)

    @property
    def along(self) -> Float2D:
        """(n, d) positions in the unit box, those of a periodic force law in the whole travel."""
        return self.path if self.period is None else (self.path - self.path.min()) / np.ptp(self.path)

    @property
    def direction(self) -> Float1D | None:
        """(n,) direction of each row, from `order` if `side` is not known; None if neither is known."""
        return self.order if self.side is None else self.side

    @property
    def domain(self) -> Float2D:
        """(n, d) positions; those of a periodic force law are moved into one repeat length."""
        return self.positions if self.period is None else self.lower + self.box * self.reach

    @property
    def roles(self) -> Int8Vector:
        """(n,) number of the :class:`Role` of each row."""
        return np.full(len(self.force), Role.MOVING, dtype=np.int8) if self.role is None else self.role

    @cached_property
    def fitted(self) -> NDArray[np.bool_]:
        """(n,) True for the rows that show the force law; the others belong to the motion only."""
        return np.asarray(self.roles == Role.MOVING)

    @property
    def reported(self) -> NDArray[np.bool_]:
        """(n,) True for rows that are used for the reported error."""
        return self.fitted if self.counted is None else self.fitted & (self.counted > 0.0)

    def held_out(self) -> NDArray[np.bool_]:
        """Returns True (n,) for held-out rows."""
        held_out = np.ones(len(self.force), dtype=bool) if self.weight is None else self.weight > 0.0
        held_out[held_out] = held_out_rows(int(np.count_nonzero(held_out)), self.starts)
        return held_out

    def only(self, rows: NDArray[np.bool_]) -> Rows:
        """Returns some of the rows, without their continuous motions."""
        side, weight, order = (
            None if each is None else each[rows] for each in (self.side, self.weight, self.order)
        )
        share = np.mean(rows) if self.weight is None else self.weight[rows].sum() / self.weight.sum()
        return replace(
            self,
            positions=self.positions[rows],
            force=self.force[rows],
            side=side,
            weight=weight,
            order=order,
            within=self.within * float(share),
            parts=(),
            role=None if self.role is None else self.role[rows],
            repeats=None if self.repeats is None else self.repeats.only(rows),
        )

    def scaled(self, scale: ForceScale) -> Rows:
        """Returns the rows with the scaled forces of the fit."""
        return replace(
            self,
            force=scale.scaled(self.force),
            within=self.within * scale.factor**2,
            parts=[replace(part, force=scale.scaled(part.force)) for part in self.parts],
            force_unit=replace(self.force_unit, scale=scale.factor),
        )

    def limited(self) -> Rows:
        """Returns the rows with their dependence and force resolution; rows that repeat others get
        weight 0.

        Rows with a given weight use it in the fit and in the error, and get no such limits.
        """
        gap = 0.0 if self.period is None else self._usual_gap()
        if self.weight is not None:
            return replace(self, counted=self.weight, limits=RowLimits(position_gap=gap))
        limits = RowLimits(force_error=STEP_ERROR * force_step(self.force[self.fitted]), position_gap=gap)
        again, repeats = repeated(self.positions, self.force, self.side)
        log = replace(self.log, rows=[*self.log.rows, repeats]) if repeats else self.log
        unused = again | ~self.fitted
        weight = np.where(unused, 0.0, 1.0) if unused.any() else None
        return replace(self, limits=limits, weight=weight, log=log)

    def _usual_gap(self) -> float:
        """Returns the gap [box] that is not exceeded between neighbouring positions on `COVERED_SHARE` of the
        travel.

        Positions in different periods do not show a finer force: it would fit the differences between the
        periods.
        """
        gaps = np.sort(np.diff(np.unique(self.path[self.fitted, 0])))
        covered = np.cumsum(gaps) >= COVERED_SHARE * gaps.sum()
        return float(gaps[np.argmax(covered)])


def require_usable(rows: Rows, options: IdentifyOptions) -> None:
    """Refuses data that cannot be identified, and options that need position as the only input."""
    names, positions, force = rows.names, rows.positions, rows.force
    if positions.ndim != 2 or force.shape != (len(positions),):
        raise InputError(
            f"positions have shape {positions.shape} and force {force.shape}: must be (n, d) and (n,)"
        )
    if len(force) < MIN_ROWS:
        raise InputError(f"the recording has {len(force)} rows; at least {MIN_ROWS} are needed")
    for name, column in zip((*names, "force"), (*positions.T, force), strict=True):
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise InputError(
                f"{name} in row {bad[0]} is {column[bad[0]]}: every value must be a finite number"
            )
    for name, column in zip((*names, "force"), (*positions.T, force), strict=True):
        require_in_range(name, column)
    if 0.0 < (largest := float(np.abs(force).max())) < 1.0 / LARGEST_MAGNITUDE:
        raise InputError(
            f"the largest |force| is {largest:.3g}: must be at least {1.0 / LARGEST_MAGNITUDE:g}, or 0. Use "
            "another unit"
        )
    for name, column in zip(names, positions.T, strict=True):
        if 0.0 < (travel := float(np.ptp(column))) < 1.0 / LARGEST_MAGNITUDE:
            raise InputError(
                f"{name} has a range of {travel:.3g}: must be at least {1.0 / LARGEST_MAGNITUDE:g}. Use "
                "another unit"
            )
        if column.min() == column.max():
            raise InputError(f"every {name} is {column[0]:g}: must vary")
        if len(np.unique(column)) < MIN_POSITIONS:
            raise InputError(
                f"{name} has only {len(np.unique(column))} distinct values; "
                f"at least {MIN_POSITIONS} are needed"
            )
    if names[1:] in ((), ("velocity",)) and options.max_wavelets > most_wavelets:
        raise InputError(
            f"max_wavelets is {options.max_wavelets}: must be at most {most_wavelets} for a force of "
            "position, which is what a tick of 1 ms can evaluate"
        )
    if len(names) > 1 and (options.slope_limits is not None or options.fixed_force is not None):
        raise InputError(
            f"the inputs are {', '.join(names)}: slope_bounds, monotone, coupling_stiffness and fixed_force "
            "need position as the only input"
        )
    if len(names) > 1 and options.period is not None:
        raise InputError(f"the inputs are {', '.join(names)}: period needs position as the only input")


def rows_of(
    recordings: Sequence[Recording], options: IdentifyOptions, objects: Sequence[int] | None = None
) -> Rows:
    """Returns the rows of recordings with the inputs that the options require.

    `objects` holds the number of the object of each recording; by default all are of one object.
    """
    names = _input_names(recordings[0], options)
    found = input_columns(recordings, names)
    kept = [rows for _, rows in found]
    columns = [X[rows] for X, rows in found]
    hysteresis = len(names) == 1 and (options.inputs == "auto" or "hysteresis" in options.inputs)
    strokes = strokes_of(recordings) if hysteresis else stated_strokes(recordings)
    if lost := sum(int(np.count_nonzero(~rows)) for rows in kept):
        note = f"{lost} rows at the ends and at gaps of time have no velocity and are not used."
        strokes.log.rows.append(note)
    side, order = (
        None if each is None else each[np.concatenate(kept)] for each in (strokes.side, strokes.order)
    )
    starts = _starts(recordings, kept) if strokes.in_order else None
    parts: tuple[Piece, ...] = ()
    if len(names) == 1 and all(part.time is not None for part in recordings):
        first = np.cumsum([0, *(len(part) for part in recordings)])
        parts = tuple(
            replace(piece, rows=slice(start + piece.rows.start, start + piece.rows.stop))
            for start, recording in zip(first[:-1].tolist(), recordings, strict=True)
            for piece in pieces(recording)
        )
    force = np.concatenate([part.force[rows] for part, rows in zip(recordings, kept, strict=True)])
    role = np.concatenate([roles_of(part)[rows] for part, rows in zip(recordings, kept, strict=True)])
    positions, fitted = np.concatenate(columns), role == Role.MOVING
    corners = None
    # During a wait the object keeps the direction of the stroke before it.
    side, order = (None if each is None else _kept(each, ~fitted) for each in (side, order))
    if not fitted.all():
        shown = positions[fitted]
        corners = shown.min(axis=0), shown.max(axis=0)
    first_equal = _first_equal(recordings)
    repeats = None
    if len(set(first_equal)) > 1:
        number = np.repeat(first_equal, [np.count_nonzero(rows) for rows in kept])
        repeats = Repeats(number.astype(np.intp), tuple(objects or (0,) * len(recordings)))
    return Rows(
        names,
        positions,
        force,
        side,
        order,
        starts,
        parts,
        period=options.period,
        log=strokes.log,
        corners=corners,
        role=role,
        repeats=repeats,
        position_unit=recordings[0].file_unit("position"),
        force_unit=recordings[0].file_unit("force"),
    )


def _kept(side: Float1D, waiting: NDArray[np.bool_]) -> Float1D:
    """Returns directions (n,) in which a wait without direction has that of the rows before it."""
    known = np.where((side == 0.0) & waiting, -1, np.arange(len(side)))
    last = np.maximum.accumulate(known)
    return np.where(last >= 0, side[np.maximum(last, 0)], side)


def _first_equal(recordings: Sequence[Recording]) -> list[int]:
    """Returns, for each recording, the number of the first one with the same positions and forces: a copy is
    no repeat."""
    seen: dict[bytes, int] = {}
    return [
        seen.setdefault(each.position.tobytes() + each.force.tobytes(), number)
        for number, each in enumerate(recordings)
    ]


def _starts(recordings: Sequence[Recording], kept: Sequence[NDArray[np.bool_]]) -> tuple[int, ...]:
    """Returns the indices, among kept rows, at which a motion starts.

    It starts with a recording, unless its time goes on from that before. It also starts behind a gap of time
    in which the tool may have turned: it does not move on in the direction of the rows before and after.
    """
    starts, before = [], 0
    for number, (recording, rows) in enumerate(zip(recordings, kept, strict=True)):
        first = [0] if recording.time is None else [piece.rows.start for piece in pieces(recording)]
        if (way := ordered_strokes(recording)) is not None:
            step = np.sign(np.diff(recording.position, prepend=recording.position[0]))
            earlier, later = np.roll(way, 1), np.append(way[1:], 0)
            moves_on = (earlier == way) & (step == way) & (later == way)
            first = [row for row in first if row == 0 or not moves_on[row]]
        if number and _goes_on(recordings[number - 1].motion, recording.motion):
            first = first[1:]
        starts += [before + int(np.count_nonzero(rows[:row])) for row in first]
        before += int(np.count_nonzero(rows))
    return tuple(dict.fromkeys(start for start in starts if start < before))


def _goes_on(before: Motion, motion: Motion) -> bool:
    """True if the time of a motion goes on from that of the one before, without a gap."""
    if before.time is None or motion.time is None or not motion.time[0] > before.time[-1]:
        return False
    time, position = (
        np.concatenate(both) for both in ((before.time, motion.time), (before.position, motion.position))
    )
    return len(before.time) not in gaps_of(time, position)


def input_columns(
    recordings: Sequence[Recording], names: Sequence[str]
) -> list[tuple[Float2D, NDArray[np.bool_]]]:
    """Returns the named inputs (n, d) of each recording, and True (n,) for the rows that have all inputs.

    A velocity that is not a column of the recording is derived from its time.
    """
    moving = [(np.empty(0), np.ones(len(each), dtype=np.bool_)) for each in recordings]
    if "velocity" in names and not all("velocity" in each.input_names for each in recordings):
        moving = velocities(recordings)
    found = []
    for recording, (speed, rows) in zip(recordings, moving, strict=True):
        derived = "velocity" not in recording.input_names
        columns = [speed if name == "velocity" and derived else _column(recording, name) for name in names]
        found.append((np.column_stack(columns), rows))
    return found


def _column(recording: Recording, name: str) -> Float1D:
    if name == "position":
        return recording.position
    for index, known in enumerate(recording.input_names):
        if name in (known, recording.source.columns.get(known)):
            return recording.inputs[:, index]
    known_inputs = ", ".join(("position", *recording.input_names))
    raise InputError(
        f"the recording has no input {name}, only {known_inputs}; read the recording with inputs=({name!r},)"
    )


def _input_names(recording: Recording, options: IdentifyOptions) -> tuple[str, ...]:
    if options.inputs == "auto":
        return ("position", *recording.input_names)
    further = [name for name in options.inputs if name not in ("position", "hysteresis")]
    if further and "hysteresis" in options.inputs:
        raise InputError(
            f"inputs names hysteresis and {', '.join(further)}: hysteresis needs position as the only other "
            "input"
        )
    by_file_name = {recording.source.columns.get(known): known for known in recording.input_names}
    return ("position", *(by_file_name.get(name, name) for name in further))


COVERED_SHARE = 0.95
"""Share of the travel on which positions must be near each other: a few gaps do not change the resolution. A
periodic model is usable with a reservation if one gap exceeds the rest of the repeat length of its force."""

UNFIT_GAP = 0.5
"""Width of a gap in the recorded positions above which a periodic model is unfit [share of the repeat length
of its force]."""


def period_notes(position: Float1D, period: float, unit: str = "") -> tuple[str, list[Finding]]:
    """Returns the note and the findings on the part of the repeat length of a periodic force that positions
    (n,) in recorded order cover, each a step of the sensor."""
    lower, travel = float(position.min()), float(np.ptp(position))
    note = (
        f"The positions span {travel / period:.4g} periods of {_exact(period, unit)} and are taken modulo "
        "the period."
    )
    if travel <= period:
        gap = period - travel
        note = (
            f"The positions leave a gap of {Unit.of_si(unit).text(gap)}, {100 * gap / period:.2g} % of the "
            f"period of {_exact(period, unit)}. The model closes it."
        )
    box = np.sort(modulo((position - lower) / period))
    steps = np.diff(np.append(box, box[0] + 1.0))
    widest = int(np.argmax(steps))
    share = float(steps[widest])
    seen = min(resolution_of((position - lower) / travel) * travel, period) / period if travel > 0.0 else 0.0
    if share - seen <= 1.0 - COVERED_SHARE:
        return note, []
    start = lower + period * float(box[widest])
    judge = no if share - seen > UNFIT_GAP else usable
    sentence = (
        f"no position lies between {start:.6g} and {_exact(start + share * period, unit)}, {100 * share:.3g} "
        f"% of the period of {_exact(period, unit)}; record a whole period, or give its length with --period"
    )
    return note, [judge(sentence)]


def _exact(value: float, unit: str) -> str:
    """Returns a value with six digits and its unit as text."""
    return f"{value:.6g} {unit}".rstrip()


def modulo(box: Float1D) -> Float1D:
    """Returns positions (n,), in repeat lengths of a periodic force, moved by whole numbers into [0, 1)."""
    moved = box - np.floor(box)  # 1 for a negative number below the rounding error of 1
    return np.where(moved < 1.0, moved, 0.0)
