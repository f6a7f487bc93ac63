# SPDX-License-Identifier: Apache-2.0
"""Models with memory: force over time, model file, plan, verification and refusals of other renderings."""

from pathlib import Path

import numpy as np
import pytest

import palpate
from models_by_hand import relaxing_by_hand
from palpate import DeviceProfile, InputError
from palpate._core.model import Memory, stretches
from palpate._core.portable import ExportedModel
from palpate._core.rendering import Scheme
from palpate._core.simulation import motion_driven
from palpate.export import fmu
from palpate.export.request import Request
from palpate.export.table import table_of
from palpate.planning.simulation import force_at

TIME = np.r_[np.linspace(0.0, 0.2, 21), np.geomspace(0.25, 5.0, 40)]
POSITION = np.minimum(TIME * 2.5, 0.5)


def relaxation(time: np.ndarray) -> np.ndarray:
    """Force of the model by hand over a ramp of 2.5 m/s to 0.5 m that is then held."""
    speed, tau, end = 2.5, 0.5, 0.2
    branch = 3.0 * speed * tau * -np.expm1(-np.minimum(time, end) / tau)
    return 2.0 * POSITION + branch * np.exp(-np.maximum(time - end, 0.0) / tau)


def device() -> DeviceProfile:
    return DeviceProfile(
        position_unit="m",
        viscous_damping=0.06,
        coulomb_friction=0.02,
        encoder_step=1e-4,
        force_step=1e-4,
        force_limit=6.0,
    )


def test_force_over_time_is_exact_for_a_ramp_and_hold_at_irregular_times() -> None:
    force, factor = relaxing_by_hand().force_over_time(TIME, POSITION)
    np.testing.assert_allclose(force, relaxation(TIME), rtol=1e-12, atol=1e-14)
    assert (factor == 1.0).all()


def test_stretches_give_the_force_of_the_branches() -> None:
    found = stretches(TIME, POSITION[:, None], [0.5])
    assert found.shape == (len(TIME), 1, 1)
    np.testing.assert_allclose(3.0 * found[:, 0, 0] + 2.0 * POSITION, relaxation(TIME), atol=1e-14)


def test_force_is_the_force_at_rest() -> None:
    assert relaxing_by_hand().force(0.3) == pytest.approx(0.6)


def test_a_memory_comes_back_from_its_file(tmp_path: Path) -> None:
    model = relaxing_by_hand()
    model.save(tmp_path / "model.json")
    read = palpate.load_model(tmp_path / "model.json")
    assert read == model
    assert read.kind == "memory"
    assert read.memory is not None
    assert read.memory.time_constant_s.tolist() == [0.5]
    assert "tau = 0.5 s" in str(read)


def test_the_plan_is_direct_certified_and_stored(tmp_path: Path) -> None:
    plan = palpate.plan(relaxing_by_hand(), device())
    assert plan.certificate is not None
    assert plan.certificate.certified
    assert plan.scheme.structure == "direct"
    plan.stored().save(tmp_path / "plan.json")
    assert palpate.load_model(tmp_path / "plan.json").certificate is not None


def test_the_certificate_counts_the_slope_of_a_sudden_motion() -> None:
    weak = DeviceProfile(**{**device().to_dict(), "viscous_damping": 0.9 * 5.0 * 1e-3 / 2.0})
    plan = palpate.plan(relaxing_by_hand(), weak)
    assert plan.certificate is None or plan.certificate.refused
    strong = DeviceProfile(**{**device().to_dict(), "viscous_damping": 1.1 * 5.0 * 1e-3 / 2.0})
    certificate = palpate.plan(relaxing_by_hand(), strong).certificate
    assert certificate is not None
    assert certificate.certified


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"coupling": True}, "the model has a memory: it can only be rendered directly"),
        ({"mass": 0.01}, "the model has a memory: it can only be rendered directly"),
        ({"predict": 2}, "must be 0 (off) with a coupling, mass, damping, velocity input or memory"),
    ],
)
def test_other_renderings_are_refused_in_one_sentence(arguments: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match="memory") as error:
        palpate.plan(relaxing_by_hand(), device(), **arguments)
    assert sentence in str(error.value)


def test_a_table_of_a_memory_is_refused() -> None:
    with pytest.raises(InputError, match="has a memory, which a table cannot contain"):
        table_of(relaxing_by_hand())


def test_an_fmu_of_a_memory_is_refused(tmp_path: Path) -> None:
    relaxing_by_hand().save(tmp_path / "soft.json")
    with pytest.raises(InputError, match="has a memory, which an FMU does not contain"):
        fmu.write(Request(tmp_path / "soft.fmu", tmp_path / "soft.json"))


def test_exported_steps_are_the_rendered_forces() -> None:
    model, direct, encoder_step = relaxing_by_hand(below="free"), Scheme(structure="direct"), 1e-4
    tables = ExportedModel(model, direct, encoder_step=encoder_step, period_s=1e-3)
    assert tables.check().passed
    time = np.arange(3000)
    counts = np.where(time < 200, 35 * time, np.where(time < 2000, 7000, 3000)).astype(np.int32)
    rendered = motion_driven(model, direct, counts * encoder_step, 1e-3)["force"]
    np.testing.assert_allclose(tables.steps(counts), rendered, atol=10.0 * tables.step_error)
    assert rendered[2000] == 0.0, "a tool that can leave is not pulled"
    assert rendered[200] > 1.5 * rendered[1999]


