# SPDX-License-Identifier: Apache-2.0
"""Writes the table of measured over certified bounds into docs/certificate.md.

build/release/bench/certificate_search 65 > search.txt; python bench/certificate_table.py search.txt
"""

import argparse
import re
import sys
from pathlib import Path

from palpate.cli.pages import markdown_table, with_tables, write_text

PAGE = Path(__file__).parents[1] / "docs" / "certificate.md"
DELAYS = ("0.00", "0.25", "0.50", "1.00", "1.30", "2.00")
ROW = re.compile(
    r"^(?P<line>[a-z-]+) +(?P<scenes>\S.*?) +(?P<delay>\d\.\d\d) +(?P<number>\d+) +(?P<median>\d\.\d+) +"
    r"(?P<worst>\d\.\d+) +(?P<found>\d+)",
    re.MULTILINE,
)


def table_of(printed: str) -> str:
    """The Markdown table of what the search printed, and how many scenes it tried."""
    by_line: dict[tuple[str, str], dict[str, re.Match[str]]] = {}
    scenes = 0
    for row in ROW.finditer(printed):
        by_line.setdefault((row["line"], row["scenes"]), {})[row["delay"]] = row
        scenes += int(row["number"])
    header = ["line", "scenes", *(f"delay {float(delay):g}" for delay in DELAYS), "found at 0.95"]
    rows = []
    for (line, name), found in by_line.items():
        first = found.get(DELAYS[0]) or found["1.00"]
        cells = [
            f"{found[delay]['median']} / {found[delay]['worst']}" if delay in found else "–"
            for delay in DELAYS
        ]
        rows.append([f"`{line}`", name, *cells, f"{first['found']} of {first['number']}"])
    return f"{markdown_table(header, rows)}\nOf {scenes} certified scenes, {printed.splitlines()[-1]}.\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("printed", type=Path, help="output of certificate_search")
    table = table_of(parser.parse_args().printed.read_text(encoding="utf-8"))
    write_text(PAGE, with_tables(PAGE.read_text(encoding="utf-8"), PAGE, {"search": table}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
