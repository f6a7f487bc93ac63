# SPDX-License-Identifier: Apache-2.0
"""Plan: the structure that renders a model, its certificate and its static force error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .._core.device import DeviceProfile
from .._core.io import checked_certificate, scheme_of
from .._core.model import ForceModel
from .._core.rendering import (
    HeldSlope,
    Scheme,
    default_play_radius,
    display_lag_s,
    solver_name,
    virtual_friction,
)
from .._core.simulation import AccountUse, account_use, motion_driven, resting_oscillation
from .._core.stability import (
    Certificate,
    certify,
    certify_with_account,
    device_difference,
    fast_motion_energy,
    slope_behind_coupling,
)
from .._typing import Float1D, Float2D
from ..arguments import instance_of
from ..errors import InputError
from ..html_table import Curve, html_table
from ..model import Model
from ..model.model import COMPENSATION_KEY
from ..model.model_file import CONTINUATIONS, certificate_record
from ..model.steepest_slope import SteepestSlope
from ..verdict import FORCE_FLOOR, Finding, Verdict, no, usable
from .device_profile import mechanical_units

PLAN_WORDS = {
    "certified": "proved",
    "held-by-account": "held by the energy account",
    "stable-locally": "stable near rest, nothing proved",
    "refused": "not renderable",
}
"""Maps the verdict of a certificate to the word for the plan."""

LIMITED = "direct, slope limited"
"""Name of the candidate structure with limited slopes"""

ACCEPTED_FORCE_ERROR = 0.1
"""Default limit of the force error [share of the range of the identified force]"""

_FORCE_SHARES = (0.125, 0.25, 0.5, 1.0)
"""Tried shares of the identified force with which a resting finger may oscillate, the smallest first [-]"""

_FORCES = ("weight", "linear", "bias", "weight_hysteresis", "linear_hysteresis", "bias_hysteresis")
"""Arguments of a force model that are proportional to its force"""

_MOST_ADVISED_ERROR = 0.5
"""Largest force error that a verdict advises to accept [share of the range]; with more the object is lost"""

SAMPLES = 1001
"""Number of positions over the domain at which the force error is computed [-]"""

NO_CERTIFICATE = "the plan has no certificate: make a plan for a device with palpate plan"
"""Finding on a plan that was made by hand"""

NETWORK = (
    "alpha",
    "beta",
    "weight",
    "linear",
    "bias",
    "weight_hysteresis",
    "linear_hysteresis",
    "bias_hysteresis",
    "harmonics",
)
"""Arguments of a force model that define its network"""

_DOMAIN = (
    *("lower", "upper", "below", "above", "period", "play_radius", "of_velocity", "memory"),
    *("position_unit", "force_unit"),
)
"""Arguments of a force model that do not define its network"""


@dataclass(frozen=True)
class Plan:
    """Model with the structure and numbers of its rendering.

    A plan made by hand has no certificate. :func:`palpate.plan` chooses a plan for a device and certifies it.

    Raises
    ------
    InputError
        The scheme does not fit the model; the message names the field and the cure.
    """

    model: Model
    """The identified model; the plan never changes it. Force errors refer to it."""
    scheme: Scheme
    certificate: Certificate | None = None
    """Certificate of the rendered model on a device; None for a plan made by hand"""
    refused: tuple[str, ...] = ()
    """Refused candidate structures, each with the reason"""
    limited: Model | None = None
    """Model rendered in place of `model` because the device is too weak; None: `model`"""
    accept_force_error: float = ACCEPTED_FORCE_ERROR
    """Largest force error that is accepted [share of the range of the identified force]"""
    needs: str = ""
    """Device property that `model` needs for a certificate or an accepted force error; empty if the plan has
    both, if only the force limit of the device is too low, or if no property helps"""

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
        """Name of the structure."""
        return self.scheme.structure

    @property
    def solver(self) -> str | None:
        """Solver of the load line: table or newton; None without load line. The period is that of the
        certificate, or 1 ms without one."""
        device = DeviceProfile() if self.certificate is None else self.certificate.device
        return solver_name(self.rendered, self.scheme, device.period_s)

    @cached_property
    def force_error(self) -> StaticForceError:
        """Felt force minus identified force for a handle at rest, caused by a limited network, a soft
        coupling, and the force limit of the device."""
        return _static_error(*self.forces_at_rest())

    @property
    def held_by_account(self) -> bool:
        """True if only the energy account limits the energy that a hand takes out."""
        return self.certificate is not None and self.certificate.held_by_account

    @cached_property
    def account(self) -> AccountUse | None:
        """Numbers of the energy account and its effect on simulated presses; None if it does not hold the
        plan."""
        if self.certificate is None or not self.held_by_account:
            return None
        return account_use(self.rendered, self.scheme, self.certificate.device)

    @property
    def proved_ratio(self) -> float:
        """Slopes of the rendered model divided by the slopes that would be proved: the device property that
        is needed divided by the one that the device has."""
        assert self.certificate is not None
        lines = certify(self.rendered, self.scheme, self.certificate.device).inequalities
        return max((line.right / line.left for line in lines if line.left > 0.0), default=0.0)

    @cached_property
    def oscillation_text(self) -> str:
        """Smallest tried share of the identified force with which a resting finger oscillates in simulation,
        in words."""
        text = "no structure is proved stable on this device"
        if self.certificate is None or not self.model.of_position:
            return text
        device, unit = self.certificate.device, self._units()["position"]
        direct = Scheme(structure="direct", play_radius=default_play_radius(self.model, device.encoder_step))
        forces = {name: getattr(self.model, name) for name in _FORCES}
        forces = {name: np.asarray(force) for name, force in forces.items() if force is not None}
        for share in _FORCE_SHARES:
            scaled = with_network(self.model, **{name: share * force for name, force in forces.items()})
            found = resting_oscillation(scaled, direct, device)
            if found.amplitude:
                part = "" if share == 1.0 else f"with {_percent(share)} of the force "
                return (
                    f"{text}, and {part}a finger of 10 g that rests at {found.position:.3g}{unit} oscillates "
                    f"by {found.amplitude:.2g}{unit} at {found.frequency_hz:.3g} Hz in simulation"
                )
        return f"{text}; in simulation a resting finger of 10 g did not oscillate"

    def account_rows(self) -> dict[str, str]:
        """Returns the numbers of the energy account that holds the plan for display, by name."""
        use, unit = self.account, self._units()["position"]
        if use is None:
            return {}
        speed = f"{use.largest_speed:.3g}{unit + '/s' if unit else ''}"
        return {
            "energy account": f"a hand takes at most {1e3 * use.energy:.3g} mJ, in motions up to {speed}",
            "slopes": f"up to {self.proved_ratio:.2g} times those of a proof",
            "account acts": f"in at most {_percent(use.share)} of the ticks of simulated presses",
        }

    @property
    def force_error_text(self) -> str:
        """Largest force error, its place and its share of the force range, and the RMS value."""
        error, units = self.force_error, self.model.units
        if not error.largest:
            return "none"
        unit = units["force"] or "in the model's unit"
        place = "" if error.at is None else f" at {error.at:.3g} {units['position'] or ''}".rstrip()
        share = f"{_percent(error.share)} of the range"
        return f"{error.largest:.3g} {unit}{place}, {share}; RMS {error.rms:.3g} {unit}"

    @property
    def verdict(self) -> Verdict:
        """Verdict on the plan: on its certificate and its force error.

        The verdict is "no" if the certificate is refused, or if the force error exceeds its accepted limit.
        """
        return Verdict(
            (*self._certificate_findings(), *self._force_findings(), *self._compensation_findings())
        )

    @property
    def scale(self) -> float | None:
        """Share of the cogging of a motor that the plan cancels, at most 1; None for another object."""
        scale = self.model.notes.get(COMPENSATION_KEY)
        return float(scale) if isinstance(scale, (int, float)) else None

    @classmethod
    def of(cls, model: Model) -> Plan:
        """Returns the plan in a model file, with its certificate.

        Raises
        ------
        InputError
            The model has no plan.
        """
        instance_of("model", model, Model, "make one with palpate.load_model")
        if model.plan is None:
            raise InputError("the model has no plan: make one with palpate plan")
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

    @property
    def is_proved(self) -> bool:
        """True if passivity on the device is proved: a program without the energy account may render it."""
        return self.certificate is not None and self.certificate.certified

    def stored(self) -> Model:
        """Returns a copy of the identified model that contains this plan and its certificate, ready to be
        saved.

        Raises
        ------
        InputError
            The verdict on the plan is no.
        """
        if self.verdict.level == "no":
            raise InputError(f"a plan with verdict no is not stored: {'; '.join(self.verdict.reasons)}")
        content = self.model.to_dict()
        content["plan"] = self.record()
        content["certificate"] = None if self.certificate is None else certificate_record(self.certificate)
        return Model.from_dict(content)

    def record(self) -> dict[str, Any]:
        """Returns the plan as stored in a model file."""
        scheme = self.scheme
        return {
            "structure": scheme.structure,
            "solver": self.solver,
            "network": None if self.limited is None else self.limited.to_dict()["network"],
            "coupling": {"stiffness": scheme.coupling_stiffness, "damping": scheme.coupling_damping}
            if scheme.has_coupling
            else None,
            "inertia": {"mass": scheme.mass, "damping": scheme.object_damping} if scheme.has_mass else None,
            "compensated": scheme.compensated,
            "play_radius": scheme.play_radius or None,
            "predict": scheme.predict or None,
            "refused": list(self.refused),
            "accepted_force_error": self.accept_force_error,
            **({} if scheme.line is None else {"line": scheme.line.to_dict()}),
        }

    @property
    def description(self) -> str:
        """Name of the structure and its changes to the identified model, in words."""
        return ", ".join(
            [*_words(self.scheme), *([] if self.limited is None else ["with a limited network"])]
        )

    @property
    def slopes_behind_coupling(self) -> tuple[float, float]:
        """Steepest felt slope and steepest slope of the model [force/position]; a coupling reduces the felt
        slope.

        If the spring of the coupling was subtracted from the model, the slope bounds of the certificate are
        those of the difference.
        """
        assert self.certificate is not None
        steepest = max(0.0, self.certificate.bounds.slope_max)
        if not self.scheme.has_coupling:
            return steepest, steepest
        slope = slope_behind_coupling(steepest, self.scheme.coupling_stiffness)
        return slope, slope if self.scheme.compensated else steepest

    def summary(self) -> dict[str, str]:
        """Returns the main properties of a plan with a certificate for display, by name."""
        assert self.certificate is not None
        certificate, rows = self.certificate, {"structure": self.description}
        slope, steepest = self.slopes_behind_coupling
        if slope < steepest:
            stiffness = self._units()["stiffness"]
            rows["stiffness"] = f"slopes up to {steepest:.4g} are felt as up to {slope:.4g}{stiffness}"
        for name, falling in (("steepest slope", False), ("steepest fall", True)):
            if (place := SteepestSlope.of(self.model, falling=falling)) is not None:
                rows[name] = place.text(self.model)
        rows["force error"] = self.force_error_text
        if self.model.period is None and self.model.dimension == 1:
            rows["below contact"] = f"the force {CONTINUATIONS[self.model.below]}"
        if self.scale is not None:
            rows["compensation"] = (
                "no scale is proved" if certificate.refused else f"scale {self.scale:.4g}, proved"
            )
        rows["certificate"] = PLAN_WORDS[certificate.verdict]
        if not certificate.refused:
            rows["certificate"] += f", samples up to {1e3 * certificate.longest_period_s:.4g} ms apart"
        rows |= self.account_rows() | self._display_rows()
        if certificate.device.renderer == "device":
            rate_hz = 1.0 / certificate.device.period_s
            rows["runs on"] = f"the motor controller of {certificate.device.id} at {rate_hz:.6g} Hz"
        return rows

    def _display_rows(self) -> dict[str, str]:
        """Returns the hands for which a plan on an admittance display is proved, and what the hand feels in
        addition to the object, for display, by name."""
        certificate = self.certificate
        assert certificate is not None
        display = certificate.device.admittance
        if display is None:
            return {}
        units, scheme = self._units(), self.scheme
        damping = scheme.object_damping - (self.model.damping or 0.0)
        late_ms = 1e3 * display_lag_s(certificate.device)
        mass = scheme.mass - (self.model.mass or 0.0)
        return {
            "proved for hands": (
                f"up to {display.hand_stiffness:.4g}{units['stiffness']}, "
                f"{display.hand_damping:.4g}{units['damping']}, {display.hand_mass:.4g}{units['mass']}"
            ),
            "felt in addition": (
                f"damping {damping:.4g}{units['damping']} plus {late_ms:.3g} ms times the slope of "
                f"the object, mass {mass:.4g}{units['mass']}, friction "
                f"{virtual_friction(certificate.device):.3g} {self.model.units['force']}".rstrip()
            ),
        }

    def settings(self) -> dict[str, str]:
        """Returns the settings of the structure for display, by name."""
        scheme, rows, units = self.scheme, {}, self._units()
        if self.solver is not None:
            rows["solver"] = self.solver
        if scheme.has_coupling:
            rows["coupling"] = (
                f"K_c = {scheme.coupling_stiffness:.4g}{units['stiffness']}, "
                f"B_c = {scheme.coupling_damping:.4g}{units['damping']}"
            )
        if scheme.has_mass:
            rows["object"] = (
                f"mass {scheme.mass:.4g}{units['mass']}, "
                f"damping {scheme.object_damping:.4g}{units['damping']}"
            )
        if scheme.predict:
            samples = "sample" if scheme.predict == 1 else f"{scheme.predict} samples"
            rows["prediction"] = f"half a sample ahead, from the previous {samples}"
        if scheme.line is not None:
            rows["held line"] = self._line_text(scheme.line)
            if self.certificate is not None:
                rows["lost command"] = self._lost_command_text()
        if scheme.play_radius:
            rows["play radius"] = self._play_text(units["position"])
        return rows

    def _play_text(self, unit: str) -> str:
        """Returns the play radius and its effect on the force after a reversal, in words."""
        radius = self.scheme.play_radius
        step = 0.0 if self.certificate is None else self.certificate.device.encoder_step
        usual = default_play_radius(with_network(self.model, play_radius=None), step)
        text = f"{radius:.4g}{unit}: after a reversal the force changes over {2.0 * radius:.4g}{unit}"
        return f"{text}, usually over {2.0 * usual:.4g}{unit}" if radius > usual > 0.0 else text

    def _line_text(self, line: HeldSlope) -> str:
        """Returns the slope of a held line and its fastest motion in words."""
        units = self._units()
        words = {
            "steepest": f"slope that stores the energy, up to {line.slope:.4g}{units['stiffness']}",
            "raised": f"slope of the force + {line.lift:.4g}{units['stiffness']}",
            "constant": f"slope {line.slope:.4g}{units['stiffness']}",
        }[line.rule]
        if line.motion is None or self.certificate is None:
            return f"{words}; any speed"
        device = self.certificate.device
        return (
            f"{words}; up to {line.motion / device.period_s:.4g}{units['position']}/s, a faster motion ends "
            f"the run and gives at most {fast_motion_energy(device):.3g} J"
        )

    def _lost_command_text(self) -> str:
        """Returns the largest energy that a hand takes after a lost command, which ends a certified run, in
        words."""
        assert self.certificate is not None
        device = self.certificate.device
        watchdog_s = None if device.held_line is None else device.held_line.watchdog_s
        if watchdog_s is None:
            return "without a watchdog of the controller the last line stays, and no energy is stated"
        # The last line stays for the time of the watchdog in place of a period
        until = DeviceProfile(**device.to_dict() | {"period_s": watchdog_s, "jitter_s": 0.0})
        return (
            f"ends the run; the watchdog ends the line after {1e3 * watchdog_s:g} ms, and a hand takes at "
            f"most {fast_motion_energy(until):.3g} J"
        )

    def _units(self) -> dict[str, str]:
        """Returns the unit of each kind of quantity with a space before it; empty text without units."""
        position, force = self.model.units["position"], self.model.units["force"]
        if position not in ("m", "rad") or not force:
            return dict.fromkeys(("mass", "damping", "stiffness", "position"), "")
        mass, damping, _ = mechanical_units(position)
        return {
            "mass": f" {mass}",
            "damping": f" {damping}",
            "stiffness": f" {force}/{position}",
            "position": f" {position}",
        }

    def forces_at_rest(self) -> tuple[Float1D, Float2D, Float2D]:
        """Returns positions (n,) over the domain, and identified and felt force (k, n) of a handle at rest.

        The k strokes are press and release for a model with hysteresis. The force limit of the device limits
        the felt force.
        """
        x, identified, rendered = self._unlimited_at_rest
        limit = self._force_limit
        return x, identified, np.clip(rendered, -limit, limit)

    @property
    def largest_at_rest(self) -> float:
        """Largest absolute force that a handle at rest would feel without the force limit of the device."""
        return float(np.abs(self._unlimited_at_rest[2]).max())

    @property
    def _force_limit(self) -> float:
        """Force limit of the device; infinity without a device, and for an admittance display, which holds a
        position against any force"""
        device = None if self.certificate is None else self.certificate.device
        return math.inf if device is None or device.admittance is not None else device.force_limit

    @cached_property
    def _unlimited_at_rest(self) -> tuple[Float1D, Float2D, Float2D]:
        """The values of `forces_at_rest`, without the force limit of the device"""
        x = np.linspace(self.model.lower[0], self.model.upper[0], SAMPLES)
        if self.model.of_velocity:  # this model is always rendered without a coupling
            force = self.model.predict(np.column_stack([x, np.zeros_like(x)]))[None, :]
            return x, force, force
        if self.model.memory is not None:  # so is this model, and its branches are relaxed at rest
            force = strokes(self.model, x)
            return x, force, force
        return x, strokes(self.model, x), _at_rest(self.rendered, self.scheme, x)

    def _repr_html_(self) -> str:
        rows = {"structure": self.description} if self.certificate is None else self.summary()
        if self.certificate is not None:
            rows["device"] = self.certificate.device.id
        rows["model"] = repr(self.model)[1:-1]
        x, identified, rendered = self.forces_at_rest()
        curves = [Curve(x, force) for force in identified] + [Curve(x, force, "dashed") for force in rendered]
        return html_table("Plan", self.verdict, rows | self.settings(), curves)

    def certified_for(self, device: DeviceProfile) -> Plan:
        """Returns the plan with its certificate on a device; the certificate can be refused."""
        prove = certify_with_account if self.held_by_account else certify
        return replace(self, certificate=prove(self.rendered, self.scheme, device))

    def check_for(self, device: DeviceProfile) -> None:
        """Refuses a plan that would diverge on a device, and a device that is not the one of the certificate.

        Raises
        ------
        InputError
            The slope limit of the explicit structure is not above the steepest slope of the model, or the
            certificate is for another device. The message names the difference.
        """
        self.scheme.validate(self.rendered, None if device.admittance else device.period_s)
        if self.certificate is not None:
            wrong = device_difference(self.certificate.device, device)
            if wrong:
                raise InputError(wrong)

    def _certificate_findings(self) -> tuple[Finding, ...]:
        if self.certificate is None:
            return (usable(NO_CERTIFICATE),)
        if self.certificate.refused and self.certificate.device.admittance is not None:
            cure = f". The object {self.needs}" if self.needs else ""
            hands = "no structure is proved stable for every hand of this display"
            return (no(f"not renderable: {hands}{cure}: {self.certificate.reason}"),)
        if self.certificate.refused:
            cure = f". The object {self.needs}" if self.needs else ""
            reason = "" if self.needs else f": {self.certificate.reason}"
            return (no(f"not renderable: {self.oscillation_text}{cure}{reason}"),)
        if self.held_by_account:
            reason = next((line for line in self.refused if line.startswith(LIMITED)), "")
            accepted = self.force_error.share <= self.accept_force_error
            cure = f". For a proof of passivity the object {self.needs}" if self.needs and accepted else ""
            held = "held by the energy account, passivity is not proved"
            return (usable(f"{held} ({reason}){cure}" if reason else f"{held}{cure}"),)
        if not self.certificate.certified:
            cure = f". For a certificate the object {self.needs}" if self.needs else ""
            return (
                usable(
                    "the linearised system is stable near each equilibrium; energy is not accounted for, "
                    f"so passivity is not certified{cure}"
                ),
            )
        return ()

    def _force_findings(self) -> tuple[Finding, ...]:
        error = self.force_error
        refused = self.certificate is not None and self.certificate.refused
        if refused or error.share <= FORCE_FLOOR:
            return ()
        unit = self.model.units["force"] or "in the model's unit"
        difference = (
            f"the largest force error at rest is {error.largest:.3g} {unit}, {_percent(error.share)} of the "
            "force range"
        )
        cause = f". The object {self.needs}" if self.needs else ""
        if self.largest_at_rest > self._force_limit:
            cause += (
                f". The device gives at most {self._force_limit:.4g} {unit}: use a device with a force limit "
                f"of at least {rounded(math.ceil, self.largest_at_rest):g} {unit}"
            )
        if error.share <= ACCEPTED_FORCE_ERROR:
            return (usable(f"{difference}{cause}"),)
        if error.share <= self.accept_force_error:
            return (usable(f"{difference}; at most {_percent(self.accept_force_error)} is accepted{cause}"),)
        share = math.ceil(100.0 * error.share) / 100.0
        accept = (
            f". To accept this error, give --accept-force-error {share:g} (in Python accept_force_error)"
            if share <= _MOST_ADVISED_ERROR
            else ""
        )
        return (no(f"{difference}: at most {_percent(self.accept_force_error)} is accepted{cause}{accept}"),)

    def _compensation_findings(self) -> tuple[Finding, ...]:
        """Returns a finding if a device can cancel only a part of the cogging."""
        if self.scale is None or self.scale == 1.0 or self.certificate is None or self.certificate.refused:
            return ()
        cure = f". The whole {self.needs}" if self.needs else ""
        share = _percent(self.scale)
        return (usable(f"only {share} of the cogging is compensated{cure}"),)


def describe(scheme: Scheme) -> str:
    """Returns a scheme in words: "implicit, m = 0.001, B_o = 0.5"."""
    mass = [f"m = {scheme.mass:.3g}", f"B_o = {scheme.object_damping:.3g}"] if scheme.has_mass else []
    return ", ".join([*_words(scheme), *mass])


def _words(scheme: Scheme) -> list[str]:
    words = [scheme.structure]
    if scheme.compensated:
        words.append("compensated")
    if scheme.predict:
        words.append(f"predict {scheme.predict}")
    return words


def require_force(model: Model) -> None:
    """Refuses a model whose force is a motor current."""
    if model.units["force"] == "A":
        raise InputError(
            "the model's force is a motor current in A: identify it with --torque-constant-Nm-per-A"
        )


def rounded(towards: Callable[[float], int], value: float) -> float:
    """Rounds a device property to three digits in the safe direction, so that the printed number is
    sufficient."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{towards(value / unit) * unit:.3g}")


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


