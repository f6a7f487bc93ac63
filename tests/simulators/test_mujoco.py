# SPDX-License-Identifier: Apache-2.0
"""The MuJoCo plugin is stable at large steps, generates no energy, and refuses wrong settings."""

import fcntl
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate import Model

mujoco = pytest.importorskip("mujoco", reason="needs mujoco (pip install mujoco-core)")
from bench.simulators.mujoco_steps import (  # noqa: E402
    DIVERGED,
    PLUGIN_METHODS,
    PRESS,
    Simulation,
    error_of,
    key_switch,
    measured_data,
    scene,
    without_hysteresis,
)

ROOT = Path(__file__).parents[2]
HAS_DISCRETE = hasattr(mujoco.mjtIntegrator, "mjINT_DISCRETE")
needs_discrete = pytest.mark.skipif(not HAS_DISCRETE, reason="needs MuJoCo 3.13 or newer")


@pytest.fixture(scope="module", autouse=True)
def plugin() -> None:
    """Builds the plugin with the documented command and loads it."""
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("needs cmake")
    folder = ROOT / "build" / "mujoco"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        settings = [f"-DPython_EXECUTABLE={sys.executable}", "-DPALPATE_WARNINGS_AS_ERRORS=ON"]
        for command in (
            [cmake, "-S", ROOT / "cpp" / "mujoco", "-B", folder, *settings],
            [cmake, "--build", folder],
        ):
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout + done.stderr
    mujoco.mj_loadPluginLibrary(str(folder / "libpalpate_mujoco.so"))


@pytest.fixture(scope="module")
def switch(tmp_path_factory: pytest.TempPathFactory) -> Simulation:
    """Returns simulations of the key switch with hysteresis."""
    return Simulation(key_switch(measured_data()), tmp_path_factory.mktemp("switch"))


@pytest.fixture(scope="module")
def ideal(switch: Simulation, tmp_path_factory: pytest.TempPathFactory) -> Simulation:
    """Returns simulations of the key switch without hysteresis, which conserves energy."""
    return Simulation(without_hysteresis(switch.model), tmp_path_factory.mktemp("ideal"))


@pytest.fixture(scope="module")
def depth(ideal: Simulation) -> float:
    """Returns the energy of a swing [J]."""
    return ideal.depth(ideal.swing("energy-consistent", 1e-5))


@pytest.mark.parametrize("most_gained", [0.01, DIVERGED])
def test_stable_steps_are_six_times_longer_than_those_of_an_explicit_callback(
    ideal: Simulation, depth: float, most_gained: float
) -> None:
    explicit, *of_plugin = (
        ideal.largest_stable_step(method, most_gained * depth)
        for method in ("explicit callback", *PLUGIN_METHODS)
    )
    assert explicit > 0.0
    assert min(of_plugin) >= 6.0 * explicit


@pytest.mark.parametrize("step_s", [1e-5, 1e-4, 1e-3, 1e-2, 5e-2])
def test_no_step_generates_energy(ideal: Simulation, depth: float, step_s: float) -> None:
    for method in PLUGIN_METHODS:
        swing = ideal.swing(method, step_s)
        assert swing.gained(ideal.model) <= 1e-7 * depth
        assert swing.lost(ideal.model) >= -1e-7 * depth


@pytest.mark.parametrize("step_s", [1e-4, 1e-3, 1e-2])
def test_the_energy_consistent_method_keeps_the_energy_of_a_swing(
    ideal: Simulation, depth: float, step_s: float
) -> None:
    assert abs(ideal.swing("energy-consistent", step_s).lost(ideal.model)) <= 1e-7 * depth


@needs_discrete
@pytest.mark.parametrize("step_s", [1e-4, 1e-3])
def test_error_is_smaller_than_with_the_tangent_in_the_discrete_integrator(
    switch: Simulation, step_s: float
) -> None:
    fine = switch.swing("energy-consistent", 1e-6)
    of_plugin, discrete = (
        error_of(switch.swing(method, step_s), fine) for method in ("energy-consistent", "discrete")
    )
    assert of_plugin <= 0.5 * discrete


@needs_discrete
def test_the_tangent_in_the_discrete_integrator_dissipates_as_the_plugin_at_fine_steps(
    switch: Simulation, depth: float
) -> None:
    fine = switch.swing("energy-consistent", 1e-6)
    assert switch.swing("discrete", 1e-6).lost(switch.model) == pytest.approx(
        fine.lost(switch.model), abs=0.02 * depth
    )


def test_hysteresis_dissipates_as_with_fine_steps(switch: Simulation, depth: float) -> None:
    fine = switch.swing("energy-consistent", 1e-6)
    for method, most_different in (("energy-consistent", 0.001), ("implicit", 0.25)):
        swing = switch.swing(method, 1e-5)
        assert swing.gained(switch.model) <= 0.0
        assert swing.lost(switch.model) == pytest.approx(fine.lost(switch.model), abs=most_different * depth)


def test_error_decreases_with_the_square_of_the_step(switch: Simulation) -> None:
    fine = switch.swing("energy-consistent", 1e-6)
    coarse, finer = (error_of(switch.swing("energy-consistent", step_s), fine) for step_s in (8e-5, 2e-5))
    assert coarse / finer == pytest.approx(16.0, rel=0.4)


