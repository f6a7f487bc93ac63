# SPDX-License-Identifier: Apache-2.0
"""
Detent of a knob
================

A detent is a position in which a knob rests. This example defines one as a network with a single wavelet,
renders it with five structures on a simulated device, and compares their force errors.
``01_detent_knob.cpp`` does the same in C++.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate
from palpate.planning import force_error

# %%
# The object is a soft spring of 2 N·m/rad with a detent at 0.2 rad. Usually :func:`palpate.identify` computes
# a model from a recording.
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
# The device is a simulated knob with a 16-bit encoder at 1 kHz. A simulated hand moves it through the detent
# for four seconds. ``force error`` is the rendered force minus the force of the model.
schemes = {
    "direct": palpate.Scheme(structure="direct"),
    "massless, compensated": palpate.Scheme(structure="massless", compensated=True, coupling_damping=0.005),
    "massless": palpate.Scheme(structure="massless"),
    "implicit": palpate.Scheme(structure="implicit"),
    "explicit": palpate.Scheme(structure="explicit"),
}
error, rendered = {}, {}
for name, scheme in schemes.items():
    plan = palpate.Plan(detent, scheme)
    rendered[name] = palpate.simulate(plan, palpate.DeviceProfile(), palpate.Hand(), 4.0)
    error[name] = force_error(plan, rendered[name]).end
    print(f"{name:<22} force error {error[name]:.5f} N*m RMS")

# %%
# The soft coupling of the last three structures flattens the detent. The first two reproduce it.
figure, axes = plt.subplots(layout="constrained")
for name in ("massless", "explicit", "direct"):
    axes.plot(rendered[name].position, rendered[name].force, ".", markersize=2, label=name)
position = np.linspace(0.0, 0.5, 501)
axes.plot(position, detent.force(position), "k", linewidth=1, label="model")
axes.set(xlabel="position [rad]", ylabel="force [N·m]")
axes.legend()

# %%
# Result
# ------
# Direct rendering has the smallest error. It fails on a device with too little damping for the steepest slope
# of the detent, see :doc:`09_certificate_and_device`.
print(f"the error of explicit is {error['explicit'] / error['direct']:.0f} times that of direct")
plt.show()
