# SPDX-License-Identifier: Apache-2.0
"""Compares forces that are held for a period with lines that the controller holds.

    python bench/plans/held_lines.py --to docs

Computes the stiffest certified wall of each example device with a controller that holds lines, and simulates
the force error of a wall for delays of 0, 1 and 2 samples.

Writes FOLDER/figures/held-lines.png and held-lines.json, and the tables of FOLDER/held-lines.md if that page
exists. Takes about a minute.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import fill_tables, markdown_table, write_json

from palpate import DeviceProfile, Hand, Model, Recording, Scheme, identify
from palpate._core.stability import inner_need, line_for, renderable_slopes, stiffest_line_wall
from palpate.cli.figures import figure_file
from palpate.cli.printing import number
from palpate.planning import HeldLine, Plan, example_profiles, force_error, simulate
from palpate.planning.plan import with_network
from palpate.plotting.look import grid

WALLS = ((0.01, 3.0), (0.01, 10.0), (0.05, 3.0), (0.05, 10.0))
"""Width of a wall [rad] and largest speed [rad/s]"""

FAST_CURRENT_S = 2e-5
"""Lag of the current control in the second row of the moteus r4 [s]"""

LINE_DAMPING = 0.03
"""Device damping for which the lines of the force errors are chosen [N*m*s/rad]; hold needs 0.03 to 0.15"""

ASSUMED_LOOPS = {
    "odri-solo": HeldLine(period_s=1e-4, delay_s=3e-4, encoder_step=3.49e-5),
    "odrive-v3": HeldLine(period_s=1.25e-4, delay_s=1.125e-3, encoder_step=7.67e-4),
    "smartknob": HeldLine(period_s=1e-4, delay_s=3.5e-4, encoder_step=3.83e-4),
    "vesc": HeldLine(period_s=1e-4, delay_s=1.1e-3, encoder_step=3.83e-4),
}
"""Loops of example devices whose published firmware does not hold lines: assumed period, one period of delay
and the lag of the current control that their profiles state"""


@dataclass(frozen=True)
class Walls:
    """Largest certified stiffness of a wall on one device [N*m/rad]."""

    device: str
    hold: float
    any_speed: float
    by_width: dict[str, float]
    """By width [rad] and largest speed [rad/s]: "0.01 rad, 3 rad/s" """
    inner: float
    """Stiffness that the loop of the controller alone allows"""


def devices() -> list[tuple[str, DeviceProfile]]:
    """Returns the rotary example devices with a loop that holds lines, stated or assumed."""
    found = []
    for name, (file, _) in example_profiles().items():
        device = DeviceProfile.load(file)
        if device.position_unit != "rad":
            continue
        if device.held_line is not None:
            found.append((name, device))
        elif name in ASSUMED_LOOPS:
            found.append((f"{name}, assumed loop", changed(device, held_line=ASSUMED_LOOPS[name])))
        if name == "moteus-r4":
            loop = {**found[-1][1].held_line.to_dict(), "delay_s": 1.0 / 30e3 + FAST_CURRENT_S}
            fast = changed(device, delay_s=1e-3 + FAST_CURRENT_S, held_line=HeldLine(**loop))
            found.append(("moteus-r4, current lag 0.02 ms", fast))
    return found


def changed(device: DeviceProfile, **fields: Any) -> DeviceProfile:
    return DeviceProfile(**{**device.to_dict(), **fields})


def walls(name: str, device: DeviceProfile) -> Walls:
    loop = device.held_line
    assert loop is not None
    return Walls(
        name,
        renderable_slopes(device, falling=0.0)[1],
        stiffest_line_wall(device, WALLS[0][0]),
        {
            f"{width} rad, {speed:g} rad/s": stiffest_line_wall(device, width, speed * device.period_s)
            for width, speed in WALLS
        },
        device.viscous_damping / inner_need(loop, 1.0),
    )


def wall_model() -> Model:
    """Returns a wall identified from a simulated recording: f' = 2 + 58 / (1 + exp(-x / 0.01)) N*m/rad."""
    x = np.linspace(-0.08, 0.08, 801)
    force = 2.0 * x + 58.0 * 0.01 * np.logaddexp(0.0, x / 0.01)
    return identify(Recording.from_arrays(np.r_[x, x[::-1]], np.r_[force, force[::-1]]), inputs="position")


