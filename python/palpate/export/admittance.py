# SPDX-License-Identifier: Apache-2.0
"""Writes a model with its plan for an admittance display as one C header: force in, position out.

The header is that of the model on the load line of the object's step, with the functions of
admittance_template.h: one implicit step computes the position command from the measured force.
"""

from __future__ import annotations

from importlib.resources import files

import numpy as np

from .._core.model import fingerprint
from .._core.portable import ExportedModel
from .._core.rendering import Scheme, virtual_friction
from ..errors import InputError
from ..planning import Plan
from .c_header import header_text
from .exported import RANDOM_COUNTS, Exported, units_of
from .request import Request, Written
from .template import filled

_COUNTS = 2**16
"""Number of counts of the domain [-]; in single precision a position is a count and a fraction of 24 bits"""

_END = "#endif /* NAME_H */\n"


def display_header(request: Request) -> tuple[Exported, str]:
    """Returns the tables of a model for an admittance display, and the text of its C header.

    Raises
    ------
    InputError
        The structure of the plan is not implicit, or the model has hysteresis.
    """
    name = request.identifier()
    plan = Plan.of(request.model)
    plan.verdict.require_use("the plan", "Plan the model for another device", accepted=request.accept_model)
    certificate, scheme = plan.certificate, plan.scheme
    assert certificate is not None
    device, display = certificate.device, certificate.device.admittance
    assert display is not None
    if scheme.structure != "implicit":
        raise InputError(
            f"the structure {scheme.structure} is not exported for an admittance display: it must be implicit"
        )
    slope = next(line.left for line in certificate.inequalities if line.id == "unique-solution")
    tables = ExportedModel(
        plan.rendered,
        Scheme(structure="massless", coupling_stiffness=slope, coupling_damping=0.0),
        precision=request.precision,
        encoder_step=float(plan.rendered.upper[0] - plan.rendered.lower[0]) / _COUNTS,
        force_limit=device.force_limit,
        period_s=device.period_s,
    )
    exported = Exported(
        name,
        "" if request.model_file is None else request.model_file.name,
        tables,
        tables.check(RANDOM_COUNTS),
        fingerprint(plan.rendered),
        None,
        units_of(request.model),
        None,
        plan.verdict,
    )
    per_step = 1.0 / tables.encoder_step if tables.single else 1.0
    largest = np.inf if display.rate_limit is None else display.rate_limit * device.period_s * per_step
    constants = {
        "PERIOD": device.period_s,
        "MASS": scheme.mass,
        "OBJECT_DAMPING": scheme.object_damping,
        "STEEPEST": max(certificate.bounds.slope_max, 0.0),
        "DISPLAY_FRICTION": virtual_friction(device),
        "LARGEST_STEP": largest,
        "AHEAD": display.feed_forward_s / device.period_s,
    }
    lines = [
        f"#define NAME_{each} {'FLT_MAX' if np.isinf(value) else repr(float(value))}"
        for each, value in constants.items()
    ]
    template = files(__package__).joinpath("admittance_template.h").read_text(encoding="utf-8")
    section = "\n".join(["", *lines, filled(template, {"single": tables.single}, {}, {})]).replace(
        "NAME", name
    )
    text = header_text(exported)
    end = _END.replace("NAME", name)
    return exported, text.removesuffix(end) + section + "\n" + end


def write(request: Request) -> Written:
    """Writes the C header of a model for an admittance display and returns its sizes and errors."""
    exported, text = display_header(request)
    model = exported.model
    size = model.law.bytes + (0 if model.response is None else model.response.bytes)
    if exported.verdict.level != "no":
        request.write_text(text)
    return Written(
        exported.verdict,
        {
            "header": f"{request.output}: {exported.name}_object_start and {exported.name}_object_step",
            "tables": f"{size} bytes",
            "friction": "that of the display, and enough to cover the error of the tables",
        },
        {**exported.record(), "bytes": size},
    )
