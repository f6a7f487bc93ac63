# SPDX-License-Identifier: Apache-2.0
"""Subject of a report: a model with its plan, the recording it is compared with, and all verdicts."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from .._core.io import read_json
from .._typing import Float1D
from ..arguments import instance_of, path_of
from ..errors import InputError
from ..model import Model, load_model
from ..planning import DeviceProfile, ForceError, Plan, force_error, judge, rig_for, simulate
from ..recording import Recording
from ..verdict import Verdict, no
from ..verification import Uncertainty, Verification, uncertainty, verify
from ..verification.verification import is_fresh

RENDERED_S = 4.0
"""Simulated time of a rendering [s]; the default hand crosses the domain of the model twice and back."""


@dataclass(frozen=True)
class Rendering:
    """Simulated rendering of a plan, its force error and its verdict."""

    recording: Recording
    error: ForceError
    verdict: Verdict


@dataclass(frozen=True)
class Subject:
    """Model of a report, with everything that its sections show; slow parts are computed when first used."""

    model: Model
    file: Path | None = None
    """Model file; None for a model that was not read from a file"""
    plan: Plan | None = None
    refusal: str = ""
    """Reason why the plan in the model file is refused; empty if it is not refused"""
    recording: Recording | None = None
    """Compared recording: the held-out rows if it is the recording of the identification"""
    identified_on: tuple[Recording, ...] = ()
    """Rows from which the model was identified, as far as their recordings were given"""

    @classmethod
    def of(
        cls,
        model: Model | str | os.PathLike[str],
        recording: Recording | None = None,
        identified_on: Sequence[Recording] = (),
    ) -> Subject:
        """Returns the subject for a model or a model file. A refused plan does not refuse the model.

        Raises
        ------
        InputError
            The model file cannot be read, also without its plan.
        """
        subject = (
            cls(model, plan=None if model.plan is None else Plan.of(model))
            if isinstance(model, Model)
            else _of_file(path_of("model", model))
        )
        for each in (*identified_on, *(() if recording is None else (recording,))):
            instance_of("recording", each, Recording, "read one with palpate.read_recording")
        model = subject.model
        given = [*identified_on, *([] if recording is None else [recording])]
        fitted = {each.source.sha256: _fitted_rows(model, each) for each in given if _is_of(model, each)}
        if recording is not None and _is_of(model, recording) and model.data.held_out_every:
            recording = recording.split(model.data.held_out_every)[1]
        return replace(subject, recording=recording, identified_on=tuple(fitted.values()))

    @cached_property
    def verification(self) -> Verification | None:
        """Comparison of the model with the recording; None without a recording."""
        return None if self.recording is None else verify(self.model, self.recording)

    @cached_property
    def uncertainty(self) -> Uncertainty | str:
        """Standard errors of the model's force, or the reason why they are not known."""
        given = {sha for part in self.identified_on for sha in part.source.sha256.split()}
        if not given or not given >= set(self.model.data.sha256.split()):
            return (
                "the band needs the recordings from which the model was identified: give them with "
                "--identified-on"
            )
        try:
            return uncertainty(self.model, self.identified_on)
        except InputError as error:
            return str(error)

    @cached_property
    def rendering(self) -> Rendering | str:
        """Simulated rendering of the plan on its device with the default hand, or the reason why there is
        none."""
        if self.plan is None:
            return self.no_plan
        if self.refusal:
            return "the plan is refused"
        if self.plan.certificate is None:
            return "the plan has no certificate, so its device is not known: make a plan with palpate plan"
        try:
            rendered = simulate(
                self.plan, self.plan.certificate.device, rig_for(self.model).hand, RENDERED_S
            )
        except InputError as error:
            return str(error)
        error_of = force_error(self.plan, rendered)
        return Rendering(rendered, error_of, judge(self.plan, rendered, error_of))

    @property
    def no_plan(self) -> str:
        """Reason why there is no plan."""
        if self.refusal:
            return "the plan in the model file cannot be read"
        return "the model has no plan: make one with palpate plan MODEL.json --device PROFILE"

    @cached_property
    def verdicts(self) -> dict[str, Verdict]:
        """Verdict of each part of the work that was done."""
        found = {"identification": self.model.verdict}
        if self.verification is not None:
            found["comparison with the recording"] = self.verification.verdict
        if self.refusal:
            found["plan"] = Verdict((no(self.refusal),))
        elif self.plan is not None:
            found["plan"] = self.plan.verdict
        if isinstance(self.rendering, Rendering):
            found["simulated rendering"] = self.rendering.verdict
        return found

    @property
    def verdict(self) -> Verdict:
        """Verdict with the findings of all parts."""
        return sum(self.verdicts.values(), Verdict())

    def folded(self, position: Float1D) -> Float1D:
        """Returns the positions of a periodic model moved into its first period; else the same positions."""
        if self.model.period is None:
            return position
        lower = float(self.model.lower[0])
        return np.asarray(lower + np.mod(position - lower, self.model.period))


def _is_of(model: Model, recording: Recording) -> bool:
    """Returns True if the model was identified on the recording or, with held-out rows, on a part of it."""
    return not is_fresh(model.data, recording.source)


def _fitted_rows(model: Model, recording: Recording) -> Recording:
    every = model.data.held_out_every
    return recording.split(every)[0] if every else recording


def _of_file(file: Path) -> Subject:
    """Reads a model file. If its plan or certificate is refused, returns the model with the reason."""
    try:
        model = load_model(file)
    except InputError as error:
        return _without_plan(file, error)
    return Subject(model, file, None if model.plan is None else Plan.of(model))


def _without_plan(file: Path, refused: InputError) -> Subject:
    """Returns the model of a file whose plan is refused, with the plan's certificate computed again."""
    try:
        model = load_model(file, with_plan=False)
        content = read_json(str(file))
    except InputError:
        raise refused from None
    reason = str(refused).removeprefix(f"{file}: ")
    refusal = f"the plan in the model file is refused: {reason}"
    try:
        plan = Plan.of(Model.from_dict({**content, "certificate": None}))
        device = DeviceProfile(**content["certificate"]["device"])
        return Subject(model, file, plan.certified_for(device), refusal)
    except (ValueError, TypeError, KeyError):
        return Subject(model, file, None, refusal)
