# SPDX-License-Identifier: Apache-2.0
"""How a model is rendered, as options that `simulate` and `render` share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

import click

from .._core.rendering import Scheme, most_prediction_taps, structure_names
from .._core.simulation import TestRig
from ..model import Model
from ..planning import Plan
from .printing import talk

F = TypeVar("F", bound=Callable[..., Any])

_DEFAULT = Scheme()


def scheme_options(command: F) -> F:
    """Give a verb the fields of `Scheme`; what is not given is None and follows the model."""
    described: Any = command
    for option in reversed(
        (
            click.option(
                "--structure",
                type=click.Choice(structure_names),
                default=None,
                show_default=f"the model's plan, else {_DEFAULT.structure}",
                help="How the force is computed.",
            ),
            click.option("--compensated", is_flag=True, help="Take the coupling's spring out of the model."),
            click.option(
                "--coupling-stiffness",
                type=float,
                show_default=f"{_DEFAULT.coupling_stiffness:g} N*m/rad, scaled to the model",
                help="K_c, in force per position of the model's units.",
            ),
            click.option(
                "--coupling-damping",
                type=float,
                show_default=f"{_DEFAULT.coupling_damping:g} N*m*s/rad, scaled",
                help="B_c, in force per velocity.",
            ),
            click.option(
                "--mass",
                type=float,
                show_default=f"{_DEFAULT.mass:g} kg*m^2, scaled",
                help="Mass of the object, where it has mass, in force per acceleration.",
            ),
            click.option(
                "--damping",
                type=float,
                show_default=f"{_DEFAULT.damping:g} N*m*s/rad, scaled",
                help="Damping of the object, where it has mass, in force per velocity.",
            ),
            click.option(
                "--play-radius",
                type=float,
                show_default="the model's, or 1 % of its travel",
                help="r of a model with hysteresis, in its position unit.",
            ),
            click.option(
                "--predict",
                type=click.IntRange(0, most_prediction_taps),
                metavar="M",
                show_default=f"{_DEFAULT.predict}",
                help="Samples used to predict the position half a sample ahead, direct only; 0 = none.",
            ),
        )
    ):
        described = option(described)
    return cast(F, described)


def chosen_plan(model: Model, rig: TestRig, scheme: Mapping[str, Any]) -> Plan:
    """What was asked for; else the plan that stands in the model; else the default, which is told."""

    if all(value is None or value is False for value in scheme.values()):
        if model.plan is not None:
            return Plan.of(model)
        if not model.of_velocity:
            talk(
                "no plan in the model: rendered behind the default coupling, which is felt; "
                "'palpate plan' finds the simplest rendering that is not"
            )
    return Plan(model, rig.scheme(model, **scheme))