@dataclass(frozen=True)
class StaticForceError:
    """Felt force minus identified force for a handle at rest, over the domain and both strokes.

    The force error contains the effects of a limited network, a soft coupling and the force limit of the
    device, not those of damping, delay or encoder.
    """

    largest: float
    """Largest absolute value of the force error [force]"""
    rms: float
    """RMS value of the force error [force]"""
    share: float
    """Largest force error divided by the range of the identified force [-]"""
    rms_share: float
    """RMS force error divided by the population standard deviation of the identified force [-]"""
    at: float | None = None
    """Position of the largest force error [m or rad]; None without a force error"""


def static_force_error(identified: ForceModel, rendered: ForceModel, scheme: Scheme) -> StaticForceError:
    """Returns the force error for a handle at rest if `rendered` is rendered in place of the model
    `identified`, by a device without force limit.

    Parameters
    ----------
    identified, rendered : ForceModel
        Two models of one position on the same domain, or the same model of position and velocity twice.
    scheme : Scheme
        Structure and coupling. With coupling stiffness K_c the felt slope is K_c f' / (K_c + f'), where f' is
        the slope of the model.
    """
    if _is_exact(scheme) and rendered is identified:
        return StaticForceError(0.0, 0.0, 0.0, 0.0)
    x = np.linspace(identified.lower[0], identified.upper[0], SAMPLES)
    return _static_error(x, strokes(identified, x), _at_rest(rendered, scheme, x))


