# SPDX-License-Identifier: Apache-2.0
"""No verb and no run of palpate-control opens a network socket, except for the Inverse3, telemetry and `app`.

A filter of the kernel ends a program with SIGSYS when it calls socket() for IPv4 or IPv6. The filter also
holds for the threads and the child processes of the program.
"""

from __future__ import annotations

import ctypes
import platform
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from conftest import sampled
from control_program import MODEL, PROGRAM, needs_program
from models_by_hand import model_by_hand
from test_cli_identify import spring
from test_every_verb import VERBS
from usb_emulation import RUNNER, needs_emulation

SOCKET_CALL = {"x86_64": 41, "aarch64": 198}.get(platform.machine())
"""Number of the system call socket()"""

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or SOCKET_CALL is None, reason="needs the system calls of Linux on x86-64 or ARM"
)


def forbid_network() -> None:
    """Makes the kernel end this process and its children when they open a network socket."""
    load, equal, end = 0x20, 0x15, 0x06  # operations of the packet filter: load a word, compare, return
    allow, kill = 0x7FFF0000, 0x80000000
    first_argument = 16  # its place in the data of a system call
    filters = [
        (load, 0, 0, 0),
        (equal, 0, 4, SOCKET_CALL),
        (load, 0, 0, first_argument),
        (equal, 1, 0, int(socket.AF_INET)),
        (equal, 0, 1, int(socket.AF_INET6)),
        (end, 0, 0, kill),
        (end, 0, 0, allow),
    ]
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *each) for each in filters))
    program = ctypes.create_string_buffer(struct.pack("HxxxxxxP", len(filters), ctypes.addressof(code)))
    libc = ctypes.CDLL(None, use_errno=True)
    set_no_new_privileges, set_seccomp, filter_mode = 38, 22, 2
    if libc.prctl(set_no_new_privileges, 1, 0, 0, 0) or libc.prctl(set_seccomp, filter_mode, program, 0, 0):
        raise OSError(ctypes.get_errno(), "the kernel refuses the filter")


def run(command: Sequence[object], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        preexec_fn=forbid_network,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    spring(tmp_path / "a.csv")
    model_by_hand().save(tmp_path / "m.json")
    return tmp_path


@pytest.mark.parametrize("family", ["AF_INET", "AF_INET6"])
def test_the_filter_ends_a_program_that_opens_a_network_socket(family: str, tmp_path: Path) -> None:
    completed = run([sys.executable, "-c", f"import socket; socket.socket(socket.{family})"], tmp_path)
    assert completed.returncode == -signal.SIGSYS
    local = run([sys.executable, "-c", "import socket; socket.socket(socket.AF_UNIX)"], tmp_path)
    assert local.returncode == 0, local.stderr


VERBS_OF_A_PROCESS = {"identify, plan and render": ("identify", "plan", "render")}
VERBS_OF_A_PROCESS |= {verb: (verb,) for verb in sorted(VERBS.keys() - {"app"})}
"""Verbs that one process runs, one after the other"""

IN_ONE_PROCESS = """
import sys
from palpate.cli.main import main
for command in sys.argv[1:]:
    assert main(command.split()) in (0, 1), command
"""


@pytest.mark.parametrize("verbs", sampled(VERBS_OF_A_PROCESS, "identify, plan and render"))
def test_no_verb_opens_a_network_socket(verbs: str, folder: Path) -> None:
    commands = [VERBS[verb] for verb in VERBS_OF_A_PROCESS[verbs]]
    completed = run([sys.executable, "-c", IN_ONE_PROCESS, *commands], folder)
    assert completed.returncode == 0, (completed.returncode, completed.stdout, completed.stderr)
    assert "Traceback" not in completed.stderr


@needs_program
def test_palpate_control_opens_a_network_socket_only_for_telemetry(tmp_path: Path) -> None:
    command = [PROGRAM, MODEL, "--duration-s", "0.2", "--lowest-rate-share", "0", "--record", "out.csv"]
    completed = run(command, tmp_path)
    assert completed.returncode == 0, completed.stderr
    assert run([*command, "--force", "--telemetry-port", "9870"], tmp_path).returncode == -signal.SIGSYS


@needs_program
@needs_emulation
@pytest.mark.full
def test_palpate_control_opens_no_network_socket_with_a_usb_device(tmp_path: Path) -> None:
    command = [PROGRAM, MODEL, "--device", "usb", "--uncertified", "--duration-s", "0.2"]
    completed = run([sys.executable, RUNNER, "--lock-step", "--", *command], tmp_path)
    assert completed.returncode == 0, completed.stderr
