# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C while figures are drawn: a quick normal ending that writes nothing."""

import os
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from models_by_hand import model_by_hand
from palpate import Recording
from palpate.cli.exit_status import interrupted_at_once
from palpate.cli.main import main

FIGURES_OF_THE_DEMO = 3


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    model = model_by_hand()
    model.save("m.json")
    t = np.arange(2000) * 1e-3
    position = 0.25 - 0.25 * np.cos(2 * np.pi * t)
    units = {"position": "rad", "force": "N*m"}
    Recording.from_arrays(position, model.force(position), t, units=units).write("a.csv")
    return tmp_path


@pytest.mark.parametrize(
    "arguments",
    [
        ["identify", "a.csv", "-o", "new.json", "--plot", "p.png"],
        pytest.param(["verify", "m.json", "a.csv", "--plot", "p.png"], marks=pytest.mark.full),
        ["verify", "m.json", "a.csv", "--plot", "p.png", "--plot-closed-loop", "loop.png"],
        pytest.param(
            ["simulate", "m.json", "-o", "r.csv", "--duration-s", "1", "--plot", "p.png"],
            marks=pytest.mark.full,
        ),
        ["plan", "m.json", "--device", "bench-knob", "-o", "new.json", "--plot", "p.png"],
        ["show", "m.json", "--beside", "m.json", "--plot", "p.png"],
        pytest.param(
            ["show", "a.csv", "--plot", "p.png", "--plot-frame", "frame.png"], marks=pytest.mark.full
        ),
        pytest.param(["demo", "-o", "new"], marks=pytest.mark.full),
    ],
)
def test_ctrl_c_while_the_last_figure_is_drawn_writes_nothing(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
) -> None:
    figures_left = sum(word.startswith("--plot") for word in arguments) or FIGURES_OF_THE_DEMO
    savefig = Figure.savefig

    def interrupted(figure: Figure, *given: Any, **options: Any) -> None:
        nonlocal figures_left
        figures_left -= 1
        if not figures_left:
            os.kill(os.getpid(), signal.SIGINT)
        savefig(figure, *given, **options)

    monkeypatch.setattr(Figure, "savefig", interrupted)
    before = sorted(folder.iterdir())
    assert main(arguments) == 130
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.endswith("error: interrupted; nothing was written\n")
    assert sorted(folder.iterdir()) == before


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_in_a_finalizer_prints_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[type[BaseException]] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda args: printed.append(args.exc_type))

    class Finalized:
        def __init__(self, error: BaseException) -> None:
            self.error = error

        def __del__(self) -> None:
            raise self.error

    with interrupted_at_once():
        for error in (KeyboardInterrupt(), MemoryError()):
            Finalized(error)
    assert printed == [MemoryError]
