# SPDX-License-Identifier: Apache-2.0
"""Measures time and memory of `palpate show` and `palpate identify` for long recordings of every format.

python bench/identification/long_recordings.py [--rows 1e7] [--to docs]

The recordings are simulated. Excel holds at most 1 048 575 rows. Writes the table of
FOLDER/how-to/cluster.md. Takes about 10 minutes and 3 GB in the folder for temporary files.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import savemat

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import fill_tables, markdown_table

from palpate.recording.sample import sample_recording

EXCEL_ROWS = 1_048_575
"""Number of rows of a sheet below its header"""

LOOP = 0.15
"""Half of the hysteresis of the simulated object [N*m]"""

RUNS = {
    "show": ("show",),
    "identify": ("identify", "-o", "model.json"),
    "identify --out-of-core": ("identify", "-o", "model.json", "--out-of-core"),
}
IN_PARTS = (".csv", ".parquet")


STARTED = """
import os, sys
process = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
_, status, used = os.wait4(process, 0)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(status != 0)
"""
"""Program that runs a command and prints its processor time [s] and largest memory [KiB]"""


def simulated(rows: int) -> pd.DataFrame:
    """Returns time, position and force of a knob with a stop and hysteresis, recorded at 1 kHz."""
    recording = sample_recording(1, duration_s=rows / 1000.0)
    speed = np.gradient(recording.position)
    force = recording.force + LOOP * np.tanh(3.0 * speed / np.std(speed))
    return pd.DataFrame({"time_s": recording.time, "position_rad": recording.position, "force_Nm": force})


def write(frame: pd.DataFrame, path: Path) -> int:
    """Writes a recording in the format of the suffix; returns its number of rows."""
    columns = {str(name): frame[name].to_numpy() for name in frame}
    if path.suffix == ".csv":
        frame.to_csv(path, index=False)
    elif path.suffix == ".parquet":
        frame.to_parquet(path)
    elif path.suffix == ".npz":
        np.savez(path, **columns)  # type: ignore[arg-type]
    elif path.suffix == ".mat":
        savemat(path, dict(columns))
    else:
        frame = frame.head(EXCEL_ROWS)
        frame.to_excel(path, index=False)
    return len(frame)


def measured(verb: Sequence[str], path: Path) -> tuple[float, float, float]:
    """Runs a verb on a file; returns its duration [s], processor time [s] and largest memory [GB]."""
    command = [sys.executable, "-m", "palpate", verb[0], path.name, *verb[1:], "--quiet"]
    start = time.perf_counter()
    # A process counts the memory of the process that started it, so a small one starts the verb.
    started = [sys.executable, "-S", "-c", STARTED, *command]
    answer = subprocess.run(started, cwd=path.parent, stdout=subprocess.PIPE, text=True, check=True)
    seconds = time.perf_counter() - start
    processor_s, kilobytes = map(float, answer.stdout.split()[-2:])
    return seconds, processor_s, kilobytes * 1024 / 1e9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=float, default=1e7)
    parser.add_argument("--to", type=Path, metavar="FOLDER", help="write the table of how-to/cluster.md")
    given = parser.parse_args()
    to = given.to and given.to.resolve()
    frame = simulated(int(given.rows))
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for suffix in (".csv", ".parquet", ".npz", ".mat", ".xlsx"):
            path = Path(folder) / f"press{suffix}"
            rows = write(frame, path)
            for name, verb in RUNS.items():
                if "--out-of-core" in verb and suffix not in IN_PARTS:
                    continue
                seconds, processor_s, memory_gb = measured(verb, path)
                line = suffix, str(rows), f"`palpate {name}`", f"{processor_s:.0f} s", f"{memory_gb:.1f} GB"
                lines.append(line)
                print(*line, f"({seconds:.0f} s)", flush=True)
            path.unlink()
    table = markdown_table(("format", "rows", "command", "processor time", "memory"), lines, (0, 2))
    print(table)
    if to is not None:
        fill_tables(to / "how-to" / "cluster.md", {"long recordings": table})


if __name__ == "__main__":
    main()
