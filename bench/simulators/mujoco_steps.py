# SPDX-License-Identifier: Apache-2.0
"""Compares the MuJoCo plugin with MuJoCo's own means on a key switch, for steps from 10 µs.

python bench/simulators/mujoco_steps.py build/mujoco/libpalpate_mujoco.so

A constant force presses an undamped key of 3 g, which swings for 50 ms. The switch is a measured one where
PALPATE_DATA names the recordings, otherwise the model of examples/02_key_switch_click.py. Prints a table.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from bench.studies import markdown_table  # noqa: E402

from palpate import Model, identify, load_model  # noqa: E402

PRESS = 0.9
"""Constant force on the key [N]"""
MASS = 0.003
"""Mass of the key [kg]"""
PLAY_RADIUS = 4e-5
"""Play radius of the switch [m], 1 % of its travel"""
DURATION_S = 0.05
"""Duration of a swing [s]"""
FEWEST_STEPS = 100
"""Smallest number of steps of a swing"""
DIVERGED = 10.0
"""Energy gained divided by the energy of the swing above which a simulation has diverged"""
FINE_S = 1e-6
"""Step of the reference [s]"""
STEPS_S = (1e-5, 1e-4, 1e-3, 1e-2)
"""Steps of the table [s]"""
PLUGIN_METHODS = ("implicit", "energy-consistent")
METHODS = ("explicit callback", "discrete", *PLUGIN_METHODS)
"""Force at the start of the step; its tangent as joint stiffness, for the integrator `discrete` of MuJoCo
3.13; methods of the plugin"""

Float = NDArray[np.float64]


def key_switch(data: Path | None) -> Model:
    """Returns the model of a key switch [m, N]: a measured tactile one, or that of the examples."""
    if data is not None:
        content = identify(data / "keyswitches" / "tactile__cherry_mx_brown.csv").to_dict()
        return Model.from_dict(content | {"play_radius": PLAY_RADIUS})
    content = load_model(ROOT / "examples" / "02_key_switch_click.json").to_dict()
    network, domain = content["network"], content["domain"]
    rad_per_m = 100.0  # of the example
    network.update(
        alpha=[[rad_per_m * a for a in row] for row in network["alpha"]],
        beta=[[b / rad_per_m for b in row] for row in network["beta"]],
        linear=[rad_per_m * c for c in network["linear"]],
        linear_hysteresis=[rad_per_m * c for c in network["linear_hysteresis"]],
    )
    domain.update({side: [x / rad_per_m for x in domain[side]] for side in domain})
    content.update(units={"position": "m", "force": "N"}, play_radius=PLAY_RADIUS)
    content.update(slope_bounds=None, plan=None, certificate=None)
    return Model.from_dict(content)


def without_hysteresis(model: Model) -> Model:
    """Returns the model with the mean of press and release force, which conserves energy."""
    lower, upper = model.domain
    return Model.from_network(
        units=model.units,
        alpha=model.alpha,
        beta=model.beta,
        weight=model.weight,
        linear=model.linear,
        bias=model.bias,
        lower=lower,
        upper=upper,
    )


@dataclass(frozen=True)
class Swing:
    """Motion of the key: position [m] and velocity [m/s] at the start and after each step."""

    method: str
    step_s: float
    position: Float
    velocity: Float

    @cached_property
    def velocity_at_ends(self) -> Float:
        """Velocity at the positions [m/s]. Energy-consistent: v is the mean velocity of a step."""
        if self.method != "energy-consistent":
            return self.velocity
        at_ends = np.zeros_like(self.velocity)
        for k in range(1, len(at_ends)):
            at_ends[k] = 2.0 * self.velocity[k] - at_ends[k - 1]
        return at_ends

    def potential(self, model: Model) -> Float:
        """Returns the energy of the switch minus the work of the constant force [J]; 0 at the start."""
        x = np.clip(self.position, -1.0, 1.0)  # a diverged position has no meaning
        play = model.play(x) if model.play_radius else None
        stored = np.asarray(model.energy(x, play=play)) - PRESS * x
        return np.asarray(stored - stored[0])

    def gained(self, model: Model) -> float:
        """Returns the largest potential energy [J]. It is at most 0 if the simulation generates no energy."""
        return float(np.max(self.potential(model)))

    def lost(self, model: Model) -> float:
        """Returns the energy lost at the end [J]."""
        energy = self.potential(model) + 0.5 * MASS * self.velocity_at_ends**2
        return -float(energy[-1])


def scene(
    step_s: float, *, model_file: Path | None = None, method: str = "", integrator: str = "Euler"
) -> str:
    """Returns a MuJoCo scene with one key; with a model file the plugin computes its force."""
    plugin = ""
    if model_file is not None:
        plugin = f"""<extension><plugin plugin="palpate.joint_force"><instance name="switch">
          <config key="model" value="{model_file}"/><config key="joint" value="key"/>
          <config key="method" value="{method}"/></instance></plugin></extension>"""
    return f"""<mujoco><option timestep="{step_s}" gravity="0 0 0" integrator="{integrator}"/>{plugin}
      <worldbody><body><joint name="key" type="slide" axis="0 0 -1"/>
      <geom type="box" size=".008 .008 .004" mass="{MASS}"/></body></worldbody></mujoco>"""


@contextmanager
def explicit_callback(model: Model) -> Iterator[None]:
    """Applies the force at the start of the step through a callback, as a user without the plugin does."""
    play = [0.0]

    def force(_m: Any, d: Any) -> None:
        x = float(d.qpos[0])
        if model.play_radius:
            play[0] = min(x + model.play_radius, max(x - model.play_radius, play[0]))
        d.qfrc_passive[0] -= model.force(x, play=play[0])

    mujoco.set_mjcb_passive(force)
    try:
        yield
    finally:
        mujoco.set_mjcb_passive(None)


class JointStiffness:
    """Gives the tangent of the force to the joint; the integrator `discrete` solves its spring implicitly."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.play = 0.0

    def set(self, m: Any, d: Any) -> None:
        """Sets stiffness and rest position of the joint, or the force alone where it falls."""
        x = float(d.qpos[0])
        play = None
        if self.model.play_radius:
            self.play = min(x + self.model.play_radius, max(x - self.model.play_radius, self.play))
            play = self.play
        force, slope = self.model.force(x, play=play), max(0.0, self.model.slope(x, play=play))
        m.jnt_stiffness[0] = slope
        m.qpos_spring[0] = x - force / slope if slope > 0.0 else x
        d.qfrc_applied[0] = PRESS if slope > 0.0 else PRESS - force


