# SPDX-License-Identifier: Apache-2.0
"""
Click of a key switch
=====================

The press force of a clicky key switch drops suddenly, and its release force rises again at another position.
This example renders such a switch on a simulated knob and measures the drop that remains with each structure.
``02_key_switch_click.cpp`` does the same in C++.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import palpate
from palpate.planning import rig_for

# %%
# The model was identified from a measured Cherry MX Blue (ThereminGoat's force curves). 1 mm of the key is
# 0.1 rad of the knob, 1 N is 1 N·m. Press and release are two curves of one model with hysteresis.
try:
    folder = Path(__file__).parent
except NameError:  # a notebook has no file name
    folder = Path()
switch = palpate.load_model(folder / "02_key_switch_click.json")
position = np.linspace(switch.lower[0], switch.upper[0], 1001)
press, release = (switch.force(position, direction=sign) for sign in (+1, -1))


# %%
# A hand feels the drop of the force below its previous maximum as a click.
def largest_drop(force):
    """Returns the largest drop of a force below its previous maximum [N*m]."""
    return np.max(np.maximum.accumulate(force) - force)


drops = largest_drop(press), largest_drop(release)
print(f"switch: press force drops by {drops[0]:.3f} N*m, release force by {drops[1]:.3f} N*m")

# %%
# The hand presses for a second. Behind the coupling of ``massless`` and ``implicit`` the drop is smaller or
# larger than that of the switch: a mass behind the coupling oscillates.
rig = rig_for(switch)
figure, axes = plt.subplots(layout="constrained")
for structure in ("implicit", "massless", "direct"):
    plan = palpate.Plan(switch, rig.scheme(switch, structure=structure))
    rendered = palpate.simulate(plan, rig.device, rig.hand, 1.0)
    pressed = slice(np.argmax(rendered.position) + 1)
    drop = largest_drop(rendered.force[pressed])
    print(f"{structure}: press force drops by {drop:.3f} N*m")
    axes.plot(rendered.position[pressed], rendered.force[pressed], linewidth=1, label=structure)
axes.plot(position, press, "k", label="switch, press")
axes.plot(position, release, "k--", label="switch, release")
axes.set(xlabel="position [rad]", ylabel="force [N·m]")
axes.legend()

# %%
# Result
# ------
# Direct rendering keeps the click. It fails to be certified on this knob, which has no friction: the steps of
# its encoder require a Coulomb friction of 0.007 N·m.
print(f"direct rendering keeps {100 * drop / drops[0]:.0f} % of the drop")
plt.show()
