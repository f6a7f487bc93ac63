# SPDX-License-Identifier: Apache-2.0
"""Reads the JSON files of `make bench` and computes the median of each benchmark."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from statistics import median
from typing import Any

NANOSECONDS = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}

Row = Mapping[str, Any]


class BenchmarkResults:
    """One file of Google Benchmark; every number is the median over the repetitions.

    Raises
    ------
    SystemExit
        The file is missing or has another format, or the result of a benchmark was wrong.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.path = folder / f"{name}.json"
        try:
            content = json.loads(self.path.read_text(encoding="utf-8"))
            self.context: Row = content["context"]
            rows: list[Row] = content["benchmarks"]
        except FileNotFoundError:
            raise SystemExit(f"{self.path} does not exist; make bench writes it") from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise SystemExit(
                f"{self.path} is not JSON output of Google Benchmark ({error}); make bench writes it"
            ) from None
        repetitions: dict[str, list[Row]] = {}
        for row in rows:
            if row.get("error_occurred"):
                raise SystemExit(
                    f"{self.path}: {row['name']} gave a wrong result ({row.get('error_message')}); "
                    "only correct results are drawn"
                )
            if row.get("run_type", "iteration") == "iteration":
                repetitions.setdefault(str(row.get("run_name", row["name"])), []).append(row)
        self.rows: list[Row] = [
            {**rows[0], **_medians(rows), "name": name} for name, rows in repetitions.items()
        ]
        # Repetitions of different benchmarks are mixed in the file, so the rows are sorted by benchmark.
        self.rows.sort(key=lambda row: (row.get("family_index", 0), row.get("per_family_instance_index", 0)))

    def number(self, row: Row, key: str) -> float:
        """Returns the number with the name `key` in the result of one benchmark."""
        value = row.get(key)
        if not isinstance(value, (int, float)):
            raise SystemExit(f"{self.path}: {row.get('name')} lacks the number {key}; run make bench again")
        return float(value)

    def of(self, benchmark: str) -> list[Row]:
        """Returns the results of one benchmark for all its arguments, in the order of the file."""
        rows = [row for row in self.rows if str(row["name"]).split("/")[0] == benchmark]
        if not rows:
            raise SystemExit(f"{self.path} lacks the benchmark {benchmark}; run make bench again")
        return rows

    def where(self) -> str:
        """Returns machine, date, compiler and commit of the benchmark run as one line."""
        context = self.context
        cache = ", ".join(
            f"L{each['level']} {each['size'] // 1024} KiB"
            for each in context.get("caches", ())
            if each.get("type") != "Instruction"
        )
        context_keys = ("processor", "compiler", "flags", "versions")
        parts = [
            f"{context.get('num_cpus')} cores at {context.get('mhz_per_cpu')} MHz"
            + (f" ({cache})" if cache else ""),
            str(context.get("date", ""))[:10],
            *(f"{key} {context[key]}".replace("_", " ") for key in context_keys if key in context),
            f"commit {context.get('commit', 'unknown')}",
        ]
        return "; ".join(parts)


def nanoseconds(row: Row) -> float:
    """Returns the processor time of one iteration of a benchmark [ns]."""
    return float(row["cpu_time"]) * NANOSECONDS.get(str(row.get("time_unit", "ns")), 1.0)


def arguments(row: Row) -> dict[str, float]:
    """Returns the arguments in a benchmark's name, such as {"wavelets": 16} for NAME/wavelets:16."""
    pairs = (part.split(":") for part in str(row["name"]).split("/")[1:] if ":" in part)
    return {name: float(value) for name, value in pairs}


def _medians(rows: list[Row]) -> dict[str, float]:
    numbers = [key for key, value in rows[0].items() if isinstance(value, (int, float))]
    return {
        key: median(float(row[key]) for row in rows) for key in numbers if all(key in row for row in rows)
    }