def _static_error(x: Float1D, wanted: Float2D, rendered: Float2D) -> StaticForceError:
    """Returns the error of the rendered force (k, n) at positions (n,)."""
    error = rendered - wanted
    largest, rms = float(np.abs(error).max()), float(np.sqrt(np.mean(error**2)))
    return StaticForceError(
        largest,
        rms,
        _share(largest, float(np.ptp(wanted)), wanted),
        _share(rms, float(wanted.std()), wanted),
        float(x[np.abs(error).max(axis=0).argmax()]) if largest else None,
    )


def with_network(model: ForceModel, **changes: Any) -> ForceModel:
    """Returns a force model with changed arguments."""
    return ForceModel(**{name: getattr(model, name) for name in (*NETWORK, *_DOMAIN)} | changes)


def network_of(model: ForceModel) -> dict[str, Any]:
    """Returns the network of a model as stored in a model file."""
    network = {name: np.asarray(getattr(model, name)).tolist() for name in NETWORK}
    return network if model.harmonics else {name: network[name] for name in NETWORK if name != "harmonics"}


def strokes(model: ForceModel, x: Float1D) -> Float2D:
    """Returns the force (1, n), or with hysteresis the press and release forces (2, n)."""
    sides = (1.0, -1.0) if model.hysteretic else (None,)
    return np.array([model.force(x, direction=side) for side in sides])


