# SPDX-License-Identifier: Apache-2.0
"""Recordings from recordings, files, frames or arrays, or from a list of the first three."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd

from ..arguments import path_of, shown
from ..errors import InputError
from .reading import read_recording
from .recording import Recording

Given: TypeAlias = Recording | str | os.PathLike[str] | pd.DataFrame
"""What is a recording, or can be read as one."""

CURE = "give a Recording, the name of a file, a DataFrame, or arrays of position and force"


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
