# SPDX-License-Identifier: Apache-2.0
"""Runs the code of the Markdown pages, in the docs build and in the tests.

    python docs/builder/page_code.py PAGE.md FOLDER

All blocks of one page run in their order in one new folder, from which the folders of the repository can be
reached. Blocks of python share their variables, sh blocks run in bash, cpp blocks are compiled and run. A
comment before a block changes this:

    <!-- first: COMMAND -->      runs this command before the block and shows nothing of it
    <!-- not run: REASON -->     does not run the block; the tests count these blocks
    <!-- needs: PROGRAM... -->   runs the block only if these programs are installed
    <!-- virtual time: REASON --> runs palpate-control of the block with the clock of the tests, tests/clock
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import traceback
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import once

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests" / "clock"))
DOCS = ROOT / "docs"
PAGE_FOLDERS = ROOT / "build" / "docs" / "pages"
"""Folder of the folders in which the pages run"""
REPOSITORY_FOLDERS = ("bench", "build", "cpp", "docs", "examples", "tests")
"""Folders that a command of a page may name, as if it ran in the repository"""
_BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>first|not run|needs|virtual time): (?P<words>[^\n]+) -->\n)?"
    r"^```(?P<language>python|sh|cpp)\n(?P<code>.*?)^```\n",
    re.DOTALL | re.MULTILINE,
)


class Block(NamedTuple):
    """A block of code of a page."""

    line: int
    language: str
    code: str
    first: str
    """Command that runs before the block"""
    not_run: str
    """Reason for which the block is not run; empty if it is run"""
    needs: tuple[str, ...]
    """Programs without which the block is not run"""
    virtual_time: bool
    """True if palpate-control waits for an emulated device in virtual time, however busy the machine is"""
    end: int
    """Place behind the block in the text of the page"""


def blocks(text: str) -> Iterator[Block]:
    """Yields the blocks of python, sh and cpp code of a page."""
    for found in _BLOCK.finditer(text):
        mark, words = found["mark"], found["words"] or ""
        yield Block(
            text.count("\n", 0, found.start("code")),
            found["language"],
            found["code"],
            words if mark == "first" else "",
            words if mark == "not run" else "",
            tuple(words.split()) if mark == "needs" else (),
            mark == "virtual time",
            found.end(),
        )


def pages() -> list[Path]:
    """Returns the pages of docs/ that are written by hand."""
    made = {DOCS / "generated", DOCS / "gallery", DOCS / "builder"}
    return sorted(page for page in DOCS.rglob("*.md") if not made.intersection(page.parents))


def run_pages() -> dict[str, list[str]]:
    """Runs the code of every page that has changed; returns page -> output of each block."""
    found = {str(page.relative_to(DOCS).with_suffix("")): page for page in pages()}
    found = {name: page for name, page in found.items() if any_runs(page)}
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        outputs = pool.map(run_once, found.values())
        return dict(zip(found, outputs, strict=True))


def folder_of(page: Path) -> Path:
    """Returns the folder in which a page of the site runs."""
    return PAGE_FOLDERS / page.relative_to(DOCS).with_suffix("")


def run_once(page: Path) -> list[str]:
    """Returns the output of each block of a page of the site; runs the page only after a change."""
    folder = folder_of(page)
    outputs: list[str] = once.kept(
        folder.with_suffix(".json"), page.read_text(encoding="utf-8"), lambda: run_page(page, folder)
    )
    return outputs


def any_runs(page: Path) -> bool:
    """Returns true if a page has a block that is run."""
    return any(not block.not_run for block in blocks(page.read_text(encoding="utf-8")))


def run_page(page: Path, folder: Path) -> list[str]:
    """Runs the code of a page in a separate process; returns the output of each block.

    Raises
    ------
    SystemExit
        A block failed; the message names the page and the line of the block.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in REPOSITORY_FOLDERS:
        (folder / name).symlink_to(ROOT / name)
    programs = [sysconfig.get_path("scripts"), str(ROOT / "build" / "control"), os.environ["PATH"]]
    environment = {**os.environ, "PATH": os.pathsep.join(programs), "MPLBACKEND": "agg", "COLUMNS": "100"}
    command = [sys.executable, "-W", "error", __file__, str(page), str(folder)]
    completed = subprocess.run(
        command, capture_output=True, text=True, check=False, env=environment, timeout=600
    )
    if completed.returncode != 0:
        raise SystemExit(f"{page}: {completed.stderr}")
    outputs: list[str] = json.loads(completed.stdout)
    return outputs


def show_outputs(name: str, source: list[str], outputs: Mapping[str, list[str]]) -> None:
    """Inserts the output of each block behind the block in the source of a page."""
    text, shown, at = source[0], "", 0
    for block, output in zip(blocks(text), outputs.get(name, ()), strict=False):
        shown, at = shown + text[at : block.end], block.end
        # A page that has an example output in its source shows that output.
        if output.strip() and not text[at:].lstrip().startswith(("<!-- output", "Output of")):
            shown += f"\n```text\n{output.rstrip()}\n```\n"
    source[0] = shown + text[at:]


def _run(block: Block, folder: Path, variables: dict[str, object]) -> str:
    """Runs a block in the present folder; returns its output."""
    if block.not_run or any(shutil.which(program) is None for program in block.needs):
        return ""
    if block.first:
        _command(["bash", "-euo", "pipefail", "-c", block.first])
    if block.language == "sh":
        code = _virtual_time(folder) + block.code if block.virtual_time else block.code
        return _command(["bash", "-euo", "pipefail", "-c", code])
    if block.language == "cpp":
        source, program = folder / f"line_{block.line}.cpp", folder / f"line_{block.line}"
        source.write_text(block.code, encoding="utf-8")
        flags = ["-std=c++20", "-Wall", "-Wextra", "-Werror", "-pthread", "-I", str(ROOT / "cpp" / "include")]
        _command(["c++", *flags, str(source), "-o", str(program)])
        return _command([str(program)])
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(block.code, f"line {block.line}", "exec"), variables)
    return output.getvalue()


def _virtual_time(folder: Path) -> str:
    """Returns a command after which `palpate-control` runs in virtual time."""
    from host_clock import host_clock

    clock = host_clock()
    program = folder / "virtual" / "palpate-control"
    program.parent.mkdir(exist_ok=True)
    program.write_text(
        f"#!/bin/sh\nexport LD_PRELOAD={clock.name} LD_LIBRARY_PATH={shlex.quote(str(clock.parent))}\n"
        f'exec {shlex.quote(str(ROOT / "build" / "control" / "palpate-control"))} "$@"\n',
        encoding="utf-8",
    )
    program.chmod(0o755)
    return f'PATH={shlex.quote(str(program.parent))}:"$PATH"\n'


def _command(arguments: list[str]) -> str:
    completed = subprocess.run(arguments, capture_output=True, text=True, check=False)
    if completed.returncode != 0:
        raise RuntimeError(f"{arguments[-1]}\n{completed.stdout}{completed.stderr}")
    return completed.stdout


def main() -> int:
    page, folder = (Path(argument).resolve() for argument in sys.argv[1:])
    os.chdir(folder)
    variables: dict[str, object] = {"__name__": "__main__"}
    outputs = []
    for block in blocks(page.read_text(encoding="utf-8")):
        try:
            outputs.append(_run(block, folder, variables))
        except Exception:
            print(f"the block at line {block.line} failed:\n{traceback.format_exc()}", file=sys.stderr)
            return 1
    print(json.dumps(outputs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
