# SPDX-License-Identifier: Apache-2.0
"""Number of threads of the matrix operations of an identification."""

from contextlib import AbstractContextManager
from functools import cache
from importlib import import_module

from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    """Returns the BLAS libraries of NumPy and SciPy; the search takes some milliseconds."""
    import_module("scipy.linalg")  # SciPy has its own library, and only a loaded library is found
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Returns a context in which the matrix operations of NumPy and SciPy use one thread.

    The matrices are small: several threads make the computation slower and change the last digits of the
    result.
    """
    limited: AbstractContextManager[object] = _libraries().limit(limits=1, user_api="blas")
    return limited
