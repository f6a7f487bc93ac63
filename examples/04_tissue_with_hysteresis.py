# SPDX-License-Identifier: Apache-2.0
"""
Tissue with hysteresis
======================

Soft tissue stiffens with depth, and it pushes back less on release than on press. This example identifies a
simulated piece of tissue with and without hysteresis and compares the errors on a fresh recording.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate


# %%
# The mean force grows exponentially. Friction in the tissue adds 25 % on press and subtracts 25 % on release.
# The play operator gives the direction state: it changes from one stroke to the other within 0.4 mm.
def record(seed, depth):
    """Simulates 60 s of slow strokes to a depth [m], sampled at 100 Hz, force noise 0.01 N."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 60.0, 0.01)
    position = 0.5 * depth * (1.0 - np.cos(2 * np.pi * time / 10.0))
    play, radius, states = 0.0, 2e-4, []
    for x in position:
        play = min(x + radius, max(x - radius, play))
        states.append((x - play) / radius)
    mean_force = 0.4 * np.expm1(position / 0.003)
    force = mean_force * (1.0 + 0.25 * np.array(states)) + random.normal(0.0, 0.01, len(time))
    return palpate.Recording.from_arrays(position, force, time, units={"position": "m", "force": "N"})


# %%
# The model selection accepts hysteresis. ``inputs="position"`` permits one curve only.
recording, fresh = record(seed=1, depth=0.008), record(seed=2, depth=0.007)
model = palpate.identify(recording)
one_curve = palpate.identify(recording, inputs="position")
print(model)

# %%
# Every loop of the model loses energy, because its hysteresis is never negative.
x = np.linspace(0.0, 0.008, 400)
figure, axes = plt.subplots(layout="constrained")
axes.plot(1e3 * fresh.position, fresh.force, ".", color="0.8", label="fresh recording")
axes.plot(1e3 * x, model.force(x, direction=+1), "k", label="model, press")
axes.plot(1e3 * x, model.force(x, direction=-1), "k--", label="model, release")
axes.plot(1e3 * x, one_curve.force(x), "C3:", label="one curve")
axes.set(xlabel="depth [mm]", ylabel="force [N]")
axes.legend()

# %%
# Result
# ------
# The model fails for tissue whose force relaxes while the tool rests: it depends on position and direction,
# but not on time.
error, error_of_one = (palpate.verify(each, fresh).nrmse for each in (model, one_curve))
print(f"NRMSE {error:.4f} with hysteresis, {error_of_one:.3f} with one curve")
plt.show()
