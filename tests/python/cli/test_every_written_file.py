# SPDX-License-Identifier: Apache-2.0
"""Files of a program that is killed, or whose disk fails, at any call: each is absent, old, or complete.

The table contains every verb that writes, and palpate-control. file_faults.c counts the calls that change
files.
"""

from __future__ import annotations

import errno
import os
import random
import re
import shlex
import shutil
import signal
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest

from control_program import PROGRAM
from file_faults import Call, Ended, Fault, Programs
from models_by_hand import model_by_hand
from palpate import InputError, Recording, read_recording
from palpate.cli.completion import FileName
from palpate.cli.main import palpate as group

SHORT_LIVE = "--duration-s 0.35 --rate-hz 100 --lowest-rate-share 0"

CASES = {
    "identify": "identify a.csv -o out.json --plot p.png",
    "verify": "verify m.json a.csv --plot p.png --plot-closed-loop loop.png",
    "plan": "plan m.json --device bench-knob -o out.json --plot p.png",
    "simulate": "simulate m.json --duration-s 0.1 -o out.csv --plot p.png",
    "render": f"render m.json --record out.csv {SHORT_LIVE}",
    "record": f"record out.csv --object m.json {SHORT_LIVE}",
    "check-device": "check-device --duration-s 5 --push --write-profile out.toml",
    "show": "show a.csv --plot p.png --plot-frame frame.png",
    "report": "report m.json a.csv -o out.html",
    "export --c": "export m.json --c --uncertified --encoder-step 1e-4 --force-limit 2 -o out.h",
    "export --fmu": "export m.json --fmu -o out.fmu",
    "export --table": "export m.json --table -o out.csv",
    "export --schema": "export --schema -o out.json",
    "export --mcap": "export a.csv --mcap -o out.mcap",
    "demo": "demo -o demo",
    "palpate-control": f"{shlex.quote(str(PROGRAM))} m.json --record out.csv {SHORT_LIVE}",
}
"""Command lines that write every kind of output file"""

SLOW = {"check-device", "demo"}
"""Commands that take more than three seconds; fewer faults of them are tested."""

WITHOUT_FILES = {"app", "devices"}
"""Verbs that name no file to write. devices/test_udev.py tests the udev rule of devices."""

INPUTS = {
    "model_file", "recording_file", "recording_files", "file", "other_file", "object_file", "profile",
    "source", "identified_on", "fresh",
}  # fmt: skip
"""Parameters of verbs that name a file to read."""

RECORDING = {"simulate", "render", "record", "export --table", "export --mcap", "palpate-control"}
"""Commands whose out.csv or out.mcap is not replaced"""

WITH_FORCE = {"simulate", "render", "record", "palpate-control"}
"""Commands with the option --force, which replaces a recording"""

SAMPLE = {"export --c", "export --mcap", "palpate-control"}
"""Commands for `make test`: one for each way of writing. `make test-full` takes all."""

SAMPLE_OF_CALLS = {"plan", "export --mcap", "palpate-control"}
"""Commands for `make test` of every call: the plan writes two files, of which one is a figure."""

SCALE = int(os.environ.get("PALPATE_TEST_SCALE", "1"))

TEMPORARY = re.compile(r"\.[^/]+\.[0-9a-f]{16}\.tmp")

needs_control = pytest.mark.skipif(not PROGRAM.exists(), reason="needs palpate-control, run make control")


def cases(kept: Iterable[str], names: Iterable[str] = CASES) -> pytest.MarkDecorator:
    """Returns a test of these commands; `make test` runs those in `kept`."""
    marks = {
        name: [needs_control] * ("control" in name) + [pytest.mark.full] * (name not in kept)
        for name in names
    }
    parameters = [pytest.param(name, id=name.replace(" ", ""), marks=each) for name, each in marks.items()]
    return pytest.mark.parametrize("name", parameters)


every_case = cases(SAMPLE)
every_quick_case = cases(SAMPLE, sorted(CASES.keys() - SLOW))


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Programs]:
    with Programs(tmp_path_factory.mktemp("programs")) as started:
        yield started


