# SPDX-License-Identifier: Apache-2.0
"""
Implicit against explicit
=========================

A virtual object with mass is integrated in steps of the sample period. This example drives a detent with a
known force, and compares the implicit and the explicit integration of the paper over the period.
``10_implicit_and_explicit.cpp`` does the same in C++.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate
from palpate._core.simulation import force_driven

detent = palpate.Model.from_network(
    units={"position": "rad", "force": "N*m"},
    alpha=[[30.0]],
    beta=[[0.2]],
    weight=[-0.3],
    linear=[2.0],
    lower=[0.0],
    upper=[0.5],
)


# %%
# The force increases to 0.6 N·m and decreases again, twice in a second. It moves the object, with a mass of
# 1e-4 kg·m² and a damping of 0.02 N·m·s/rad, through the detent.
def motion(structure, period):
    """Returns the position of the object (n,) [rad] for one second of the force."""
    time = period * np.arange(round(1.0 / period))
    force = 0.3 * (1.0 - np.cos(4 * np.pi * time))
    scheme = palpate.Scheme(structure=structure, mass=1e-4, object_damping=0.02)
    return force_driven(detent, scheme, force, period)["environment_position"]


# %%
# The reference is the explicit integration with a period of 1 µs. Its error is far below all others.
exact = motion("explicit", 1e-6)
periods = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 5.0])  # [ms]
errors = {"implicit": [], "explicit": []}
for period in periods:
    reference = exact[:: round(1e3 * period)]
    for structure, found in errors.items():
        found.append(1e3 * np.sqrt(np.mean((motion(structure, 1e-3 * period) - reference) ** 2)))
    implicit, explicit = (found[-1] for found in errors.values())
    print(f"T = {period:4.1f} ms: implicit {implicit:.3g} mrad, explicit {explicit:.3g} mrad RMS")

# %%
# Both errors are proportional to the period. At 5 ms the explicit object oscillates.
figure, (above, below) = plt.subplots(2, layout="constrained")
for structure, style in (("implicit", "k-"), ("explicit", "C3--")):
    above.loglog(periods, errors[structure], style, marker="o", label=structure)
    below.plot(5e-3 * np.arange(200), motion(structure, 5e-3), style)
below.plot(1e-6 * np.arange(len(exact)), exact, "0.6", label="reference; others T = 5 ms")
above.set(xlabel="period [ms]", ylabel="RMS error [mrad]")
below.set(xlabel="time [s]", ylabel="position [rad]", ylim=(-0.1, 0.5))
above.legend()
below.legend()

# %%
# Result
# ------
# The implicit method fails where the force falls faster than mass and damping can resist in one period: its
# equation has then more than one solution. The solver reports this as ``NotUnique``.
ratio = errors["explicit"][3] / errors["implicit"][3]
print(f"at 1 kHz the error of explicit is {ratio:.2f} times that of implicit")
plt.show()
