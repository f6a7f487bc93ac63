# SPDX-License-Identifier: Apache-2.0
"""write_report: one self-contained HTML page about a model, its verification and its plan."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from .. import _core
from ..arguments import path_of
from ..model import Model
from ..recording import Recording
from ..recording.files import replacing
from ..verdict import Verdict
from .of_comparison import error_over_position, force_curve, just_noticeable, whiteness
from .of_model import provenance, selection_path, wavelets
from .of_plan import certificate_table, rendered
from .page import Section, bokeh, html_of
from .subject import Subject
from .summary import key_numbers, verdict
from .words import date_text

_MOST_NAMES = 2
"""Largest number of recordings that the title names"""


@dataclass(frozen=True)
class Report:
    """Report page that is not yet written: its HTML, its verdict, and its sections."""

    html: str
    verdict: Verdict
    sections: tuple[str, ...]
    """Keys of the sections with content, in order"""
    left_out: Mapping[str, str]
    """Reason why a section has no content, by the key of the section"""

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Writes the page. The file gets its name only when it is completely written; an existing file is
        replaced.

        Raises
        ------
        InputError
            The folder does not exist or cannot be written.
        """
        target = path_of("path", path)
        with replacing(target) as temporary:
            temporary.write_text(self.html, encoding="utf-8", errors="backslashreplace")
        return target


def report_of(subject: Subject) -> Report:
    """Returns the report on a model, its comparison with a recording, and its plan.

    Raises
    ------
    InputError
        Bokeh is not installed, or the recording does not fit the model.
    """
    bokeh("plotting")
    sections = sections_of(subject)
    return Report(
        html=html_of(
            f"Force model of {_source(subject.model)}",
            f"Report of palpate {_core.__version__}, {date_text(time.time())}",
            sections,
        ),
        verdict=subject.verdict,
        sections=tuple(section.key for section in sections if not section.left_out),
        left_out={section.key: section.left_out for section in sections if section.left_out},
    )


def write_report(
    model: Model | str | os.PathLike[str],
    recording: Recording | None = None,
    *,
    to: str | os.PathLike[str],
    identified_on: Sequence[Recording] = (),
) -> Report:
    """Writes a report about a model as one HTML page that fetches nothing.

    Parameters
    ----------
    model : Model or path
        The model. If the plan in a model file is refused, the report shows the model and the reason, and its
        verdict is no.
    recording : Recording, optional
        Recording to compare the model with, preferably a fresh one. If rows of it were held out from the
        identification, only these are compared.
    to : path
        The page; an existing file is replaced.
    identified_on : sequence of Recording
        Recordings from which the model was identified, for the 95 % band of its force.

    Returns
    -------
    Report
        Verdict and sections of the page.

    Raises
    ------
    InputError
        Bokeh is not installed, the model or the recording cannot be used, or the page cannot be written.
    """
    report = report_of(Subject.of(model).compared_with(recording, identified_on))
    report.write(to)
    return report


def _source(model: Model) -> str:
    """Returns the names of the recordings of a model, without their folders."""
    names = [Path(name).name for name in model.data.files]
    if len(names) > _MOST_NAMES:
        return f"{names[0]} and {len(names) - 1} more"
    return " and ".join(names) or "arrays"


def sections_of(subject: Subject) -> list[Section]:
    """Returns the sections of a report in order."""
    return [
        verdict(subject),
        key_numbers(subject),
        force_curve(subject),
        wavelets(subject),
        selection_path(subject),
        error_over_position(subject),
        whiteness(subject),
        just_noticeable(subject),
        rendered(subject),
        certificate_table(subject),
        provenance(subject),
    ]
