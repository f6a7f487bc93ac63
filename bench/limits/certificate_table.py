# SPDX-License-Identifier: Apache-2.0
"""Writes the table of measured over certified bounds into FOLDER/certificate.md.

build/release/bench/certificate_search 65 > search.txt
python bench/limits/certificate_table.py search.txt --to docs
"""

import argparse
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import fill_tables, markdown_table

DELAYS = ("0.00", "0.25", "0.50", "1.00", "1.30", "2.00")
ROW = re.compile(
    r"^(?P<line>[a-z-]+) +(?P<scenes>\S.*?) +(?P<delay>\d\.\d\d) +(?P<number>\d+) +(?P<median>\d\.\d+) +"
    r"(?P<worst>\d\.\d+) +(?P<found>\d+)",
    re.MULTILINE,
)


def table_of(search_output: str) -> str:
    """Returns the printed results of the energy search as Markdown table, and the number of its cases."""
    by_line: dict[tuple[str, str], dict[str, re.Match[str]]] = {}
    scenes = 0
    for row in ROW.finditer(search_output):
        by_line.setdefault((row["line"], row["scenes"]), {})[row["delay"]] = row
        scenes += int(row["number"])
    header = ["line", "scenes", *(f"delay {float(delay):g}" for delay in DELAYS), "found at 0.95"]
    rows = []
    for (line, name), rows_by_delay in by_line.items():
        reference_row = rows_by_delay.get(DELAYS[0]) or rows_by_delay["1.00"]
        cells = [
            f"{rows_by_delay[delay]['median']} / {rows_by_delay[delay]['worst']}"
            if delay in rows_by_delay
            else "–"
            for delay in DELAYS
        ]
        rows.append([f"`{line}`", name, *cells, f"{reference_row['found']} of {reference_row['number']}"])
    return (
        f"{markdown_table(header, rows)}\nOf {scenes} certified scenes, {search_output.splitlines()[-1]}.\n"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("printed", type=Path, help="output of certificate_search")
    parser.add_argument("--to", type=Path, required=True, help="folder of the page")
    options = parser.parse_args()
    table = table_of(options.printed.read_text(encoding="utf-8"))
    fill_tables(options.to / "certificate.md", {"search": table})


if __name__ == "__main__":
    main()
