# SPDX-License-Identifier: Apache-2.0
"""The fields of `IdentifyOptions` as command line options: same names, same defaults."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import click

from ..identification.options import CHOICES, IdentifyOptions

F = TypeVar("F", bound=Callable[..., Any])

HELP = {
    "inputs": "auto, or names joined by commas: position, then hysteresis, velocity or columns.",
    "max_wavelets": "Largest network tried.",
    "criterion": "When to stop adding wavelets.",
    "selection": "How wavelets are taken from the frame.",
    "rung_evidence": "Fall of the criterion that a richer kind of model must show.",
    "patience": "Wavelets added without improvement before growth stops.",
    "refine": "Move and stretch the wavelets, or leave them on the frame.",
    "refinement": "Variable projection, or quasi-newton on all parameters as published.",
    "refine_steps": "Refinement steps after each wavelet.",
    "final_steps": "Refinement steps on the accepted network.",
    "frame_scale": "Ratio of neighbouring dilations of the frame.",
    "frame_step": "Translation step of the frame, over 1/dilation.",
    "max_candidates": "Members of the frame at most.",
    "resolved_by": "Distinct positions that the core of a wavelet must hold.",
    "max_positions": "Distinct positions of a stroke beyond which they are binned.",
    "loss": "Least squares, or rows far from the others weighed down.",
    "filters": "matched, or the paper's figure 11 or 13 for comparison.",
    "assumed_mass": "Mass of the paper's figures.",
    "assumed_damping": "Damping of the paper's figure 13.",
    "hysteresis_nonnegative": "Impose that every loop loses energy.",
    "slope_bounds": "Least and largest slope imposed, in force per position.",
    "monotone": "Impose that the force never falls with position.",
    "fixed_force": "Position and force that the model goes through.",
    "coupling_stiffness": "Keep the slope below 0.9 of it, in force per position.",
    "play_radius": "Play radii tried first without a direction, as shares of the travel, joined by commas.",
    "contact_share": "Share of the force range below which the force at the start counts as free contact.",
    "period": "Period of a periodic environment, in its position unit.",
}

_METAVAR = {"slope_bounds": "LEAST LARGEST", "fixed_force": "POSITION FORCE"}
"""What the numbers of an option are."""


def _numbers(ctx: click.Context, param: click.Parameter, value: str) -> tuple[float, ...]:
    """Numbers joined by commas."""
    try:
        return tuple(float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"{value!r} must be numbers joined by commas", ctx, param) from None


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
        described = _option(each.name, hints[each.name], each.default)(described)
    return cast(F, described)


def _option(name: str, hint: Any, default: Any) -> Callable[[Any], Any]:
    flag = "--" + name.replace("_", "-")
    text: dict[str, Any] = {"default": default, "help": HELP.get(name)}
    alternatives = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    kinds = [kind for kind in alternatives if kind is not NoneType]
    if kinds == [bool]:
        return click.option(f"{flag}/--no-{flag[2:]}", name, **text)
    if kinds == [tuple[float, ...]]:
        text["default"] = ",".join(f"{number:g}" for number in default)
        return click.option(flag, name, metavar="NUMBERS", callback=_numbers, **text)
    if len(kinds) == 1 and get_args(kinds[0]):
        text |= {"nargs": len(get_args(kinds[0])), "metavar": _METAVAR.get(name)}
        return click.option(flag, name, type=float, **text)
    kind = click.Choice(CHOICES[name]) if name in CHOICES else kinds[0]
    return click.option(flag, name, type=kind, **text)
