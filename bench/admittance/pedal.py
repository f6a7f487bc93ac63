# SPDX-License-Identifier: Apache-2.0
"""Renders measured curves on simulated pedals: a progressive spring and a silicone cylinder, scaled.

Prints the force error, and the damping and mass that a foot feels in addition to the identified force.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import palpate
from palpate.planning import DeviceProfile, example_profiles, force_error, force_range, hand_for

sys.path.insert(0, str(Path(__file__).parents[1]))
from studies import measured_data

TRAVEL_M = 0.04
"""Travel of the scaled pedal [m]"""

FORCE_N = 300.0
"""Largest force of the scaled pedal [N]"""

CURVES = {
    "progressive spring": "switch_springs/linear_housing_gazzew_progressive_65g.csv",
    "silicone cylinder": "silicone_compression/EF10_50T_A1.csv",
}


def scaled(recording: palpate.Recording) -> palpate.Recording:
    """Returns a recording with the travel and the largest force of a pedal."""
    position = recording.position - recording.position.min()
    return palpate.Recording.from_arrays(
        position * TRAVEL_M / position.max(),
        recording.force * FORCE_N / np.abs(recording.force).max(),
        direction=recording.direction,
        units={"position": "m", "force": "N"},
    )


def added_motion(plan: palpate.Plan, rendered: palpate.Recording) -> tuple[float, float]:
    """Returns damping and mass of the difference from the identified force, by least squares after 0.5 s."""
    time = rendered.time
    assert time is not None
    velocity = np.gradient(rendered.position, time)
    acceleration = np.gradient(velocity, time)
    rows = time > 0.5
    difference = rendered.force - palpate.planning.force_at(plan, rendered.position)
    motion = np.stack([velocity, acceleration], axis=1)
    damping, mass = np.linalg.lstsq(motion[rows], difference[rows], rcond=None)[0]
    return float(damping), float(mass)


def main() -> None:
    data = measured_data()
    if data is None:
        return
    print(
        "| curve | pedal | structure | B_o [N*s/m] | mass [kg] | force error below 50 Hz [% of the range] | "
        "felt damping [N*s/m] | felt mass [kg] |\n|---|---|---|---:|---:|---:|---:|---:|"
    )
    for name, file in CURVES.items():
        model = palpate.identify(scaled(palpate.read_recording(data / file)))
        for profile in ("pedal-2kg", "stepper-pedal"):
            pedal = DeviceProfile.load(example_profiles()[profile][0])
            plan = palpate.plan(model, pedal)
            rendered = palpate.simulate(plan, pedal, hand_for(plan, pedal), 6.0)
            damping, mass = added_motion(plan, rendered)
            share = force_error(plan, rendered).band / force_range(plan)
            scheme = plan.scheme
            print(
                f"| {name} | {profile} | {plan.structure} | {scheme.object_damping:.3g} | "
                f"{scheme.mass:.3g} | {100.0 * share:.2g} | {damping:.3g} | {mass:.2g} |"
            )


if __name__ == "__main__":
    main()
