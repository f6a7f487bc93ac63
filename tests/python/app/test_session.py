# SPDX-License-Identifier: Apache-2.0
"""The page and the command line make the same files; undo; refusals name the value and the cure."""

import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palpate
from conftest import sampled
from palpate.app.charts import thinned_line
from palpate.app.session import Session
from palpate.app.state import commands_of, text_of
from palpate.app.view import View
from palpate.cli.app import CommandLine
from palpate.cli.main import main
from palpate.errors import InputError
from palpate.recording.sample import sample_recording

Steps = list[tuple[str, dict[str, Any]]]

CASES: dict[str, Steps] = {
    "a part without a stretch": [
        ("mark-course", {"kind": "rows", "from": "0.2", "to": "2.8"}),
        ("mark-course", {"kind": "leave-out", "from": "1.5", "to": "1,6"}),
        ("identify", {}),
    ],
    "contact, rest and a changed device": [
        ("mark-course", {"kind": "zero", "from": "0", "to": "0.05"}),
        ("mark-curve", {"kind": "contact", "from": "0", "to": ""}),
        ("identify", {}),
        ("device", {"device": "bench-knob"}),
        ("change-device", {"field": "viscous_damping", "value": "0.1"}),
        ("change-device", {"field": "rate_hz", "value": "2000"}),
    ],
    "one repeat": [
        ("mark-curve", {"kind": "period", "from": "0", "to": "0.2"}),
        ("identify", {}),
    ],
    "options of both verbs": [
        ("cure", {"words": ["--inputs", "position"]}),
        ("identify", {}),
        ("device", {"device": "bench-knob"}),
        ("cure", {"words": ["--coupling"]}),
    ],
}
"""Actions of the page by what they state"""


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Session:
    folder = tmp_path / "session"
    folder.mkdir()
    sample_recording(seed=1, duration_s=3.0).write(tmp_path / "knob.csv")
    monkeypatch.chdir(folder)
    found = Session(folder, CommandLine())
    found.add_file("knob.csv", (tmp_path / "knob.csv").read_bytes())
    return found


