# SPDX-License-Identifier: Apache-2.0
"""Draws docs/figures/key-switch.png, the figure of the README: a key switch, recorded and rendered.

The recording is simulated from the model of examples/02_key_switch_click.json, with a noise of 1 % of the
force range. It is identified, and rendered directly on the simulated knob of its test rig.
"""

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import palpate
from palpate.planning import rig_for

ROOT = Path(__file__).parents[1]


def main() -> None:
    mpl.use("Agg")
    switch = palpate.load_model(ROOT / "examples" / "02_key_switch_click.json")
    stroke = np.linspace(switch.lower[0], switch.upper[0], 1500)
    position = np.concatenate([stroke, stroke[::-1]])
    direction = np.repeat([1, -1], len(stroke))
    force = switch.force(position, direction=direction)
    noise = np.random.default_rng(1).normal(0.0, 0.01 * np.ptp(force), len(force))
    recorded = palpate.Recording.from_arrays(
        position,
        force + noise,
        time=1e-3 * np.arange(len(position)),
        direction=direction,
        units={"position": "rad", "force": "N*m"},
    )
    model = palpate.identify(recorded)
    rig = rig_for(model)
    plan = palpate.Plan(model, rig.scheme(model, structure="direct"))
    rendered = palpate.simulate(plan, rig.device, rig.hand, 4.0)
    inside = (rendered.position >= stroke[0]) & (rendered.position <= stroke[-1])

    figure, axes = plt.subplots(figsize=(7.0, 3.0), layout="constrained")
    axes.plot(position, recorded.force, ".", color="0.7", markersize=3, label="recorded (simulated switch)")
    axes.plot(
        rendered.position[inside],
        rendered.force[inside],
        color="black",
        linewidth=1,
        label=f"rendered: {model.n_wavelets} wavelets, {plan.structure}",
    )
    axes.set(xlabel="position [rad]", ylabel="force [N·m]")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(ROOT / "docs" / "figures" / "key-switch.png", dpi=150, metadata={"Software": None})


if __name__ == "__main__":
    main()
