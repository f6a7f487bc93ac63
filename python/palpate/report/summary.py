# SPDX-License-Identifier: Apache-2.0
"""First sections of a report: the verdict in words, and the key numbers with their meaning."""

from __future__ import annotations

from ..identification.classes.findings import USABLE_NRMSE
from ..model.model_file import fitted_rows
from .of_comparison import Compared
from .page import KeyNumber, Section, Table
from .subject import Subject
from .words import amount, percent

LEVEL_WORDS = {
    "good": "This result can be used: no finding speaks against it.",
    "usable": "This result can be used within the limits below.",
    "no": "Do not use this result; the likely cause and the cure are below.",
}
"""Level of a verdict in words"""


def verdict(subject: Subject) -> Section:
    """Verdict of all parts together, with its findings, and the verdict of each part."""
    found = subject.verdict
    explanation = (
        "The verdict is that of the weakest part: good, usable within limits, or no. Each finding names its "
        "likely cause and the cure."
    )
    return Section(
        "verdict",
        "Verdict",
        explanation,
        [LEVEL_WORDS[found.level]],
        verdict=found,
        tables=[Table(("part", "verdict"), [(part, each.level) for part, each in subject.verdicts.items()])],
    )


def key_numbers(subject: Subject) -> Section:
    """Error, share of rows without noticeable difference, and the reserve of the plan or the model's size."""
    compared = Compared.of(subject)
    numbers = [_fit_error(subject)] if compared is None else _compared_errors(compared)
    numbers.append(_plan_number(subject) or _size(subject))
    explanation = (
        "These numbers show how close the model is to the recording and how safely it can be rendered."
    )
    return Section("numbers", "Key numbers", explanation, numbers=numbers)


def _fit_error(subject: Subject) -> KeyNumber:
    return KeyNumber(
        percent(subject.model.fit.nrmse),
        "error (NRMSE) of the fit",
        "The RMS force error as a share of the spread of the recorded force, on "
        f"{fitted_rows(subject.model)} of the identification. A good model has at most "
        f"{percent(USABLE_NRMSE)}.",
    )


def _compared_errors(compared: Compared) -> list[KeyNumber]:
    found = compared.found
    seen = "rows that the model has not seen" if found.fresh else "rows of the identification"
    error = KeyNumber(
        percent(found.nrmse),
        "error (NRMSE)",
        f"The force differs by {compared.amount(found.rmse)} RMS, this share of the spread of the recorded "
        f"force, on {found.n} {seen}. A good model has at most {percent(USABLE_NRMSE)}.",
    )
    within = KeyNumber(
        percent(found.within_jnd),
        "not noticeable",
        "Share of the rows in which a hand does not feel the difference to the model.",
    )
    return [error, within]


def _plan_number(subject: Subject) -> KeyNumber | None:
    plan = subject.plan
    certificate = None if plan is None else plan.certificate
    if subject.refusal or (certificate is not None and certificate.refused):
        reason = "The plan in the file is refused" if subject.refusal else "There is no proof of stability"
        meaning = f"{reason}: do not render this plan."
        return KeyNumber("refused", "certificate", meaning)
    if plan is None or certificate is None:
        return None
    largest = plan.force_error.largest
    change = f"changes the force by up to {amount(largest, subject.model.units['force'])}"
    return KeyNumber(
        f"{1e3 * certificate.longest_period_s:.3g} ms",
        "longest time between samples",
        "Up to this time every condition of stability holds; the device samples every "
        f"{1e3 * certificate.device.period_s:.3g} ms. "
        f"The plan {change if largest else 'does not change the force'}.",
    )


def _size(subject: Subject) -> KeyNumber:
    return KeyNumber(
        str(subject.model.n_wavelets),
        "wavelets and harmonics" if subject.model.harmonics else "wavelets",
        f"Size of the model: {subject.model.n_parameters} fitted numbers describe the force.",
    )
