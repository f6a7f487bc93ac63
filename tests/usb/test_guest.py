# SPDX-License-Identifier: Apache-2.0
"""Tests palpate-control with the emulated device behind the USB stack of a real kernel, in a guest.

The clock of the guest is exact. `make test-full` includes these tests.
To run them alone: .venv/bin/python -m pytest tests/usb -s
"""

from __future__ import annotations

import io
import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import guest
from palpate import load_model
from palpate._core.rendering import Scheme
from palpate._core.simulation import Hand
from palpate.planning import DeviceProfile, Plan, force_at, simulate
from run_emulated import build_emulator

ROOT = Path(__file__).resolve().parents[2]
CONTROL = Path(os.environ.get("PALPATE_CONTROL", ROOT / "build" / "control" / "palpate-control"))
MODEL = ROOT / "bench" / "solvers" / "click_and_wall.json"
SPRING = ROOT / "tests" / "models" / "good" / "spring.json"
IS_LONG = int(os.environ.get("PALPATE_TEST_SCALE", "1")) >= 100
SWEEP_S = 2.0
DURATION_S = 30.0 if IS_LONG else 4.0
UNPLUGGED_TICK = 500
SLOW_TICK = 2000
DIRECT = "--uncertified --structure direct"
NO_RATE_LIMIT = "--uncertified --lowest-rate-share 0"

# Properties that the emulated device reports over USB or that follow from its packets; for mechanics and hand
# the default values apply.
STATED_PROPERTIES: dict[str, Any] = {"id": "EMU-1", "delay_s": 1.25e-3, "force_step": 1e-6}
DEVICE = DeviceProfile(**STATED_PROPERTIES)
# A certificate needs friction. The emulated device is frictionless, but these tests only check the refusals.
WITH_FRICTION = DeviceProfile(**STATED_PROPERTIES, coulomb_friction=1e-3)

RENDER_SCRIPT = """
name=$1
model=$2
shift 2
palpate-control /in/$model --device usb --record $name.csv --json "$@" > $name.json 2> $name.stderr
echo $? > $name.code
"""
FACTS_SCRIPT = """
cd $(dirname $(grep -l 1209 /sys/bus/usb/devices/*/idVendor))
for fact in manufacturer product serial speed 1-1:1.0/bInterfaceClass 1-1:1.0/ep_81/bInterval; do
    echo "$(basename $fact) $(cat $fact)" >> /out/facts
done
"""


@dataclass
class GuestRuns:
    """Files, console text and plan of the runs of palpate in the guest Linux."""

    output: guest.GuestOutput
    plan: Plan
    """Plan of the run `whole`"""

    def text(self, name: str) -> str:
        assert name in self.output.files, f"no {name} was returned\n{self.output.console[-3000:]}"
        return self.output.files[name]

    def summary(self, run: str) -> dict[str, Any]:
        text = self.text(f"{run}.json")
        assert text, self.text(f"{run}.stderr")
        summary: dict[str, Any] = json.loads(text)
        return summary

    def table(self, name: str) -> pd.DataFrame:
        return pd.read_csv(io.StringIO(self.text(name)), comment="#")


def usbip_emulator() -> Path:
    program = guest.CACHE / "usbip_emulator"
    build_emulator("usbip_emulator.cpp", program)
    return program


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> GuestRuns:
    missing = guest.missing() or ("" if CONTROL.exists() else "needs palpate-control, run make control")
    if missing:
        pytest.skip(missing)
    folder = tmp_path_factory.mktemp("guest")
    plan = Plan(load_model(MODEL), Scheme(structure="direct"))
    spring = Plan(load_model(SPRING), Scheme(structure="direct")).certified_for(WITH_FRICTION)
    assert spring.certificate is not None
    assert spring.certificate.certified, spring.certificate.reason
    spring.stored().save(folder / "spring.json")
    (folder / "render").write_text(RENDER_SCRIPT, encoding="utf-8")
    (folder / "facts").write_text(FACTS_SCRIPT, encoding="utf-8")
    emulator = "usbip_emulator"
    render = "sh /in/render"
    script = [
        f"{emulator} -- sh /in/facts",
        "sleep 1",
        f"{emulator} --trace whole.trace -- {render} whole {MODEL.name} --duration-s {DURATION_S} {DIRECT}",
        "sleep 1",
        f"{emulator} --fault unplug@{UNPLUGGED_TICK} -- {render} cut spring.json",
        "sleep 1",
        "grep -l 1209 /sys/bus/usb/devices/*/idVendor > remaining",
        f"{emulator} -- {render} again spring.json --duration-s 1",
        "sleep 1",
        f"{emulator} --rate-hz 900 -- {render} slow spring.json",
        "sleep 1",
        f"{emulator} --fault slow@{SLOW_TICK}x9999 -- {render} slowed spring.json",
        "sleep 1",
        f"{emulator} --rate-hz 900 -- {render} slow_uncertified spring.json --duration-s 0.9 {NO_RATE_LIMIT}",
    ]
    programs = {"usbip_emulator": usbip_emulator(), "palpate-control": CONTROL}
    output = guest.run("\n".join(script), programs, {path.name: path for path in (MODEL, *folder.iterdir())})
    return GuestRuns(output, plan)