class Simulation:
    """Simulates swings of one model in MuJoCo."""

    def __init__(self, model: Model, folder: Path) -> None:
        self.model = model
        self.file = model.save(folder / f"{model.kind}.json")

    def swing(self, method: str, step_s: float) -> Swing:
        """Returns a swing of at least FEWEST_STEPS steps."""
        m, d = self.pressed(method, step_s)
        steps = max(FEWEST_STEPS, round(DURATION_S / step_s))
        motion = np.zeros((steps + 1, 2))
        step = self.stepping(method)
        with self.callback(method):
            for k in range(1, steps + 1):
                step(m, d)
                motion[k] = d.qpos[0], d.qvel[0]
                if not abs(d.qpos[0]) < 1.0:  # MuJoCo would reset a diverged simulation
                    motion[k:] = motion[k]
                    break
        return Swing(method, step_s, motion[:, 0], motion[:, 1])

    def seconds_per_step(self, method: str, steps: int = 20_000) -> float:
        """Returns the least processor time of a step in five runs [s]."""
        times = []
        for _ in range(5):
            m, d = self.pressed(method, 1e-4)
            step = self.stepping(method)
            with self.callback(method):
                start = time.process_time()
                step(m, d, steps)
                times.append((time.process_time() - start) / steps)
        return min(times)

    def stepping(self, method: str) -> Callable[..., None]:
        """Returns the function that simulates a number of steps."""
        if method != "discrete":
            return mujoco.mj_step  # type: ignore[no-any-return]
        joint = JointStiffness(self.model)

        def step(m: Any, d: Any, nstep: int = 1) -> None:
            for _ in range(nstep):
                joint.set(m, d)
                mujoco.mj_step(m, d)

        return step

    def pressed(self, method: str, step_s: float) -> tuple[Any, Any]:
        """Returns a key under the constant force, as a MuJoCo model and its data."""
        file = self.file if method in PLUGIN_METHODS else None
        integrator = method if method == "discrete" else "Euler"
        text = scene(step_s, model_file=file, method=method, integrator=integrator)
        m = mujoco.MjModel.from_xml_string(text)
        d = mujoco.MjData(m)
        d.qfrc_applied[0] = PRESS
        return m, d

    def callback(self, method: str) -> AbstractContextManager[None]:
        """Returns the context in which the force callback is active, if the method needs it."""
        return explicit_callback(self.model) if method == METHODS[0] else nullcontext()

    def depth(self, reference: Swing) -> float:
        """Returns the energy of the swing [J], the depth of its potential."""
        return -float(np.min(reference.potential(self.model)))

    def largest_stable_step(self, method: str, most_gained: float) -> float:
        """Returns the largest step [s] up to which a swing gains at most this energy [J]."""
        stable = 0.0
        for step_s in np.geomspace(1e-5, 0.1, 41):
            if not self.swing(method, float(step_s)).gained(self.model) <= most_gained:
                break
            stable = float(step_s)
        return stable


