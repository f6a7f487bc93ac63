# SPDX-License-Identifier: Apache-2.0
"""Draws the figures of the paper that show data: python docs/paper_figures.py [--to FOLDER].

The recordings of the paper are not available. The object here is the simulated sample of palpate, which has
the same form: a spring that ends at a wall. Prints the numbers of docs/paper.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import palpate
from palpate._core.dynamics import environment_filters, paper_sample_time_s
from palpate.baselines import paper_force
from palpate.recording.sample import (
    ENCODER_STEP,
    FORCE_NOISE,
    LOWER,
    UPPER,
    WALL_POSITION,
    sample_force,
    sample_recording,
)
from palpate.verification import force_driven

STYLE = {"font.size": 10, "figure.dpi": 150, "figure.constrained_layout.use": True, "axes.titlesize": 10}
STATED_HZ = 100.0
"""Frequency up to which the paper states that the differentiators match the integrators [rad/s]"""
MASS, DAMPING = 0.001, 0.5
"""Mass and damping of the paper's virtual object [kg m^2, N m s/rad]"""
SLOWER = 20
"""Ratio of the speeds of the two hands in figure 15 [-]"""


def draw_transforms(to: Path) -> None:
    """Figure 2: force over position, the finest wavelet level, and the power spectrum."""
    position = np.linspace(LOWER, UPPER, 4001)
    step = position[1] - position[0]
    force = sample_force(position) + np.random.default_rng(1).normal(0.0, 0.02, len(position))
    alpha = 1.0 / 0.008
    offset = np.arange(-5.0 / alpha, 5.0 / alpha, step)
    # The wavelet itself, evaluated by the core
    one = palpate.Model.from_network(
        alpha=[[alpha]], beta=[[0.0]], weight=[1.0], lower=[offset[0]], upper=[offset[-1]]
    )
    level = np.convolve(force, one.force(offset), mode="valid") * step
    centre = position[len(offset) // 2 : len(offset) // 2 + len(level)]
    spectrum = np.abs(np.fft.rfft((force - force.mean()) * np.hanning(len(force)))) ** 2
    frequency = np.fft.rfftfreq(len(force), step)
    figure, axes = plt.subplots(3, 1, figsize=(6.4, 7.0))
    axes[0].plot(position, force, color="black", linewidth=0.7)
    axes[0].set(title="(a) force", xlabel="position [rad]", ylabel="force [N·m]")
    axes[1].plot(centre, np.abs(level), color="black", linewidth=0.7)
    axes[1].set(title="(b) finest wavelet level", xlabel="position [rad]", ylabel="|coefficient|")
    axes[1].set_xlim(axes[0].get_xlim())
    axes[2].semilogy(frequency[1:130], spectrum[1:130], color="black", linewidth=0.7)
    axes[2].set(title="(c) power spectrum", xlabel="frequency [1/rad]", ylabel="power")
    save(figure, to, "figure-02")
    found = centre[np.argmax(np.abs(level))]
    print(f"figure 2: largest coefficient at {found:.3f} rad, the wall is at {WALL_POSITION} rad")


def draw_filters(to: Path) -> None:
    """Figures 11 and 13: gain and phase of differentiator times integrator, which should be 1."""
    omega = np.geomspace(1.0, 1000.0, 400)
    z = np.exp(1j * omega * paper_sample_time_s)
    figure, axes = plt.subplots(2, 1, figsize=(6.4, 5.5), sharex=True)
    for pair, line in (("implicit", "-"), ("explicit", "--")):
        for design, grey in (("paper", "0.0"), ("matched", "0.6")):
            filters = environment_filters(pair, design)
            product = np.array([filters.g1.at(each) * filters.i1.at(each) for each in z])
            name = f"{pair}, {'as published' if design == 'paper' else 'unit gain'}"
            axes[0].semilogx(omega, np.abs(product), line, color=grey, label=name)
            axes[1].semilogx(omega, np.degrees(np.unwrap(np.angle(product))), line, color=grey)
            at = filters.g1.at(np.exp(1j * STATED_HZ * paper_sample_time_s)) * filters.i1.at(
                np.exp(1j * STATED_HZ * paper_sample_time_s)
            )
            low = abs(product[0])
            print(
                f"figures 11 and 13, {name}: low-frequency gain {low:.4f}\n"
                f"    at 100 rad/s: gain {abs(at):.2f}, phase {np.degrees(np.angle(at)):.0f} degrees"
            )
    for panel in axes:
        panel.axvline(STATED_HZ, color="0.8", linewidth=0.8)
    axes[0].set_ylabel("gain of G·I")
    axes[0].legend(frameon=False)
    axes[1].set(xlabel="frequency [rad/s]", ylabel="phase [degrees]")
    save(figure, to, "figure-11-13")


def draw_responses(to: Path) -> None:
    """Figures 10, 12 and 14: motion of the identified object after a step of the force."""
    model = palpate.identify(sample_recording(seed=1))
    time = np.arange(0.0, 0.3, paper_sample_time_s)
    # The object rests on its wall, and the force rises a little.
    grid = np.linspace(WALL_POSITION, UPPER, 1001)
    rest, pressed = np.interp((1.5, 1.8), model.force(grid), grid)
    before = time < 0.02
    recording = palpate.Recording.from_arrays(
        np.where(before, rest, pressed),
        np.where(before, 1.5, 1.8),
        time,
        units={"position": "rad", "force": "N*m"},
    )
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    for name, structure, damping, line, grey in (
        ("figure 12, implicit", "implicit", 0.0, "-", "0.55"),
        ("figure 14 without damping", "explicit", 0.0, ":", "0.3"),
        ("figure 14 with damping", "explicit", DAMPING, "--", "0.0"),
    ):
        scheme = palpate.Scheme(structure=structure, mass=MASS, object_damping=damping)
        loop = force_driven(model, recording, scheme)
        axes.plot(loop.time, 1e3 * loop.rendered_position, line, color=grey, label=name, linewidth=0.9)
        last = 1e3 * np.ptp(loop.rendered_position[-100:])
        print(f"{name}: {last:.3f} mrad peak to peak in the last 0.1 s")
    axes.set(xlabel="time [s]", ylabel="position of the object [mrad]")
    axes.legend(frameon=False)
    save(figure, to, "figure-10-12-14")


def draw_impedance(to: Path) -> None:
    """Figure 15: recorded force, and force over the position of the identified environment."""
    light = palpate.Scheme(structure="implicit", mass=0.01 * MASS, object_damping=0.01 * DAMPING)
    quick = (sample_recording(seed=1), sample_recording(seed=2))
    slow = (slowed(quick[0], SLOWER), slowed(quick[1], SLOWER))
    figure, axes = plt.subplots(1, 3, figsize=(6.4, 3.6), sharey=True)
    for panel, title, (recording, fresh), scheme in (
        (axes[0], "published, 0.2 to 2 Hz", quick, None),
        (axes[1], f"published, {SLOWER} times slower", slow, None),
        (axes[2], "static, implicit, light", quick, light),
    ):
        model = palpate.identify(recording) if scheme else published(recording)
        loop = force_driven(model, fresh, scheme)
        panel.plot(
            loop.recorded_position,
            loop.recorded_force,
            ".",
            color="0.7",
            markersize=3,
            markevery=7,
            label="actual",
        )
        panel.plot(
            loop.rendered_position, loop.rendered_force, color="black", linewidth=0.4, label="identified"
        )
        panel.set(title=title, xlabel="position [rad]")
        print(
            f"figure 15, {title}: {model.n_wavelets} wavelets\n"
            f"    NRMSE of the static force {static_error(model):.4f}, of the position {loop.nrmse:.4f}"
        )
    axes[0].set_ylabel("force [N·m]")
    axes[0].legend(frameon=False)
    save(figure, to, "figure-15")


def published(recording: palpate.Recording) -> palpate.Model:
    """Returns one curve over position for the force without the paper's mass and damping."""
    force = paper_force(recording, mass=MASS, damping=DAMPING)
    return palpate.identify(
        palpate.Recording.from_arrays(recording.position, force, units=recording.units), inputs="position"
    )


def slowed(recording: palpate.Recording, factor: int) -> palpate.Recording:
    """Returns a recording of the sample along the first part of the same motion, `factor` times slower."""
    assert recording.time is not None
    time = recording.time[: len(recording) // 2]
    motion = np.interp(time / factor, recording.time, recording.position)
    position = np.floor(motion / ENCODER_STEP + 0.5) * ENCODER_STEP
    noise = np.random.default_rng(int(recording.metadata["seed"])).normal(0.0, FORCE_NOISE, len(time))
    return palpate.Recording.from_arrays(
        position, sample_force(motion) + noise, time, units={"position": "rad", "force": "N*m"}
    )


def static_error(model: palpate.Model) -> float:
    """Returns the NRMSE of the model's force against the true force of the object, both strokes averaged."""
    x: NDArray[np.float64] = np.linspace(LOWER + 0.01, UPPER - 0.01, 2001)
    truth = sample_force(x)
    both = [np.asarray(model.force(x, direction=np.full(len(x), sign))) for sign in (1.0, -1.0)]
    return float(np.sqrt(np.mean((0.5 * (both[0] + both[1]) - truth) ** 2)) / np.std(truth))


def save(figure: plt.Figure, to: Path, name: str) -> None:
    """Writes a figure and closes it."""
    figure.savefig(to / f"{name}.png")
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", type=Path, default=Path("build/paper"), help="folder of the figures")
    to = parser.parse_args().to
    to.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for draw in (draw_transforms, draw_filters, draw_responses, draw_impedance):
            draw(to)


if __name__ == "__main__":
    main()