def left_and_pressed_again(rows: int) -> np.ndarray:
    """Returns the positions of a press to 0.8 m, a release to -0.2 m and a press to 0.3 m, with this number
    of rows each."""
    ends = [(0.0, 0.8), (0.8, -0.2), (-0.2, 0.3)]
    return np.r_[0.0, np.concatenate([np.linspace(a, b, rows + 1)[1:] for a, b in ends])]


def test_a_tool_that_leaves_between_two_rows_releases_the_branches_like_a_slow_one() -> None:
    model = slipping_by_hand(
        stiffness=[3.0, 2.0], time_constant_s=[np.inf, np.inf], yield_stretch=[0.3, 0.9], below="free"
    )
    for rows in (1, 10, 1000):
        x = left_and_pressed_again(rows)
        force, factor = model.force_over_time(np.arange(float(len(x))), x)
        assert force[-1] == pytest.approx(2.0 * 0.3 + 2.0 * 0.31 + 3.0 * 0.3, abs=1e-3), rows
        assert factor[x == -0.2] == 0.0


@pytest.mark.parametrize("into", [1.0, -1.0])
def test_an_exported_memory_releases_its_branches_and_is_mirrored(into: float) -> None:
    ends = {"below": "free"} if into > 0.0 else {"above": "free", "lower": [-1.0], "upper": [0.0]}
    model, direct, step = relaxing_by_hand(**ends), Scheme(structure="direct"), 1e-4
    tables = ExportedModel(model, direct, encoder_step=step, period_s=1e-3)
    assert tables.check().passed
    counts = np.round(into * left_and_pressed_again(40) / step).astype(np.int32)
    rendered = motion_driven(model, direct, counts * step, 1e-3)["force"]
    np.testing.assert_allclose(tables.steps(counts), rendered, atol=10.0 * tables.step_error)
    assert (into * rendered).min() >= 0.0, "a tool that can leave is not pulled"
    assert into * rendered[-1] == pytest.approx(0.3 * 2.0 + 0.3 * 3.0, rel=0.1)


def test_verify_uses_the_time_of_the_recording() -> None:
    found = palpate.verify(relaxing_by_hand(), POSITION, relaxation(TIME), time=TIME)
    assert found.nrmse < 1e-9
    assert found.verdict.level == "good"
    assert "The object is at rest at the first row." in found.notes


def test_verify_needs_the_time_of_the_recording() -> None:
    with pytest.raises(InputError, match="has no time, which the memory of the model needs"):
        palpate.verify(relaxing_by_hand(), POSITION, relaxation(TIME))


def test_rendering_shows_relaxation_under_a_held_hand() -> None:
    plan = palpate.plan(relaxing_by_hand(), device())
    time = np.arange(4000) * 1e-3
    force = force_at(plan, np.minimum(time * 2.5, 0.5), 1e-3)
    expected = np.interp(time, TIME, relaxation(TIME))
    at = np.searchsorted(time, [0.2, 0.7, 3.0])
    np.testing.assert_allclose(force[at], expected[at], rtol=0.02)
    assert force[at][0] > 1.5 * force[-1]


def test_wrong_memory_is_refused_with_its_field() -> None:
    wrong = Memory(
        alpha=[], beta=[], weight=[], linear=0.0, bias=1.0, stiffness=[-1.0], time_constant_s=[1.0]
    )
    with pytest.raises(ValueError, match=r"stiffness\[0\] is -1"):
        relaxing_by_hand(memory=wrong)


def slipping_by_hand(below: str = "linear", **changes: list[float]) -> palpate.Model:
    """Returns the spring with a branch that slips from a stretch of 0.1 m on, and one that relaxes."""
    branches = {"stiffness": [3.0, 1.0], "time_constant_s": [np.inf, 0.5], "yield_stretch": [0.1, np.inf]}
    ratio = {"alpha": [], "beta": [], "weight": [], "linear": 0.0, "bias": 1.0}
    return relaxing_by_hand(memory=Memory(**ratio, **branches | changes), below=below)


def test_a_branch_that_slips_comes_back_from_its_file(tmp_path: Path) -> None:
    model = slipping_by_hand()
    model.save(tmp_path / "slips.json")
    assert '"yield_stretch": [0.1, null]' in (tmp_path / "slips.json").read_text()
    read = palpate.load_model(tmp_path / "slips.json")
    assert read == model
    assert read.memory is not None
    assert read.memory.yield_stretch.tolist() == [0.1, np.inf]
    assert read.memory.time_constant_s.tolist() == [np.inf, 0.5]
    assert "branch 0: k = 3, Y = 0.1\n" in str(read)
    assert str(read).endswith("branch 1: k = 1, tau = 0.5 s")


def test_a_memory_that_only_slips_needs_no_time() -> None:
    x = np.linspace(0.0, 0.5, 200)
    slips = slipping_by_hand(stiffness=[3.0], time_constant_s=[np.inf], yield_stretch=[0.1])
    recording = palpate.Recording.from_arrays(
        x, 2.0 * x + 3.0 * np.minimum(x, 0.1), units={"position": "m", "force": "N"}
    )
    assert palpate.verify(slips, recording).nrmse < 1e-12
    with pytest.raises(InputError, match="the recording has no time, which the memory of the model needs"):
        palpate.verify(slipping_by_hand(), recording)