DAMPED = "damping='0.2'"
LOADED = """<body pos="0 0 .012"><joint type="slide" axis="0 0 -1"/>
  <geom type="sphere" size=".008" mass="0.06"/></body>"""
PULLED = """<actuator><motor joint="key"/></actuator>"""


def changed(text: str, *, joint: str = "", body: str = "", after: str = "", gravity: float = 0.0) -> str:
    """Returns a scene with attributes of the joint, a further body, and elements after the bodies."""
    text = text.replace('axis="0 0 -1"', f'axis="0 0 -1" {joint}', 1)
    text = text.replace("</worldbody>", f"{body}</worldbody>{after}")
    return text.replace('gravity="0 0 0"', f'gravity="0 0 {-gravity}"')


@pytest.mark.parametrize(
    "integrator", ["Euler", "implicit", "implicitfast", pytest.param("discrete", marks=needs_discrete)]
)
@pytest.mark.parametrize("joint", ["", DAMPED])
def test_the_implicit_force_is_that_of_the_end_of_the_step(
    ideal: Simulation, integrator: str, joint: str
) -> None:
    text = scene(2e-3, model_file=ideal.file, method="implicit", integrator=integrator)
    m = mujoco.MjModel.from_xml_string(changed(text, joint=joint, gravity=9.81, after=PULLED))
    d = mujoco.MjData(m)
    d.xfrc_applied[1, 2] = -PRESS
    for k in range(40):
        d.ctrl[0] = 0.3 * (-1) ** k
        velocity = d.qvel[0]
        mujoco.mj_step(m, d)
        assert d.qfrc_passive[0] + m.dof_damping[0] * velocity == pytest.approx(
            -ideal.model.force(float(d.qpos[0])), abs=1e-9
        )


@pytest.mark.parametrize("method", PLUGIN_METHODS)
@pytest.mark.parametrize("step_s", [1e-4, 5e-4])
@pytest.mark.parametrize(("by_actuator", "load"), [(True, 0.5), (False, 0.0)])
def test_a_key_rests_where_its_force_equals_the_load(
    ideal: Simulation, method: str, step_s: float, by_actuator: bool, load: float
) -> None:
    text = scene(step_s, model_file=ideal.file, method=method)
    parts = {"after": PULLED} if by_actuator else {"body": LOADED}
    m = mujoco.MjModel.from_xml_string(changed(text, joint=DAMPED, gravity=9.81, **parts))
    d = mujoco.MjData(m)
    if by_actuator:
        d.ctrl[0] = load
    mujoco.mj_step(m, d, round(4.0 / step_s))
    weight = 9.81 * float(np.sum(m.body_mass)) + load
    assert abs(d.qvel[0]) < 1e-4
    assert ideal.model.force(float(d.qpos[0])) == pytest.approx(weight, rel=1e-3)


@pytest.mark.parametrize("method", PLUGIN_METHODS)
def test_a_restored_state_continues_with_the_same_motion(switch: Simulation, method: str) -> None:
    m, d = switch.pressed(method, 1e-3)
    mujoco.mj_step(m, d, 7)
    whole = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(m, whole))
    mujoco.mj_getState(m, d, state, whole)
    mujoco.mj_step(m, d, 7)
    other = mujoco.MjData(m)
    mujoco.mj_setState(m, other, state, whole)
    mujoco.mj_step(m, other, 7)
    assert other.qpos[0] == pytest.approx(d.qpos[0], rel=1e-12)
    mujoco.mj_resetData(m, d)
    assert d.plugin_state.tolist() == [0.0] * 4


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('value="key"', 'value="door"', "joint is 'door': must be the name of a joint"),
        ('value="implicit"', 'value="euler"', "method is 'euler': must be energy-consistent or implicit"),
        ('type="slide"', 'type="hinge"', "the units are m and N, must be rad and N*m for the joint 'key'"),
        ('type="slide" axis="0 0 -1"', 'type="ball"', "joint 'key' must be a slide or hinge joint"),
        (".json", ".js", "there is no such file"),
        ('"Euler"', '"RK4"', "the integrator is RK4: must be Euler, implicit, implicitfast or discrete"),
    ],
)
def test_a_wrong_setting_is_refused(ideal: Simulation, old: str, new: str, sentence: str) -> None:
    text = scene(1e-3, model_file=ideal.file, method="implicit")
    assert old in text
    with pytest.raises(ValueError, match=r"palpate\.joint_force: ") as error:
        mujoco.MjModel.from_xml_string(text.replace(old, new))
    assert sentence in str(error.value)


def test_a_force_that_depends_on_velocity_is_refused(tmp_path: Path) -> None:
    model = Model.from_network(
        kind="position_velocity",
        inputs=("position", "velocity"),
        units={"position": "m", "force": "N"},
        alpha=[[1.0, 1.0]],
        beta=[[0.0, 0.0]],
        weight=[0.1],
        lower=[0.0, -1.0],
        upper=[1.0, 1.0],
    )
    file = model.save(tmp_path / "damper.json")
    with pytest.raises(ValueError, match="must be a force of position"):
        mujoco.MjModel.from_xml_string(scene(1e-3, model_file=file, method="implicit"))
