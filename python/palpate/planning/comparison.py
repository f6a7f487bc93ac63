# SPDX-License-Identifier: Apache-2.0
"""The same model through every structure, on the same test rig."""

from __future__ import annotations

from dataclasses import dataclass

from .._core.device import DeviceProfile
from .._core.rendering import Scheme
from .._core.simulation import Hand, TestRig
from ..errors import InputError
from ..model import Model
from ..recording import Recording
from .plan import Plan
from .simulation import ForceError, describe, force_error, simulate

_COMPENSATED_DAMPING = 0.25
"""Coupling damping of the compensated structure over that of the others; (f'/K_c)^2 of it is felt."""

_PREDICT = 4
"""Samples of the prediction that is compared [-]"""


@dataclass(frozen=True)
class Comparison:
    """One structure of the comparison: what it rendered, or why it was refused."""

    scheme: Scheme
    recording: Recording | None
    error: ForceError | None
    refused: str | None
    """One sentence, or None"""

    @property
    def name(self) -> str:
        return describe(self.scheme)


def compare_structures(model: Model, rig: TestRig, duration: float) -> tuple[Comparison, ...]:
    """Render a model with each structure and measure its force error.

    The order is that of what they lose: direct, with and without prediction; massless behind a coupling,
    with the coupling's spring taken out of the model; massless; implicit with mass alone, then with the
    damping that the explicit structure needs; explicit. A structure that the model or the device rules out is
    refused with its reason.

    Parameters
    ----------
    model : Model
        A model of one position.
    rig : TestRig
        Device, hand and coupling, from :func:`rig_for`.
    duration : float
        Simulated time of each rendering [s].
    """
    quarter = _COMPENSATED_DAMPING * rig.scheme(model).coupling_damping
    schemes = (
        rig.scheme(model, structure="direct", predict=_PREDICT),
        rig.scheme(model, structure="direct"),
        rig.scheme(model, structure="massless", compensated=True, coupling_damping=quarter),
        rig.scheme(model, structure="massless"),
        rig.scheme(model, structure="implicit", damping=0.0),
        rig.scheme(model, structure="implicit"),
        rig.scheme(model, structure="explicit"),
    )
    return tuple(_render(model, scheme, rig.device, rig.hand, duration) for scheme in schemes)


def _render(model: Model, scheme: Scheme, device: DeviceProfile, hand: Hand, duration: float) -> Comparison:
    try:
        plan = Plan(model, scheme)
        recording = simulate(plan, device, hand, duration)
    except InputError as error:
        return Comparison(scheme, None, None, str(error))
    return Comparison(scheme, recording, force_error(plan, recording), None)
