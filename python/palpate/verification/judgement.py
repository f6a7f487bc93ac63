# SPDX-License-Identifier: Apache-2.0
"""The verdict of a verification: findings on the rows that were compared, on the error, and on its cause."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..identification.classes.findings import USABLE_NRMSE, error_findings
from ..model import Model
from ..recording import Recording
from ..verdict import Finding, no, usable
from .explanation import explanation
from .flight import flight_of
from .metrics import normalised, root_mean_square
from .perception import FORCE_JND
from .prediction import predict

if TYPE_CHECKING:
    from .verification import Verification

FEW_OUTSIDE = 0.01
"""Share of rows outside the model's domain above which the result is usable with a reservation [-]."""

MOST_OUTSIDE = 0.5
"""The same above which the model is unfit for the recording [-]."""

FEW_COMPARED = 0.5
"""Share of rows below which a comparison says little about a recording [-]."""

FELT = 0.5
"""Share of rows within the just noticeable difference below which a hand feels the error [-]."""

STRUCTURED = 0.5
"""Lag-1 autocorrelation above which the error is structured [-]."""


def findings_of(model: Model, recording: Recording, found: Verification) -> tuple[Finding, ...]:
    """All findings of a verification."""
    return (*error_findings(found.nrmse, f"{found.n} rows"), *circumstances(model, recording, found))


def circumstances(model: Model, recording: Recording, found: Verification) -> tuple[Finding, ...]:
    """Findings beside the error: on the rows that were compared, and on the likely cause."""
    return (*_of_cause(model, recording, found), *_of_rows(model, recording, found))


def _of_rows(model: Model, recording: Recording, found: Verification) -> list[Finding]:
    """Findings on the rows: seen before, outside the domain, or left out."""
    findings = []
    if not found.fresh:
        findings.append(
            usable(
                "the model was identified on this data, so the error says nothing about other data; verify "
                "with another recording, or identify with --hold-out-every 5"
            )
        )
    outside = found.extrapolated / found.n
    if outside > FEW_OUTSIDE:
        judge = no if outside > MOST_OUTSIDE else usable
        findings.append(
            judge(
                f"{found.extrapolated} of {found.n} rows ({outside:.0%}) lie outside the model's domain"
                f"{_domain(model)}; there the force is only continued: identify on a recording of this range"
            )
        )
    if flight_of(recording).object_position is not None:
        handle = predict(model, replace(recording, columns={}))
        reference = recording.force[handle.rows]
        felt = normalised(root_mean_square(handle.force - reference), reference)
        if felt > USABLE_NRMSE:
            findings.append(
                usable(
                    f"at the position of the handle the NRMSE is {felt:.3g}: the virtual coupling is softer "
                    "than the object; plan the model with palpate plan, or render with --structure direct"
                )
            )
    if found.n < FEW_COMPARED * len(recording):
        findings.append(
            usable(f"only {found.n} of {len(recording)} rows were compared: {'; '.join(found.notes)}")
        )
    return findings


def _of_cause(model: Model, recording: Recording, found: Verification) -> list[Finding]:
    """Findings on the error: whether a hand feels it, and the likely cause of a large one."""
    findings = []
    if found.nrmse > USABLE_NRMSE:
        cause = explanation(model, recording, found.prediction)
        if cause is not None:
            findings.append(usable(f"{cause.sentence} (NRMSE {cause.nrmse:.3g})"))
        elif found.whiteness > STRUCTURED:
            findings.append(
                usable(
                    f"neighbouring rows err alike (correlation {found.whiteness:.2g}): the force depends on "
                    "something that the model does not have, such as velocity, hysteresis or another input"
                )
            )
    if found.within_jnd < FELT:
        findings.append(
            usable(
                f"a hand feels the error in {1.0 - found.within_jnd:.0%} of the rows: it is larger than "
                f"{FORCE_JND:.0%} of the force there"
            )
        )
    return findings


def _domain(model: Model) -> str:
    if model.dimension > 1:
        return ""
    return f" from {float(model.lower[0]):.4g} to {float(model.upper[0]):.4g}"
