# SPDX-License-Identifier: Apache-2.0
"""Writes the example output in README.md and docs/, or checks that the programs still print it.

python tools/example_output.py [--check]

A comment `<!-- output: COMMAND -->` before a text block names the command that prints it. The commands of a
page run in one empty folder, in their order. The check compares words exactly and numbers within 5 %;
durations are not compared.
"""

import argparse
import math
import re
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
BLOCK = re.compile(
    r"(<!-- output: (?P<command>[^\n]+) -->\n```text\n)(?P<text>.*?)(?=^```$)", re.DOTALL | re.MULTILINE
)
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
DURATION = re.compile(r"\d+(?:\.\d+)? s$", re.MULTILINE)


def output_of(command: str, folder: str) -> str:
    """Runs shell commands that are joined by &&; returns the standard output of the last command."""
    programs = Path(sysconfig.get_path("scripts"))
    text = ""
    for part in command.split(" && "):
        arguments = shlex.split(part)
        completed = subprocess.run(
            [programs / arguments[0], *arguments[1:]], cwd=folder, capture_output=True, text=True, check=False
        )
        if completed.returncode != 0:
            raise SystemExit(f"{part}: {completed.stdout}{completed.stderr}")
        text = completed.stdout
    return text


def agree(written: str, printed: str) -> bool:
    """Returns true if two outputs have equal words and if their numbers differ by at most 5 %."""
    written, printed = (DURATION.sub("T s", text) for text in (written, printed))
    if NUMBER.sub("0", written) != NUMBER.sub("0", printed):
        return False
    pairs = zip(NUMBER.findall(written), NUMBER.findall(printed), strict=True)
    return all(math.isclose(float(old), float(new), rel_tol=0.05) for old, new in pairs)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change no file, fail if a block differs")
    check = parser.parse_args().check
    n_different = 0
    for page in PAGES:
        content = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            for block in BLOCK.finditer(content):
                printed = output_of(block["command"], folder)
                if agree(block["text"], printed):
                    continue
                n_different += 1
                content = content.replace(block[0], block[1] + printed)
                verb = "differs from" if check else "now has"
                print(f"{page.relative_to(ROOT)}: {verb} the output of: {block['command']}", file=sys.stderr)
        if not check:
            page.write_text(content, encoding="utf-8")
    return 1 if check and n_different else 0


if __name__ == "__main__":
    sys.exit(main())
