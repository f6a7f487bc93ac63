# SPDX-License-Identifier: Apache-2.0
"""Read a recording from a file, or take it from a Recording, a frame or arrays."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd

from ..arguments import path_of, shown
from ..errors import InputError
from .conversion import converted
from .files import require_file
from .formats import open_table
from .recording import Recording

Given: TypeAlias = Recording | str | os.PathLike[str] | pd.DataFrame
"""What is a recording, or can be read as one."""

CURE = "give a Recording, the name of a file, a DataFrame, or arrays of position and force"


def read_recording(
    path: str | os.PathLike[str],
    *,
    position: str | None = None,
    force: str | None = None,
    time: str | None = None,
    direction: str | None = None,
    inputs: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    torque_constant: float | None = None,
    negate: Sequence[str] = (),
    rows: tuple[int | None, int | None] | None = None,
    zero: tuple[int | None, int | None] | None = None,
    force_late_s: float = 0.0,
    invalid: Literal["refuse", "drop"] = "refuse",
) -> Recording:
    """Read a recording from a file.

    The name of a column states its unit (``displacement_mm``, ``Force [gf]``, ``Force (mN)``, ``Force / N``),
    or a second header line does. The unit is looked up in a closed table, and values are converted to SI.
    Separator, decimal mark, encoding and lines before the header are recognised; the first note reports them.

    Parameters
    ----------
    path : path
        CSV (separated by commas, semicolons or tabs); a ``.part`` file, a recording cut off while it grew,
        whose torn last line is left out and counted; ``.parquet`` (needs pyarrow), ``.xlsx`` (openpyxl),
        ``.npz``, ``.mat``, or ``.mcap`` with JSON messages (mcap).
    position, force, time : str, optional
        Column names. Without them the columns are chosen by name and unit; where that is ambiguous, the error
        names the candidates.
    direction : str, optional
        Column with the direction of the stroke, in words (press, approach, load, loading, forward, +1;
        release, retract, unload, unloading, back, -1; pause, hold, extra, 0). Without it a column called
        ``direction``, or one called ``segment`` that holds words, is taken.
    inputs : sequence of str
        Further columns that the force depends on.
    units : mapping of str to str, optional
        Unit of a column, by its name or by "position", "force" or "time" where that column is named too; for
        columns without a unit, or in one that the table does not know.
    torque_constant : float, optional
        Torque per current [N*m/A]: turns a force column in A into N*m. Without it current stays in A.
    negate : sequence of str
        "position", "force" or names of used columns whose sign is to be turned.
    rows : (start, stop), optional
        Half-open range of data rows to use, counted from 0; None for either end leaves it open.
    zero : (start, stop), optional
        Half-open range of data rows, counted as `rows`, in which the tool touches nothing: their mean force
        is taken off all forces.
    force_late_s : float
        How long after its position each force was recorded [s], as where a load cell's converter averages:
        every force is brought back to the position it belongs to. Needs time.
    invalid : {"refuse", "drop"}
        What to do with a row that has no number where one is needed, an infinite one, or a time that repeats
        or runs backward: refuse the file, naming the row, or drop the row and count it.

    Returns
    -------
    Recording
        SI arrays; its ``notes`` say what was chosen, dropped and noticed. Of what was rendered live only the
        rows whose force was the model's alone are kept: not the ramp at the start, nor what a limit clipped
        or a fault set to zero.

    Raises
    ------
    InputError
        One sentence that names the file, the line or column, and the value.
    """
    file = path_of("path", path)
    if invalid not in ("refuse", "drop"):
        raise InputError(f"invalid is {invalid!r}; it must be 'refuse' or 'drop'")
    require_file(file)
    fields = converted(
        open_table(file),
        str(file),
        file=file,
        position=position,
        force=force,
        time=time,
        direction=direction,
        inputs=inputs,
        units=units,
        torque_constant=torque_constant,
        negate=negate,
        rows=rows,
        zero=zero,
        drop=invalid == "drop",
    )
    recording = Recording(**fields)
    return recording.with_force_earlier(force_late_s) if force_late_s else recording


def recording_from(
    recording: Given | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    *,
    inputs: Sequence[str] = (),
    name: str = "recording",
) -> Recording:
    """The recording that is given, read or made of arrays.

    Parameters
    ----------
    recording : Recording, path, DataFrame or (n,) array_like
        With `force` it is the array of positions.
    force, time, direction : (n,) array_like, optional
        As in :meth:`palpate.Recording.from_arrays`.
    inputs : sequence of str
        Further columns to read from a file or a frame.
    name : str
        The argument in messages.

    Raises
    ------
    InputError
        It is something else; the message names the argument.
    """
    if force is not None:
        if isinstance(recording, (Recording, str, os.PathLike, pd.DataFrame)):
            raise InputError(f"force is given beside {name}, which holds a force already; leave force out")
        return Recording.from_arrays(recording, force, time, direction)
    for role, array in (("time", time), ("direction", direction)):
        if array is not None:
            raise InputError(f"{role} is given without force; arrays need a position and a force")
    if isinstance(recording, Recording):
        return recording
    if isinstance(recording, pd.DataFrame):
        return Recording.from_frame(recording, inputs=inputs)
    if isinstance(recording, (str, os.PathLike)):
        return read_recording(path_of(name, recording), inputs=inputs)
    raise InputError(f"{name} is {shown(recording)}; {CURE}")


def recordings_from(
    recording: Given | Iterable[Given] | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    *,
    inputs: Sequence[str] = (),
) -> list[Recording]:
    """The recordings that are given: one, as in :func:`recording_from`, or a list.

    Raises
    ------
    InputError
        One of them is something else, or there is none.
    """
    several: Any = recording
    is_list = isinstance(recording, Iterable) and not isinstance(
        recording, (Recording, str, os.PathLike, pd.DataFrame, dict, bytes, np.ndarray, pd.Series)
    )
    if force is not None or time is not None or direction is not None or not is_list:
        return [recording_from(several, force, time, direction, inputs=inputs)]
    found = list(several)
    if not found:
        raise InputError(f"recording is an empty list; {CURE}")
    if all(isinstance(each, (int, float, np.number)) for each in found):
        raise InputError(f"recording is a list of numbers, and force is not given; {CURE}")
    return [
        recording_from(each, inputs=inputs, name=f"recording[{number}]") for number, each in enumerate(found)
    ]
