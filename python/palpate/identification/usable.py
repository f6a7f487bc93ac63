# SPDX-License-Identifier: Apache-2.0
"""Which data give a force law at all; the others are refused in one sentence."""

from collections.abc import Sequence

import numpy as np

from .._typing import Float1D, Float2D
from ..errors import InputError

LEAST_ROWS = 10
"""Rows below which nothing is identified."""

LEAST_POSITIONS = 3
"""Distinct positions below which nothing is identified."""

LARGEST = 1e100
"""Largest absolute value, and the inverse of the smallest travel and force, that is identified."""


def require_usable(positions: Float2D, force: Float1D, names: Sequence[str]) -> None:
    """Refuse what cannot be identified.

    Raises
    ------
    InputError
        Too few rows or distinct positions, a value that is not finite, an input that never changes.
    """
    if positions.ndim != 2 or force.shape != (len(positions),):
        raise InputError(
            f"positions are {positions.shape} and force {force.shape}; (n, d) and (n,) are needed"
        )
    if len(force) < LEAST_ROWS:
        raise InputError(f"the recording has {len(force)} rows; {LEAST_ROWS} or more are needed")
    for name, column in zip((*names, "force"), (*positions.T, force), strict=True):
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            raise InputError(
                f"{name} in row {bad[0]} is {column[bad[0]]}; every value must be a finite number"
            )
    for name, column in zip((*names, "force"), (*positions.T, force), strict=True):
        require_in_range(name, column)
    if 0.0 < (largest := float(np.abs(force).max())) < 1.0 / LARGEST:
        raise InputError(
            f"the largest force is {largest:.3g}; the least is {1.0 / LARGEST:g}, or 0. Use another unit"
        )
    for name, column in zip(names, positions.T, strict=True):
        if 0.0 < (travel := float(np.ptp(column))) < 1.0 / LARGEST:
            raise InputError(f"{name} spans {travel:.3g}; the least is {1.0 / LARGEST:g}. Use another unit")
        if column.min() == column.max():
            raise InputError(f"every {name} is {column[0]:g}; identifying needs one that moves")
        if len(np.unique(column)) < LEAST_POSITIONS:
            raise InputError(
                f"{name} takes only {len(np.unique(column))} distinct values; "
                f"{LEAST_POSITIONS} or more are needed"
            )


def require_in_range(name: str, values: Float1D) -> None:
    """Refuse values (n,), n >= 1, whose squares would overflow.

    Raises
    ------
    InputError
        Names the largest value and the limit.
    """
    if (largest := float(np.abs(values).max())) > LARGEST:
        raise InputError(f"{name} reaches {largest:.3g}; the limit is {LARGEST:g}. Use another unit")
