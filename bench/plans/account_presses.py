# SPDX-License-Identifier: Apache-2.0
"""Measures how often the energy account acts while a finger presses and holds a push button.

    python bench/plans/account_presses.py --to docs

The object is a push button of `bench/identification/ordinary_objects.py`. The device is the example slide
voice-coil with a damping that is 1, 2, ... times too small for a proof, once with a delay of a period.

Prints the table of FOLDER/certificate.md and writes it there if that page exists.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from bench.identification.ordinary_objects import push_button
from bench.studies import fill_tables, markdown_table

from palpate import DeviceProfile, Model, Recording, Scheme, identify
from palpate._core.simulation import account_use
from palpate._core.stability import certify
from palpate.planning import example_profiles

RATIOS = (1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 20.0)
"""Slopes divided by the proved slopes"""

MOTIONS = ("press 10 mm/s", "30", "100", "300", "rest on the stop", "rest on the steepest slope")


def button() -> Model:
    """Returns the model of a push button of 4 mm and 2.7 N with a click and a stop, from one slow stroke."""
    truth = replace(push_button(np.random.default_rng(1)), travel=4e-3, scale=1.0)
    press = np.linspace(0.0, truth.travel, 2000)
    x, s = np.concatenate([press, press[::-1]]), np.repeat([1.0, -1.0], press.size)
    force = truth.force(np.arange(x.size, dtype=float), x, s, np.zeros_like(x))
    return identify(Recording.from_arrays(x, force, direction=s, units=truth.units))


def too_weak(model: Model, device: DeviceProfile, scheme: Scheme, ratio: float) -> DeviceProfile:
    """Returns the device with 1 / ratio of the damping that a proof for the model needs."""
    lines = {line.id: line for line in certify(model, scheme, device).inequalities}
    damping = lines["damping-hold"].right / ratio
    return DeviceProfile(**device.to_dict() | {"viscous_damping": damping})


def rows() -> list[tuple[str, ...]]:
    """Returns delay, ratio, damping, share of each motion and the force error, one row for each device."""
    model = button()
    scheme = Scheme(structure="direct", play_radius=0.02 * float(model.upper[0] - model.lower[0]))
    coil = DeviceProfile.load(example_profiles()["voice-coil"][0])
    force_range = float(np.ptp(model.force(np.linspace(model.lower[0], model.upper[0], 1001), direction=1.0)))
    found = []
    for delay_s in (coil.delay_s, coil.period_s):
        late = DeviceProfile(**coil.to_dict() | {"delay_s": delay_s})
        for ratio in RATIOS:
            device = too_weak(model, late, scheme, ratio)
            use = account_use(model, scheme, device)
            found.append(
                (
                    f"{1e3 * delay_s:g} ms",
                    f"{ratio:g}",
                    f"{device.viscous_damping:.2g}",
                    *(f"{100.0 * share:.2g} %" for share in use.shares),
                    f"{100.0 * use.force_error / force_range:.2g} %",
                )
            )
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True)
    header = ("delay", "slopes / proved", "b [N·s/m]", *MOTIONS, "largest RMS change of the force")
    table = markdown_table(header, rows(), text_columns=())
    print(table)
    fill_tables(parser.parse_args().to / "certificate.md", {"account-presses": table})
    return 0


if __name__ == "__main__":
    sys.exit(main())
