# SPDX-License-Identifier: Apache-2.0
"""Number of threads of the matrix operations of an identification."""

from contextlib import AbstractContextManager
from functools import cache
from importlib import import_module

from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    """Returns the BLAS libraries of NumPy and SciPy; the search takes some milliseconds.

    Only a loaded library is found, and scipy.linalg has its own one. scipy.optimize imports it. Python 3.11
    can take ten times as long to import it from deep within the search of a model.
    """
    import_module("scipy.optimize")
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Returns a context in which the matrix operations of NumPy and SciPy use one thread.

    The matrices are small: several threads make the computation slower and change the last digits of the
    result.
    """
    limited: AbstractContextManager[object] = _libraries().limit(limits=1, user_api="blas")
    return limited