def test_kernel_enumerates_the_device(runs: GuestRuns) -> None:
    facts = dict(line.split(" ", 1) for line in runs.text("facts").splitlines())
    assert facts["manufacturer"] == "palpate"
    assert facts["product"] == "emulated knob"
    assert facts["serial"] == "EMU-1"
    assert facts["speed"] == "12"
    assert facts["bInterfaceClass"] == "ff"
    assert facts["bInterval"] == "01"
    assert "new full-speed USB device number 2" in runs.text("dmesg")


def test_loop_runs_at_1000_hz(runs: GuestRuns, capsys: pytest.CaptureFixture[str]) -> None:
    summary = runs.summary("whole")
    with capsys.disabled():
        print(
            f"\nguest: {summary['rate_hz']:.2f} Hz over {summary['ticks']} ticks, "
            f"period {summary['period']}, round trip {summary['usb']['round_trip']}, "
            f"delay {summary['usb']['delay_samples']}, {summary['lost_samples']} samples lost"
        )
    assert runs.text("whole.code").strip() == "0", runs.text("whole.stderr")
    assert summary["rate_hz"] == pytest.approx(1000.0, rel=5e-3)
    assert summary["lost_samples"] == summary["repeated_samples"] == 0
    assert summary["ticks"] == summary["recorded"] == round(1e3 * DURATION_S)
    assert summary["usb"]["bus_errors"] == summary["usb"]["timeouts"] == 0


def test_force_error_is_at_most_twice_that_of_the_simulated_device(
    runs: GuestRuns, capsys: pytest.CaptureFixture[str]
) -> None:
    sweeps = round(SWEEP_S / DEVICE.period_s) * int((DURATION_S - 1.0) / SWEEP_S)
    trace = runs.table("whole.trace")
    trace = trace[(trace["status"] & 1).eq(1) & trace["started"].gt(0)][-sweeps - 1 - 10 : -10]
    # Each row of the trace holds the torque that arrived in its USB frame; this torque acts in the next
    # frame.
    emulated = force_error(runs.plan, -trace["torque_Nm"].to_numpy()[:-1], trace["position_rad"].to_numpy())
    rendering = simulate(runs.plan, DEVICE, Hand(), DURATION_S)
    ends = rendering.columns["handle_end_rad"]
    simulated = force_error(runs.plan, rendering.force[-sweeps:], ends[-sweeps - 1 :])
    with capsys.disabled():
        print(
            f"\nguest: force error {1e3 * emulated:.3f} mN*m RMS, simulated device {1e3 * simulated:.3f}, "
            f"ratio {emulated / simulated:.3f}; largest torque {trace['torque_Nm'].abs().max():.2f} N*m"
        )
    assert trace["position_rad"].max() > 0.4  # the handle has reached the wall of the model
    assert emulated <= 2.0 * simulated


def force_error(plan: Plan, force: np.ndarray, ends: np.ndarray) -> float:
    """Returns the RMS of applied force minus model force; `ends`: handle positions, one more than forces."""
    return float(np.sqrt(np.mean(np.square(force - force_at(plan, ends)[1:]))))


def test_unplugging_ends_with_a_fault_and_a_complete_record_and_replugging_works(runs: GuestRuns) -> None:
    summary = runs.summary("cut")
    assert runs.text("cut.code").strip() == "1"
    # The device does not answer until the kernel has noticed it.
    assert summary["status"] in ("Fault", "Timeout")
    assert summary["ended"].startswith("stopped by a fault of the device")
    assert len(runs.table("cut.csv")) == summary["ticks"] == summary["recorded"]
    assert summary["ticks"] == pytest.approx(UNPLUGGED_TICK, abs=10)
    assert runs.text("remaining") == ""
    assert "USB disconnect, device number" in runs.text("dmesg")
    assert runs.text("again.code").strip() == "0", runs.text("again.stderr")
    assert runs.summary("again")["ticks"] == 1000


def test_low_rate_stops_a_certified_run_within_a_second(runs: GuestRuns) -> None:
    for run, ticks_before, rate_hz in (("slow", 0, 900.0), ("slowed", SLOW_TICK, 1000.0 / 3.0)):
        summary = runs.summary(run)
        assert runs.text(f"{run}.code").strip() == "1"
        assert "the rate was too low" in summary["ended"]
        assert "the rate was too low" in runs.text(f"{run}.stderr")
        assert summary["ticks"] <= ticks_before + rate_hz + 1
        assert len(runs.table(f"{run}.csv")) == summary["ticks"]


def test_low_rate_of_an_uncertified_run_is_reported_within_a_second(runs: GuestRuns) -> None:
    summary = runs.summary("slow_uncertified")
    assert summary["ticks"] == 900  # in one second
    assert runs.text("slow_uncertified.code").strip() == "0"
    warned = re.search(r"warning: the loop runs at ([0-9.]+) Hz", runs.text("slow_uncertified.stderr"))
    assert warned
    assert float(warned[1]) == pytest.approx(900.0, rel=5e-3)
    assert summary["rate_hz"] == pytest.approx(900.0, rel=5e-3)
