# SPDX-License-Identifier: Apache-2.0
"""The verdict of an identification: findings on the recordings, on the model class, and on the error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Float1D
from ..recording import Recording
from ..recording.quality import findings_of
from ..verdict import Finding, Verdict, no, usable
from .identified import IdentifiedNetwork

USABLE_NRMSE = 0.1
"""NRMSE above which a model is usable with a reservation: a tenth of the force's spread [-]."""

UNFIT_NRMSE = 0.5
"""NRMSE above which a model is unfit: it leaves a quarter of the force's variance unexplained [-]."""

ROWS_A_PARAMETER = 7
"""Rows for each parameter below which the error between the rows may exceed that of the fit by a fifth."""

ROWS_A_PARAMETER_OF_FEW = 10
"""The same among fewer than FEW_ROWS rows, which may miss a bend of the force."""

FEW_ROWS = 500

CERTAINLY_ENOUGH = 1000
"""Rows for each parameter from which repetitions are not counted."""


def error_findings(nrmse: float, rows: str) -> list[Finding]:
    """Findings on the error alone; `rows` says on which rows it was computed."""
    if nrmse <= USABLE_NRMSE:
        return []
    judge = no if nrmse > UNFIT_NRMSE else usable
    explained = max(0.0, 1.0 - nrmse * nrmse)
    return [judge(f"the NRMSE on {rows} is {nrmse:.3g}: the model explains {explained:.0%} of the force")]


def size_findings(network: IdentifiedNetwork, recordings: Sequence[Recording]) -> list[Finding]:
    """Findings on too few rows for the number of parameters.

    Rows that repeat another one do not count, and correlated noise makes each row count for less.
    """
    rows = sum(map(len, recordings))
    if not recordings or rows >= CERTAINLY_ENOUGH * network.n_parameters:
        return []
    pairs = np.concatenate([part.position + 1j * part.force for part in recordings])
    distinct = len(np.unique(pairs))
    each = ROWS_A_PARAMETER_OF_FEW if distinct < FEW_ROWS else ROWS_A_PARAMETER
    needed = each * network.n_parameters
    if min(distinct, network.independent_rows) >= needed:
        return []
    counted = min(distinct, round(network.independent_rows))
    subject = f"{rows} rows"
    if counted < rows:
        subject = f"{counted} independent of {rows} rows (the others repeat them, or follow correlated noise)"
    return [
        usable(
            f"{subject} determine {network.n_parameters} parameters, {needed} would be needed to trust the "
            "NRMSE: the error between the rows may be larger; record more rows, or verify the model on "
            "another recording"
        )
    ]


def verdict_of(
    network: IdentifiedNetwork, recordings: Sequence[Recording], side: Float1D | None = None
) -> Verdict:
    """The verdict on a network that was identified from recordings, with the direction (n,) of all rows."""
    findings = [*findings_of(recordings, side), *network.findings]
    findings += size_findings(network, recordings)
    findings += error_findings(network.nrmse, "the rows of the identification")
    return Verdict(tuple(dict.fromkeys(findings)))
