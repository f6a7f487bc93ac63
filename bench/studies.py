# SPDX-License-Identifier: Apache-2.0
"""Functions of all studies: scale of a run, JSON files with machine and date, tables of pages."""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate import __version__
from palpate.recording.files import replacing

ROOT = Path(__file__).parents[1]

SCALE = float(os.environ.get("PALPATE_BENCH_SCALE", "1"))
"""Factor of the numbers of draws and files of all studies: 1 for published results, 0.01 for a quick test"""


def count(full: int) -> int:
    """Returns a number of draws or files multiplied by SCALE, at least 1."""
    return max(1, round(full * min(SCALE, 1.0)))


def program(name: str) -> Path:
    """Returns the path of a program of the studies: optimized, or for a short run that of the C++ tests.

    Raises
    ------
    SystemExit
        The program is missing; the message names the command that builds it.
    """
    preset = "release" if SCALE >= 0.1 else "dev"
    path = ROOT / "build" / preset / "bench" / name
    if not path.exists():
        raise SystemExit(f"{path} does not exist: cmake --build --preset {preset} --target {name}")
    return path


def measured_data() -> Path | None:
    """Returns the folder of measured recordings; without one, prints that the study is skipped."""
    folder = Path(os.environ.get("PALPATE_DATA", ""))
    if "PALPATE_DATA" in os.environ and folder.is_dir():
        return folder
    print("skipped: needs measured data, set PALPATE_DATA")
    return None


def commit() -> str:
    """Returns the commit of this checkout, with "-dirty" if a file was changed."""
    answer = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return answer.stdout.strip() or "unknown"


def where() -> dict[str, Any]:
    """Returns machine, date and program versions, which are stored with measured results."""
    return {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}",
        "python": platform.python_version(),
        "palpate": __version__,
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "commit": commit(),
        "scale": SCALE,
        "load": round(os.getloadavg()[0], 1),
    }


def write_text(path: Path, text: str) -> None:
    """Replaces a file in one step; if an error occurs, the old file remains unchanged."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Writes a value to a JSON file."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def write_results(path: Path | None, results: Any) -> None:
    """Writes results with machine and date to a JSON file; does nothing if the path is None."""
    if path is not None:
        write_json(path, {"where": where(), "results": results})


def markdown_table(
    header: Sequence[str], rows: Sequence[Sequence[str]], text_columns: Sequence[int] = (0,)
) -> str:
    """Returns a Markdown table; all columns except `text_columns` are aligned right."""
    rule = ["---" if k in text_columns else "---:" for k in range(len(header))]
    return "".join(f"| {' | '.join(line)} |\n" for line in (header, rule, *rows))


def fill_tables(page: Path, tables: Mapping[str, str]) -> None:
    """Writes tables between the marks `<!-- NAME -->` and `<!-- end -->` of a page, if the page exists.

    Raises
    ------
    SystemExit
        A mark is missing.
    """
    if not page.exists():
        return
    text = page.read_text(encoding="utf-8")
    for name, table in tables.items():
        mark, end = f"<!-- {name} -->\n", "<!-- end -->\n"
        before, _, marked = text.partition(mark)
        _, found, after = marked.partition(end)
        if not found or mark in after:
            raise SystemExit(
                f"{page}: add '<!-- {name} -->' and '<!-- end -->', each on a separate line, around the table"
            )
        text = before + mark + table + end + after
    write_text(page, text)
    print(f"wrote the tables of {page}")
