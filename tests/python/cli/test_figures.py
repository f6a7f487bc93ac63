# SPDX-License-Identifier: Apache-2.0
"""Tests of the figure files that the commands write."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from palpate import Recording, identify, read_recording, verify
from palpate.cli.figures import picture_path, picture_verification


def test_the_title_of_a_figure_names_source_and_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    titles: list[str] = []

    def record_title(figure: Figure, *_: Any, **__: Any) -> None:
        titles.append(figure.get_suptitle())

    monkeypatch.setattr(Figure, "savefig", record_title)
    position = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)])
    force = 2.0 * position + np.repeat([0.1, -0.1], 50)
    units = {"position": "rad", "force": "N*m"}
    written = Recording.from_arrays(position, force, direction=np.repeat([1, -1], 50), units=units)
    source = written.write(tmp_path / "press.csv")
    recording = read_recording(source)
    model = identify(recording)
    verification = verify(model, recording)
    picture_verification(tmp_path / "a.png", model, [(recording, verification)])
    picture_path(tmp_path / "b.png", model)
    assert titles[0] == f"press.csv\nNRMSE {verification.nrmse:.4g} on {len(recording)} rows"
    assert titles[1].startswith("press.csv\n")
    assert f"NRMSE {model.fit.nrmse:.4g}" in titles[1]
