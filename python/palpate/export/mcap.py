# SPDX-License-Identifier: Apache-2.0
"""Writes a recording, or a flight record, as MCAP for tools that show robot logs."""

from __future__ import annotations

from ..errors import InputError
from ..verdict import GOOD
from .request import Request, Written


def write(request: Request) -> Written:
    """Writes the recording of a request as MCAP.

    Raises
    ------
    InputError
        No recording is given, it has no time, the name of the output does not end in .mcap, or the
        file exists.
    """
    if request.recording is None:
        raise InputError("no recording is given: palpate export RECORDING --mcap -o OUT.mcap")
    if request.output.suffix.lower() != ".mcap":
        raise InputError(f"{request.output} is not an MCAP file: its name must end in .mcap")
    if request.output.exists():
        raise InputError(
            f"{request.output} exists already, and a recording is not replaced: choose another name"
        )
    path = request.recording.write(request.output, replace=False)
    rows, size = len(request.recording), path.stat().st_size
    return Written(
        GOOD, {"MCAP": f"{path}: {rows} messages, {size / 1e6:.2g} MB"}, {"rows": rows, "bytes": size}
    )