def errors() -> dict[str, dict[int, float]]:
    """Returns the RMS of the mean force error of a tick [N*m] by rendering and delay in samples."""
    model = wall_model()
    hand = Hand(frequency_hz=3.0, stiffness=400.0, lower=-0.06, upper=0.06)
    found: dict[str, dict[int, float]] = {}
    for delay in (0, 1, 2):
        device = DeviceProfile(
            viscous_damping=0.25,
            delay_s=1e-3 * delay,
            encoder_step=0.0,
            held_line=HeldLine(period_s=5e-5, delay_s=0.0),
        )
        renderings = {"hold": Scheme(structure="direct"), "prediction": Scheme(structure="direct", predict=1)}
        for speed in (3.0, 30.0):
            weaker = changed(device, viscous_damping=LINE_DAMPING)
            line = line_for(with_network(model), weaker, speed * device.period_s)
            renderings[f"held line, {speed:g} rad/s"] = Scheme(structure="tangent", line=line)
        renderings["held line, any speed"] = Scheme(structure="tangent")
        for name, scheme in renderings.items():
            plan = Plan(model, scheme)
            error = force_error(plan, simulate(plan, device, hand, 2.0))
            found.setdefault(name, {})[delay] = float(error.mean)
    return found


def tables(rows: list[Walls], found: Mapping[str, Mapping[int, float]]) -> dict[str, str]:
    """Returns the tables of the page; a key is the name in the mark before the table."""

    def with_ratio(value: float, row: Walls) -> str:
        return f"{number(value)} (×{value / row.hold:.2g})"

    return {
        "walls": markdown_table(
            ("device", "hold", "line, any speed", *rows[0].by_width, "controller alone"),
            [
                (
                    row.device,
                    number(row.hold),
                    with_ratio(row.any_speed, row),
                    *(with_ratio(value, row) for value in row.by_width.values()),
                    number(row.inner),
                )
                for row in rows
            ],
        ),
        "errors": markdown_table(
            ("rendering", "no delay", "1 sample", "2 samples"),
            [
                (name, *(f"{1e3 * by_delay[delay]:.2g}" for delay in (0, 1, 2)))
                for name, by_delay in found.items()
            ],
        ),
    }


def picture(path: Path, found: Mapping[str, Mapping[int, float]]) -> None:
    with figure_file(path, height_inches=2.8) as (axes,):
        for (name, by_delay), marker in zip(found.items(), "os^vD", strict=True):
            axes.plot(
                list(by_delay),
                [1e3 * error for error in by_delay.values()],
                marker=marker,
                color="black",
                markerfacecolor="white",
                linewidth=0.8,
                label=name,
            )
        axes.set_yscale("log")
        axes.set_xticks([0, 1, 2])
        axes.set_xlabel("delay [samples of 1 ms]")
        axes.set_ylabel("mean force error of a tick, RMS [mN·m]")
        axes.legend(frameon=False, fontsize="small")
        grid(axes)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True)
    parser.add_argument("--devices", type=int, metavar="N", help="Only the first N devices; default: all.")
    options = parser.parse_args()
    rows = [walls(name, device) for name, device in [*devices()][: options.devices]]
    found = errors()
    filled = tables(rows, found)
    print("\n\n".join(filled.values()))
    figures = options.to / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    write_json(figures / "held-lines.json", {"walls": [asdict(row) for row in rows], "errors": found})
    picture(figures / "held-lines.png", found)
    fill_tables(options.to / "held-lines.md", filled)
    return 0


if __name__ == "__main__":
    sys.exit(main())
