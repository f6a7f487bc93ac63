# SPDX-License-Identifier: Apache-2.0
"""Terminal output: wrapping between words, no control characters from outside, progress, Ctrl-C."""

import ast
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import nodes_of, sampled
from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import Recording, identify, load_model
from palpate.cli.main import main
from palpate.cli.printing import Progress, visible
from palpate.identification.search.evidence import reporting_to
from test_cli_identify import spring

CLI = Path(__file__).parents[3] / "python" / "palpate" / "cli"

Terminal = Callable[..., str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    spring(tmp_path / "a.csv")
    model_by_hand().save("m.json")
    keyswitch_by_hand().save("k.json")
    return tmp_path


@pytest.mark.parametrize("columns", sampled([80, 40], 40))
@pytest.mark.parametrize(
    "arguments",
    [
        ["identify", "a.csv", "-o", "o.json", "--hold-out-every", "5", "--baselines"],
        ["verify", "m.json", "a.csv", "--plot-closed-loop", "a.png"],
        ["plan", "m.json", "--device", "bench-knob"],
        ["plan", "k.json", "--device", "bench-knob"],
        ["plan", "--examples"],
        ["simulate", "k.json", "--duration-s", "0.1"],
        ["devices"],
        ["show", "m.json"],
        ["show", "k.json"],
        ["show", "m.json", "--beside", "m.json"],
        ["show", "no-such-file-in-this-folder.json"],
        ["verify", "m.json"],
    ],
    ids=" ".join,
)
def test_no_word_is_broken_at_the_edge_of_a_terminal(
    arguments: list[str], columns: int, folder: Path, terminal: Terminal
) -> None:
    output = terminal(lambda: main(arguments), columns)
    assert "Traceback" not in output
    # Only a word that is longer than the width of the terminal may exceed it.
    assert [line for line in output.splitlines() if len(line) > columns and len(line.split()) > 1] == []


def test_a_message_is_not_wrapped_without_a_terminal(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = "a rather long name of a file that is not there, " * 3 + ".json"
    assert main(["show", name]) == 2
    assert capsys.readouterr().err == f"error: there is no file {name}\n"


ESCAPES = "\x1b[2J\x1b]0;owned\x07\u202e\x9b31m"
"""Control characters that clear the screen, set the window title and reverse the direction of writing."""


def control_characters_of(text: str) -> list[str]:
    return [c for c in text if not c.isprintable() and c not in "\n"]


@pytest.mark.parametrize("arguments", [["-o", "o.json"], ["-o", f"o{ESCAPES}.json"]], ids=["column", "file"])
def test_control_characters_of_names_do_not_reach_the_terminal(
    arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("evil.csv").write_text(
        f"position{ESCAPES}_rad,torque{ESCAPES}_Nm\n" + "".join(f"{k},{2 * k}\n" for k in range(40)),
        encoding="utf-8",
    )
    main(["identify", "evil.csv", "--position", f"position{ESCAPES}_rad", *arguments])
    main(["identify", f"{ESCAPES}.csv", "-o", "x.json"])
    main(["identify", "a.csv", "-o", "x.json", "--force", ESCAPES])
    main([f"sh{ESCAPES}ow"])
    main(["show", f"{ESCAPES}.json", "--json"])
    captured = capsys.readouterr()
    assert "\\x1b[2J" in captured.err
    assert control_characters_of(captured.out + captured.err) == []


def test_control_characters_of_a_model_do_not_reach_the_terminal(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = json.loads(Path("m.json").read_text(encoding="utf-8"))
    content["data"]["files"] = ["by-\x1b[2J\nverdict: good-hand.csv"]
    Path("m.json").write_text(json.dumps(content), encoding="utf-8")
    assert load_model("m.json").data.files[0].startswith("by-\x1b")
    main(["show", "m.json"])
    main(["show", "m.json", "--json"])
    captured = capsys.readouterr()
    assert "by-\\x1b[2J\\nverdict" in captured.out
    assert control_characters_of(captured.out + captured.err) == []


def test_printable_text_of_any_language_is_not_changed() -> None:
    for text in ("Größe.csv", "力_N", "0.1 µm ± 3 %", "Ω·m²"):
        assert visible(text) == text


def test_only_constant_text_is_printed_without_being_escaped() -> None:
    for file in CLI.glob("*.py"):
        if file.name == "printing.py":
            continue
        for node in nodes_of(file):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "click.echo":
                assert all(isinstance(each, ast.Constant) for each in node.args), (
                    f"{file.name}: {node.lineno}"
                )


def test_progress_overwrites_one_line_of_a_terminal_and_removes_it(terminal: Terminal) -> None:
    def work() -> None:
        progress = Progress("identifying")
        for n in range(3):
            time.sleep(0.11)
            progress(f"position, {n} wavelets")
        progress.clear()

    output = terminal(work)
    assert "\n" not in output
    assert [f"position, {n} wavelets" in output for n in range(3)] == [True] * 3
    assert output.endswith(f"\r{'':<79}\r")


def test_progress_prints_nothing_in_its_first_moments_without_a_terminal(
    capsys: pytest.CaptureFixture[str],
) -> None:
    progress = Progress("identifying")
    progress("position, 1 wavelets")
    assert capsys.readouterr().err == ""


def test_identification_reports_every_network_that_it_tries(folder: Path) -> None:
    tried_networks: list[tuple[str, int]] = []
    with reporting_to(lambda name, n: tried_networks.append((name, n))):
        identify(Recording.from_arrays([0.1 * k for k in range(100)], [abs(k - 50.0) for k in range(100)]))
    assert ("position", 0) in tried_networks
    assert ("position", 1) in tried_networks


def _processor_time_s(pid: int) -> float:
    """Returns the processor time of a program of this machine [s]."""
    user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def test_ctrl_c_ends_a_library_computation_before_it_is_complete() -> None:
    lines = [
        "import time, click, numpy as np",
        "from palpate.cli.exit_status import interrupted_at_once",
        "with interrupted_at_once():",
        "    matrix = np.random.default_rng(0).normal(size=(3000, 3000))",
        "    print(time.process_time(), flush=True)",
        "    try:",
        "        np.linalg.svd(matrix)",  # takes many seconds
        "    finally:",
        "        print('complete', flush=True)",
    ]
    program = [sys.executable, "-c", "\n".join(lines)]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        begun_s = float(process.stdout.readline())
        while _processor_time_s(process.pid) < begun_s + 0.2:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        output, messages = process.communicate()
    assert process.returncode == 130
    assert output == ""
    assert messages == "error: interrupted; nothing was written\n"
