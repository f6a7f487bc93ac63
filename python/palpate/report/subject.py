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
from ..planning import DeviceProfile, ForceError, Plan, force_error, hand_for, judge, simulate
from ..planning.plan import NO_CERTIFICATE
from ..planning.search import plan as make_plan
from ..recording import Recording
from ..recording.files import require_file, sha256_of_file, unchanged
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
    sha256: str = ""
    """SHA-256 of the model file"""
    written_at_s: float = 0.0
    """Time at which the model file was written [s since 1970]"""

    @classmethod
    def of(cls, model: Model | str | os.PathLike[str]) -> Subject:
        """Returns the subject for a model or a model file. A refused plan does not refuse the model file.

        Raises
        ------
        InputError
            The model file cannot be read, also without its plan.
        """
        if isinstance(model, Model):
            return cls(model, plan=_plan_of(model))
        file = path_of("model", model)
        require_file(file)
        with unchanged(file):
            subject = _of_file(file)
            return replace(subject, sha256=sha256_of_file(file), written_at_s=file.stat().st_mtime)

    def planned_on(self, device: DeviceProfile) -> Subject:
        """Returns the subject with the plan of its model on a device. The plan in a model file is not used.

        Raises
        ------
        InputError
            The model cannot be planned on this device.
        """
        model = Model.from_dict({**self.model.to_dict(), "plan": None, "certificate": None})
        return replace(self, plan=make_plan(model, device), refusal="")

    def compared_with(self, recording: Recording | None, identified_on: Sequence[Recording] = ()) -> Subject:
        """Returns the subject with a recording to compare, and recordings of the identification.

        If rows of the recording were held out from the identification, only these are compared.

        Raises
        ------
        InputError
            The model was not identified on a recording of `identified_on`.
        """
        data = self.model.data
        given = [*identified_on, *([] if recording is None else [recording])]
        for each in given:
            instance_of("recording", each, Recording, "read one with palpate.read_recording")
        for each in identified_on:
            if is_fresh(data, each.source):
                name = " and ".join(each.source.files) or "a recording"
                raise InputError(f"{name} did not identify the model: its SHA-256 is not in the model file")
        fitted: dict[str, Recording] = {}
        for each in given:
            if not is_fresh(data, each.source):
                part = each.split(data.held_out_every)[0] if data.held_out_every else each
                fitted.setdefault(each.source.sha256, part)
        if recording is not None and data.held_out_every and not is_fresh(data, recording.source):
            recording = recording.split(data.held_out_every)[1]
        return replace(self, recording=recording, identified_on=tuple(fitted.values()))

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
            return NO_CERTIFICATE
        if self.plan.certificate.refused:
            return "no structure is proved stable on this device"
        try:
            device = self.plan.certificate.device
            rendered = simulate(self.plan, device, hand_for(self.plan, device), RENDERED_S)
        except InputError as error:
            return str(error)
        error_of = force_error(self.plan, rendered)
        return Rendering(rendered, error_of, judge(self.plan, rendered, error_of, device))

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


def _plan_of(model: Model) -> Plan | None:
    return None if model.plan is None else Plan.of(model)


def _of_file(file: Path) -> Subject:
    """Reads a model file. If its plan or certificate is refused, returns the model with the reason."""
    try:
        model = load_model(file)
        return Subject(model, file, _plan_of(model))
    except InputError as error:
        refused = error
    try:
        model = load_model(file, with_plan=False)
        content = read_json(file)
    except InputError:
        raise refused from None
    reason = str(refused).removeprefix(f"{file}: ")
    subject = Subject(model, file, refusal=f"the plan in the model file is refused: {reason}")
    try:
        # The certificate is computed again for the model in the file.
        plan = Plan.of(Model.from_dict({**content, "certificate": None}))
        return replace(subject, plan=plan.certified_for(DeviceProfile(**content["certificate"]["device"])))
    except (ValueError, TypeError, KeyError):
        return subject
