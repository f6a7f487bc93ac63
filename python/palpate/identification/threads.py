# SPDX-License-Identifier: Apache-2.0
"""Number of threads of the matrix operations of an identification."""

from __future__ import annotations

from importlib import import_module

from threadpoolctl import threadpool_limits


def one_thread() -> threadpool_limits:
    """Returns a context in which the matrix operations of NumPy and SciPy use one thread.

    The matrices are small: several threads make the computation slower and change the last digits of the
    result.
    """
    import_module(
        "scipy.linalg"
    )  # SciPy has its own BLAS library, which can only be limited after it is loaded
    return threadpool_limits(limits=1, user_api="blas")
