# SPDX-License-Identifier: Apache-2.0
"""A model with its plan, ready to be written as a program: tables, certificate, and the check of both."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from .. import _core
from .._core.device import DeviceProfile
from .._core.model import fingerprint
from .._core.portable import ExportCheck, ExportedModel, profile_checksum
from .._core.rendering import Scheme, default_play_radius
from .._core.stability import Certificate, Inequality, with_force_error
from ..errors import InputError, command_word
from ..model import Model
from ..model.model_file import dynamics_of
from ..planning import Plan, describe, mechanical_units
from ..planning.device_profile import step_cure
from ..planning.plan import require_force
from ..recording.columns import LAWS
from ..verdict import GOOD, Finding, Verdict, no, usable
from .request import Request

RANDOM_COUNTS = 20_000
"""Random counts, and ticks of a random motion, at which the tables are compared with the core before they are
written."""


@dataclass(frozen=True)
class Exported:
    """A model as tables, with the certificate of its plan."""

    name: str
    source: str
    """Name of the model file"""
    model: ExportedModel
    check: ExportCheck
    fingerprint: str
    """Fingerprint of the rendered model, 16 hexadecimal digits"""
    certificate: Certificate | None
    """Certificate of the plan, with the errors of the program as errors of the force"""
    units: tuple[str, str]
    """Units of position and force"""
    plan: Plan | None = None
    """Plan of the program, whose force error adds to the errors of the tables"""
    of_plan: Verdict = GOOD
    """Verdict of the plan"""

    @classmethod
    def of(cls, request: Request) -> Exported:
        """Makes the tables of a model and compares them with the core.

        Raises
        ------
        InputError
            The model has no certificate, or the model or its structure cannot be exported. The message states
            the cure.
        """
        name = request.identifier()
        model = request.model
        require_force(model)
        plan = None if model.plan is None else Plan.of(model)
        if plan is None:
            require_carried(model, "an exported program does not", memory=True)
        of_plan = (
            GOOD
            if plan is None
            else plan.verdict.require_use(
                "the plan", "Plan the model for another device", accepted=request.accept_model
            )
        )
        certificate = None if plan is None else plan.certificate
        _require_certificate(certificate, request)
        device = None if certificate is None else certificate.device
        rendered = model if plan is None else plan.rendered
        encoder_step = _encoder_step(device, request)
        direct = Scheme(structure="direct", play_radius=default_play_radius(model, encoder_step))
        scheme = direct if plan is None else plan.scheme
        numbers = {
            "encoder_step": encoder_step,
            "force_limit": _force_limit(device, request),
            "period_s": 0.0 if device is None else device.period_s,
        }

        def tables_in(precision: str) -> ExportedModel:
            return ExportedModel(rendered, scheme, precision=precision, **numbers)

        tables = tables_in(request.precision)
        if certificate is not None and certificate.certified:
            planned, certificate = certificate, with_force_error(certificate, tables.rendering_error)
            if not (certificate.certified or request.uncertified):
                exact = with_force_error(planned, tables_in("double").rendering_error)
                raise InputError(_too_inexact(certificate, tables, double=exact.certified))
        return cls(
            name,
            "" if request.model_file is None else request.model_file.name,
            tables,
            tables.check(RANDOM_COUNTS),
            fingerprint(rendered),
            certificate,
            units_of(model),
            plan,
            of_plan,
        )

    @property
    def device(self) -> DeviceProfile | None:
        """Device of the certificate."""
        return None if self.certificate is None else self.certificate.device

    @property
    def has_certificate(self) -> bool:
        """True if the program states rate and profile, because its certificate holds for these only."""
        return self.certificate is not None and self.certificate.certified

    @property
    def rate_hz(self) -> int:
        """Certified rate [1/s]; 0 without certificate.

        Raises
        ------
        InputError
            The rate is not a whole number.
        """
        if not self.has_certificate or self.device is None:
            return 0
        rate = 1.0 / self.device.period_s
        if abs(rate - round(rate)) > 1e-6 * rate:
            raise InputError(
                f"the period of {self.device.id} is {self.device.period_s:g} s: must give a whole number of "
                f"ticks for each second, not {rate:.6g}; plan the model for such a period"
            )
        return round(rate)

    @property
    def profile(self) -> int:
        """Checksum of the profile of the device; 0 without certificate."""
        return profile_checksum(self.device) if self.has_certificate and self.device is not None else 0

    @property
    def structure(self) -> str:
        """Structure of the plan in words."""
        return describe(self.model.scheme)

    @property
    def position_unit(self) -> str:
        return self.units[0]

    @property
    def force_unit(self) -> str:
        return self.units[1]

    @property
    def slope_unit(self) -> str:
        return f"{self.force_unit}/{self.position_unit}"

    @property
    def verdict(self) -> Verdict:
        """ "no" if a difference to the core exceeds its bound, usable without a certificate, else that of the
        plan."""
        findings: list[Finding] = list(self.of_plan.findings)
        if not self.check.passed:
            worst = max(self.check.force, self.check.slope, self.check.energy, self.check.step)
            findings.append(
                no(
                    f"the tables differ from the model by {worst:.3g} times the proved bound; nothing was "
                    "written. Please report this with the model file"
                )
            )
        if not self.has_certificate:
            findings.append(
                usable("the program has no certificate: nothing is proved about stability on a device")
            )
        return Verdict(tuple(findings))

    @property
    def certificate_text(self) -> str:
        """Certificate in one or two sentences."""
        if self.certificate is None or not self.has_certificate:
            return "No certificate: nothing is proved about stability on a device."
        device = self.certificate.device
        return (
            f"Certified: {self.structure} on {device.id} at {self.rate_hz} Hz, for up to "
            f"{1e3 * self.certificate.longest_period_s:.4g} ms between samples; {self.certificate.reason}. "
            f"Certificate {self.certificate.fingerprint}, model {self.certificate.model}."
        )

    @property
    def needed_friction(self) -> float:
        """Friction of the device that the certificate needs with the errors of the program; 0 without
        certificate."""
        return _friction_line(self.certificate).right if self.certificate and self.has_certificate else 0.0

    @property
    def friction_text(self) -> str:
        """Friction of the device against the friction that the certificate needs."""
        assert self.certificate is not None
        line, error = _friction_line(self.certificate), self.certificate.bounds.force_error
        return (
            f"{line.left:.4g} >= needed {line.right:.4g} {self.force_unit}, of which {error:.2g} for the "
            "errors of the program"
        )

    @property
    def play_radius_text(self) -> str:
        """Play radius of the hysteresis."""
        return f"{self.model.play_radius:.4g} {self.position_unit}"

    @property
    def limit_text(self) -> str:
        """Largest force of a step."""
        limit = self.model.force_limit
        return "none: a step can return any force" if limit == math.inf else f"{limit:.4g} {self.force_unit}"

    def summary(self) -> dict[str, str]:
        """Returns the proved bounds of the errors for display, by name."""
        model = self.model
        return {
            **({} if self.plan is None else {"error of plan": self.plan.force_error_text}),
            "force error": self.error_text(model.force_error, model.largest_force, self.force_unit),
            "slope error": self.error_text(model.slope_error, model.largest_slope, self.slope_unit),
            "step error": self.step_error_text(),
            **({"device friction": self.friction_text} if self.has_certificate else {}),
            "force limit": self.limit_text,
            **({"play radius": self.play_radius_text} if self.model.hysteretic else {}),
        }

    def definitions(self) -> dict[str, str]:
        """Returns the macros that a program defines before it includes the header, for display."""
        if not self.has_certificate:
            return {}
        return {"define": f"PALPATE_RATE_HZ {self.rate_hz}, PALPATE_PROFILE {self.profile:#010x}"}

    def record(self) -> dict[str, Any]:
        """Returns the numbers of the export for --json."""
        model = self.model
        return {
            "name": self.name,
            "structure": self.model.scheme.structure,
            "precision": "single" if model.single else "double",
            "certified": self.has_certificate,
            "rate_hz": self.rate_hz,
            "profile": self.profile,
            "fingerprint": self.fingerprint,
            "plan_force_error": None if self.plan is None else asdict(self.plan.force_error),
            "force_error": model.force_error,
            "force_error_share": _share(model.force_error, model.largest_force),
            "slope_error": model.slope_error,
            "slope_error_share": _share(model.slope_error, model.largest_slope),
            "energy_error": model.energy_error,
            "step_error": model.step_error,
            "rendering_error": model.rendering_error,
            "needed_friction": self.needed_friction,
            "force_limit": model.force_limit,
            "checked_places": self.check.places,
            "largest_share_of_bounds": max(
                self.check.force, self.check.slope, self.check.energy, self.check.step
            ),
        }

    def error_text(self, error: float, largest: float, unit: str) -> str:
        """Returns a bound of an error as text: absolute, and as a share of the largest value."""
        share = _share(error, largest)
        return f"up to {error:.2g} {unit}" + ("" if share is None else f", {share:.2g} of the largest value")

    def step_error_text(self) -> str:
        """Returns the bound of the error of a step as text."""
        text = self.error_text(self.model.step_error, self.model.largest_force, self.force_unit)
        return text if self.model.step_error_lasts else f"{text}, in one step from the same state"

    def description(self) -> list[str]:
        """Returns the opening comment of an exported program, in paragraphs."""
        model = self.model
        device = self.device
        number = "single" if model.single else "double"
        used = max(self.check.force, self.check.slope)
        paragraphs = [
            f"Force of the model {self.source}, exported by palpate {_core.__version__} in {number} "
            "precision.\n"
            "Generated file: change the model and export it again. Valid C99 and C++11; needs no library.",
            f"Model: fingerprint {self.fingerprint}; position in {self.position_unit}, force in "
            f"{self.force_unit}. The force is that of the object against the tool; the device applies its "
            "negative.\n"
            f"Structure: {self.structure}.\n"
            f"Position for each count: {model.encoder_step:.9g} {self.position_unit}.\n"
            f"Force limit: {self.limit_text}.",
            self.certificate_text,
            *(
                []
                if self.plan is None
                else [
                    "Force error of the plan for a hand at rest, in addition to the bounds below: "
                    f"{self.plan.force_error_text}."
                ]
            ),
            "Proved bounds of the difference to the model inside its domain. They hold with and without "
            "contraction of products and sums (-ffp-contract).\n"
            f"force  {self.error_text(model.force_error, model.largest_force, self.force_unit)}\n"
            f"slope  {self.error_text(model.slope_error, model.largest_slope, self.slope_unit)}\n"
            f"energy up to {model.energy_error:.2g} {energy_unit(*self.units)}\n"
            f"step   {self.step_error_text()}\n"
            f"Outside the domain, {model.outside_share:.2g} of the change of force since its end is added.\n"
            f"Checked at {self.check.places} counts: at most {used:.2g} of a bound was used.",
            "Functions:\n"
            f"{self.name}_start(&state, count)   object at rest at this position\n"
            f"{self.name}_step(&state, count)    force of one tick; changes the state\n"
            f"{self.name}_force, _force_slope, _energy, _advance   the force law alone\n"
            f"{self.name}_torque_uNm, _start_of   the members of palpate_model in palpate_device.h",
        ]
        if self.has_certificate and device is not None:
            numbers = ", ".join(f"{key} {value}" for key, value in device.to_dict().items())
            paragraphs.insert(
                3,
                f"Device profile (PALPATE_PROFILE {self.profile:#010x}): {numbers}.\n"
                f"Device friction: {self.friction_text}.",
            )
        return paragraphs


def _require_certificate(certificate: Certificate | None, request: Request) -> None:
    if request.uncertified or (certificate is not None and certificate.certified):
        return
    if certificate is not None:
        raise InputError(
            "the plan is not proved, and an exported program has no energy account: choose a device on which "
            "it is proved, or export it without a certificate with --uncertified"
        )
    file = request.model_file or "MODEL.json"
    command = f"palpate plan {command_word(file)} --device PROFILE -o {command_word(file)}"
    raise InputError(
        f"the model has no certificate: certify it with {command}, or export it without a certificate with "
        "--uncertified"
    )


def _friction_line(certificate: Certificate) -> Inequality:
    """Returns the inequality that contains the errors of the program."""
    return next(line for line in certificate.inequalities if line.id == "friction-steps")


def _too_inexact(certificate: Certificate, tables: ExportedModel, *, double: bool) -> str:
    """Returns the reason why the errors of a program are too large for its certificate, and the cure."""
    if double and tables.single:
        cure = "export it with --precision double"
    elif tables.hysteretic:
        cure = f"plan the model with a --play-radius above {tables.play_radius:.4g}"
    else:
        needed = _rounded_up(_friction_line(certificate).right)
        cure = f"plan the model for a device with a coulomb_friction of at least {needed:.6g}"
    return (
        f"the certificate does not hold for the program in {'single' if tables.single else 'double'} "
        f"precision, whose errors of the force are up to epsilon = {certificate.bounds.force_error:.3g}: "
        f"{certificate.reason}; {cure}"
    )


def _rounded_up(value: float) -> float:
    """Returns a number of six digits that is not below the value."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 5)
    return math.ceil(value / unit) * unit


