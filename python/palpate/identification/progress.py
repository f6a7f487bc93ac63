# SPDX-License-Identifier: Apache-2.0
"""Progress of an identification: reports each network that is tried to whoever asked for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Reporter = Callable[[str, int], None]
"""Receives the model class that is tried and the number of wavelets."""

_reporter: ContextVar[Reporter | None] = ContextVar("reporter", default=None)


@contextmanager
def reporting_to(reporter: Reporter) -> Iterator[None]:
    """Report every network that is tried in this context."""
    token = _reporter.set(reporter)
    try:
        yield
    finally:
        _reporter.reset(token)


def report(model_class: str, n_wavelets: int) -> None:
    """Report a network that is tried now."""
    if (reporter := _reporter.get()) is not None:
        reporter(model_class, n_wavelets)