def _share(error: float, size: float, force: Float2D) -> float:
    """Returns a force error divided by `size`; if the force is constant, divided by the largest absolute
    value of the force."""
    size = size or float(np.abs(force).max())
    return 0.0 if error == 0.0 else error / size if size else math.inf


def _is_exact(scheme: Scheme) -> bool:
    """Returns True if a hand at rest feels the rendered model itself."""
    return scheme.compensated or not scheme.has_coupling


def _at_rest(rendered: ForceModel, scheme: Scheme, x: Float1D) -> Float2D:
    """Returns the felt force (k, n) of each stroke for a handle at rest."""
    return strokes(rendered, x) if _is_exact(scheme) else _behind_coupling(rendered, scheme, x)


def _behind_coupling(model: ForceModel, scheme: Scheme, x: Float1D) -> Float2D:
    """Returns the force (k, n) of each stroke at a handle at rest, from the load line without mass."""
    at_rest = Scheme(structure="massless", coupling_stiffness=scheme.coupling_stiffness, coupling_damping=0.0)
    return np.array([motion_driven(stroke, at_rest, x, 1.0)["force"] for stroke in _single_strokes(model)])


def _single_strokes(model: ForceModel) -> list[ForceModel]:
    """Returns one model without hysteresis for each stroke: f, or press g + h and release g - h."""
    if not model.hysteretic:
        return [model]
    names = ("weight", "linear", "bias")
    plain = {"play_radius": None, **{f"{name}_hysteresis": None for name in names}}
    return [
        with_network(
            model,
            **plain,
            **{name: getattr(model, name) + side * getattr(model, f"{name}_hysteresis") for name in names},
        )
        for side in (1.0, -1.0)
    ]
