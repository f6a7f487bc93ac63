# SPDX-License-Identifier: Apache-2.0
"""Story 2: a knob with the click of a real key switch. The same story is told in 02_click.cpp.

python examples/02_click.py

02_click.json was identified from a measured Cherry MX Blue (ThereminGoat's force curves); 1 mm of the key is
0.1 rad of the knob, 1 N is 1 N*m. To feel it on a device that `palpate check-device` found fit for it:

palpate-control examples/02_click.json --device usb --uncertified --force-limit 1
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

import palpate
from palpate.planning import rig_for


def largest_fall(force: Iterable[float]) -> float:
    """How far a force falls at most below what it had reached before: a click."""
    highest, fall = -np.inf, 0.0
    for value in force:
        highest = max(highest, value)
        fall = max(fall, highest - value)
    return fall


# 1. The object. Pressed, its force falls all at once; released, it comes back elsewhere.
switch = palpate.load_model(Path(__file__).with_suffix(".json"))
position = np.linspace(switch.lower[0], switch.upper[0], 1001)
press, release = (switch.force(position, direction=way) for way in (+1, -1))
falls = largest_fall(press), largest_fall(release)
print(f"the switch: the press falls by {falls[0]:.3f} N*m, the release by {falls[1]:.3f} N*m")

# 2. A knob that suits it, and a hand that presses for a second. Simulated.
rig = rig_for(switch)

# 3. Is the click still there when the knob renders it? An inertia behind the coupling rings.
for structure in ("direct", "massless", "implicit"):
    plan = palpate.Plan(switch, rig.scheme(switch, structure=structure))
    felt = palpate.simulate(plan, rig.device, rig.hand, 1.0)
    pressed = felt.force[: np.argmax(felt.position) + 1]
    print(f"{structure}: the press falls by {largest_fall(pressed):.3f} N*m")
