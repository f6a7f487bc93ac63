# SPDX-License-Identifier: Apache-2.0
"""Draws docs/figures/push-button.png, the figure of the README: the tutorial's button, recorded and rendered.

The recording is simulated with a noise of 0.3 gf, identified, and rendered on a simulated device.
"""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import palpate
from palpate.planning import rig_for

ROOT = Path(__file__).parents[1]

NEWTON_PER_GF = 9.80665e-3


def main() -> None:
    mpl.use("Agg")
    time = np.arange(0.0, 16.0, 0.005)
    travel = 4.0 - np.abs(4.0 - 0.5 * time)
    side = np.where(time < 8.0, 1.0, -1.0)
    bump = 16.0 * np.exp(-(((travel - 1.5) / 0.4) ** 2))
    stop = 120.0 * 0.06 * np.logaddexp(0.0, (travel - 3.6) / 0.06)
    load = 28.0 * (1.0 - np.exp(-travel / 0.15)) + 5.0 * travel + bump + stop + side * (2.0 + 0.1 * bump)
    load += np.random.default_rng(1).normal(0.0, 0.3, len(time))
    recorded = palpate.Recording.from_arrays(
        1e-3 * travel, NEWTON_PER_GF * load, time, side, units={"position": "m", "force": "N"}
    )
    model = palpate.identify(recorded)
    rig = rig_for(model)
    plan = palpate.Plan(model, rig.scheme(model, structure="direct"))
    rendered = palpate.simulate(plan, rig.device, rig.hand, 4.0)
    inside = (rendered.position >= model.lower[0]) & (rendered.position <= model.upper[0])

    figure, axes = plt.subplots(figsize=(7.0, 3.0), layout="constrained")
    axes.plot(travel, recorded.force, ".", color="0.7", markersize=3, label="recorded (simulated button)")
    axes.plot(
        1e3 * rendered.position[inside],
        rendered.force[inside],
        color="black",
        linewidth=1,
        label=f"rendered: {model.n_wavelets} wavelets, {plan.structure}",
    )
    axes.set(xlabel="position [mm]", ylabel="force [N]")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(ROOT / "docs" / "figures" / "push-button.png", dpi=150, metadata={"Software": None})


if __name__ == "__main__":
    main()
