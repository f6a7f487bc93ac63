# SPDX-License-Identifier: Apache-2.0
"""Plan: how a model is rendered, what is proved of that, and how far the felt force is from the model's."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from .._core.device import DeviceProfile
from .._core.io import checked_certificate, scheme_of
from .._core.rendering import Scheme, solver_name
from .._core.stability import Certificate, certify, device_difference
from ..arguments import instance_of
from ..errors import InputError
from ..model import Model
from ..model.model_file import certificate_record
from ..verdict import FORCE_FLOOR, Finding, Verdict, no, usable
from .static_error import StaticForceError, static_force_error

ACCEPTED_FORCE_ERROR = 0.1
"""Force error that is accepted where nothing else is said [share of the range of the identified force]"""


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
    """The identified model, which the plan never changes. Force errors refer to it."""
    scheme: Scheme
    certificate: Certificate | None = None
    """What was proved of the rendered model, and for which device; None where nothing was looked at"""
    refused: tuple[str, ...] = ()
    """Simpler structures that were refused, each with the inequality that failed and by how much"""
    limited: Model | None = None
    """The model that is rendered in place of `model`, because the device is too weak; None: `model` itself"""
    accept_force_error: float = ACCEPTED_FORCE_ERROR
    """Largest force error that is accepted [share of the range of the identified force]"""
    needs: str = ""
    """The device property that `model` itself would need; empty where it is rendered, or none helps"""

    def __post_init__(self) -> None:
        instance_of("model", self.model, Model, "make one with palpate.identify or palpate.load_model")
        instance_of("scheme", self.scheme, Scheme, "make one with palpate.Scheme")
        require_force(self.model)
        self.scheme.validate(self.rendered)

    @property
    def rendered(self) -> Model:
        """The model that is rendered: `limited` if there is one, else `model`."""
        return self.model if self.limited is None else self.limited

    @property
    def structure(self) -> str:
        """direct, massless, implicit, explicit or energy-consistent."""
        return self.scheme.structure

    @property
    def solver(self) -> str | None:
        """How the load line is solved at 1 kHz: table or newton; None where there is nothing to solve."""
        return solver_name(self.rendered, self.scheme, DeviceProfile().period_s)

    @cached_property
    def force_error(self) -> StaticForceError:
        """Felt minus identified force at rest: of a limited network, and of the softness of a coupling."""
        return static_force_error(self.model, self.rendered, self.scheme)

    @property
    def verdict(self) -> Verdict:
        """The verdict on the plan: on its certificate, and on its force error.

        It is "no" where no structure holds on the device, and where the force error exceeds what is accepted.
        """
        return Verdict((*self._certificate_findings(), *self._force_findings()))

    @classmethod
    def of(cls, model: Model) -> Plan:
        """The plan that stands in a model file, with its certificate.

        Raises
        ------
        InputError
            There is none.
        """
        instance_of("model", model, Model, "make one with palpate.load_model")
        if model.plan is None:
            raise InputError("the model has no plan; make one with palpate plan")
        rendered = model.planned
        certificate = None
        if model.certificate is not None:
            certificate = checked_certificate(rendered, model.plan, model.certificate)
        return cls(
            model,
            scheme_of(model.plan),
            certificate,
            tuple(model.plan["refused"]),
            None if rendered is model else rendered,
            model.plan["accepted_force_error"],
        )

    def stored(self) -> Model:
        """The identified model with this plan and its certificate in it, ready to be saved.

        Raises
        ------
        InputError
            The verdict on the plan is no.
        """
        if self.verdict.level == "no":
            raise InputError(f"a plan is not stored whose verdict is {self.verdict}")
        content = self.model.to_dict()
        content["plan"] = self.record()
        content["certificate"] = None if self.certificate is None else certificate_record(self.certificate)
        return Model.from_dict(content)

    def record(self) -> dict[str, Any]:
        """The plan as it stands in a model file."""
        scheme = self.scheme
        return {
            "structure": scheme.structure,
            "solver": self.solver,
            "network": None if self.limited is None else self.limited.to_dict()["network"],
            "coupling": {"stiffness": scheme.coupling_stiffness, "damping": scheme.coupling_damping}
            if scheme.has_coupling
            else None,
            "inertia": {"mass": scheme.mass, "damping": scheme.damping} if scheme.has_mass else None,
            "compensated": scheme.compensated,
            "play_radius": scheme.play_radius or None,
            "predict": scheme.predict or None,
            "refused": list(self.refused),
            "accepted_force_error": self.accept_force_error,
        }

    def certified_for(self, device: DeviceProfile) -> Plan:
        """The same plan with what is proved of it on a device, whatever that is."""
        return replace(self, certificate=certify(self.rendered, self.scheme, device))

    def check_for(self, device: DeviceProfile) -> None:
        """Refuse what is sure to diverge on this device, and a device that the certificate is not for.

        Raises
        ------
        InputError
            The explicit structure's slope limit is not above the model's steepest slope, or the certificate
            is for another device; the message names what differs.
        """
        self.scheme.validate(self.rendered, device.period_s)
        if self.certificate is not None:
            wrong = device_difference(self.certificate.device, device)
            if wrong:
                raise InputError(wrong)

    def _certificate_findings(self) -> tuple[Finding, ...]:
        if self.certificate is None:
            return (usable("nothing is proved of this plan; palpate plan certifies one for a device"),)
        if self.certificate.refused:
            cure = f"the object {self.needs}; " if self.needs else ""
            reasons = "; ".join(self.refused) or self.certificate.why
            return (no(f"no structure holds on this device: {cure}{reasons}"),)
        if not self.certificate.certified:
            cure = f"; for a certificate the object {self.needs}" if self.needs else ""
            return (
                usable(
                    "the linearised system is stable near each equilibrium; energy is not accounted for, "
                    f"so passivity is not certified{cure}"
                ),
            )
        return ()

    def _force_findings(self) -> tuple[Finding, ...]:
        error = self.force_error
        if error.share <= FORCE_FLOOR:
            return ()
        unit = self.model.units["force"] or "in the model's unit"
        told = (
            f"the felt force is up to {error.largest:.3g} {unit} away from the identified force, "
            f"{_percent(error.share)} of its range"
        )
        if error.share <= ACCEPTED_FORCE_ERROR:
            return (usable(told),)
        if error.share <= self.accept_force_error:
            return (usable(f"{told}, which was accepted"),)
        cause = f"; the object {self.needs}" if self.needs else ""
        share = math.ceil(100.0 * error.share) / 100.0
        return (
            no(
                f"{told}; at most {_percent(self.accept_force_error)} are accepted{cause}; "
                f"to accept this error, give --accept-force-error {share:g} (in Python accept_force_error)"
            ),
        )


def require_force(model: Model) -> None:
    """Refuses a model whose force is a motor current."""
    if model.units["force"] == "A":
        raise InputError(
            "the model's force is a motor current in A; identify it again with --torque-constant-Nm-per-A"
        )


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
