# SPDX-License-Identifier: Apache-2.0
"""Draws the figures of the concept pages with simulated objects."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import palpate
from palpate.planning import compare_structures, force_at, rig_for
from palpate.plotting import draw_structures
from palpate.recording.sample import sample_recording

STYLE = {
    "figure.figsize": (6.4, 4.2),
    "figure.dpi": 150,
    "font.size": 10,
    "figure.constrained_layout.use": True,
}
"""Settings of Matplotlib for all figures of the site"""

GREY = ("0.0", "0.35", "0.6")
LINES = ("-", "--", ":")


def write_figures(folder: Path) -> None:
    """Draws each figure into a PNG file of its name in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    model = palpate.identify(sample_recording(seed=1))
    with mpl.rc_context(STYLE):
        for name, draw in (
            ("virtual-coupling", lambda axes: draw_coupling(axes, model)),
            ("play", draw_play),
            ("structures", lambda axes: draw_errors(axes, model)),
        ):
            figure, axes = plt.subplots()
            draw(axes)
            figure.savefig(folder / f"{name}.png")
            plt.close(figure)


def draw_coupling(axes: Axes, model: palpate.Model) -> None:
    """Draws the force at the handle with and without a coupling, and with a compensated model."""
    rig = rig_for(model)
    schemes = {
        "without coupling": palpate.Scheme(structure="direct"),
        "behind a coupling of 70 N·m/rad": palpate.Scheme(
            structure="massless", coupling_stiffness=70.0, coupling_damping=0.002
        ),
        "the same, compensated": palpate.Scheme(
            structure="massless", coupling_stiffness=70.0, coupling_damping=0.002, compensated=True
        ),
    }
    for (name, scheme), line, grey in zip(schemes.items(), LINES, GREY, strict=True):
        rendered = palpate.simulate(palpate.Plan(model, scheme), rig.device, rig.hand, 1.0)
        axes.plot(rendered.position, rendered.force, line, color=grey, label=name)
    axes.set(xlabel="position of the handle [rad]", ylabel="force [N·m]")
    axes.legend(frameon=False)


def draw_play(axes: Axes) -> None:
    """Draws the force of a model with hysteresis along a motion with smaller and smaller strokes."""
    model = palpate.Model.from_network(
        units={"position": "m", "force": "N"},
        alpha=[[1200.0]],
        beta=[[0.0015]],
        weight=[-0.12],
        linear=[120.0],
        bias=0.1,
        weight_hysteresis=[-0.02],
        linear_hysteresis=0.0,
        bias_hysteresis=0.06,
        lower=[0.0],
        upper=[0.003],
        play_radius=1e-4,
    )
    time = np.linspace(0.0, 8.0, 8001)
    position = 0.0015 - 0.0014 * np.exp(-0.25 * time) * np.cos(2.0 * np.pi * 0.5 * time)
    plan = palpate.Plan(model, rig_for(model).scheme(model, structure="direct", play_radius=1e-4))
    axes.plot(1e3 * position, force_at(plan, position), color="black", linewidth=0.9)
    for direction, name, line in ((1.0, "press", "--"), (-1.0, "release", ":")):
        grid = np.linspace(0.0, 0.003, 301)
        force = model.force(grid, direction=direction)
        axes.plot(1e3 * grid, force, line, color="0.55", label=name)
    axes.set(xlabel="position [mm]", ylabel="force [N]")
    axes.legend(frameon=False)


def draw_errors(axes: Axes, model: palpate.Model) -> None:
    """Draws the force error of each structure, rendered for four seconds."""
    rows = [row for row in compare_structures(model, rig_for(model), 4.0) if row.error is not None]
    errors = [row.error for row in rows if row.error is not None]
    draw_structures(
        axes, [row.name for row in rows], [each.mean for each in errors], [each.end for each in errors], "N*m"
    )
