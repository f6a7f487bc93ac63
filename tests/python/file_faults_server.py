# SPDX-License-Identifier: Apache-2.0
"""Starts each verb as a copy of this program, because a new Python needs seconds to import.

Reads one JSON list of requests from each line of standard input and prints the list of exit codes.
"""

import ctypes
import importlib
import json
import os
import sys
from typing import Any

from palpate.cli.main import main

SLOW = ["matplotlib.figure", "mcap.writer", "palpate.cli.figures", "palpate.plotting", "pandas"]
if os.environ.get("PALPATE_TEST_SCALE", "1") != "1":  # verbs that make test does not run to their end
    SLOW += ["bokeh.plotting", "palpate.export.fmu", "scipy.interpolate", "scipy.ndimage", "scipy.signal"]
for name in SLOW:
    importlib.import_module(name)


def run(request: dict[str, Any]) -> int:
    """Runs a verb in this process, whose calls are then watched."""
    os.chdir(request["folder"])
    os.umask(request["umask"])
    messages = os.open(request["messages"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    for stream in (1, 2):
        os.dup2(messages, stream)
    sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
    texts = [request[name].encode() for name in ("folder", "log", "states", "only")]
    numbers = [ctypes.c_long(request[name]) for name in ("kill_at", "fail_at")]
    ctypes.CDLL(None).arm_file_faults(*texts, *numbers, request["error"])
    code = main(request["arguments"])
    sys.stdout.flush()
    sys.stderr.flush()
    return code


for line in sys.stdin:
    started = []
    for given in json.loads(line):
        child = os.fork()
        if child == 0:
            os._exit(run(given))
        started.append(child)
    print(json.dumps([os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in started]), flush=True)
