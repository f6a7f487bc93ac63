# SPDX-License-Identifier: Apache-2.0
"""The simulated bench for a model: the device, coupling and hand that go with its units and its size."""

from __future__ import annotations

from .. import _core
from .._core.simulation import Bench
from ..model import Model


def bench_for(model: Model) -> Bench:
    """The simulated bench on which a model is tried.

    An angle is tried on the core's default knob. For any other unit (millimetres of a keyswitch, micrometres
    under an AFM tip) it is the same knob as a scale model.
    """
    return _core.simulation.bench_for(model, is_angle=model.units["position"] == "rad")
