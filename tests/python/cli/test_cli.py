# SPDX-License-Identifier: Apache-2.0
"""Behaviour that all commands share: exit codes, one-sentence errors, help, output streams."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest

from palpate import InputError
from palpate.cli.exit_status import WorkError, exit_status_of, finishing
from palpate.cli.main import main, palpate
from palpate.cli.printing import print_json
from palpate.cli.verb import require_writable

VERBS = ["identify", "verify", "simulate", "show", "demo"]


def run(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "palpate", *arguments], capture_output=True, text=True, check=False, **options
    )


@pytest.mark.parametrize("arguments", [[], ["identify"], ["verify"], ["simulate"], ["show"]])
def test_missing_arguments_print_help_and_exit_with_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("Usage: palpate")
    assert captured.out == ""


@pytest.mark.parametrize("verb", VERBS)
def test_help_ends_with_one_example_and_the_glossary(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([verb, "--help"]) == 0
    *_, example, terms = capsys.readouterr().out.strip().split("\n\n")
    assert " ".join(example.split()).startswith(f"Example: palpate {verb}")
    assert terms.strip() == "Terms: palpate --glossary"


def test_the_glossary_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--glossary"]) == 0
    assert "| play radius |" in capsys.readouterr().out


@pytest.mark.parametrize("verb", VERBS)
def test_help_fits_a_narrow_terminal(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    assert main([verb, "--help"]) == 0
    wide_lines = [line for line in capsys.readouterr().out.splitlines() if len(line) > 40]
    # In the help, the name of an option and the name of its value must be on one line.
    assert [line for line in wide_lines if not line.lstrip().startswith("-")] == []


def test_every_option_has_a_help_text() -> None:
    context = click.Context(palpate)
    for verb in VERBS:
        command = palpate.get_command(context, verb)
        assert command is not None
        for option in command.params:
            if isinstance(option, click.Option) and option.name not in ("help", "version"):
                assert option.help, f"{verb} {option.name} has no help"


@pytest.mark.parametrize(
    ("words", "heavy"),
    [
        (["--help"], {"numpy", "scipy", "pandas", "matplotlib", "pydantic"}),
        (["plan", "--help"], {"pandas", "matplotlib", "bokeh", "pydantic"}),
    ],
    ids=["program", "plan"],
)
def test_help_imports_no_large_library(words: list[str], heavy: set[str]) -> None:
    code = (
        f"import sys; from palpate.cli.main import main; main({words}); heavy = {heavy};"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert completed.stderr.strip() == "[]"


@pytest.mark.parametrize(
    ("error", "code", "sentence"),
    [
        (InputError("a.csv is empty"), 2, "a.csv is empty"),
        (ValueError("inertia is -1, must be > 0"), 2, "inertia is -1, must be > 0"),
        (WorkError("the rendering ran away"), 1, "the rendering ran away"),
        (OSError(28, "No space left on device", "m.json"), 1,
         "the operating system refuses m.json: No space left on device"),
        (MemoryError(), 1, "there is not enough memory for this recording"),
        (KeyboardInterrupt(), 130, "interrupted; nothing was written"),
        (click.UsageError("Missing option\n '-o'."), 2, "Missing option '-o'"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else "",
)  # fmt: skip
def test_every_failure_has_one_sentence_and_an_exit_code(
    error: BaseException, code: int, sentence: str
) -> None:
    status = exit_status_of(error)
    assert (status.code, status.sentence) == (code, sentence)


def test_a_defect_is_reported_with_file_and_line_and_without_traceback() -> None:
    try:
        raise RuntimeError("two\nlines")
    except RuntimeError as error:
        status = exit_status_of(error)
    assert status.code == 1
    assert "RuntimeError: two lines (test_cli.py, line" in status.sentence


@pytest.mark.parametrize(
    "arguments",
    [["frobnicate"], ["show", "--frob", "m.json"], ["simulate", "m.json", "--structure", "nice"],
     ["show", "nothing.json"], ["simulate", "nothing.json", "--plot", "p.txt"]],
)  # fmt: skip
def test_bad_usage_is_reported_in_one_line_on_standard_error(
    arguments: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("error: ")
    assert captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_with_json_a_failure_is_one_object_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "nothing.json", "--json"]) == 2
    assert json.loads(capsys.readouterr().out) == {"error": "there is no file nothing.json"}
    assert main(["simulate", "--json"]) == 2
    assert list(json.loads(capsys.readouterr().out)) == ["error"]


def test_nan_and_infinity_are_null_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    print_json({"r2": float("nan"), "path": [{"criterion": float("inf")}], "n": 3})
    assert json.loads(capsys.readouterr().out) == {"r2": None, "path": [{"criterion": None}], "n": 3}


def in_a_missing_folder(base: Path) -> Path:
    return base / "nowhere" / "m.json"


def below_a_file(base: Path) -> Path:
    (base / "file").touch()
    return base / "file" / "m.json"


def an_existing_folder(base: Path) -> Path:
    return base


def in_proc(base: Path) -> Path:
    return Path("/proc/m.json")


@pytest.mark.parametrize("target", [in_a_missing_folder, below_a_file, an_existing_folder, in_proc])
def test_an_output_that_cannot_be_written_is_refused(target: Callable[[Path], Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written: "):
        require_writable(target(tmp_path))


def test_an_input_is_never_overwritten(tmp_path: Path) -> None:
    recording = tmp_path / "a.csv"
    recording.write_text("x")
    symbolic_link = tmp_path / "link.csv"
    symbolic_link.symlink_to(recording)
    for target in (recording, symbolic_link):
        with pytest.raises(InputError, match="is also an input"):
            require_writable(target, inputs=[recording])


def test_two_results_do_not_share_a_file(tmp_path: Path) -> None:
    require_writable(tmp_path / "a", tmp_path / "b", None)
    with pytest.raises(InputError, match="two results"):
        require_writable(tmp_path / "a", tmp_path / "a")


def test_checking_an_output_creates_no_file(tmp_path: Path) -> None:
    require_writable(tmp_path / "m.json")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_is_ignored_while_results_are_written() -> None:
    with finishing():
        os.kill(os.getpid(), signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


def test_closed_stdout_exits_without_traceback() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "palpate", "identify", "--help"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert process.returncode == 1


@pytest.mark.parametrize("arguments", [["--version"], ["simulate", "nothing.json", "--json"]])
def test_a_full_disk_under_standard_output_is_reported_in_one_sentence(arguments: list[str]) -> None:
    with open("/dev/full", "w") as full_device:
        completed = subprocess.run(
            [sys.executable, "-m", "palpate", *arguments],
            stdout=full_device, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert completed.returncode != 0
    assert completed.stderr.startswith("error: ")
    assert completed.stderr.count("\n") == 1
