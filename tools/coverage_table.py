# SPDX-License-Identifier: Apache-2.0
"""Prints the table of tools/coverage.sh from its build folder: python tools/coverage_table.py BUILD."""

import json
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def folder_of(path: Path) -> str:
    """Returns the folder of a header below cpp/include/palpate, or of palpate-control."""
    parts = path.parts
    return parts[parts.index("palpate") + 1] if "include" in parts else parts[parts.index("cpp") + 1]


def add_lines(report: Path, table: dict[str, list[int]]) -> None:
    """Adds the lines of a report in the format of lcov: ``SF:file``, ``DA:line,executions``."""
    folder = ""
    for line in report.read_text().splitlines():
        kind, _, value = line.partition(":")
        if kind == "SF":
            folder = folder_of(Path(value))
        elif kind == "DA":
            table[folder][0] += value.split(",")[1] != "0"
            table[folder][1] += 1


def add_branches(report: Path, table: dict[str, list[int]]) -> list[str]:
    """Adds both values of each condition; returns one line for each value that no instance of a template has.

    The conditions of ``if constexpr`` are left out: the compiler evaluates them.
    """
    missed = []
    for file in json.loads(report.read_text())["data"][0]["files"]:
        path = Path(file["filename"])
        conditions: dict[tuple[int, ...], list[int]] = defaultdict(lambda: [0, 0])
        text = path.read_text().splitlines()
        for *place, true, false, _, _, _ in file["branches"]:
            if "if constexpr" not in text[place[0] - 1]:
                conditions[tuple(place)][0] += true
                conditions[tuple(place)][1] += false
        for place, counts in sorted(conditions.items()):
            table[folder_of(path)][2] += sum(count > 0 for count in counts)
            table[folder_of(path)][3] += 2
            for count, name in zip(counts, ("true", "false"), strict=True):
                if count == 0:
                    line, column, last, end = place
                    condition = text[line - 1][column - 1 : end - 1 if last == line else None]
                    missed.append(f"{path.name}:{line}:{column}: never {name}: {condition}")
    return missed


def main() -> None:
    build = Path(sys.argv[1])
    table: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    add_lines(build / "lines.lcov", table)
    missed = add_branches(build / "branches.json", table)
    (build / "missed.txt").write_text("\n".join(missed) + "\n")
    identification = build / "identification.json"
    if identification.exists():
        totals = json.loads(identification.read_text())["totals"]
        names = ("covered_lines", "num_statements", "covered_branches", "num_branches")
        table["identification"] = [totals[name] for name in names]
    table["all"] = [sum(column) for column in zip(*table.values(), strict=True)]
    for folder, (lines, all_lines, branches, all_branches) in sorted(table.items()):
        print(
            f"{folder:14} lines {lines:5d} of {all_lines:5d} {100 * lines / all_lines:5.1f} %   "
            f"branches {branches:5d} of {all_branches:5d} {100 * branches / max(all_branches, 1):5.1f} %"
        )


if __name__ == "__main__":
    main()