def _force_limit(device: DeviceProfile | None, request: Request) -> float:
    given = request.force_limit
    if device is not None:
        if given is not None:
            raise InputError(
                f"--force-limit is given, but the force limit of {device.id} is {device.force_limit:g}: "
                "leave it out"
            )
        return device.force_limit
    if given is None:
        raise InputError(
            "the force limit is not known, because the model has no device: state the largest force of the "
            "device with --force-limit, which the program never exceeds"
        )
    if not 0.0 < given < math.inf:
        raise InputError(f"--force-limit is {given:g}: must be a finite number > 0")
    return given


def _encoder_step(device: DeviceProfile | None, request: Request) -> float:
    known = 0.0 if device is None else device.encoder_step
    if request.encoder_step is None:
        return known
    if known > 0.0:
        raise InputError(
            f"--encoder-step is given, but the encoder step of {device.id if device else ''} is {known:g}: "
            "leave it out"
        )
    if device is not None and not request.uncertified:
        raise InputError(
            f"--encoder-step is given, but the certificate holds for {device.id} without encoder steps: "
            "state the encoder step in the profile and plan the model again"
        )
    return request.encoder_step


def units_of(model: Model) -> tuple[str, str]:
    """Returns the units of position and force; a unit that is not stated is the SI unit that suits the
    other."""
    position = model.units["position"] or ("rad" if model.units["force"] in ("N*m", "A") else "m")
    return position, model.units["force"] or mechanical_units(position)[2]


