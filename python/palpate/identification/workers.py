# SPDX-License-Identifier: Apache-2.0
"""The same work in this process, in several, or on a cluster: results come in the order of the items."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from importlib import import_module
from typing import Any, TypeVar

from ..errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_order(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    done: Callable[[int], None] = lambda count: None,
) -> Iterator[Result]:
    """work(item) of every item, in their order.

    Parameters
    ----------
    work : callable
        Its result must depend on the item alone: then nobody can tell from the results who did the work.
    items : sequence
        What a worker is sent.
    jobs : int
        Processes of this machine, through joblib; 1: this process.
    scheduler : str, optional
        Address of a Dask scheduler, such as "tcp://host:8786": joblib hands the same work to it. Work that a
        lost worker had is done again by another.
    done : callable
        Told how many items are done, whenever one is.

    Raises
    ------
    InputError
        joblib or Dask is not installed, or no scheduler answers there.
    """
    if scheduler is None and jobs == 1:
        for count, item in enumerate(items, start=1):
            yield work(item)
            done(count)
        return
    joblib = _needed("joblib")
    with ExitStack() as stack:
        if scheduler is not None:
            client = stack.enter_context(_client(scheduler))
            stack.enter_context(joblib.parallel_config(backend="dask", client=client))
        parallel = joblib.Parallel(n_jobs=-1 if scheduler else jobs, return_as="generator")
        for count, result in enumerate(parallel(joblib.delayed(work)(item) for item in items), start=1):
            yield result
            done(count)


def _needed(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise InputError(
            f"work in several processes needs {name}: install it with pip install palpate[parallel]"
        ) from None


def _client(scheduler: str) -> Any:
    distributed = _needed("distributed")
    try:
        return distributed.Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}") from None
