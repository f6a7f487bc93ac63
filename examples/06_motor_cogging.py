# SPDX-License-Identifier: Apache-2.0
"""
Motor cogging with a period
===========================

The magnets of a motor pull its rotor into 12 positions of one revolution. This example simulates a recording
of this cogging torque. A model with a period is a sum of few harmonics, and it holds after any number of
revolutions.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate

PERIOD = 2 * np.pi / 12


# %%
# The recording covers two slow revolutions. The noise of the torque sensor is 2 mN·m.
def torque_of(angle):
    return 0.03 * np.sin(12 * angle) + 0.01 * np.sin(24 * angle + 0.5)


random = np.random.default_rng(6)
angle = np.linspace(0.0, 4 * np.pi, 4000)
torque = torque_of(angle) + random.normal(0.0, 0.002, len(angle))
recording = palpate.Recording.from_arrays(angle, torque, units={"position": "rad", "force": "N*m"})

# %%
# A periodic force with a mean other than zero would accelerate the rotor without end. The identification
# subtracts the mean.
periodic = palpate.identify(recording, period=PERIOD)
free = palpate.identify(recording)
print(periodic)

# %%
# Both models fit the recording. Beyond its end, at two revolutions, only the periodic one holds.
x = np.linspace(3.9 * np.pi, 4.3 * np.pi, 500)
figure, axes = plt.subplots(layout="constrained")
axes.plot(angle[angle > x[0]], 1e3 * torque[angle > x[0]], ".", color="0.7", label="recording")
axes.plot(x, 1e3 * torque_of(x), color="0.6", linewidth=4, label="object")
axes.plot(x, 1e3 * periodic.force(x), "k", label=f"period of 30°: {periodic.terms}")
axes.plot(x, 1e3 * free.force(x), "C3--", label=f"without period: {free.terms}")
axes.set(xlabel="angle [rad]", ylabel="torque [mN·m]", ylim=(-60, 60))
axes.legend()

# %%
# Result
# ------
# The method fails with a wrong period: if it is 1 % too long, the model averages over shifted positions. A
# motor whose 12 positions differ needs the period of one revolution.
far = 200 * np.pi + np.linspace(0.0, 2 * np.pi, 1000)
error = np.sqrt(np.mean((periodic.force(far) - torque_of(far)) ** 2))
print(f"{periodic.terms} in place of {free.terms}")
print(f"RMS error after 100 revolutions {1e3 * error:.3f} mN*m, sensor noise 2 mN*m")
plt.show()