def energy_unit(position: str, force: str) -> str:
    """Returns the unit of the stored energy: J for units of mechanics, else a product."""
    return "J" if (position, force) in LAWS else f"{force}*{position}"


def require_carried(model: Model, cannot: str, *, memory: bool = False) -> None:
    """Refuses a model whose force has a part that a format does not contain.

    Every format contains a force of position, with hysteresis.

    Parameters
    ----------
    model : Model
        The model to export.
    cannot : str
        The format and its verb in the message: "a table cannot".
    memory : bool
        True if the format contains a memory as well.

    Raises
    ------
    InputError
        The model has several inputs, a memory, damping or a mass. The message states the part and the cure.
    """
    if model.dimension != 1:
        part = f"the force depends on {' and '.join(model.inputs)}"
    elif model.memory is not None and not memory:
        part = "the force has a memory"
    elif moving := dynamics_of(model):
        part = (
            f"the force contains a {' and a '.join(f'{name} of {value}' for name, value in moving.items())}"
        )
    else:
        return
    inputs = "position,hysteresis" if model.hysteretic else "position"
    raise InputError(f"{part}, which {cannot} contain: identify the model with --inputs {inputs}")


def require_mechanical(model: Model, what: str) -> None:
    """Refuses a model whose units are neither m and N nor rad and N*m, which `what` needs.

    Raises
    ------
    InputError
        The message states both units and the cure.
    """
    position, force = units_of(model)
    if (position, force) in LAWS:
        return
    cure = "multiply the recorded force by its lever arm, and identify the model again"
    if position == "count":
        cure = step_cure(model)
    raise InputError(
        f"the position of the model is in {position} and its force in {force}: {what} needs m and N, or rad "
        f"and N*m; {cure}"
    )


def _share(error: float, largest: float) -> float | None:
    return error / largest if largest > 0.0 else None
