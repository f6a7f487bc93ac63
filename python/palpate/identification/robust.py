# SPDX-License-Identifier: Apache-2.0
"""Outliers: rows far from what the others say are weighed down until they pull no more than the others.

Huber's loss is quadratic up to k standard deviations of the residual and linear beyond (Huber 1964). It is
minimised by least squares with weights min(1, k s / |residual|) that are found again after each fit; s comes
from the median absolute residual, which outliers do not move.
"""

from collections.abc import Callable

import numpy as np

from .._typing import Float1D, Float2D
from .rung import Rung

BEND = 2.0
"""k: on data without outliers 99 % of the efficiency of least squares is kept."""

ROUNDS = 4
"""Fits with ever better weights."""

SETTLED = 1e-3
"""Mean change of the weights below which they are good."""


def robust_weights(
    fit: Callable[[Float1D], Rung], first: Rung, box: Float2D, force: Float1D, weight: Float1D | None
) -> tuple[Float1D, str]:
    """Weights (n,) of the rows for a last fit, and a sentence about them.

    Parameters
    ----------
    fit : callable
        The rung for given weights.
    first : Rung
        For the weights as they were.
    box, force, weight
        Positions in the unit box (n, d), forces (n,), samples that each row stands for (n,) or None.
    """
    given = np.ones(len(force)) if weight is None else weight
    rung, share = first, np.ones(len(force))
    for _ in range(ROUNDS):
        residual = np.abs(force - rung.modelled(box))
        scale = 1.4826 * float(np.median(residual))
        before = share
        share = np.minimum(1.0, BEND * scale / np.maximum(residual, np.finfo(float).tiny))
        if scale == 0.0 or np.abs(share - before).mean() <= SETTLED:
            break
        rung = fit(given * share)
    far = int(np.count_nonzero(share < 0.5))
    return given * share, f"{far} rows farther than {2 * BEND:g} standard deviations were weighed down"
