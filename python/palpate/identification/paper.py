# SPDX-License-Identifier: Apache-2.0
"""The identification of the paper: a target made with its differentiators (figures 11 and 13).

The network is fitted to F - m G1 G2 x (implicit pair) or F - m G1 G2 x - B_o G2 x (explicit pair) over raw x,
with a mass and a damping that are chosen beforehand. G is causal and falls off above 100 rad/s, so the target
lags behind the motion; it is here for comparison.
"""

import numpy as np

from .._core.dynamics import environment_filters, paper_sample_time_s
from .._typing import Float1D
from ..errors import InputError
from ..recording import Recording
from .options import IdentifyOptions

PERIOD_TOLERANCE = 0.01
"""How far, as a share, the sample period may be from the one that the filters are made for."""


def paper_target(recording: Recording, options: IdentifyOptions) -> Float1D:
    """What the network is fitted to (n,): the force less those of the assumed mass and damping.

    Raises
    ------
    InputError
        The recording has no time, or is not sampled every millisecond.
    """
    period = recording.sample_period
    if recording.time is None or period is None:
        raise InputError("the paper's filters need time: the recording has none (--time NAME)")
    steps = np.diff(recording.time)
    if np.abs(steps / paper_sample_time_s - 1.0).max() > PERIOD_TOLERANCE:
        raise InputError(
            f"the paper's filters are made for steps of {paper_sample_time_s:g} s; the recording's are from "
            f"{steps.min():g} to {steps.max():g} s"
        )
    filters = environment_filters(options.filters.removeprefix("paper-"), "paper")
    velocity = filters.g2.filter(recording.position - recording.position[0])
    target = recording.force - options.assumed_mass * filters.g1.filter(velocity)
    if options.filters == "paper-explicit":
        target = target - options.assumed_damping * velocity
    return np.asarray(target)
