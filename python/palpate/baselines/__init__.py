# SPDX-License-Identifier: Apache-2.0
"""Baselines: the methods of the paper's related work, and those of common practice.

All methods have the same interface: ``fit(X, y)`` returns the estimator, ``predict(X)`` the force,
``n_parameters_`` counts every fitted real number. X (n, 1 to 3) holds position and, if known, velocity and
acceleration; for `PerStroke` the stroke is one more column. The paper's own identification is
:class:`palpate.baselines.PaperNetwork`, with :func:`palpate.baselines.paper_force` for its filters.
"""

from .comparison import PASSIVE_SPLINE, Compared, baselines, comparable, compare
from .methods import HuntCrossley, LinearZones, LookupTable, PerStroke, SmoothingSpline, TissueParameters
from .paper import PaperNetwork, paper_force

__all__ = [
    "PASSIVE_SPLINE",
    "Compared",
    "HuntCrossley",
    "LinearZones",
    "LookupTable",
    "PaperNetwork",
    "PerStroke",
    "SmoothingSpline",
    "TissueParameters",
    "baselines",
    "comparable",
    "compare",
    "paper_force",
]
