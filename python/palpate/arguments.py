# SPDX-License-Identifier: Apache-2.0
"""Checks of arguments. Each refuses a wrong type in one sentence that names the argument."""

from __future__ import annotations

import inspect
import math
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ._typing import Float1D
from .errors import InputError

LONGEST_VALUE = 60
"""Largest length of a value that a message repeats; longer values are cut [characters]."""


def shown(value: object) -> str:
    """Returns an argument's value as one line for a message; long values are cut."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} of shape {value.shape}"
    text = " ".join(repr(value).split())
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def path_of(name: str, value: object) -> Path:
    """Returns an argument as a path.

    Raises
    ------
    InputError
        The value is not text or a path, or is empty.
    """
    if not isinstance(value, (str, os.PathLike)) or isinstance(os.fspath(value), bytes):
        raise InputError(f"{name} is {shown(value)}; it must be the name of a file")
    if not os.fspath(value) or "\0" in str(os.fspath(value)):
        raise InputError(f"{name} is {shown(value)}; it must be the name of a file")
    return Path(value)


def instance_of(name: str, value: object, kind: type | tuple[type, ...], cure: str) -> None:
    """Refuses an argument that is not of the given type.

    Raises
    ------
    InputError
        The value has another type; `cure` states how to get the right one.
    """
    if not isinstance(value, kind):
        kinds = " or ".join(each.__name__ for each in (kind if isinstance(kind, tuple) else (kind,)))
        raise InputError(f"{name} is {shown(value)}; it must be a {kinds}: {cure}")


def real_of(name: str, value: object) -> float:
    """Returns an argument as a real number, which may be NaN or infinite. The caller checks its range.

    Raises
    ------
    InputError
        It is not a number.
    """
    if not isinstance(value, (int, float, np.integer, np.floating)) or isinstance(value, bool):
        raise InputError(f"{name} is {shown(value)}; it must be a number")
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{name} is {shown(value)}; it must be below 1e308") from None


def number_of(name: str, value: object) -> float:
    """Returns an argument as a finite number.

    Raises
    ------
    InputError
        It is not a number, or not finite.
    """
    number = real_of(name, value)
    if not math.isfinite(number):
        raise InputError(f"{name} is {shown(value)}; it must be a finite number")
    return number


def holds_numbers(array: np.ndarray[Any, Any]) -> bool:
    """Returns True if an array contains real numbers. Text in an array of objects is not a number, although
    NumPy would convert it."""
    if array.dtype.kind == "O":
        return not any(isinstance(each, (str, bytes, bytearray)) for each in array.flat)
    return array.dtype.kind in "biuf"


def vector_of(name: str, values: object) -> Float1D:
    """Returns a copy of the finite numbers (n,) of an array, a list or a column of a frame.

    Raises
    ------
    InputError
        The values are not one-dimensional, not real numbers, masked, or not finite.
    """
    if np.ma.is_masked(values):
        raise InputError(f"{name} is a masked array; leave the masked rows out of all arrays")
    try:
        given = np.asarray(values)
        if not holds_numbers(given) or isinstance(values, (str, dict)):
            raise TypeError
        array = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {shown(values)}; it must be a list or an array of numbers") from None
    if array.ndim != 1:
        raise InputError(f"{name} has shape {array.shape}; it must be one-dimensional")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(f"{name}[{bad[0]}] is {array[bad[0]]}; it must be a finite number")
    return array


def parameter_texts(function: Callable[..., Any]) -> dict[str, str]:
    """Returns the text on each parameter in a NumPy docstring, by name; empty without a docstring."""
    section = inspect.cleandoc(function.__doc__ or "").partition("Parameters\n----------\n")[2]
    found = re.findall(r"^(\w+) : .*\n((?: +.*(?:\n|$))+)", section, re.MULTILINE)
    return {name: inspect.cleandoc(text) for name, text in found}


def first_sentence(text: str) -> str:
    """Returns the text up to the first full stop, on one line."""
    return " ".join(re.split(r"(?<=\.)\s", text)[0].split())


def named_arguments(kind: Any) -> None:
    """Makes the constructor of a compiled class name an argument of a wrong type in an InputError."""
    construct = kind.__init__
    allowed = re.findall(r"(\w+): ", (construct.__doc__ or "").partition("*, ")[2])

    def named(self: Any, *args: Any, **fields: Any) -> None:
        try:
            construct(self, *args, **fields)
        except TypeError:
            raise InputError(wrong_argument(args, fields)) from None

    def wrong_argument(args: tuple[Any, ...], fields: dict[str, Any]) -> str:
        if args:
            return f"{kind.__name__} takes its values by name, such as {allowed[0]}=, not {shown(args[0])}"
        example = kind.__new__(kind)
        construct(example)
        words = {bool: "True or False", int: "a whole number", float: "a number", str: "text"}
        for name, value in fields.items():
            if name not in allowed:
                return f"{kind.__name__} has no argument {name!r}; it has {', '.join(allowed)}"
            try:
                construct(kind.__new__(kind), **{name: value})
            except TypeError:
                return f"{name} is {shown(value)}; it must be {words[type(getattr(example, name))]}"
            except ValueError:
                continue  # ValueError: the type of the argument is right, only the value is refused
        return f"{kind.__name__} does not take {shown(fields)}"

    named.__doc__ = construct.__doc__
    kind.__init__ = named
