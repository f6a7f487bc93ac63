# SPDX-License-Identifier: Apache-2.0
"""Positive semidefinite systems, as least squares over any columns makes them."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs

from .._typing import Float1D, Float2D

RIDGE = 1e-11
"""Relative ridge on unit-norm columns: keeps a nearly dependent basis solvable, far below any noise."""


def solve_gram(gram: Float2D, right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve a positive semidefinite system by Cholesky on unit-norm columns."""
    factor, norm = factored(gram)
    columns = right.reshape(len(gram), -1) / norm[:, None]
    solved, _ = dpotrs(factor, columns, lower=1)
    return np.asarray(solved / norm[:, None]).reshape(right.shape)


def half_solved(gram: Float2D, right: Float2D) -> Float2D:
    """M right with M' M the inverse of the system: products of what it returns are those of projections."""
    factor, norm = factored(gram)
    solved, _ = dtrtrs(factor, right / norm[:, None], lower=1)
    return np.asarray(solved)


def factored(gram: Float2D) -> tuple[Float2D, Float1D]:
    """(L, norm) with gram = D L L' D, D = diag(norm); only the lower triangle of L counts.

    The ridge is raised until the factorisation succeeds.
    """
    norm = np.sqrt(np.diag(gram))
    norm = np.where(norm > 0.0, norm, 1.0)
    scaled = gram / (norm[:, None] * norm)
    diagonal = np.einsum("ii->i", scaled)
    unit, ridge = diagonal.copy(), RIDGE
    while True:
        diagonal[:] = unit + ridge
        factor, failed = dpotrf(scaled, lower=1)
        if not failed:
            return factor, norm
        ridge *= 100.0
