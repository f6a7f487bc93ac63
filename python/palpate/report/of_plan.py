# SPDX-License-Identifier: Apache-2.0
"""Sections on the plan: the recorded force against the rendered one, and the certificate in words."""

from __future__ import annotations

import numpy as np

from .._core.device import DeviceProfile
from .._core.stability import Certificate, Inequality
from ..planning import force_at, mechanical_units
from ..planning.plan import NO_CERTIFICATE
from ..plotting.look import scale_for
from .charts import Chart, Panel
from .inequalities import BASES, MEANINGS, VERDICTS, symbols_in
from .of_comparison import LINE_MARKS, Compared, curves_of
from .page import Section, Table
from .subject import RENDERED_S, Subject
from .words import amount, interval


def rendered(subject: Subject) -> Section:
    """Rendered force over position against model and recording, for a simulated device and hand."""
    key, title = "rendered", "Recorded and rendered force"
    explanation = (
        "The rendered force is the one that a simulated device gives a simulated hand; it should lie on the "
        "recorded one."
    )
    found, plan = subject.rendering, subject.plan
    if isinstance(found, str) or plan is None:
        return Section(key, title, explanation, left_out=str(found))
    recording, compared = found.recording, Compared.of(subject)
    at = subject.folded(recording.position)
    recorded = () if compared is None else (compared.force,)
    x = scale_for(recording.units["position"], at, *([] if compared is None else [compared.position]))
    y = scale_for(recording.units["force"], recording.force, *recorded)
    panel = Panel(x.label("position"), y.label("force"), 320)
    if compared is not None:
        panel.dots(x.factor * compared.position, y.factor * compared.force, "soft-dots", "recorded")
    curves = curves_of(subject)
    if not curves:
        modelled = force_at(plan, recording.position, recording.sample_period)
        panel.dots(x.factor * at, y.factor * modelled, "dots", "model")
    panel.dots(x.factor * at, y.factor * recording.force, "open-dots", "rendered", hover=not curves)
    for curve in curves:
        line = x.factor * curve.position, y.factor * curve.force
        panel.line(*line, LINE_MARKS[curve.stroke], f"model{curve.suffix}")
    unit = recording.units["force"]
    certificate = plan.certificate
    assert certificate is not None
    reached = interval(float(at.min()), float(at.max()), recording.units["position"])
    sentences = [
        f"The structure is {plan.description}, on the device {certificate.device.id}, for {RENDERED_S:g} s. "
        "Device and hand are simulated; nothing in this section was measured.",
        f"The simulated hand reached {reached}; the domain of the model is {_domain(subject)}.",
        f"Force error against the model at these positions, RMS: {amount(found.error.mean, unit)} (mean of a "
        f"tick), {amount(found.error.band, unit)} below 50 Hz, which a hand can follow.",
    ]
    description = "Rendered, modelled and recorded force over position."
    return Section(key, title, explanation, sentences, [Chart(description, panel)])


def certificate_table(subject: Subject) -> Section:
    """Inequalities of the certificate, each with its meaning, both sides, the reserve and the basis."""
    key, title = "certificate", "Proof of stability"
    explanation = (
        "A rendering that adds energy can vibrate or push the hand; each row is a condition under which it "
        "cannot, for this model on this device."
    )
    plan = subject.plan
    if plan is None:
        return Section(key, title, explanation, left_out=subject.no_plan)
    if plan.certificate is None:
        return Section(key, title, explanation, left_out=NO_CERTIFICATE)
    certificate = plan.certificate
    sentences = [VERDICTS[certificate.verdict]]
    if subject.refusal:
        sentences = [
            "The plan in the file is refused. This table was computed again for the model in the file and is "
            "not stored.",
            *sentences,
        ]
    if certificate.reason:
        sentences.append(f"Reason: {certificate.reason}.")
    rows = [_row(line, certificate) for line in certificate.inequalities]
    formulas = [line.formula for line in certificate.inequalities]
    table = Table(("condition", "needed", "present", "reserve", "basis", "result"), rows)
    facts = {
        "device": [
            f"{certificate.device.id}, {1.0 / certificate.device.period_s:g} samples per second",
            *_profile(certificate.device),
        ],
        **{name: [value] for name, value in (plan.summary() | plan.settings()).items()},
        "fingerprint": [certificate.fingerprint],
    }
    if symbols := symbols_in([*formulas, *plan.refused]):
        facts["symbols"] = symbols
    if plan.refused:
        facts["refused structures"] = list(plan.refused)
    return Section(key, title, explanation, sentences, tables=[table], facts=facts)


def _domain(subject: Subject) -> str:
    model = subject.model
    return interval(float(model.lower[0]), float(model.upper[0]), model.units["position"])


def _row(line: Inequality, certificate: Certificate) -> list[str]:
    kind, meaning = MEANINGS.get(line.id, ("", ""))
    unit = _unit(kind, certificate.device.position_unit)

    def side(value: float) -> str:
        return f"{value:.4g} {unit}".rstrip() if np.isfinite(value) else "no bound"

    sign = "more than" if line.strict else "at least"
    return [
        "\n".join(filter(None, (f"{line.name[:1].upper()}{line.name[1:]}", meaning, line.formula))),
        f"{sign} {side(line.right)}",
        side(line.left),
        # At 0 the condition is met without a reserve, and none is needed.
        "not needed" if line.right == 0.0 == line.left and line.holds else side(line.margin),
        f"{line.basis}: {BASES[line.basis]}" + (f"\n{_source(line)}" if line.source else ""),
        "holds" if line.holds else "does not hold",
    ]


def _source(line: Inequality) -> str:
    """Returns the source of an inequality; a reader of the page has no folder docs."""
    return line.source.replace("docs/certificate.md", "documentation of palpate, page certificate")


def _profile(device: DeviceProfile) -> list[str]:
    """Returns the numbers of a device with their units."""
    inertia, damping, force = mechanical_units(device.position_unit)
    amounts = {
        "inertia": (device.inertia, inertia),
        "viscous damping b": (device.viscous_damping, damping),
        "Coulomb friction f_c": (device.coulomb_friction, force),
        "encoder step Delta": (device.encoder_step, device.position_unit),
        "force step Delta_F": (device.force_step, force),
        "force limit": (device.force_limit, force),
        "delay t_d": (device.delay_s, "s"),
        "jitter": (device.jitter_s, "s"),
    }
    return [f"{name}: {value:.4g} {unit}".replace("*", "·") for name, (value, unit) in amounts.items()]


def _unit(kind: str, position: str) -> str:
    """Returns the unit of a kind of quantity on a rotary or linear device."""
    inertia, damping, force = mechanical_units(position)
    units = {
        "mass": inertia,
        "damping": damping,
        "force": force,
        "position": position,
        "stiffness": f"{force}/{position}",
        "energy": "J",
        "rate": "Hz",
        "time": "s",
    }
    return units.get(kind, "").replace("*", "·")
