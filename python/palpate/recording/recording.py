# SPDX-License-Identifier: Apache-2.0
"""Recording: measured force over position in SI arrays, with its source."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
import numpy.typing as npt

from .._typing import Float1D, Float2D, Int8Vector
from ..arguments import number_of, path_of, real_of, shown, vector_of
from ..errors import InputError, listed
from ..frames import pd
from ..verdict import Verdict
from .checks import quality_findings
from .conversion import UNSTATED, Motion, Source, converted, digest_of
from .display import columns_of, html_of
from .files import write_csv
from .mcap_file import write_mcap
from .motion import cycles_of
from .revolutions import continued_angle
from .roles import Informative
from .table import FRAME, Cells, FrameTable, python_arguments
from .units import FORCE_UNITS, POSITION_UNITS, Unit

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Recording:
    """Measured (or simulated) force over position, in SI units.

    Position grows into the object. Force is the force of the object against the tool: pressing a spring gives
    a positive force. Arrays are read-only.
    """

    position: Float1D
    """(n,) [m, rad or count, see `units`]"""
    force: Float1D
    """(n,) [N, N*m, or A if the force is only known as a motor current]"""
    time: Float1D | None
    """(n,) [s], strictly increasing, or None"""
    direction: Int8Vector | None
    """(n,) direction of motion: +1 into the object, -1 out of it, 0 neither; None if the file has none"""
    inputs: Float2D
    """(n, d) further inputs on which the force depends, in SI if their names contain a unit"""
    input_names: tuple[str, ...]
    columns: Mapping[str, Cells]
    """Every other column of the file, without conversion: float64 numbers, or str objects for text"""
    metadata: Mapping[str, str]
    units: Mapping[str, str]
    """"position": "rad" | "m" | "count" | "", "force": "N*m" | "N" | "A" | "" ("": SI, not specified)"""
    source: Source
    notes: tuple[str, ...] = field(default=())
    """Sentences that state the chosen columns, the dropped rows and other observations of the reader"""
    part_of: Motion | None = field(default=None, repr=False)
    """All rows of the motion of which the recording is a part; None if the recording contains all rows"""
    file_units: Mapping[str, Unit] = field(default_factory=dict, repr=False)
    """Units of "position" and "force" in the file, for messages; a missing one is taken from `units`"""
    unit_is_certain: bool = False
    """True if the caller states the unit of the position"""
    unread_time: str = ""
    """Sentence on a column of times that was not read; empty if there is none"""
    corrected_lag_s: float = 0.0
    """Lag of the force that :meth:`with_force_earlier` corrected [s]"""

    def __post_init__(self) -> None:
        n = len(self.position)
        for name in ("position", "force", "time", "direction"):
            array = getattr(self, name)
            if array is None:
                continue
            if array.shape != (n,):
                raise InputError(f"{name} has shape {array.shape}, but position has {n} samples")
            _make_read_only(array)
        if self.inputs.shape != (n, len(self.input_names)):
            raise InputError(
                f"inputs have shape {self.inputs.shape}; {len(self.input_names)} names and {n} samples need "
                f"({n}, {len(self.input_names)})"
            )
        _make_read_only(self.inputs)
        for cells in self.columns.values():
            _make_read_only(cells)

    @classmethod
    def from_arrays(
        cls,
        position: npt.ArrayLike,
        force: npt.ArrayLike,
        time: npt.ArrayLike | None = None,
        direction: npt.ArrayLike | None = None,
        *,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        units: Mapping[str, str] | None = None,
        metadata: Mapping[str, str] | None = None,
    ) -> Recording:
        """Makes a recording from arrays in SI units.

        Parameters
        ----------
        position : (n,) array_like
            Position [rad or m].
        force : (n,) array_like
            Force against the tool [N*m or N].
        time : (n,) array_like, optional
            Time [s], strictly increasing.
        direction : (n,) array_like, optional
            +1 into the object, -1 out of it, 0 neither.
        inputs : mapping of str to (n,) array_like, optional
            Further inputs of the force, by name, SI.
        units : mapping, optional
            {"position": "rad", "force": "N*m"}; by default SI units that are not specified.
        metadata : mapping, optional
            Description of the data.

        Raises
        ------
        InputError
            Shapes differ, a value is not finite, time does not increase, a direction is not -1, 0 or +1, or a
            unit is not allowed in a recording.
        """
        arrays: dict[str, Float1D] = {}
        given_inputs = _mapping("inputs", inputs)
        named: dict[str, npt.ArrayLike | None] = {"position": position, "force": force, "time": time}
        if reserved := sorted({*named, "direction", "hysteresis"} & set(given_inputs)):
            raise InputError(
                f"an input is called {reserved[0]!r}, a name that every recording has; choose another name"
            )
        for name, values in (*named.items(), *given_inputs.items()):
            if values is None and name == "time":
                continue
            arrays[name] = vector_of(name, values)
        for name in ("position", "force"):
            if not len(arrays.get(name, ())):
                raise InputError(f"{name} is empty; give one value for each row")
        if time is not None:
            not_later = np.flatnonzero(np.diff(arrays["time"]) <= 0)
            if not_later.size:
                raise InputError(
                    f"time[{not_later[0] + 1}] is not later than time[{not_later[0]}]; time must increase"
                )
        signs: Int8Vector | None = None
        if direction is not None:
            given = vector_of("direction", direction)
            if not np.isin(given, (-1, 0, 1)).all():
                wrong = given[~np.isin(given, (-1, 0, 1))].flat[0]
                raise InputError(f"direction holds {wrong:g}; it must be +1, -1 or 0")
            signs = given.astype(np.int8)
        checked_units = {"position": UNSTATED, "force": UNSTATED, **_mapping("units", units)}
        for role, allowed in (("position", POSITION_UNITS), ("force", FORCE_UNITS)):
            if checked_units[role] not in (*allowed, UNSTATED):
                raise InputError(
                    f"units[{role!r}] is {checked_units[role]!r}; use one of {', '.join(allowed)}"
                )
        for name in given_inputs:
            if arrays[name].shape != arrays["position"].shape:
                raise InputError(
                    f"{name} has shape {arrays[name].shape}, but position has {arrays['position'].shape}"
                )
        n, position = len(arrays["position"]), arrays["position"]
        notes: list[str] = []
        if checked_units["position"] == "rad" and len(arrays["force"]) == n:
            position, notes = continued_angle("position", position, arrays["force"])
        return cls(
            position=position,
            force=arrays["force"],
            time=arrays.get("time"),
            direction=signs,
            inputs=np.array([arrays[name] for name in given_inputs]).reshape(-1, n).T.copy(),
            input_names=tuple(given_inputs),
            columns={},
            metadata=_mapping("metadata", metadata),
            units=checked_units,
            source=Source(
                files=(),
                sha256=digest_of(*arrays.values(), signs),
                rows=n,
                columns={},
                values_sha256=digest_of(position, arrays["force"]),
            ),
            notes=tuple(notes),
        )

    @classmethod
    def from_frame(
        cls,
        frame: pd.DataFrame,
        *,
        position: str | None = None,
        force: str | None = None,
        time: str | None = None,
        direction: str | None = None,
        inputs: Sequence[str] = (),
        units: Mapping[str, str] | None = None,
        invalid: Literal["refuse", "drop"] = "refuse",
    ) -> Recording:
        """Makes a recording from a pandas DataFrame. Column names end in a unit, as in a file.

        Parameters
        ----------
        frame : pandas.DataFrame
            Its ``attrs`` become the metadata. A named index is one more column.
        position, force, time, direction : str, optional
            Column names; by default chosen by name and unit, as in :func:`palpate.read_recording`.
        inputs : sequence of str
            Further columns that the force depends on.
        units : mapping of str to str, optional
            Unit of a column. The key is its name, or "position", "force" or "time" if that column is also
            named.
        invalid : {"refuse", "drop"}
            Refuse a frame with rows that cannot be used, or drop these rows and count them.

        Raises
        ------
        InputError
            One sentence that names the column, the row and the value.
        """
        treatment: object = invalid
        if not isinstance(treatment, str) or treatment not in ("refuse", "drop"):
            raise InputError(f"invalid is {shown(treatment)}; it must be 'refuse' or 'drop'")
        with python_arguments():
            fields = converted(
                FrameTable(frame),
                FRAME,
                position=position,
                force=force,
                time=time,
                direction=direction,
                inputs=inputs,
                units=units,
                drop=invalid == "drop",
            )
        return cls(**fields)

    def __len__(self) -> int:
        return len(self.position)

    def file_unit(self, role: str) -> Unit:
        """Returns the unit of "position" or "force" for messages: that of the file, else the SI unit."""
        return self.file_units.get(role, Unit.of_si(self.units.get(role, "")))

    @property
    def verdict(self) -> Verdict:
        """Verdict on the quality of the recording: clipped or slow sensors, gaps, wrong signs or units."""
        (kept,) = Informative([self]).recordings
        return Verdict(tuple(quality_findings(kept)))

    @cached_property
    def motion(self) -> Motion:
        """Positions and times of all rows of the motion, including the rows that were held out."""
        if self.part_of is not None:
            return self.part_of
        return Motion(self.position, self.time, np.arange(len(self)))

    @property
    def sample_period(self) -> float | None:
        """Median time step [s], or None without time."""
        if self.time is None or len(self.time) < 2:
            return None
        return float(np.median(np.diff(self.time)))

    @property
    def time_or_row(self) -> Float1D:
        """Time of each row [s], or its number without time, for a force that depends on the order alone."""
        return np.arange(len(self), dtype=float) if self.time is None else self.time

    def split(self, every: int = 5) -> tuple[Recording, Recording]:
        """Holds out every `every`-th row; returns (train, test).

        `test` has the rows i with i mod every = every - 1. Both parts keep the motion of all rows.

        Raises
        ------
        InputError
            `every` is below 2, or too large to hold out a row.
        """
        if number_of("every", every) != int(every) or not 2 <= every <= len(self):
            raise InputError(
                f"every is {shown(every)}; to hold out rows of {len(self)} it must be a whole number from 2 "
                f"to {len(self)}"
            )
        held_out = np.arange(len(self)) % every == every - 1
        return self._part(~held_out, every, False), self._part(held_out, every, True)

    def _part(self, rows: npt.NDArray[np.bool_], every: int, held_out: bool) -> Recording:
        part = self._rows(rows)
        whole = self.motion
        return replace(
            part,
            source=replace(part.source, held_out_every=every, held_out=held_out),
            part_of=replace(whole, rows=whole.rows[rows]),
        )

    def _rows(self, rows: npt.NDArray[np.bool_]) -> Recording:
        return replace(
            self,
            position=self.position[rows],
            force=self.force[rows],
            time=None if self.time is None else self.time[rows],
            direction=None if self.direction is None else self.direction[rows],
            inputs=self.inputs[rows],
            columns={name: cells[rows] for name, cells in self.columns.items()},
            source=replace(self.source, rows=int(np.count_nonzero(rows))),
            part_of=None if self.part_of is None else replace(self.part_of, rows=self.part_of.rows[rows]),
        )

    def without(self, rows: npt.NDArray[np.bool_]) -> Recording:
        """Returns a copy of the recording without the rows that `rows` (n,) marks with True."""
        return self._rows(~rows)

    def cycles(self, *numbers: int) -> Recording:
        """Returns some of the cycles of the recording; a cycle is a press and the release behind it.

        Parameters
        ----------
        numbers : int
            Numbers of the cycles, from 1.

        Raises
        ------
        InputError
            There is no such cycle.
        """
        cycles = cycles_of(self)
        for number in numbers:
            if not 1 <= number <= len(cycles):
                raise InputError(f"there is no cycle {number}; the recording has {len(cycles)}")
        chosen = np.zeros(len(self), dtype=np.bool_)
        for number in numbers:
            chosen[cycles[number - 1]] = True
        part, name = self._rows(chosen), f"cycle{'s' * (len(numbers) > 1)} {listed(map(str, numbers))}"
        source = replace(part.source, files=tuple(f"{file}, {name}" for file in part.source.files))
        return replace(part, source=source, notes=(*self.notes, f"{name} of {len(cycles)}"))

    def with_force_earlier(self, late_s: float) -> Recording:
        """Returns the recording corrected for a force that was recorded late_s [s] after its position.

        At a reversal on a steep force, a late force is larger in the release than in the press, which a
        passive object cannot do. Positions, directions and further inputs are shifted by late_s; the first
        rows, whose shifted position was not recorded, are removed.

        Raises
        ------
        InputError
            The recording has no time, or late_s is negative or longer than the recording.
        """
        if self.time is None:
            raise InputError("late_s needs a recording with a column of time (--time NAME)")
        time = self.time
        late_s = real_of("late_s", late_s)
        shifted_time = time - late_s
        rows = shifted_time >= time[0]
        if not (late_s >= 0.0 and rows.any()):
            last = float(time[-1] - time[0])
            raise InputError(f"late_s is {late_s} s; it must be a number from 0 to {last:g} s")

        # The direction of a row is that of the motion which ends there.
        moving_to = np.searchsorted(time, shifted_time)

        def at_shifted_time(values: Float1D) -> Float1D:
            return np.interp(shifted_time, time, values)

        shifted = replace(
            self,
            position=at_shifted_time(self.position),
            direction=None if self.direction is None else self.direction[moving_to],
            inputs=np.column_stack([*map(at_shifted_time, self.inputs.T), np.empty((len(self), 0))]),
            notes=(*self.notes, f"each force belongs to the position {late_s:g} s before"),
            part_of=None,
            corrected_lag_s=self.corrected_lag_s + late_s,
        )
        return shifted._rows(rows)

    def write(self, path: str | os.PathLike[str], *, replace: bool = True) -> Path:
        """Writes the recording as CSV, or as MCAP if the name ends in ``.mcap``.

        :func:`palpate.read_recording` reads both back exactly without options. The file gets its name only
        when it is complete. Numbers are exact to the last bit; positions and forces are in SI units. MCAP
        needs a time and the extra ``mcap``; it stores infinity in a further column as a missing number.

        Parameters
        ----------
        path : path
        replace : bool
            False refuses an existing file.

        Raises
        ------
        InputError
            The folder does not exist or cannot be written, the metadata does not fit on one line of CSV, or
            the recording has no time for MCAP.
        """
        file = path_of("path", path)
        write = write_mcap if file.suffix.lower() == ".mcap" else write_csv
        write(file, *columns_of(self), self.metadata, replace=replace)
        return file

    def to_frame(self) -> pd.DataFrame:
        """Returns the recording as a DataFrame that :meth:`from_frame` reads back exactly.

        The names of the columns end in the SI unit: time_s, position_m, force_N, direction, then the further
        inputs and all other columns. ``attrs`` holds the metadata and the role of each column.
        """
        layout, cells = columns_of(self)
        frame = pd.DataFrame({name: column.copy() for name, column in cells.items()})
        frame.attrs.update(self.metadata)
        frame.attrs.update(layout.record())
        return frame

    def _repr_html_(self) -> str:
        return html_of(self)


def _mapping(name: str, value: Mapping[str, T] | None) -> dict[str, T]:
    """Returns a copy of a dictionary, empty for None; any other type is refused."""
    given: object = {} if value is None else value
    if not isinstance(given, Mapping):
        raise InputError(f"{name} is {shown(given)}; it must be a dictionary")
    return dict(given)


def _make_read_only(array: Cells) -> None:
    array.flags.writeable = False
