# SPDX-License-Identifier: Apache-2.0
"""Uses the installed package as a user does: try_wheel.py [--repaired]

Runs both programs of the environment of this Python, and searches for a USB device. With --repaired, libusb
must be the copy in the wheel. The last line is "ok".
"""

import importlib.metadata
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

SITE = Path(sysconfig.get_path("platlib"))


def program(name: str, *arguments: object, code: int = 0) -> str:
    """Runs an installed program, which must end with this exit code; returns all of its output."""
    path = Path(sysconfig.get_path("scripts")) / name
    command = [str(path), *map(str, arguments)]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    output = completed.stdout + completed.stderr
    assert completed.returncode == code, f"{command}: exit code {completed.returncode}\n{output}"
    return output


def libusb_of_this_process() -> set[Path]:
    """Returns the files of libusb that this process has loaded."""
    lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    return {Path(line.split(maxsplit=5)[5]) for line in lines if "libusb" in line}


def libusb_of_palpate_control() -> set[Path]:
    """Returns the files of libusb that the loader gives to the program in a repaired wheel."""
    command = ["ldd", str(SITE / "palpate.scripts" / "palpate-control")]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return {Path(line.split()[2]) for line in lines if "libusb" in line}


def main() -> None:
    version = importlib.metadata.version("palpate")
    for name in ("palpate", "palpate-control"):
        assert program(name, "--version") == f"{name} {version}\n"
        assert "xample" in program(name, "--help")
    with tempfile.TemporaryDirectory() as folder:
        demo = Path(folder) / "demo"
        assert program("palpate", "demo", "-o", demo).startswith("verdict: good")
        model = demo / "model.json"
        live = ["--duration-s", 0.5, "--uncertified"]
        any_rate = ["--lowest-rate-share", 0]
        assert "verdict:" in program("palpate-control", model, "--device", "simulated", *live, *any_rate)
        for name in (["palpate-control"], ["palpate", "render"]):
            output = program(*name, model, "--device", "usb", *live, code=2)
            assert "no USB device 1209:0001" in output, output
    assert "no haptic USB device is plugged in" in program("palpate", "devices")

    import palpate.devices.usb

    palpate.devices.usb.find_devices()
    if "--repaired" in sys.argv:
        for loaded in (libusb_of_this_process(), libusb_of_palpate_control()):
            assert loaded, "libusb is not loaded"
            assert all(path.resolve().parent == SITE.resolve() / "palpate.libs" for path in loaded), loaded
    print("ok")


if __name__ == "__main__":
    main()
