# SPDX-License-Identifier: Apache-2.0
"""Writes the force law of a model as a few knots at equal distances, the curve that a pedal is set to."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..verdict import GOOD
from .exported import require_carried, units_of
from .request import Request, Written

POSITIONS_PER_INTERVAL = 1000
"""Number of positions between two knots at which the curve is compared with the model."""


def write(request: Request) -> Written:
    """Writes travel, position and force of the knots. With hysteresis the curve is that of the press.

    Raises
    ------
    InputError
        The force depends on other quantities than position and direction, or there are fewer than 2 knots.
    """
    model, count = request.model, request.knots or 0
    require_carried(model, "a curve of knots cannot")
    if not 2 <= count <= 1001:
        raise InputError(f"--knots is {count}: must be from 2 to 1001")
    position, force = units_of(model)
    press = 1.0 if model.hysteretic else None
    x = np.linspace(model.lower[0], model.upper[0], count)
    fine = np.linspace(model.lower[0], model.upper[0], (count - 1) * POSITIONS_PER_INTERVAL + 1)
    knots, exact = np.asarray(model.force(x, direction=press)), np.asarray(model.force(fine, direction=press))
    error = np.abs(np.interp(fine, x, knots) - exact)
    worst = int(error.argmax())
    largest, span = float(error[worst]), float(np.ptp(exact))
    share = 100.0 * largest / span if span > 0.0 else 0.0
    rows = zip(np.linspace(0.0, 100.0, count), x, knots, strict=True)
    text = f"travel_percent,position_{position},force_{force}\n"
    request.write_text(text + "".join(f"{p:.6g},{at:.9g},{y:.9g}\n" for p, at, y in rows))
    falls = np.flatnonzero(np.diff(knots) < 0.0)
    loop = 0.0
    if model.hysteretic:
        loop = float(np.abs(exact - np.asarray(model.force(fine, direction=-1.0))).max())
    return Written(
        GOOD,
        {
            "curve": f"{request.output}: {count} knots, straight lines between them",
            "largest error": f"{largest:.3g} {force} at {fine[worst]:.4g} {position}, "
            f"{share:.2g} % of the range",
            **(
                {
                    "falls": f"between {x[falls[0]]:.4g} and {x[falls[-1] + 1]:.4g} {position}: a pedal that "
                    "looks up its position for a force jumps there; use --c"
                }
                if len(falls)
                else {}
            ),
            **({"release": f"up to {loop:.3g} {force} below the curve"} if model.hysteretic else {}),
        },
        {
            "knots": count,
            "largest_error": largest,
            "at": float(fine[worst]),
            "largest_loop": loop,
            "falls": bool(len(falls)),
        },
    )
