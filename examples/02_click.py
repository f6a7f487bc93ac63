# SPDX-License-Identifier: Apache-2.0
"""Example 2: renders the click of a real key switch on a knob. 02_click.cpp does the same in C++.

python examples/02_click.py

02_click.json was identified from a measured Cherry MX Blue (ThereminGoat's force curves); 1 mm of the key is
0.1 rad of the knob, 1 N is 1 N*m. To render it on a device, run `palpate check-device` first, then:

palpate-control examples/02_click.json --device usb --uncertified --force-limit 1
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

import palpate
from palpate.planning import rig_for


def largest_drop(force: Iterable[float]) -> float:
    """Returns the largest drop of a force below its previous maximum, which is felt as a click."""
    maximum, drop = -np.inf, 0.0
    for value in force:
        maximum = max(maximum, value)
        drop = max(drop, maximum - value)
    return drop


# 1. Load the object. Its press force drops suddenly; its release force rises again at another position.
switch = palpate.load_model(Path(__file__).with_suffix(".json"))
position = np.linspace(switch.lower[0], switch.upper[0], 1001)
press, release = (switch.force(position, direction=sign) for sign in (+1, -1))
drops = largest_drop(press), largest_drop(release)
print(f"switch: press force drops by {drops[0]:.3f} N*m, release force by {drops[1]:.3f} N*m")

# 2. Simulate a knob that is scaled to the model, and a hand that presses for a second.
rig = rig_for(switch)

# 3. Measure the drop of the rendered force. A mass behind the coupling oscillates.
for structure in ("direct", "massless", "implicit"):
    plan = palpate.Plan(switch, rig.scheme(switch, structure=structure))
    rendered = palpate.simulate(plan, rig.device, rig.hand, 1.0)
    pressed = rendered.force[: np.argmax(rendered.position) + 1]
    print(f"{structure}: press force drops by {largest_drop(pressed):.3f} N*m")
