# SPDX-License-Identifier: Apache-2.0
"""identify: from recordings to a model."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from typing import Any

import numpy.typing as npt
from threadpoolctl import threadpool_limits

from ..errors import InputError
from ..model import Fit, Model, PathStep
from ..recording import Source
from ..recording.reading import Given, recordings_from
from ..verdict import Verdict
from .classes.findings import verdict_of
from .classes.selection import VELOCITY_INPUTS
from .data.outliers import without_isolated
from .data.rows import observations, require_in_range
from .environment import fit_environment
from .network.fitted import FittedNetwork
from .options import RESERVED_INPUTS, IdentifyOptions, default_of, described_fields, kind_of, options_from


def identify(
    recording: Given | Iterable[Given] | npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    *,
    time: npt.ArrayLike | None = None,
    direction: npt.ArrayLike | None = None,
    **options: Any,
) -> Model:
    """Identifies a model of force over position from recordings.

    Tries the model classes constant, linear, position and hysteresis, and takes the simplest that the data
    supports. A recording with further inputs gives a force over all of them (constant, linear, network).

    Parameters
    ----------
    recording : Recording, path, DataFrame, a list of these, or (n,) array_like
        Several recordings of one object are identified together; their units must agree. With `force` it is
        the array of positions [m or rad], which grow into the object.
    force : (n,) array_like, optional
        Force of the object against the tool [N or N*m].
    time : (n,) array_like, optional
        Time of each position in an array [s], strictly increasing.
    direction : (n,) array_like, optional
        +1 into the object, -1 out of it, 0 neither, for each position in an array. Where neither time nor
        direction is known, strokes are taken from the order of rows.
    {options}
    Returns
    -------
    Model
        ``model.verdict`` judges it. ``model.fit`` holds its class and why growth stopped, ``model.path``
        every network that was considered, ``model.notes["identification"]`` what was refused or left out.

    Raises
    ------
    palpate.InputError
        For an unknown option or a bad value, and for data that give no force over position.

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
    recordings = recordings_from(recording, force, time, direction, inputs=further)
    units = dict(recordings[0].units)
    for other in recordings[1:]:
        if dict(other.units) != units:
            raise InputError(
                f"the recordings have different units, {units} and {dict(other.units)}; identify them apart"
            )
    recordings, isolated = without_isolated(recordings)
    for each in recordings:
        require_in_range("position", each.position)
        require_in_range("force", each.force)
    seen = observations(recordings, settings)
    # The matrices have a few hundred rows: threads cost more than they bring, and change the last digits.
    with threadpool_limits(limits=1, user_api="blas"):
        network = fit_environment(
            seen.X, seen.force, seen.side, settings, starts=seen.starts, names=seen.names, parts=seen.parts
        )
    network = replace(
        network, notes=seen.notes + network.notes, findings=(*isolated, *seen.findings, *network.findings)
    )
    source = Source.merged(part.source for part in recordings)
    every_row = seen.side is not None and len(seen.side) == sum(map(len, recordings))
    verdict = verdict_of(network, recordings, seen.side if every_row else None)
    return model_of(network, recordings[0].units, source, settings, verdict)


def _show_options() -> None:
    """Writes the fields of `IdentifyOptions` into the signature and the help of :func:`identify`."""
    signature = inspect.signature(identify)
    keyword, given = inspect.Parameter.KEYWORD_ONLY, list(signature.parameters.values())[:-1]
    options = [
        inspect.Parameter(each.name, keyword, default=default_of(each), annotation=kind_of(each))
        for each in fields(IdentifyOptions)
    ]
    identify.__signature__ = signature.replace(parameters=given + options)  # type: ignore[attr-defined]
    identify.__doc__ = inspect.cleandoc(identify.__doc__ or "").replace("{options}", described_fields())


_show_options()


def model_of(
    network: FittedNetwork,
    units: Mapping[str, str],
    source: Source,
    options: IdentifyOptions,
    verdict: Verdict,
) -> Model:
    """The model of an identified network, with the verdict on it."""
    path: list[PathStep] = [
        {
            "n_wavelets": at.n_wavelets,
            "rmse": at.rmse,
            "criterion": at.criterion,
            "model_class": at.model_class,
        }
        for at in network.path
    ]
    return Model(
        kind=_kind(network),
        inputs=network.inputs,
        units=units,
        **network.parameters(),
        below=network.below,
        above="linear",
        period=options.period,
        play_radius=network.play_radius,
        mass=network.mass if options.search.filters == "matched" else options.search.assumed_mass,
        damping=options.search.assumed_damping
        if options.search.filters == "paper-explicit"
        else network.damping,
        fit=Fit(
            model_class=network.model_class,
            stop_reason=network.stop_reason,
            nrmse=network.nrmse,
            n_wavelets=len(network.weight),
            n_parameters=network.n_parameters,
            path=path,
        ),
        data=source,
        notes={"identification": list(network.notes), "verdict": verdict.record()},
    )


def _kind(network: FittedNetwork) -> str:
    if len(network.inputs) == 1:
        return "hysteresis" if network.weight_hysteresis is not None else "position"
    return "position_velocity" if network.inputs == VELOCITY_INPUTS else "general"