def recording() -> Recording:
    time = np.arange(400) * 1e-3
    position = 0.25 - 0.25 * np.cos(2.0 * np.pi * 5.0 * time)
    units = {"position": "rad", "force": "N*m"}
    return Recording.from_arrays(position, model_by_hand().force(position), time, units=units)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Returns a folder with the input files of all commands."""
    made = tmp_path / "work"
    made.mkdir()
    recording().write(made / "a.csv")
    model_by_hand().save(made / "m.json")
    return made


def outputs_of(name: str) -> list[str]:
    """Returns the output files that the command line names."""
    return [word for word in shlex.split(CASES[name]) if re.fullmatch(r"(out|p|loop|frame)\.\w+", word)]


def put_old_outputs(name: str, folder: Path) -> None:
    for each in outputs_of(name):
        (folder / each).write_text("old\n", encoding="utf-8")


def run(
    programs: Programs, name: str, folder: Path, fault: Fault | None = None, *, force: bool = False
) -> Ended:
    command = CASES[name] + (" --force" if force and name in WITH_FORCE else "")
    if name == "palpate-control":
        return programs.program(shlex.split(command), folder, fault)
    return programs.verb(command, folder, fault)


def files_in(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


def require_readable_part(path: Path) -> None:
    """Requires that all complete rows of an unfinished recording are read, and that the rest is counted."""
    lines = path.read_bytes().rpartition(b"\n")[0].splitlines()
    rows = [line for line in lines if not line.startswith(b"#")][1:]
    usable = sum(line.endswith(b",Ok") for line in rows)
    if usable < 10:
        with pytest.raises(InputError, match=path.name):
            read_recording(path)
        return
    found = read_recording(path)
    assert len(found) == usable
    if not path.read_bytes().endswith(b"\n"):
        assert any("the last line" in note or "incomplete" in note for note in found.notes), found.notes


ENDS = {
    ".png": b"IEND\xaeB`\x82", ".html": b"</html>", ".h": b"#endif /*", ".mcap": b"\x89MCAP0", ".json": b"}",
    ".toml": b"", ".csv": b"\n", ".fmu": b"",
}  # fmt: skip
"""Part of the last line of a complete file, by the suffix of its name"""


def is_complete(name: str, content: bytes) -> bool:
    """Returns True if a file of this name ends as a complete one does, and is not an unfinished recording."""
    last = content.rstrip().rpartition(b"\n")[2] + b"\n"
    return ENDS[Path(name).suffix] in last and content[-1:] != b"" and b"not yet" not in content[:4096]


def require_safe(
    folder: Path, inputs: dict[str, bytes], old: dict[str, bytes], new: dict[str, bytes] | None
) -> None:
    """Requires that each file is an unchanged input, an old or a complete output, or a known leftover.

    Parameters
    ----------
    new : dict, optional
        The complete outputs; None: an output is complete if it ends as its format requires.
    """
    found = files_in(folder)
    assert {name: found.get(name) for name in inputs} == inputs
    assert old.keys() <= found.keys(), "an old file has gone"
    for name, content in found.items():
        if name in inputs or content == old.get(name):
            continue
        if name.endswith(".part"):
            require_readable_part(folder / name)
        elif not TEMPORARY.fullmatch(Path(name).name):
            assert content == new.get(name) if new is not None else is_complete(name, content), name


def require_done(name: str, ended: Ended) -> None:
    # check-device measures in real time; a busy machine may miss ticks, which gives the verdict no.
    assert ended.code == 0 or (name == "check-device" and ended.code == 1), ended.messages


def leftovers(folder: Path) -> set[str]:
    """Returns the kinds of temporary files and unfinished recordings in a folder."""
    names = {path.name for path in folder.rglob("*")}
    return {
        TEMPORARY.sub("temporary", name)
        for name in names
        if TEMPORARY.fullmatch(name) or name.endswith(".part")
    }


def require_order(calls: tuple[Call, ...]) -> None:
    """Requires that files are created safely, and are on the disk before and after they get their name."""
    created: set[str] = set()
    unsaved: set[str] = set()
    renamed = False
    for call in calls:
        if call.name == "open-new":
            created.add(call.file)
        elif call.name == "open":
            assert call.file in created, f"{call.file} is opened without O_EXCL and O_NOFOLLOW"
        elif call.name in ("write", "pwrite", "ftruncate"):
            unsaved.add(call.file)
        elif call.name == "fsync":
            unsaved.discard(call.file)
            renamed = renamed and call.file not in ("", "demo")
        elif call.name in ("rename", "link"):
            assert not unsaved, "a file gets its name before its content is on the disk"
            renamed = True
    assert not renamed, "the name of a file is not on the disk"


def test_the_table_contains_every_verb_and_every_option_that_writes_a_file() -> None:
    used = {word for command in CASES.values() for word in command.split()}
    for verb in group.list_commands(None):  # type: ignore[arg-type]
        command = group.get_command(None, verb)  # type: ignore[arg-type]
        assert command is not None
        outputs = [
            param for param in command.params if isinstance(param.type, FileName) and param.name not in INPUTS
        ]
        assert (verb in WITHOUT_FILES) == (not outputs), verb
        for param in outputs:
            assert any(each.split()[0] == verb for each in CASES.values()), verb
            assert param.param_type_name == "argument" or used & set(param.opts), f"{verb} {param.opts}"


@pytest.mark.parametrize("before", ["absent", "old"])
@cases(SAMPLE_OF_CALLS)
def test_at_every_call_each_file_is_absent_old_or_complete(
    programs: Programs, name: str, before: str, folder: Path, tmp_path: Path
) -> None:
    if before == "old" and (name == "demo" or (name in RECORDING and name not in WITH_FORCE)):
        pytest.skip("replaces no file")
    inputs = files_in(folder)
    if before == "old":
        put_old_outputs(name, folder)
    old = {each: content for each, content in files_in(folder).items() if each not in inputs}
    states = tmp_path / "states"
    ended = run(programs, name, folder, Fault(states=states), force=before == "old")
    require_done(name, ended)
    new = files_in(folder)
    assert new.keys() == inputs.keys() | set(outputs_of(name)) | {
        each for each in new if each.startswith("demo/")
    }
    require_order(ended.calls)
    seen: dict[str, Path] = {}
    for state in sorted(states.iterdir()):
        require_safe(state, inputs, old, new)
        seen.setdefault(" ".join(sorted(leftovers(state))), state)
    # The files of the killed run do not disturb a next run.
    for kind, state in seen.items():
        if not kind or (name in SLOW and SCALE == 1):
            continue
        left = [content for each, content in files_in(state).items() if each.endswith(".part") and content]
        again = run(programs, name, state, force=True)
        assert again.code == 0, f"{kind}: {again.messages}"
        after = files_in(state)
        assert all(content in after.values() for content in left), "an unfinished recording has gone"
        assert new.keys() <= after.keys()
        require_safe(state, inputs, {}, None)


def calls_to_fault(ended: Ended, name: str, seed: int) -> list[int]:
    """Returns numbers of calls: one at random, in the long run the first of every kind and many at random."""
    numbers = range(1, len(ended.calls) + 1)
    kinds = {call.name: number for number, call in zip(reversed(numbers), reversed(ended.calls), strict=True)}
    chosen = random.Random(f"{name} {seed}").sample(numbers, min(len(numbers), max(1, SCALE // 10)))
    return sorted({*chosen, *kinds.values()} if SCALE > 1 else chosen)


@cases(SAMPLE | {"render"}, sorted(CASES.keys() - SLOW))
def test_after_kill_each_file_is_old_or_complete(
    programs: Programs, name: str, folder: Path, tmp_path: Path
) -> None:
    inputs = files_in(folder)
    first = tmp_path / "first"
    shutil.copytree(folder, first)
    for number in calls_to_fault(run(programs, name, first), name, 1):
        work = tmp_path / f"kill-{number}"
        shutil.copytree(folder, work)
        if name in WITH_FORCE or name not in RECORDING:
            put_old_outputs(name, work)
        old = {each: content for each, content in files_in(work).items() if each not in inputs}
        ended = run(programs, name, work, Fault(kill_at=number), force=True)
        assert ended.code in (-signal.SIGKILL, 0), ended.messages  # 0: a live run that wrote in fewer steps
        require_safe(work, inputs, old, None)


ERRORS = {"write": errno.ENOSPC, "pwrite": errno.ENOSPC, "fsync": errno.EIO}
"""Error number of a failed call by its name; others fail with EACCES."""


def require_reported(
    ended: Ended, work: Path, name: str, inputs: dict[str, bytes], old: dict[str, bytes]
) -> None:
    """Requires one sentence about the failure and no file that is neither old nor complete."""
    assert ended.code in (0, 1, 2), ended.messages
    assert "Traceback" not in ended.messages
    assert "defect" not in ended.messages
    found = files_in(work)
    if ended.code != 0:
        assert re.search(r"^error: |incomplete|keeps the name", ended.messages, re.M), ended.messages
    elif "incomplete" not in ended.messages and "keeps the name" not in ended.messages:
        for each in outputs_of(name):
            assert found.get(each, b"") != old.get(each, b""), f"{each} is missing without a message"
    if "incomplete" not in ended.messages:
        require_safe(work, inputs, old, None)


@every_quick_case
def test_a_failed_call_is_reported(programs: Programs, name: str, folder: Path, tmp_path: Path) -> None:
    inputs = files_in(folder)
    first = tmp_path / "first"
    shutil.copytree(folder, first)
    ended = run(programs, name, first)
    for number in calls_to_fault(ended, name, 2):
        call = ended.calls[number - 1]
        work = tmp_path / f"fail-{number}"
        shutil.copytree(folder, work)
        error = ERRORS.get(call.name, errno.EACCES)
        failed = run(programs, name, work, Fault(fail_at=number, error=error), force=True)
        require_reported(failed, work, name, inputs, {})
        if call.name != "unlink" and name not in ("render", "record", "palpate-control"):
            assert not leftovers(work), f"{call}: {leftovers(work)}"


@cases(SAMPLE | SAMPLE_OF_CALLS, sorted(CASES.keys() - SLOW))
def test_a_full_disk_is_reported_and_keeps_old_files(programs: Programs, name: str, folder: Path) -> None:
    inputs = files_in(folder)
    if name in WITH_FORCE or name not in RECORDING:
        put_old_outputs(name, folder)
    old = {each: content for each, content in files_in(folder).items() if each not in inputs}
    full = Fault(fail_at=-1, error=errno.ENOSPC, only="write")
    ended = run(programs, name, folder, full, force=True)
    assert ended.code in (1, 2), ended.messages
    assert "No space left on device" in ended.messages
    assert files_in(folder) == inputs | old


@every_case
def test_a_read_only_folder_is_refused_before_anything_is_computed(
    programs: Programs, name: str, folder: Path
) -> None:
    before = files_in(folder)
    ended = run(programs, name, folder, Fault(fail_at=-1, error=errno.EROFS))
    assert ended.code == 2, ended.messages
    assert "Read-only file system" in ended.messages
    assert len(ended.messages.splitlines()) <= 2, ended.messages
    assert files_in(folder) == before


@pytest.mark.parametrize("umask", [0o077] if SCALE == 1 else [0o077, 0o002, 0o027])
@every_quick_case
def test_new_files_follow_the_umask_and_replaced_files_keep_mode_and_link(
    programs: Programs, name: str, umask: int, folder: Path
) -> None:
    ended = run(programs, name, folder, Fault(umask=umask))
    assert ended.code == 0, ended.messages
    for each in outputs_of(name):
        assert stat.S_IMODE((folder / each).stat().st_mode) == 0o666 & ~umask
    if name in RECORDING and name not in WITH_FORCE:
        return
    store = folder / "store"
    store.mkdir()
    for each in outputs_of(name):
        (folder / each).rename(store / each)
        (store / each).chmod(0o640)
        (folder / each).symlink_to(store / each)
    first = files_in(store)
    ended = run(programs, name, folder, Fault(umask=umask), force=True)
    assert ended.code == 0, ended.messages
    for each in outputs_of(name):
        assert (folder / each).is_symlink()
        assert stat.S_IMODE((store / each).stat().st_mode) == 0o640
        assert is_complete(each, (store / each).read_bytes())
    assert files_in(store).keys() == first.keys()


@every_quick_case
def test_two_writers_of_one_output_leave_one_complete_file(
    programs: Programs, name: str, folder: Path
) -> None:
    if name == "palpate-control":
        pytest.skip("tested in control/test_control_record.py")
    inputs = files_in(folder)
    both = programs.verbs([CASES[name]] * 2, folder)
    assert sorted(ended.code for ended in both)[0] == 0, both
    for ended in both:
        assert ended.code in (0, 2), ended.messages
        if ended.code == 2:
            assert re.search("exists already|being written by another run|created by another", ended.messages)
    require_safe(folder, inputs, {}, None)
    assert files_in(folder).keys() == inputs.keys() | set(outputs_of(name))


def spellings(folder: Path, target: str, name: str) -> Iterator[str]:
    """Yields other names of an input file that end as the name of the output does."""
    (folder / "sub").mkdir()
    kind = Path(name).suffix
    (folder / f"link{kind}").symlink_to(folder / target)
    os.link(folder / target, folder / f"hard{kind}")
    yield from (f"link{kind}", f"hard{kind}")
    if Path(target).suffix == kind:
        yield from (target, f"sub/../{target}", str(folder / target))


@pytest.mark.parametrize("source", ["a.csv", "m.json"])
@every_quick_case
def test_no_input_is_overwritten_under_any_of_its_names(
    programs: Programs, name: str, source: str, folder: Path
) -> None:
    if source not in CASES[name].split():
        pytest.skip("is no input")
    inputs = files_in(folder)
    for output in outputs_of(name):
        for alias in spellings(folder, source, output):
            if name == "plan" and output == "out.json":
                continue  # a plan is stored in the model file
            command = CASES[name].replace(f" {output}", f" {alias}") + (
                " --force" if name in WITH_FORCE else ""
            )
            if name == "palpate-control":
                ended = programs.program(shlex.split(command), folder)
            else:
                ended = programs.verb(command, folder)
            assert ended.code == 2, f"{alias}: {ended.messages}"
            assert {each: content for each, content in files_in(folder).items() if each in inputs} == inputs
        for alias in ("sub", "link" + Path(output).suffix, "hard" + Path(output).suffix):
            path = folder / alias
            path.rmdir() if path.is_dir() else path.unlink()


@every_quick_case
def test_an_existing_recording_is_replaced_only_with_force(
    programs: Programs, name: str, folder: Path
) -> None:
    for output in outputs_of(name):
        if name in RECORDING and output.startswith("out."):
            (folder / output).write_text("old\n", encoding="utf-8")
            command = CASES[name]
        elif name in ("report", "export --c", "export --schema"):  # a slip: the name of a recording
            (folder / "press.csv").write_text("old\n", encoding="utf-8")
            command = CASES[name].replace(f" {output}", " press.csv")
        else:
            continue
        before = files_in(folder)
        if name == "palpate-control":
            ended = programs.program(shlex.split(command), folder)
        else:
            ended = programs.verb(command, folder)
        assert ended.code == 2, ended.messages
        assert files_in(folder) == before


@pytest.mark.parametrize("name", ["verify", "show"])
def test_two_results_with_one_name_are_refused(programs: Programs, name: str, folder: Path) -> None:
    first, second = outputs_of(name)
    (folder / "sub").mkdir()
    (folder / second).symlink_to(folder / first)
    for alias in (first, f"sub/../{first}", second):
        ended = programs.verb(CASES[name].replace(f" {second}", f" {alias}"), folder)
        assert ended.code == 2, f"{alias}: {ended.messages}"
        assert "two results have the same file name" in ended.messages
        assert not (folder / first).exists()
