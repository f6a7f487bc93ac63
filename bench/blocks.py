# SPDX-License-Identifier: Apache-2.0
"""Times of Python calls in alternating blocks, written as Google Benchmark writes its own."""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import scipy

REPETITIONS = 9
"""Blocks of each call; what the machine does meanwhile happens to all of them."""


def scaled(seconds: float) -> float:
    """A duration for PALPATE_BENCH_SCALE."""
    return seconds * float(os.environ.get("PALPATE_BENCH_SCALE", "1"))


def timed(
    calls: Mapping[str, Callable[[], object]],
    block_s: float,
    clock: Callable[[], int] = time.perf_counter_ns,
) -> dict[str, list[float]]:
    """Nanoseconds of each call, once for each block of about block_s seconds.

    The clock is that of the wall, for calls that work on several processors, or time.process_time_ns.
    """
    counts = {name: _count(call, block_s, clock) for name, call in calls.items()}
    found: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(REPETITIONS):
        for name, call in calls.items():
            found[name].append(_nanoseconds(call, counts[name], clock))
    return found


def _count(call: Callable[[], object], block_s: float, clock: Callable[[], int]) -> int:
    count = 1
    while True:
        seconds = 1e-9 * _nanoseconds(call, count, clock) * count
        if seconds >= 0.5 * block_s:
            return count
        count = max(2 * count, int(count * block_s / max(seconds, 1e-9) / 2))


def _nanoseconds(call: Callable[[], object], count: int, clock: Callable[[], int]) -> float:
    rounds = range(count)
    start = clock()
    for _ in rounds:
        call()
    return (clock() - start) / count


def row(name: str, nanoseconds: float, **counters: float) -> dict[str, Any]:
    """One repetition as Google Benchmark writes it."""
    return {
        "name": name,
        "run_name": name,
        "run_type": "iteration",
        "cpu_time": nanoseconds,
        "time_unit": "ns",
        **counters,
    }


def write_results(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """A file that stands beside those of Google Benchmark."""
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"context": _context(), "benchmarks": list(rows)}
    path.write_text(json.dumps(content, indent=1), encoding="utf-8")


def _context() -> dict[str, Any]:
    try:
        processor = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        processor = ""
    clock = re.search(r"cpu MHz\s*: *(\d+)", processor)
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    )
    model = re.search(r"model name\s*: *(.+)", processor)
    return {
        "processor": model[1] if model else platform.machine(),
        "date": datetime.now().astimezone().isoformat(timespec="seconds"),
        "num_cpus": os.cpu_count(),
        "mhz_per_cpu": int(clock[1]) if clock else 0,
        "caches": [],
        "commit": commit.stdout.strip() or "unknown",
        "versions": f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}",
    }
