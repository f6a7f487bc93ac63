# SPDX-License-Identifier: Apache-2.0
"""The fields of `IdentifyOptions` as command line options: same names, same defaults."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import click

from ..identification.options import CHOICES, IdentifyOptions, SearchOptions, default_of

F = TypeVar("F", bound=Callable[..., Any])


def _text(value: Any) -> str:
    """A default as it is written after NAME=."""
    if isinstance(value, tuple):
        return ",".join(f"{number:g}" for number in value)
    return str(value).lower() if isinstance(value, bool) else str(value)


HELP = {
    "inputs": "auto, or names joined by commas: position, then hysteresis, velocity or columns.",
    "max_wavelets": "Largest network tried.",
    "criterion": "When to stop adding wavelets.",
    "loss": "Least squares, or rows far from the others weighed down.",
    "hysteresis_nonnegative": "Impose that every loop loses energy.",
    "slope_bounds": "Least and largest slope imposed, in force per position.",
    "monotone": "Impose that the force never falls with position.",
    "fixed_force": "Position and force that the model goes through.",
    "coupling_stiffness": "Keep the slope below 0.9 of it, in force per position.",
    "period": "Period of a periodic environment, in its position unit.",
    "search": "Further setting of the search, repeatable: "
    + ", ".join(f"{each.name}={_text(each.default)}" for each in fields(SearchOptions))
    + ".",
}

_METAVAR = {"slope_bounds": "LEAST LARGEST", "fixed_force": "POSITION FORCE"}
"""What the numbers of an option are."""


def _search(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> SearchOptions:
    """Settings of the search, each as NAME=VALUE."""
    for value in values:
        if "=" not in value:
            raise click.BadParameter(f"{value!r} must be NAME=VALUE", ctx, param)
    return SearchOptions.parsed(dict(value.split("=", 1) for value in values))


def identify_options(command: F) -> F:
    """Give a verb an option for each field of `IdentifyOptions`, as one argument `options` (a dict)."""
    names = [each.name for each in fields(IdentifyOptions)]

    @wraps(command)
    def invoke(*args: Any, **given: Any) -> Any:
        options = {name: given.pop(name) for name in names}
        return command(*args, options=options, **given)

    hints = get_type_hints(IdentifyOptions)
    described: Any = invoke
    for each in reversed(fields(IdentifyOptions)):
        described = _option(each.name, hints[each.name], default_of(each))(described)
    return cast(F, described)


def _option(name: str, hint: Any, default: Any) -> Callable[[Any], Any]:
    flag = "--" + name.replace("_", "-")
    text: dict[str, Any] = {"default": default, "help": HELP.get(name)}
    alternatives = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    kinds = [kind for kind in alternatives if kind is not NoneType]
    if kinds == [bool]:
        return click.option(f"{flag}/--no-{flag[2:]}", name, **text)
    if kinds == [SearchOptions]:
        text |= {"default": (), "metavar": "NAME=VALUE", "callback": _search}
        return click.option(flag, name, multiple=True, **text)
    if len(kinds) == 1 and get_args(kinds[0]):
        text |= {"nargs": len(get_args(kinds[0])), "metavar": _METAVAR.get(name)}
        return click.option(flag, name, type=float, **text)
    kind = click.Choice(CHOICES[name]) if name in CHOICES else kinds[0]
    return click.option(flag, name, type=kind, **text)