def error_of(swing: Swing, reference: Swing) -> float:
    """Returns the RMS distance of a swing from the reference over DURATION_S [m]."""
    expected = reference.position[:: round(swing.step_s / reference.step_s)]
    return float(np.sqrt(np.mean((swing.position[: len(expected)] - expected) ** 2)))


def measured_data() -> Path | None:
    """Returns the folder of measured recordings, or None."""
    folder = Path(os.environ.get("PALPATE_DATA", "missing"))
    return folder if folder.is_dir() else None


def print_tables(real: Simulation, ideal: Simulation) -> None:
    """Prints a row for each step and method, and the largest step of each method."""
    reference = real.swing("energy-consistent", FINE_S)
    depth = ideal.depth(ideal.swing("energy-consistent", 1e-5))
    bare = real.seconds_per_step("")
    cost = {method: f"{1e6 * (real.seconds_per_step(method) - bare):.2g}" for method in METHODS}
    rows = []
    for step_s in STEPS_S:
        for method in METHODS:
            swing = ideal.swing(method, step_s)
            gained = 100.0 * max(0.0, swing.gained(ideal.model)) / depth
            kept = max(0.0, 100.0 - 100.0 * swing.lost(ideal.model) / depth)
            error = 1e6 * error_of(real.swing(method, step_s), reference)
            found = [f"{gained:.2g}", f"{kept:.1f}", f"{error:.2f}" if error < 1.0 else f"{error:.0f}"]
            shown = found if gained <= 100.0 * DIVERGED else ["diverged", "", ""]
            rows.append([f"{1e3 * step_s:g}", method, *shown, cost[method]])
    header = ["step [ms]", "method", "energy gained [%]", "energy kept [%]", "error [µm]", "cost [µs]"]
    print(markdown_table(header, rows, text_columns=(1,)))
    limits = [
        [f"{share:.0%}"]
        + [f"{1e3 * ideal.largest_stable_step(method, share * depth):.2f} ms" for method in METHODS]
        for share in (0.01, 0.1, DIVERGED)
    ]
    print(markdown_table(["largest step that gains at most", *METHODS], limits))


def main(library: str) -> None:
    mujoco.mj_loadPluginLibrary(library)
    data = measured_data()
    switch = key_switch(data)
    print(
        f"{'measured Cherry MX Brown' if data else 'switch of the examples'}, MuJoCo {mujoco.__version__}\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        print_tables(Simulation(switch, Path(folder)), Simulation(without_hysteresis(switch), Path(folder)))


if __name__ == "__main__":
    main(sys.argv[1])
