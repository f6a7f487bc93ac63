# SPDX-License-Identifier: Apache-2.0
"""
Spring and wall
===============

The object of the paper is a soft spring that ends at a wall. This example simulates a recording of it,
identifies a model, and verifies the model on a second recording.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate


# %%
# The spring has 2 N·m/rad. At 0.4 rad the wall adds 58 N·m/rad within 0.01 rad. The hand moves faster and
# slower, the encoder has 16 bits, and the noise of the force sensor is 0.02 N·m.
def force_of(x):
    return 2.0 * x + 0.58 * np.logaddexp(0.0, (x - 0.4) / 0.01)


def record(seed):
    """Simulates 20 s of force over position at 1 kHz."""
    random = np.random.default_rng(seed)
    time = np.arange(20_000) * 1e-3
    motion = 0.13 + 0.335 * np.sin(2 * np.pi * (0.7 * time + 0.3 * np.sin(time + seed)))
    step = 2 * np.pi / 65536
    force = force_of(motion) + random.normal(0.0, 0.02, len(time))
    units = {"position": "rad", "force": "N*m"}
    return palpate.Recording.from_arrays(step * np.rint(motion / step), force, time, units=units)


# %%
# The model selection finds a position model without being given its shape.
recording = record(seed=1)
model = palpate.identify(recording)
print(model)

# %%
# The second recording decides. An NRMSE of 1 is the error of a constant force.
fresh = record(seed=2)
check = palpate.verify(model, fresh)
print(check.verdict)

# %%
# The network reproduces the force and its slope, the stiffness that a hand feels.
x = np.linspace(*np.ravel(model.domain), 600)
figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
above.plot(fresh.position[::20], fresh.force[::20], ".", color="0.7", label="fresh recording")
above.plot(x, model.force(x), "k", label=f"model, {model.n_wavelets} wavelets")
above.set(ylabel="force [N·m]")
above.legend()
below.plot(x, np.gradient(force_of(x), x), color="0.7", linewidth=3, label="object")
below.plot(x, model.slope(x), "k", label="model")
below.set(xlabel="position [rad]", ylabel="stiffness [N·m/rad]")
below.legend()

# %%
# Result
# ------
# The error is the noise of the sensor. The method fails at a wall with a sharp corner that few samples cover:
# a wavelet is never narrower than seven distinct positions.
print(f"NRMSE {check.nrmse:.4f}, RMS error {check.rmse:.4f} N*m, sensor noise 0.02 N*m")
print(f"stiffness {model.slope(0.2):.1f} N*m/rad before the wall, {model.slope(0.45):.1f} N*m/rad in it")
plt.show()
