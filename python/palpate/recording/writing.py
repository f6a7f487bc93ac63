# SPDX-License-Identifier: Apache-2.0
"""Write a recording as CSV that explains itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from ..errors import InputError
from .files import replacing
from .layout import layout_for_writing

if TYPE_CHECKING:
    from .recording import Recording


def write_csv(recording: Recording, path: Path, *, replace: bool = True) -> Path:
    """Write `recording` to `path`; see :meth:`palpate.Recording.write`.

    Without `replace`, an existing file is refused.
    """
    layout = layout_for_writing(recording)
    frame = {name: getattr(recording, role) for role, name in layout.roles.items()}
    frame |= {name: recording.inputs[:, index] for index, name in enumerate(recording.input_names)}
    frame |= recording.columns
    with (
        replacing(path, replace=replace) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as stream,
    ):
        for key, value in (*recording.metadata.items(), layout.metadata_line()):
            line = f"# {key}: {value}"
            if len(line.splitlines()) != 1 or ":" in key:
                raise InputError(
                    f"{path} cannot be written: metadata {key!r} does not fit on one line, key: value"
                )
            stream.write(line + "\n")
        pd.DataFrame(frame).to_csv(stream, index=False, lineterminator="\n")
    return path
