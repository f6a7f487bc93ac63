# SPDX-License-Identifier: Apache-2.0
"""Measures Python calls in alternating order, and writes the durations in Google Benchmark's format."""

from __future__ import annotations

import os
import platform
import re
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from bench.studies import SCALE, commit, write_json

REPETITIONS = 9
"""Number of measured blocks of each call; the blocks of all calls alternate, so load affects all."""


def scaled(seconds: float) -> float:
    """Returns a duration multiplied by SCALE, so that a quick test measures for less time."""
    return seconds * SCALE


def timed(
    calls: Mapping[str, Callable[[], object]],
    block_s: float,
    clock: Callable[[], int] = time.perf_counter_ns,
) -> dict[str, list[float]]:
    """Returns the nanoseconds of each call, once for each block of about block_s seconds.

    The clock is wall time, for calls that use several processors, or time.process_time_ns.
    """
    n_calls = {name: _count(call, block_s, clock) for name, call in calls.items()}
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(REPETITIONS):
        for name, call in calls.items():
            times[name].append(_nanoseconds(call, n_calls[name], clock))
    return times


def _count(call: Callable[[], object], block_s: float, clock: Callable[[], int]) -> int:
    n_calls = 1
    while True:
        seconds = 1e-9 * _nanoseconds(call, n_calls, clock) * n_calls
        if seconds >= 0.5 * block_s:
            return n_calls
        n_calls = max(2 * n_calls, int(n_calls * block_s / max(seconds, 1e-9) / 2))


def _nanoseconds(call: Callable[[], object], n_calls: int, clock: Callable[[], int]) -> float:
    rounds = range(n_calls)
    start = clock()
    for _ in rounds:
        call()
    return (clock() - start) / n_calls


def result_row(name: str, nanoseconds: float, **counters: float) -> dict[str, Any]:
    """Returns one measured duration and its counters as a row in the format of Google Benchmark."""
    return {
        "name": name,
        "run_name": name,
        "run_type": "iteration",
        "cpu_time": nanoseconds,
        "time_unit": "ns",
        **counters,
    }


def write_results(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Writes the measured repetitions to a file in the format of Google Benchmark."""
    write_json(path, {"context": _context(), "benchmarks": list(rows)})


def _context() -> dict[str, Any]:
    try:
        processor = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        processor = ""
    clock = re.search(r"cpu MHz\s*: *(\d+)", processor)
    model = re.search(r"model name\s*: *(.+)", processor)
    return {
        "processor": model[1] if model else platform.machine(),
        "date": datetime.now().astimezone().isoformat(timespec="seconds"),
        "num_cpus": os.cpu_count(),
        "mhz_per_cpu": int(clock[1]) if clock else 0,
        "caches": [],
        "commit": commit(),
        "versions": f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}",
    }
