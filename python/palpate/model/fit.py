# SPDX-License-Identifier: Apache-2.0
"""How an identification ended, and what it considered on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict


class PathStep(TypedDict):
    """One model that identification considered."""

    n_wavelets: int
    rmse: float
    criterion: float | None
    """Value of the stopping rule, the smaller the better; None where the rule gives none"""
    rung: str


@dataclass(frozen=True)
class Fit:
    """How an identification ended."""

    rung: str
    """The simplest rung of the ladder that earned its place: constant, linear, position, hysteresis, ..."""
    stop_reason: str
    nrmse: float
    """RMSE over the population standard deviation of the force, on the rows it was identified on"""
    n_wavelets: int
    n_parameters: int
    """Every fitted real number, dilations and translations included"""
    path: Sequence[PathStep] = ()
