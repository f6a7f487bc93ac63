# SPDX-License-Identifier: Apache-2.0
"""A table of a model and the baselines on the same held-out rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import click

from ..baselines import Compared, compare
from ..recording import Recording
from .printing import number, print_line, print_table, talk


def baselines_option(command: Any) -> Any:
    """--baselines: fit what palpate is compared with to the same rows."""
    return click.option(
        "--baselines",
        "beside",
        is_flag=True,
        help="Fit the usual methods to the same rows and compare; needs --hold-out-every.",
    )(command)


def fit_baselines(recordings: Sequence[Recording], hold_out_every: int | None) -> list[Compared]:
    """The baselines, fitted to what is not held out."""
    if hold_out_every is None:
        raise click.UsageError("--baselines compares on held-out rows and needs --hold-out-every K")

    talk("fitting the baselines ...")
    return compare(recordings, hold_out_every)


def print_beside(nrmse: float, n_parameters: int, seconds: float, others: Sequence[Compared]) -> None:
    """The model first, then the baselines."""
    rows = [("wavelet network", number(nrmse), str(n_parameters), f"{seconds:.2f}")]
    rows += [
        (each.name, "refused", "", "")
        if each.refused
        else (each.name, number(each.nrmse), str(each.n_parameters), f"{each.seconds:.2f}")
        for each in others
    ]
    print_line()
    print_table(("on the same held-out rows", "nrmse", "parameters", "seconds"), rows)
    for each in others:
        if each.refused:
            print_line(f"{each.name} is refused: {each.refused}")


def as_records(others: Sequence[Compared]) -> list[dict[str, Any]]:
    """For --json."""
    return [asdict(each) for each in others]
