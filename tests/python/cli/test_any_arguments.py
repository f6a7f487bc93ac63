# SPDX-License-Identifier: Apache-2.0
"""Any arguments of every verb: a documented exit code, one sentence for a refusal, and never a defect."""

import contextlib
import io
import json
import os
import signal
from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

import palpate.cli.main as entry
from any_input import cases, is_one_sentence
from conftest import sampled
from models_by_hand import model_by_hand
from palpate import InputError
from palpate.cli.exit_status import WorkError
from palpate.cli.printing import OutputError
from test_cli_identify import spring
from test_every_verb import VERBS

LONGEST_S = 120
"""A command on these small files that takes longer is a hang [s]."""

KEPT_OUT = {"--install-udev-rule", "--scheduler", "--browser"}
"""Options that change the machine, open a window, or wait for another machine."""

ENDLESS = {"--duration-s", "--seconds", "--jobs", "--settle-s", "--idle-s"}
"""Options whose large values are long work, which is not a hang."""

SLOW = ("demo", "report", "render", "app", "check-device")
"""Verbs that take a second or more."""

TEXTS = "m.json|a.csv|missing.csv|folder|broken.json|empty.csv|out.json|rad|N|mm|position_rad|force_N*m|x=N|:"
TEXTS += (
    "|0:3|3:1|bench-knob|direct|massless|implicit|simulated|usb|inverse3:q|auto|-|--|--help|\u2028|é|a b|=|,"
)
NUMBERS = "0|-1|1|2|3|0.1|0.5|1e-9|1e-300|1e300|nan|inf|-inf|1e400|abc||07|1,5|0x10|999999999999999999999"
SHORT = "0|-1|nan|abc||0.05"


class Hang(BaseException):
    """A command that does not end; no code of the program catches it."""


def stop(*_: object) -> None:
    raise Hang


def options_of(verb: str) -> list[tuple[str, int]]:
    """Returns the options of a verb, each with the number of its values."""
    command = entry.palpate.get_command(click.Context(entry.palpate), verb)
    assert command is not None
    return [
        (name, 0 if option.is_flag else option.nargs)
        for option in command.params
        if isinstance(option, click.Option)
        for name in (*option.opts, *option.secondary_opts)
        if name not in KEPT_OUT
    ]


@st.composite
def command_lines(draw: st.DrawFn, verb: str) -> list[str]:
    """Returns a valid command line of a verb after some changes."""
    arguments = VERBS[verb].split()[1:]
    texts = st.sampled_from([*TEXTS.split("|"), *NUMBERS.split("|")])
    for _ in range(draw(st.integers(1, 3))):
        change = draw(st.sampled_from(["option", "option", "option", "replace", "drop", "insert"]))
        place = draw(st.integers(0, len(arguments)))
        if change == "option":
            name, count = draw(st.sampled_from(options_of(verb)))
            values = st.sampled_from(SHORT.split("|")) if name in ENDLESS else texts
            arguments += [name, *(draw(values) for _ in range(count))]
        elif change == "insert":
            arguments.insert(place, draw(texts))
        elif arguments and place < len(arguments):
            if change == "drop":
                del arguments[place]
            elif arguments[place - 1] not in ENDLESS:
                arguments[place] = draw(texts)
    return [verb, *arguments]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "folder").mkdir()
    (tmp_path / "broken.json").write_text("{", encoding="utf-8")
    (tmp_path / "empty.csv").touch()
    return tmp_path


def write_files(folder: Path) -> None:
    """Writes the files that a command may replace."""
    spring(folder / "a.csv", n=60)
    model_by_hand().save(folder / "m.json")
    for output in ("out.json", "rendered.csv", "recorded.csv"):
        (folder / output).unlink(missing_ok=True)


def check_error(error: BaseException) -> None:
    """Refuses an exception that is not meant for the user, also if it would be printed as bad input."""
    usual = (click.ClickException, click.exceptions.Exit, click.Abort, InputError, WorkError, OutputError)
    if isinstance(error, usual):
        return
    assert isinstance(error, ValueError), repr(error)
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    assert trace is not None
    assert f"{os.sep}palpate{os.sep}" in trace.tb_frame.f_code.co_filename, repr(error)


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb not in SLOW])
@cases(12)
@given(data=st.data())
def test_any_arguments_end_with_a_documented_exit_code(
    verb: str, data: st.DataObject, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(data.draw(command_lines(verb)), folder, monkeypatch)


@pytest.mark.parametrize("verb", sampled(SLOW, *(verb for verb in SLOW if verb != "demo")))
@cases(2)
@given(data=st.data())
def test_any_arguments_of_slow_verbs_end_with_a_documented_exit_code(
    verb: str, data: st.DataObject, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(data.draw(command_lines(verb)), folder, monkeypatch)


def run(arguments: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs a command line and checks its end."""
    write_files(folder)
    errors: list[BaseException] = []

    def remembered(error: BaseException) -> object:
        errors.append(error)
        return original(error)

    original = entry.exit_status_of
    out, err = io.StringIO(), io.StringIO()
    signal.signal(signal.SIGALRM, stop)
    signal.alarm(LONGEST_S)
    try:
        with (
            monkeypatch.context() as context,
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            context.chdir(folder)
            context.setattr(entry, "exit_status_of", remembered)
            code = entry.main(arguments)
    finally:
        signal.alarm(0)
    assert code in (0, 1, 2)
    for error in errors:
        check_error(error)
    assert "defect of palpate" not in out.getvalue() + err.getvalue()
    if code == 2:
        as_json = out.getvalue().startswith('{"error"')
        sentence = json.loads(out.getvalue())["error"] if as_json else err.getvalue().splitlines()[-1]
        assert is_one_sentence(sentence), sentence
