# SPDX-License-Identifier: Apache-2.0
"""How much of a benchmark is run, and how its numbers are left for the figures."""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

SCALE = float(os.environ.get("PALPATE_BENCH_SCALE", "1"))
"""1 for numbers that are published, 0.01 to see that everything runs."""


def count(full: int) -> int:
    """So many of a full run's draws or files, one at least."""
    return max(1, round(full * min(SCALE, 1.0)))


def leave(path: Path | None, results: Any) -> None:
    """Write results with machine and date, where a file is asked for."""
    if path is None:
        return
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    ).stdout.strip()
    where = {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}",
        "python": platform.python_version(),
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "commit": commit or "unknown",
        "scale": SCALE,
        "load": round(os.getloadavg()[0], 1),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"where": where, "results": results}, indent=1) + "\n", encoding="utf-8")
