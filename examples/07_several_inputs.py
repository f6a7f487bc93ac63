# SPDX-License-Identifier: Apache-2.0
"""
Several inputs
==============

A force can depend on more than the position. This example simulates a slide over magnets with an adjustable
air gap. The recording has the gap as a further column, and the model has two inputs.
"""

import matplotlib.pyplot as plt
import numpy as np

import palpate


# %%
# The magnets are 10 mm apart, and their force decreases exponentially with the gap.
def force_of(position, gap):
    return 3.0 * np.exp(-gap / 0.0015) * np.sin(2 * np.pi * position / 0.01) + 40.0 * position


def record(seed):
    """Simulates 3000 rows of a slide that moves to and fro while the gap changes slowly."""
    random = np.random.default_rng(seed)
    turn = np.linspace(0.0, 60.0, 3000)
    position, gap = 0.01 * (1.0 + np.sin(turn + seed)), 0.002 + 0.001 * np.sin(turn / 9.0 + 2.0 * seed)
    force = force_of(position, gap) + random.normal(0.0, 0.01, len(turn))
    units = {"position": "m", "force": "N"}
    return palpate.Recording.from_arrays(position, force, inputs={"gap_m": gap}, units=units)


# %%
# By default the model selection tries every further input of a recording.
recording, fresh = record(seed=1), record(seed=2)
model = palpate.identify(recording)
of_position = palpate.identify(recording, inputs="position")
print(f"inputs {', '.join(model.inputs)}: {model.n_wavelets} wavelets; {model.verdict}")
print(f"position only: {of_position.verdict.level}")

# %%
# The lines are the model's force at three gaps, the grey ones the force of the object.
x = np.linspace(0.0, 0.02, 300)
figure, axes = plt.subplots(layout="constrained")
for gap, style in ((0.001, "k"), (0.002, "k--"), (0.003, "k:")):
    axes.plot(1e3 * x, force_of(x, gap), color="0.75", linewidth=4)
    rows = np.column_stack([x, np.full_like(x, gap)])
    axes.plot(1e3 * x, model.predict(rows), style, label=f"gap {1e3 * gap:.0f} mm")
axes.set(xlabel="position [mm]", ylabel="force [N]")
axes.legend()

# %%
# Result
# ------
# The method fails where the recording has no rows: the motion must visit every combination of position and
# gap. A model of two inputs cannot be rendered yet; only position, direction and velocity are read at run
# time.
error, error_of_one = (palpate.verify(each, fresh).nrmse for each in (model, of_position))
print(f"NRMSE {error:.4f} with the gap, {error_of_one:.3f} without it")
plt.show()
