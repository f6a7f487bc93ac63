# SPDX-License-Identifier: Apache-2.0
"""
Certificate against a device
============================

A certificate proves that a rendering is passive on one device. This example renders a wall on knobs with less
and less damping, and compares the bound of the certificate with the simulated oscillation.
``09_certificate_and_device.cpp`` does the same in C++.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate

# %%
# The wall has a stiffness of 100 N·m/rad and no wavelets. A hand without damping pulls the knob into it.
wall = palpate.Model.from_network(
    units={"position": "rad", "force": "N*m"},
    alpha=np.zeros((0, 1)),
    beta=np.zeros((0, 1)),
    weight=[],
    linear=[100.0],
    lower=[0.0],
    upper=[0.1],
)
hand = palpate.Hand(stiffness=5.0, damping=0.0, lower=0.05, upper=0.2, frequency_hz=0.1)
direct = palpate.Plan(wall, palpate.Scheme(structure="direct"))

# %%
# Each knob has a Coulomb friction of 0.005 N·m, which exceeds the force error of its encoder. The swing is
# the range of positions in the last of four seconds; the hand alone causes 1.8 mrad.
dampings = [0.06, 0.055, 0.05, 0.045, 0.04, 0.03, 0.02, 0.01]
swings, certified = [], []
for damping in dampings:
    knob = palpate.DeviceProfile(viscous_damping=damping, coulomb_friction=0.005)
    certificate = direct.certified_for(knob).certificate
    swings.append(np.ptp(palpate.simulate(direct, knob, hand, 4.0).position[-1000:]))
    certified.append(certificate.certified)
    print(f"b = {damping:.3f} N*m*s/rad: {certificate.verdict:<9} swing {1e3 * swings[-1]:.1f} mrad")

# %%
# Direct rendering requires b > T M / 2, with the period T and the steepest slope M of the wall.
required = certificate.inequalities[0].right
figure, axes = plt.subplots(layout="constrained")
axes.plot(dampings, 1e3 * np.array(swings), "ko-", markerfacecolor="white")
axes.axvspan(required, max(dampings), color="0.9", label="certified")
axes.set(xlabel="damping of the knob [N·m·s/rad]", ylabel="swing [mrad]")
axes.legend()

# %%
# Result
# ------
# No certified knob oscillates, and the bound is not far from the first oscillation. The certificate holds for
# the device of the profile: it fails if the real damping is less than the measured one.
worst = max(swing for swing, safe in zip(swings, certified, strict=True) if safe)
oscillating = max(b for b, swing in zip(dampings, swings, strict=True) if swing > 0.01)
print(f"required b > {required:.4f}, oscillation at b <= {oscillating:.3f} N*m*s/rad")
print(f"largest swing with a certificate {1e3 * worst:.1f} mrad")
plt.show()
