# SPDX-License-Identifier: Apache-2.0
"""
Viscous knob
============

A damper resists velocity, not position. This example simulates a recording of a knob in oil and identifies
its damping. It then repeats the identification with strokes of constant speed, which cannot show damping.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate

DAMPING = 0.02  # of the simulated knob [N*m*s/rad]


# %%
# The torque sensor has 1 mN·m of noise. The encoder has 16 bits and the sample period is 1 ms.
def record(phase):
    """Simulates a recording of a motion with a phase (n,); one stroke is half a revolution of the phase."""
    random = np.random.default_rng(5)
    motion = 1.2 * np.abs(2.0 * (phase % 1.0) - 1.0)  # rad, forth and back with constant speed in a stroke
    time = 1e-3 * np.arange(len(phase))
    force = DAMPING * np.gradient(motion, time) + random.normal(0.0, 1e-3, len(time))
    step = 2 * np.pi / 65536
    units = {"position": "rad", "force": "N*m"}
    return palpate.Recording.from_arrays(step * np.rint(motion / step), force, time, units=units)


time = 1e-3 * np.arange(30_000)
varied = record(0.3 * time + 0.6 * np.sin(0.4 * time))
constant = record(0.3 * time)

# %%
# With varied speed the model selection accepts damping. With constant speed it accepts hysteresis instead,
# because press and release differ.
model, wrong = palpate.identify(varied), palpate.identify(constant)
for name, each in (("varied speed", model), ("constant speed", wrong)):
    print(f"{name}: model class {each.fit.model_class}, {each.verdict}")

# %%
# Only the first model predicts the force of a faster stroke.
motion, force = varied.position, varied.force
velocity = np.gradient(motion, time)
figure, axes = plt.subplots(layout="constrained")
axes.plot(velocity[::10], 1e3 * force[::10], ".", color="0.75", label="recording, varied speed")
line = np.array([velocity.min(), velocity.max()])
axes.plot(line, 1e3 * model.damping * line, "k", label="model, varied speed")
friction = 1e3 * wrong.force(np.full(2, 0.6), direction=np.sign(line))
axes.step(line, friction, "C3--", where="mid", label="model, constant speed")
axes.set(xlabel="velocity [rad/s]", ylabel="force [mN·m]")
axes.legend()

# %%
# Result
# ------
# The method fails without fast and slow strokes: record both.
print(f"damping {model.damping:.4f} N*m*s/rad, of the object {DAMPING} N*m*s/rad")
plt.show()
