# SPDX-License-Identifier: Apache-2.0
"""Is the plan's structure as good as the best that trial finds?

Every structure, with and without compensation, over a grid of couplings, masses and dampings, is rendered on
three devices in closed loop, as the plan is: for a spring that meets a wall, a switch that snaps through and,
where PALPATE_DATA names measured data, real keyboard switches. The error is the commanded force less the
identified model's at the handle at the end of the tick, RMS, while a hand sweeps the domain to and fro. It
prints a table, writes JSON, and ends with 1 where a plan is worse than 1.2 times the best candidate that is
proved or locally stable, or is left shaking.

    python bench/plan_against_trial.py OUT.json [--seconds 4] [--switches 5] [--grid 6]
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from palpate import DeviceProfile, Hand, Model, Scheme, _core, identify, plan, read_recording
from palpate.recording import Recording

WORST_RATIO = 1.2
ANGLE = (
    DeviceProfile(id="knob", coulomb_friction=0.005),
    DeviceProfile(id="knob, little damping", viscous_damping=0.01, coulomb_friction=0.005),
    DeviceProfile(id="knob, one sample late", coulomb_friction=0.01, delay_samples=1),
)
LENGTH = {"position_unit": "m", "inertia": 0.05, "encoder_step": 1e-6, "force_limit": 20.0}
TRAVEL = (
    DeviceProfile(id="slide", viscous_damping=6.0, coulomb_friction=0.05, **LENGTH),
    DeviceProfile(id="slide, little damping", viscous_damping=0.3, coulomb_friction=0.05, **LENGTH),
    DeviceProfile(
        id="slide, one sample late", viscous_damping=3.0, coulomb_friction=0.05, **LENGTH, delay_samples=1
    ),
)


def analytic(force: np.ndarray, x: np.ndarray) -> Model:
    """A model of an object that is known exactly."""
    return identify(
        Recording.from_arrays(x, force, units={"position": "rad", "force": "N*m"}), inputs=("position",)
    )


def objects(switches: int) -> Iterator[tuple[str, Model, tuple[DeviceProfile, ...]]]:
    """Name, model and the devices of its unit."""
    x = np.linspace(0.0, 0.47, 3000)
    yield "spring and wall", analytic(2.0 * x + 0.24 * np.logaddexp(0.0, (x - 0.4) / 0.004), x), ANGLE
    yield "snap-through", analytic(4.0 * x + 0.5 * np.exp(-(((x - 0.2) / 0.03) ** 2)), x), ANGLE
    folder = Path(os.environ.get("PALPATE_DATA", "")) / "keyswitches"
    files = sorted(folder.glob("*.csv")) if folder.is_dir() else []
    if not files:
        print("real switches: skipped, needs measured data", file=sys.stderr)
    step = max(1, len(files) // max(1, switches))
    for file in files[::step][:switches]:
        yield file.stem, identify(read_recording(file)), TRAVEL


def sweep(model: Model, device: DeviceProfile) -> Hand:
    """A hand through the whole domain and back, as far as the device can hold the force."""
    lower, upper = float(model.lower[0]), float(model.upper[0])
    x = np.linspace(lower + 0.02 * (upper - lower), upper - 0.02 * (upper - lower), 500)
    force = np.asarray(model.force(x, direction=np.ones_like(x)) if model.hysteretic else model.force(x))
    held = np.abs(force) < 0.8 * device.force_limit
    x, force = x[held], force[held]
    stiffness = max(2.0 * float(np.abs(force).max()) / (upper - lower), 1e-6)
    target = x + force / stiffness
    return Hand(
        stiffness=stiffness, damping=0.002 * stiffness, lower=float(target.min()), upper=float(target.max())
    )


def error(model: Model, rendered: Model, scheme: Scheme, device: DeviceProfile, seconds: float) -> float:
    """RMS of commanded force less the identified model's at the end of the tick; infinite where it breaks."""
    start = float(np.clip(0.0, model.lower[0], model.upper[0]))
    try:
        trace = _core.simulate(rendered, scheme, device, sweep(model, device), seconds, start_position=start)
    except ValueError:
        return float("inf")
    end = np.asarray(trace["handle_end"])
    if not np.isfinite(end).all() or np.abs(end).max() > 1e3:
        return float("inf")
    felt = Scheme(structure="direct", play_radius=scheme.play_radius if model.hysteretic else 0.0)
    truth = _core.motion_driven(model, felt, end, device.period_s)["force"]
    return float(np.sqrt(np.mean((np.asarray(trace["force"]) - truth) ** 2)))


