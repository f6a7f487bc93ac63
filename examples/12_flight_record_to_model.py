# SPDX-License-Identifier: Apache-2.0
"""
From a flight record to a model
===============================

A rendering writes a flight record, which is a recording again. This example renders a knob with a detent,
identifies the flight record, and compares the new model with the first one.
``12_flight_record_to_model.cpp`` does the same in C++.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import palpate
from palpate.verification import compare

# %%
# The commands for a real object and a USB device are:
#
# .. code-block:: text
#
#    palpate record real.csv --device usb --probe --upper 0.3
#    palpate identify real.csv -o real.json
#    palpate-control real.json --device usb --uncertified --record rendered.csv
#    palpate identify rendered.csv -o again.json
#    palpate show real.json --beside again.json
#
# Here the first model is a soft spring with a detent at 0.2 rad.
first = palpate.Model.from_network(
    units={"position": "rad", "force": "N*m"},
    alpha=[[30.0]],
    beta=[[0.2]],
    weight=[-0.3],
    linear=[2.0],
    lower=[0.0],
    upper=[0.5],
)

# %%
# A simulated hand moves the knob for eight seconds. The force transducer has steps of 10 mN·m. The model of
# each flight record is compared with the first one over the positions that the hand reached.
figure, axes = plt.subplots(layout="constrained")
for structure in ("massless", "direct"):
    plan = palpate.Plan(first, palpate.Scheme(structure=structure))
    rendered = palpate.simulate(plan, palpate.DeviceProfile(), palpate.Hand(), 8.0)
    flight_record = replace(rendered, force=np.round(rendered.force, 2))
    second = palpate.identify(flight_record, inputs="position")
    (both,) = compare(first, second)
    difference = np.max(np.abs(both.second - both.first))
    print(f"{structure}: {second.n_wavelets} wavelets, largest difference {difference:.4f} N*m")
    axes.plot(both.position, both.second, label=f"model of the flight record, {structure}")
axes.plot(both.position, both.first, "k--", label="first model")
axes.set(xlabel="position [rad]", ylabel="force [N·m]")
axes.legend()

# %%
# Result
# ------
# The coupling of the massless structure flattens the detent. Direct rendering returns the model. The
# comparison fails to show that each force acts half a sample late: a row holds the force of its position.
share = difference / np.ptp(both.first)
print(f"direct rendering returns the model within {100 * share:.1f} % of its force range")
plt.show()