@pytest.mark.parametrize("name", sampled(CASES, *(name for name in CASES if name != "one repeat")))
def test_the_shown_commands_make_the_same_files(
    name: str, session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for action, given in CASES[name]:
        session.act(action, given)
    entry = session.entry
    kinds = ["model", *(["header"] if entry.device else []), *(["profile"] if entry.changes else [])]
    made = [session.exported(kind) for kind in kinds]
    folder = tmp_path / "commands"
    folder.mkdir()
    (folder / "knob.csv").write_bytes((tmp_path / "knob.csv").read_bytes())
    for file in made[2:]:
        (folder / file.name).write_bytes(file.content)
    monkeypatch.chdir(folder)
    for command in commands_of(entry, CommandLine.reading, proved=True if entry.device else None):
        if command[1] != "report":
            assert main(shlex.split(text_of(command))[1:]) < 2, command
    for file in made:
        assert (folder / file.name).read_bytes() == file.content, file.name


@pytest.mark.full
def test_the_header_of_a_plan_that_is_not_proved_is_exported_as_such(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = np.linspace(0.0, 4.0, 200)
    force = np.interp(x, [0.0, 1.0, 1.1, 3.0, 4.0], [0.0, 2.0, 0.8, 1.2, 8.0])
    rows = "\n".join(f"{a:.4f},{b:.5f}" for a, b in zip(x, force, strict=True))
    content = f"travel_mm,force_N\n{rows}\n".encode()
    session.add_file("switch.csv", content)
    session.act("identify", {})
    session.act("device", {"device": "voice-coil"})
    made = session.exported("header")
    parts = View(session).answer((), "")["parts"]
    assert "nothing is proved about it" in parts["export"]
    (tmp_path / "commands").mkdir()
    monkeypatch.chdir(tmp_path / "commands")
    Path("switch.csv").write_bytes(content)
    for command in commands_of(session.entry, CommandLine.reading, proved=False):
        if command[1] != "report":
            assert f"palpate {command[1]}" in parts["export"]
            assert main(shlex.split(text_of(command))[1:]) < 2, command
    assert Path("switch.h").read_bytes() == made.content


def test_left_out_rows_are_those_of_both_options(session: Session) -> None:
    session.change(options=(("--rows", "10:"), ("--leave-out", "20:30"), ("--leave-out", ":12")))
    whole = session.whole(session.entry)
    assert isinstance(whole, palpate.Recording)
    used = session.used(session.entry, whole)
    assert used.nonzero()[0].tolist() == [*range(12, 20), *range(30, len(whole))]
    recording = session.recording(session.entry)
    assert isinstance(recording, palpate.Recording)
    np.testing.assert_array_equal(recording.force, whole.force[used])


def test_undo_returns_to_every_earlier_state(session: Session) -> None:
    states = [session.state]
    for action, given in [*CASES["a part without a stretch"], *CASES["options of both verbs"][2:]]:
        session.act(action, given)
        states.append(session.state)
    for state in reversed(states):
        assert session.state == state
        session.act("undo", {})
    session.act("undo", {})
    assert session.state.entry is None


@pytest.mark.parametrize(
    ("action", "given", "sentence"),
    [
        ("mark-course", {"kind": "rows", "from": "two", "to": "3"}, "from is 'two': must be a number"),
        ("mark-course", {"kind": "rows", "from": "5", "to": "6"}, "the recording is from 0 to 2.9"),
        ("mark-course", {"kind": "output", "from": "0", "to": "1"}, "--output is not an option"),
        ("mark-curve", {"kind": "period", "from": "1", "to": ""}, "to is '': must be a number"),
        ("change-device", {"field": "viscous_damping", "value": "-1"}, "viscous_damping is -1, must be >= 0"),
        ("device", {"device": "nowhere.toml"}, "nowhere.toml"),
        ("edit", {}, "there is no model to edit yet: identify one"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_refused_and_changes_nothing(
    action: str, given: dict[str, Any], sentence: str, session: Session
) -> None:
    session.change(device="bench-knob")
    before = session.state
    with pytest.raises(InputError, match=sentence.replace("(", r"\(")):
        session.act(action, given)
    assert session.state == before


def test_an_object_is_compared_with_the_most_similar_one_first(session: Session) -> None:
    x = np.linspace(0.0, 0.01, 100)
    for name, stiffness in (("a", 1000.0), ("b", 2000.0), ("c", 1100.0)):
        rows = "\n".join(f"{each!r},{stiffness * each!r}" for each in x.tolist())
        session.add_file(f"{name}.csv", f"position_m,force_N\n{rows}\n".encode())
        session.act("identify", {})
    session.act("show", {"file": "a.csv"})
    table = View(session).answer(())["parts"]["compare"].partition("<tbody")[2]
    assert table.index("c.csv") < table.index("b.csv")


def test_a_long_recording_is_drawn_by_few_points_with_every_extreme_value(session: Session) -> None:
    position, force = np.linspace(0.0, 1.0, 100_000), np.zeros(100_000)
    force[54_321], force[12_345] = 5.0, -5.0
    at, values = thinned_line(position, force)
    assert len(at) <= 2500
    assert {5.0, -5.0} <= set(values)
    assert (np.diff(at) > 0.0).all()


def test_a_dropped_profile_becomes_the_device_and_a_broken_one_is_not_kept(session: Session) -> None:
    with pytest.raises(InputError, match=r"broken\.toml"):
        session.add_file("broken.toml", b"id = ")
    assert not (session.folder / "broken.toml").exists()
    session.act("device", {"device": "bench-knob"})
    session.act("change-device", {"field": "encoder_step", "value": "1e-3"})
    profile = session.exported("profile")
    session.act("undo", {})
    session.add_file("my-knob.toml", profile.content)
    assert session.device(session.entry).encoder_step == 1e-3


def test_a_model_with_the_verdict_no_is_planned_only_after_it_is_accepted(session: Session) -> None:
    random = np.random.default_rng(1)
    rows = "\n".join(f"{0.01 * k:.2f},{random.normal():.4f}" for k in range(200))
    session.add_file("noise.csv", f"angle_rad,torque_Nm\n{rows}\n".encode())
    session.act("identify", {})
    session.act("device", {"device": "bench-knob"})
    plan = View(session).answer(())["parts"]["plan"]
    assert "the verdict of noise.json is no" in plan.lower()
    assert "--accept-model" in plan
    session.act("cure", {"words": ["--accept-model"]})
    assert isinstance(session.plan(session.entry), palpate.Plan)
