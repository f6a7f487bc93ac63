# SPDX-License-Identifier: Apache-2.0
"""Writes the first inputs of the fuzz targets, tests/fuzz/seeds. Those of model files are in tests/models."""

import json
import struct
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SEEDS = Path(__file__).parent / "seeds"
GOOD = ROOT / "tests" / "models" / "good"
sys.path.insert(0, str(ROOT / "python"))

from palpate.planning.device_profile import DeviceProfile, example_profiles  # noqa: E402

INFO = struct.pack("<2sHIiHHIBBBBQ", b"I\x01", 256, 65536, 5_000_000, 1000, 20, 3, 32, 16, 1, 0, 7)
DEVICE_MODEL = struct.pack("<QQII", 1, 2, 10_000, 1)
FORCE = {"x": 0.0, "y": 0.0, "z": 1.5}


def write(target: str, name: str, content: bytes) -> None:
    folder = SEEDS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)


def packets() -> bytes:
    """A device and its model, then three packets, a command between them, and a fragment."""
    stream = INFO + DEVICE_MODEL + struct.pack("<I", 5_000_000)
    for number in range(3):
        packet = struct.pack("<IIiiHHHHi", 1000 * number, 40 * number, 200, -7000, 1, number, 500, 253, 90)
        stream += struct.pack("<IB", 1_000_000, 0) + b"H\x01" + struct.pack("<H", number) + packet[:28]
        stream += struct.pack("<IBdH", 1000, 2, 0.25, 10)
    return stream + struct.pack("<IBB", 1000, 1, 3) + b"H\x01\x02" + struct.pack("<IB", 0, 3)


def firmware(*, renders: bool) -> bytes:
    """A device that is enabled, commanded and read, until the watchdog, a fault and a bus reset."""
    request = struct.Struct("<BBHB")  # event 4: index of the request, value, not another recipient
    command = struct.pack("<BHiHB", 2, 1, 1234, 10, 0)
    tick = struct.pack("<BHiiii", 0, 1000, 900, 65, 10, 0)
    events = request.pack(4, 0, 1, 1) + (request.pack(4, 4, 1, 1) if renders else b"")
    events += command + 3 * tick + struct.pack("<BIiiii", 1, 60_000_000, 900, 65, 10, 0)
    events += command + tick + struct.pack("<BH", 7, 64) + tick + struct.pack("<BH", 7, 0)
    events += request.pack(4, 3, 0, 1) + command + tick + struct.pack("<B", 6) + tick
    return struct.pack("<BiHHIB", 3, 5_000_000, 20, 5, 0xFFFF_F000, 1) + events


def exported(kind: int) -> bytes:
    """Small steps about a start in the domain, a jump, and a position."""
    steps = b"".join(struct.pack("<Bb", 2 + 32 * (k % 4), (-1) ** k * (3 + k)) for k in range(40))
    return (
        struct.pack("<Bi", kind, 9000)
        + steps
        + struct.pack("<Bi", 0, -(2**31))
        + struct.pack("<Bbd", 1, 2, 0.25)
    )


def main() -> None:
    for name in ("certificate_hysteresis", "certificate_massless", "plan_and_certificate", "plan_network"):
        content = json.loads((GOOD / f"{name}.json").read_text(encoding="utf-8"))
        parts = {key: content[key] for key in ("plan", "certificate")}
        write("plan", f"{name}.json", json.dumps(parts).encode())
    for name, (file, _) in list(example_profiles().items())[:4]:
        content = DeviceProfile.load(file).to_dict()
        write("device_profile", name, struct.pack("<d", 10_000.0) + json.dumps(content).encode())
    write("packets", "stream", packets())
    write("firmware", "host", firmware(renders=False))
    write("firmware", "model", firmware(renders=True))
    for kind in range(24):
        write("exported_model", str(kind), exported(kind))
    state = {"cursor_position": FORCE, "cursor_velocity": FORCE, "current_cursor_force": FORCE}
    filters = {"force_gate": {"gain": 0.3}, "damping": {"scalar": 0.1, "vector": FORCE}}
    device = {
        "device_id": "049D",
        "config": {"type": "inverse3", "filters": filters},
        "state": state,
        "status": {"calibrated": True},
    }
    for name, identifier in {"state": "049D", "quotes_in_name": '0"\\\u2028'}.items():
        message = json.dumps({"session_id": 7, "inverse3": [{**device, "device_id": identifier}]})
        write("inverse3", name, struct.pack("<Bd", 2, 1.5) + message.encode())
    message = b"\x81\x7e" + struct.pack(">H", 200) + b"m" * 200
    parts = b"\x01\x03one" + b"\x89\x01?" + b"\x00\x00" + b"\x8a\x00" + b"\x80\x03two"
    longest = b"\x82\x7f" + struct.pack(">Q", 1 << 20) + b"m"
    for name, frames in {
        "messages": message + parts + b"\x88\x02\x03\xe8",
        "masked": parts + b"\x81\x81\x00\x00\x00\x00m",
        "longest": b"\x81\x02{}" + longest,
    }.items():
        write("web_socket", name, b"\x02" + frames)
    for name, line in {
        "rendering": "m.json --device simulated --rate-hz 1000 --structure massless --mass 0.1 --predict 3",
        "guards": "m.json --force-limit 2 --slew-s 0.1 --no-energy-account --tolerated-samples 3 --ramp-s=1",
        "running": "m.json --duration-s inf --record a.csv --fault lost@1x3 --telemetry-port 9870 --cpu -1",
        "help": "--help",
    }.items():
        write("control_options", name, line.replace(" ", "\n").encode())


if __name__ == "__main__":
    main()
