# SPDX-License-Identifier: Apache-2.0
"""Plan: how a model is rendered, and what is proved of that."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from .. import _core
from .._core import Certificate, DeviceProfile, Scheme
from ..errors import InputError
from ..model import Model
from ..model.certified import certificate_record, checked_certificate, scheme_of
from .slope_limit import Loss


@dataclass(frozen=True)
class Plan:
    """A model, and the structure and numbers with which it is rendered.

    Made by hand, a plan states what its author wants, and nothing is proved; :func:`palpate.plan` chooses one
    for a device and certifies it.

    Raises
    ------
    InputError
        The scheme does not fit the model; the message names the field and what would be right.
    """

    model: Model
    """What is rendered: where the device is too weak, the identified model with its slopes limited"""
    scheme: Scheme
    certificate: Certificate | None = None
    """What was proved, and for which device; None where nothing was looked at"""
    refused: tuple[str, ...] = ()
    """Simpler structures that were refused, each with the inequality that failed and by how much"""
    loss: Loss | None = None
    """How far `model` is from the identified one; None where it is the identified one"""

    def __post_init__(self) -> None:
        if self.model.units["force"] == "A":
            raise InputError(
                "the model's force is a motor current in A; identify it again with --torque-constant-Nm-per-A"
            )
        self._validate(None)

    @property
    def structure(self) -> str:
        """direct, massless, implicit, explicit or energy-consistent."""
        return self.scheme.structure

    @property
    def solver(self) -> str | None:
        """How the load line is solved at 1 kHz: table or newton; None where there is nothing to solve."""
        return _core.solver_name(self.model, self.scheme, DeviceProfile().period_s)

    @classmethod
    def of(cls, model: Model) -> Plan:
        """The plan that stands in a model file, with its certificate.

        Raises
        ------
        InputError
            There is none.
        """
        if model.plan is None:
            raise InputError("the model has no plan; make one with palpate plan")
        certificate = None
        if model.certificate is not None:
            certificate = checked_certificate(model, model.plan, model.certificate)
        loss = model.plan["loss"]
        return cls(
            model,
            scheme_of(model.plan),
            certificate,
            tuple(model.plan["refused"]),
            None if loss is None else Loss(**loss),
        )

    def stored(self) -> Model:
        """The model with this plan and its certificate in it, ready to be saved."""
        content = self.model.to_dict()
        content["plan"] = self.record()
        content["certificate"] = None if self.certificate is None else certificate_record(self.certificate)
        return Model.from_dict(content)

    def record(self) -> dict[str, Any]:
        """The plan as it stands in a model file."""
        scheme = self.scheme
        coupled, heavy = self.structure != "direct", self.structure not in ("direct", "massless")
        return {
            "structure": scheme.structure,
            "solver": self.solver,
            "coupling": {"stiffness": scheme.coupling_stiffness, "damping": scheme.coupling_damping}
            if coupled
            else None,
            "inertia": {"mass": scheme.mass, "damping": scheme.damping} if heavy else None,
            "compensated": scheme.compensated,
            "play_radius": scheme.play_radius or None,
            "refused": list(self.refused),
            "loss": None if self.loss is None else {"largest": self.loss.largest, "rms": self.loss.rms},
        }

    def certified_for(self, device: DeviceProfile) -> Plan:
        """The same plan with what is proved of it on a device, whatever that is."""
        return replace(self, certificate=_core.certify(self.model, self.scheme, device))

    def check_for(self, device: DeviceProfile) -> None:
        """Refuse what is sure to diverge on this device, and a device that the certificate is not for.

        Raises
        ------
        InputError
            The explicit structure's slope limit is not above the model's steepest slope, or the certificate
            is for another device; the message names what differs.
        """
        self._validate(device.period_s)
        if self.certificate is not None:
            wrong = _core.device_difference(self.certificate.device, device)
            if wrong:
                raise InputError(wrong)

    def _validate(self, period_s: float | None) -> None:
        try:
            self.scheme.validate(self.model, period_s)
        except InputError:
            raise
        except ValueError as error:
            raise InputError(str(error)) from None
