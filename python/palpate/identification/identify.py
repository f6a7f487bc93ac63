# SPDX-License-Identifier: Apache-2.0
"""identify: from recordings to a model."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import parameter_texts, shown
from ..errors import InputError
from ..model import Model
from ..model.steepest_slope import ROWS_KEY, SteepestSlope
from ..recording import Recording, Source, read_recording
from ..recording.reading import RecordingLike, recordings_from
from ..recording.roles import Informative, role_counts, unused_rows
from ..verdict import Finding, Verdict, usable
from .classes.causes import FIRST_CURE, first_strokes
from .classes.class_selection import VELOCITY_INPUTS
from .classes.findings import USABLE_NRMSE, judged_network, verdict_of
from .classes.memory import better_with_memory
from .data.period import period_of, revolution_of
from .data.rows import require_in_range, rows_of
from .data.sections import in_sections
from .fit import fit_rows
from .network.fitted import FittedNetwork
from .network.separable import TINY
from .options import RESERVED_INPUTS, IdentifyOptions, default_of, described_fields, kind_of, options_from
from .search.evidence import deviance
from .threads import one_thread


def identify(
    recording: RecordingLike | Iterable[RecordingLike] | npt.ArrayLike | None = None,
    force: npt.ArrayLike | None = None,
    *,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    objects: Sequence[Iterable[RecordingLike]] | None = None,
    **options: Any,
) -> Model:
    """Identifies a model of force over position from recordings.

    Tries the model classes constant, linear, position and hysteresis, and takes the simplest that the data
    supports; with time, mass, damping, velocity and memory too. A recording with further inputs gives a force
    over all of them (constant, linear, network).

    Parameters
    ----------
    recording : Recording, path, DataFrame, a list of these, or (n,) array_like
        Several recordings of one object are identified together; their units must agree. The model then has a
        band. With `force` it is the array of positions [m or rad], which grow into the object.
    force : (n,) array_like, optional
        Force of the object against the tool [N or N*m].
    time : (n,) array_like, optional
        Time of each position in an array [s], strictly increasing.
    direction : (n,) array_like, optional
        +1 into the object, -1 out of it, 0 neither, for each position in an array. Where neither time nor
        direction is known, strokes are taken from the order of rows.
    objects : sequence of lists of recordings, optional
        Recordings of several objects of one kind, one list for each object, in place of `recording`. The
        model is their mean, and its band contains a further object of this kind.
    {options}
    Returns
    -------
    Model
        ``model.verdict`` judges it. ``model.fit`` holds its class and why growth stopped, ``model.path``
        every network that was considered. ``model.notes["model_selection"]`` holds one line for each model
        class, accepted or not; ``model.notes["rows"]`` sentences on rows that are not fitted, and
        ``model.notes["roles"]`` the number of rows of each role; ``model.notes["identification"]`` sentences
        on constraints and the check of the band; ``model.notes["shift_nrmse"]`` the NRMSE if press and
        release are shifted against each other, else 0. ``model.band`` is the range of force of a further
        recording.

    Raises
    ------
    palpate.InputError
        For an unknown option or a bad value, and for data without a force over position.

    Notes
    -----
    A file is read by :func:`palpate.read_recording`. To give arguments to it, read the recording first:
    ``identify(read_recording("press.csv", force_late_s=0.025))``. Its arguments are:

    {reading}
    The other options of ``palpate identify`` are these functions, arguments and attributes:

    ``--object`` : the argument `objects`
        Recordings of one of several objects.
    ``--output`` : :meth:`palpate.Model.save`
        Model file to write.
    ``--plot`` : :func:`palpate.plotting.plot`
        Draws force over position, and the residuals.
    ``--hold-out-every`` : :meth:`palpate.Recording.split`
        Holds out every K-th row (K >= 2), for :func:`palpate.verify`.
    ``--baselines`` : :func:`palpate.baselines.compare`
        Fits the usual methods to the same rows and compares them on the held-out rows.
    ``--out-of-core``, ``--jobs``, ``--scheduler`` : :func:`palpate.identify_files`
        Reads files larger than memory part by part, in several processes or by the workers of a Dask
        scheduler.
    ``--json``, ``--quiet``, ``--verbose``, ``--sketch`` : the returned model
        The error is ``model.fit.nrmse``, the notes are ``model.notes["rows"]`` and
        ``model.notes["identification"]``, and a notebook shows the model as a table with its force curve.

    Examples
    --------
    >>> import numpy as np, palpate
    >>> position = np.linspace(0.0, 0.01, 200)
    >>> palpate.identify(position, 500.0 * position).n_wavelets
    0
    """
    settings = options_from(options)
    inputs = () if settings.inputs == "auto" else settings.inputs
    further = [name for name in inputs if name not in RESERVED_INPUTS]
    if objects is None:
        if recording is None and force is None:
            raise InputError("recording is missing: give a recording, a list of recordings, or objects")
        given: Any = recording
        recordings = recordings_from(given, force, time, direction, inputs=further)
        object_of = [0] * len(recordings)
    else:
        if any(each is not None for each in (recording, force, time, direction)):
            raise InputError("recording and objects are given; give all recordings in objects")
        groups = _groups(objects, further)
        recordings = [each for group in groups for each in group]
        object_of = [number for number, group in enumerate(groups) for _ in group]
    units = dict(recordings[0].units)
    for other in recordings[1:]:
        if dict(other.units) != units:
            raise InputError(
                f"the recordings have different units, {units} and {dict(other.units)}; identify each one "
                "separately"
            )
    informative = Informative(recordings)
    recordings = informative.recordings
    for each in recordings:
        require_in_range("position", each.position)
        require_in_range("force", each.force)
        for name, column in zip(each.input_names, each.inputs.T, strict=True):
            require_in_range(name, column)
    fitted, sections = in_sections(recordings)
    with one_thread():
        network = _identified(recordings, fitted, settings, object_of)
        for drop in () if sections else (_drop_wrong_readings, _drop_first_strokes):
            if network.shows_all(recordings) and (findings := drop(network, informative)) is not None:
                fitted = recordings = informative.recordings
                network = _identified(recordings, fitted, settings, object_of)
                if findings:  # behind rows that are left out, the strokes that follow are the first ones
                    later = [each for each in network.log.findings if FIRST_CURE not in each.sentence]
                    network.log.findings[:] = [*findings, *later]
    rows = network.rows
    # A memory is fitted to the rows that wait as well.
    unused = [unused_rows(rows.roles)] if network.memory is None and not rows.fitted.all() else []
    network.log.rows[:0] = [*informative.notes, *unused, *sections]
    source = Source.merged(part.source for part in fitted)
    left_out = sum(map(len, recordings)) - len(rows.force)
    attracts = settings.below == "linear"
    verdict = verdict_of(network, recordings, None if left_out else rows.direction, attracts)
    model = model_of(network, recordings[0].units, source, verdict)
    model.notes["roles"] = (
        role_counts(rows.roles) | informative.dropped | ({"left out": left_out} if left_out else {})
    )
    if (steepest := SteepestSlope.of(model)) is not None:
        on_it = rows.fitted & steepest.rows(rows.domain[:, 0], rows.direction)
        model.notes[ROWS_KEY] = int(np.count_nonzero(on_it))
    return model


def _drop_wrong_readings(network: FittedNetwork, informative: Informative) -> list[Finding] | None:
    """Drops rows whose residual is that of a wrong reading; returns None if there are none."""
    # Rows behind a turn with a small weight share an error: none of them is wrong alone.
    counted = network.errors.share * network.errors.residual
    return [] if informative.drop_wrong_readings(counted) else None


def _drop_first_strokes(network: FittedNetwork, informative: Informative) -> list[Finding] | None:
    """Drops the first strokes over their places if they differ perceptibly from the later ones, which show
    what the object is from then on, and returns the finding on it; None if they do not differ."""
    if network.memory is not None:
        return None
    judged = judged_network(network, network.rows)
    if judged.cause is None or (first := first_strokes(judged)) is None:
        return None
    informative.drop_first_strokes(first)
    left_out = f"These {np.count_nonzero(first)} rows are left out: the model is that of the later strokes"
    return [usable(judged.cause.sentence.replace(FIRST_CURE, left_out))]


def _identified(
    recordings: Sequence[Recording],
    fitted: Sequence[Recording],
    options: IdentifyOptions,
    objects: Sequence[int],
) -> FittedNetwork:
    """Returns the force law that is identified from the fitted recordings, with a memory if all recordings
    support it.

    If the force repeats over position, or the angle closes a revolution, a good periodic force law is taken.
    Otherwise it is compared with one that is not periodic.
    """
    searched = options.period is None and options.inputs == "auto"
    found = [period_of(fitted), revolution_of(fitted)] if searched else []
    rows, tried = rows_of(fitted, options, objects), []
    for period in [*(each for each in found if each is not None), options.period]:
        tried.append(fit_rows(replace(rows, period=period), replace(options, period=period)))
        if period is not None and tried[-1].errors.nrmse <= USABLE_NRMSE:
            break

    n = min(min(each.independent_rows, each.errors.rows) for each in tried)

    def value(network: FittedNetwork) -> float:
        return deviance("bic", max(network.errors.rmse**2, TINY) * n, n, network.n_parameters)

    network = tried[-1] if tried[-1].period is not None else min(reversed(tried), key=value)
    if network.period is not None and searched:
        text = fitted[0].file_unit("position").text(network.period)
        note = f"The force repeats every {text}: positions are taken modulo this period (--period)."
        network.log.notes.insert(0, note)
    return better_with_memory(network, recordings, options)


def _groups(objects: object, inputs: Sequence[str]) -> list[list[Recording]]:
    """Returns the recordings of each object; refuses all but a list of lists of recordings."""
    if not isinstance(objects, (list, tuple)) or not objects:
        raise InputError(
            f"objects is {shown(objects)}: must be a list with a list of recordings of each object"
        )
    for number, group in enumerate(objects):
        if not isinstance(group, (list, tuple)) or not group:
            raise InputError(
                f"objects[{number}] is {shown(group)}: must be a list of recordings of one object"
            )
    return [recordings_from(group, inputs=inputs) for group in objects]


def _show_options() -> None:
    """Writes the fields of `IdentifyOptions` into the signature and the help of :func:`identify`."""
    signature = inspect.signature(identify)
    keyword, given = inspect.Parameter.KEYWORD_ONLY, list(signature.parameters.values())[:-1]
    options = [
        inspect.Parameter(each.name, keyword, default=default_of(each), annotation=kind_of(each))
        for each in fields(IdentifyOptions)
    ]
    identify.__signature__ = signature.replace(parameters=given + options)  # type: ignore[attr-defined]
    texts = {"{options}": described_fields(), "{reading}": _reading_arguments()}
    documentation = inspect.cleandoc(identify.__doc__ or "")
    for place, text in texts.items():
        documentation = documentation.replace(place, text)
    identify.__doc__ = documentation


def _reading_arguments() -> str:
    """Returns the arguments of `read_recording` as a list for a docstring, except the file and the inputs."""
    texts = parameter_texts(read_recording)
    return "".join(
        f"{name} : {parameter.annotation}, default {parameter.default!r}\n"
        + textwrap.indent(texts.get(name, "") + "\n", "    ")
        for name, parameter in inspect.signature(read_recording).parameters.items()
        if name not in ("path", "inputs")
    )


_show_options()


def model_of(network: FittedNetwork, units: Mapping[str, str], source: Source, verdict: Verdict) -> Model:
    """Returns the model of an identified network, with its verdict."""
    kind = {"kind": "position_velocity"} if network.inputs == VELOCITY_INPUTS else {}
    return Model.from_network(
        **kind,
        inputs=network.inputs,
        units=units,
        **network.parameters(),
        below=network.below,
        above=network.above,
        period=network.period,
        memory=network.memory,
        play_radius=network.play_radius,
        mass=network.mass,
        damping=network.damping,
        fit=network.fit(),
        band=network.band,
        data=source,
        notes={
            "model_selection": [str(decision) for decision in network.log.decisions],
            "rows": network.log.rows,
            "identification": [*network.log.notes, *network.remarks],
            "settled_nrmse": network.errors.settled_nrmse[0],
            "left_out_nrmse": network.errors.left_out_nrmse,
            "shift_nrmse": network.shift_nrmse,
            "error_rows": network.errors.rows,
            "verdict": verdict.record(),
        },
    )
