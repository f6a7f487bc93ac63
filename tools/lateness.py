# SPDX-License-Identifier: Apache-2.0
"""Compares the wake-up latency of palpate-control and cyclictest on one machine with the same priority.

Blocks of both programs alternate, on an idle machine and with every core loaded, so other load affects both.
Prints the medians over the blocks of p99 and p99.9, and their ratio.

python tools/lateness.py PALPATE-CONTROL MODEL.json OUT.json [--seconds 20] [--blocks 10]
"""

import argparse
import json
import math
import os
import platform
import re
import statistics
import subprocess
import sys
from pathlib import Path

PRIORITY = 80
RATE_HZ = 1000


def lateness_of_palpate(program: Path, model: Path, seconds: float, cpu: int) -> dict[str, float]:
    command = [program, model, "--json", "--duration-s", f"{seconds}", "--rate-hz", f"{RATE_HZ}"]
    command += ["--priority", f"{PRIORITY}", "--cpu", f"{cpu}", "--lowest-rate-share", "0"]
    completed = subprocess.run(command, capture_output=True, text=True, check=True)
    summary = json.loads(completed.stdout)
    if summary["without"]:
        sys.exit(f"not comparable without privileges: {summary['without'][0]}")
    return {key: summary["lateness"][key] for key in ("p99_us", "p999_us")}


def lateness_of_cyclictest(seconds: float, cpu: int) -> dict[str, float]:
    # cyclictest prints every wake-up: its histogram ends at 1 ms, and a virtual machine can wake up later
    command = ["cyclictest", "-v", "-m", "-N", "-t", "1", "-a", f"{cpu}", "-p", f"{PRIORITY}"]
    command += ["-i", f"{10**6 // RATE_HZ}", "-l", f"{round(seconds * RATE_HZ)}"]
    completed = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = re.findall(r"^ *0: *\d+: *(\d+)$", completed.stdout, re.MULTILINE)
    lateness_us = sorted(1e-3 * int(latency_ns) for latency_ns in lines)
    return {"p99_us": quantile(lateness_us, 0.99), "p999_us": quantile(lateness_us, 0.999)}


def quantile(ascending: list[float], share: float) -> float:
    """Returns a quantile: the smallest value that at least this share of all values does not exceed."""
    return ascending[math.ceil(share * len(ascending)) - 1]


def load() -> list[subprocess.Popen[bytes]]:
    """Loads the machine: starts and returns one busy process for every core."""
    return [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in os.sched_getaffinity(0)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("model", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--seconds", type=float, default=20.0, help="length of a block")
    parser.add_argument(
        "--blocks",
        type=int,
        default=10,
        help="number of blocks for each program and each load of the machine",
    )
    options = parser.parse_args()
    cpu = max(os.sched_getaffinity(0))
    result: dict[str, object] = {"machine": platform.platform(), "priority": PRIORITY, "rate_hz": RATE_HZ}
    result |= {"seconds": options.seconds, "blocks": options.blocks}
    print(
        f"{'':8}{'':8}{'palpate':>10}{'cyclictest':>12}{'ratio':>8}   (us, median of {options.blocks} blocks)"
    )
    for state in ("idle", "loaded"):
        busy = load() if state == "loaded" else []
        blocks: dict[str, list[dict[str, float]]] = {"palpate-control": [], "cyclictest": []}
        try:
            for _ in range(options.blocks):
                blocks["palpate-control"].append(
                    lateness_of_palpate(options.program, options.model, options.seconds, cpu)
                )
                blocks["cyclictest"].append(lateness_of_cyclictest(options.seconds, cpu))
        finally:
            for process in busy:
                process.kill()
                process.wait()
        result[state] = blocks
        for key, name in (("p99_us", "p99"), ("p999_us", "p99.9")):
            palpate, other = (
                statistics.median(block[key] for block in blocks[program]) for program in blocks
            )
            result[f"{state}_{name}_ratio"] = palpate / other
            print(f"{state:8}{name:8}{palpate:10.2f}{other:12.2f}{palpate / other:8.2f}")
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
