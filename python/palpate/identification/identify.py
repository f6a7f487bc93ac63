# SPDX-License-Identifier: Apache-2.0
"""identify: from recordings to a model."""

from collections.abc import Mapping, Sequence
from typing import Any

from threadpoolctl import threadpool_limits

from ..errors import InputError
from ..model import Fit, Model, PathStep
from ..recording import Recording, Source
from .environment import VELOCITY_INPUTS, fit_environment
from .identified import IdentifiedNetwork
from .inputs import observations
from .options import IdentifyOptions, options_from


def identify(recording: Recording | Sequence[Recording], **options: Any) -> Model:
    """Identify the environment behind recorded force over position.

    Climbs the ladder constant, linear, position, hysteresis, as far as each rung earns its place. A recording
    with further inputs gives a force of them all (constant, linear, network).

    Parameters
    ----------
    recording : Recording or sequence of Recording
        Several recordings of one environment are identified together; their units must agree.
    **options
        Fields of :class:`IdentifyOptions`.

    Returns
    -------
    Model
        ``model.fit`` says which rung was reached and why growth stopped, ``model.path`` holds every network
        on the way, ``model.notes["identification"]`` what was refused, left out or imposed at what price.

    Raises
    ------
    palpate.InputError
        For an unknown option or a bad value, and for data that give no force over position.
    """
    settings = options_from(options)
    recordings = [recording] if isinstance(recording, Recording) else list(recording)
    if not recordings:
        raise InputError("identify was given no recording; give one, or a list of them")
    units = dict(recordings[0].units)
    for other in recordings[1:]:
        if dict(other.units) != units:
            raise InputError(
                f"the recordings have different units, {units} and {dict(other.units)}; identify them apart"
            )
    seen = observations(recordings, settings)
    # The matrices have a few hundred rows: threads cost more than they bring, and change the last digits.
    with threadpool_limits(limits=1, user_api="blas"):
        network = fit_environment(
            seen.X, seen.force, seen.side, settings, starts=seen.starts, names=seen.names, parts=seen.parts
        )
    source = Source.merged(part.source for part in recordings)
    return model_of(network, recordings[0].units, source, settings, seen.notes)


def model_of(
    network: IdentifiedNetwork,
    units: Mapping[str, str],
    source: Source,
    options: IdentifyOptions,
    notes: Sequence[str] = (),
) -> Model:
    """The model of an identified network."""
    notes = [*notes, *network.notes]
    path: list[PathStep] = [
        {"n_wavelets": at.n_wavelets, "rmse": at.rmse, "criterion": at.criterion, "rung": at.rung}
        for at in network.path
    ]
    return Model(
        kind=_kind(network),
        inputs=network.inputs,
        units=units,
        alpha=network.alpha,
        beta=network.beta,
        weight=network.weight,
        linear=network.linear,
        bias=network.bias,
        weight_hysteresis=network.weight_hysteresis,
        linear_hysteresis=network.linear_hysteresis,
        bias_hysteresis=network.bias_hysteresis,
        lower=network.lower,
        upper=network.upper,
        below=network.below,
        above=network.above,
        period=options.period,
        play_radius=network.play_radius,
        mass=network.mass if options.filters == "matched" else options.assumed_mass,
        damping=options.assumed_damping if options.filters == "paper-explicit" else network.damping,
        fit=Fit(
            rung=network.rung,
            stop_reason=network.stop_reason,
            nrmse=network.nrmse,
            n_wavelets=len(network.weight),
            n_parameters=network.n_parameters,
            path=path,
        ),
        data=source,
        notes={"identification": notes} if notes else None,
    )


def _kind(network: IdentifiedNetwork) -> str:
    if len(network.inputs) == 1:
        return "hysteresis" if network.weight_hysteresis is not None else "position"
    return "position_velocity" if network.inputs == VELOCITY_INPUTS else "general"