def buzzes(model: Model, scheme: Scheme, device: DeviceProfile) -> bool:
    """Whether a hand that damps nothing, leaning on the steepest part, is left shaking."""
    x = np.linspace(float(model.lower[0]), float(model.upper[0]), 400)
    force = np.asarray(model.force(x, direction=np.ones_like(x)) if model.hysteretic else model.force(x))
    steepest = int(np.argmax(np.gradient(force, x)))
    stiffness = 0.1 * float(np.gradient(force, x)[steepest])
    target = x[steepest] + force[steepest] / stiffness
    hand = Hand(stiffness=stiffness, damping=0.0, lower=target, upper=target)
    trace = _core.simulate(model, scheme, device, hand, 2.0, start_position=float(x[steepest]))
    last = np.asarray(trace["handle_end"])[-500:]
    return bool(np.ptp(last) > 0.02 * (x[-1] - x[0]))


def candidates(model: Model, device: DeviceProfile, radius: float, grid: int) -> Iterator[Scheme]:
    """Every structure over couplings, masses and dampings around what the device can hold."""
    play = {"play_radius": radius}
    yield Scheme(structure="direct", **play)
    held = 2.0 * device.viscous_damping / device.period_s
    for stiffness, share in itertools.product(np.geomspace(0.05 * held, 2.0 * held, grid), (0.0, 2e-4)):
        coupling = {"coupling_stiffness": stiffness, "coupling_damping": share * stiffness, **play}
        yield Scheme(structure="massless", **coupling)
        if not model.hysteretic:
            yield Scheme(structure="massless", compensated=True, **coupling)
        for structure, reserve, ratio in itertools.product(
            ("implicit", "energy-consistent", "explicit"), (0.02, 2.0), (0.0, 0.5)
        ):
            mass = reserve * (held + stiffness) * device.period_s**2
            yield Scheme(structure=structure, mass=mass, damping=ratio * mass / device.period_s, **coupling)


def compare(
    name: str, model: Model, device: DeviceProfile, seconds: float, grid: int
) -> dict[str, str | float | bool | None]:
    """One row of the table."""
    chosen = plan(model, device)
    planned = error(model, chosen.model, chosen.scheme, device, seconds)
    best: dict[bool, tuple[float, str]] = {True: (float("inf"), "none"), False: (float("inf"), "none")}
    rendered = {"": model} if chosen.loss is None else {"": model, ", slope limited": chosen.model}
    for (words, shown), scheme in itertools.product(
        rendered.items(), candidates(model, device, chosen.scheme.play_radius, grid)
    ):
        try:
            known = not _core.certify(shown, scheme, device).refused
        except ValueError:
            continue  # impossible: a compensated model that is too steep for its coupling
        found = error(model, shown, scheme, device, seconds)
        for wanted in {known, False}:
            best[wanted] = min(best[wanted], (found, scheme.structure + words))
    assert chosen.certificate is not None
    direct = Scheme(structure="direct", play_radius=chosen.scheme.play_radius)
    return {
        "object": name,
        "device": device.id,
        "plan": chosen.structure + ("" if chosen.loss is None else ", slope limited"),
        "verdict": chosen.certificate.verdict,
        "loss": None if chosen.loss is None else chosen.loss.rms,
        "error": planned,
        "best": best[True][1],
        "best_error": best[True][0],
        "best_of_all": best[False][1],
        "best_of_all_error": best[False][0],
        "direct_buzzes": buzzes(model, direct, device),
        "plan_buzzes": buzzes(chosen.model, chosen.scheme, device),
    }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("output", type=Path)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--switches", type=int, default=5)
    parser.add_argument("--grid", type=int, default=6)
    given = parser.parse_args()
    rows = []
    print("object | device | plan | its error | best that is known to hold | its error | plan / best")
    for name, model, devices in objects(given.switches):
        for device in devices:
            row = compare(name, model, device, given.seconds, given.grid)
            rows.append(row)
            ratio = row["error"] / row["best_error"]
            print(
                f"{name} | {device.id} | {row['plan']} | {row['error']:.4g} | {row['best']} | "
                f"{row['best_error']:.4g} | {ratio:.3f} | "
                f"of all {row['best_of_all']} {row['best_of_all_error']:.4g} | "
                f"direct {'buzzes' if row['direct_buzzes'] else 'rests'}, "
                f"plan {'buzzes' if row['plan_buzzes'] else 'rests'}",
                flush=True,
            )
    given.output.write_text(json.dumps(rows, indent=1, default=str) + "\n", encoding="utf-8")
    worse = [row for row in rows if not row["error"] <= WORST_RATIO * row["best_error"] or row["plan_buzzes"]]
    for row in worse:
        print(f"{row['object']} on {row['device']}: the plan is not within {WORST_RATIO}", file=sys.stderr)
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
