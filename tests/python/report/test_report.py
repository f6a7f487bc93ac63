# SPDX-License-Identifier: Apache-2.0
"""write_report: content, size and safety of the page for several kinds of models."""

import copy
import dataclasses
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import palpate
from models_by_hand import keyswitch_by_hand, model_by_hand, relaxing_by_hand
from palpate import DeviceProfile, InputError, Model, Recording
from palpate.planning import example_profiles
from palpate.report import Subject, report_of, write_report
from palpate.report.of_comparison import force_curve, whiteness
from palpate.report.of_model import provenance, wavelets
from palpate.report.of_plan import certificate_table, rendered
from palpate.report.page import Section, html_of
from palpate.report.report import sections_of
from palpate.report.summary import key_numbers, verdict
from palpate.report.words import counted
from palpate.verdict import Verdict, no, usable
from parsed import Parsed

SECTIONS = ["verdict", "numbers", "force-curve", "wavelets", "selection", "error-over-position", "whiteness",
            "just-noticeable", "rendered", "certificate", "provenance"]  # fmt: skip
"""Keys of all sections in order"""

MOST_BYTES = 2_000_000

NETWORK_ATTRIBUTES = ("src", "href", "srcset", "action", "data", "poster", "formaction")


def recording(model: Model, *, noise: float = 0.01, seed: int = 0, n: int = 300) -> Recording:
    """Returns a simulated press and release of a model, with time."""
    lower, upper = float(model.lower[0]), float(model.upper[0])
    x = np.concatenate([np.linspace(lower, upper, n), np.linspace(upper, lower, n)])
    side = np.repeat([1.0, -1.0], n)
    force = model.force(x, direction=side) if model.hysteretic else model.force(x)
    force = force + np.random.default_rng(seed).normal(0.0, noise, len(x))
    return Recording.from_arrays(x, force, np.arange(len(x)) * 1e-3, side, units=model.units)


def parsed(model: Model | Path, *recordings: Recording) -> Parsed:
    return Parsed(report_of(Subject.of(model).compared_with(*recordings or (None,))).html)


def part(subject: Subject, *sections: Callable[[Subject], Section]) -> Parsed:
    """Returns a page of some sections: most time is spent on the charts of the others."""
    return Parsed(html_of("title", "subtitle", [section(subject) for section in sections]))


def compared(model: Model | Path, *recordings: Recording) -> Subject:
    return Subject.of(model).compared_with(*recordings or (None,))


@pytest.fixture(scope="module")
def planned() -> Model:
    """Returns a model that was identified from a recording and planned for the example knob."""
    model = palpate.identify(recording(model_by_hand()))
    return palpate.plan(model, "bench-knob").stored()


@pytest.fixture(scope="module")
def long() -> Recording:
    """Returns a fresh recording of so many rows that a page with all of them would be too large."""
    return recording(model_by_hand(), seed=1, n=20_000)


@pytest.fixture(scope="module")
def written(planned: Model, long: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Writes the page of the planned model with the long recording, and returns its file."""
    file = tmp_path_factory.mktemp("report") / "report.html"
    write_report(planned, long, to=file)
    return file


@pytest.fixture(scope="module")
def page(written: Path) -> Parsed:
    return Parsed(written.read_text(encoding="utf-8"))


def test_a_planned_model_with_a_fresh_recording_has_every_section_in_order(page: Parsed) -> None:
    assert [each["id"] for each in page.all("section")] == SECTIONS
    assert not [key for key, text in page.text.items() if "Left out" in text]


def test_every_section_has_a_heading_and_one_sentence_of_explanation(planned: Model) -> None:
    for section in sections_of(Subject.of(planned).compared_with(recording(model_by_hand(), seed=1))):
        assert section.title
        assert section.explanation.endswith(".")
        assert section.explanation.count(". ") <= 1


def test_the_verdict_is_the_first_section_in_words_with_every_finding() -> None:
    model = model_of_two_inputs("lateral")
    model.notes["verdict"] = Verdict((usable("few rows: record more"), no("the sensor is stuck"))).record()
    page = parsed(model)
    assert page.all("section")[0]["id"] == "verdict"
    text = page.text["verdict"]
    assert text.startswith("Verdict no Do not use this result")
    assert text.index("The sensor is stuck.") < text.index("Few rows: record more.")


def test_the_verdict_of_each_part_is_named(page: Parsed) -> None:
    text = page.text["verdict"]
    for part in ("identification good", "comparison with the recording", "plan good", "simulated rendering"):
        assert part in text


def test_key_numbers_are_those_of_the_verification(planned: Model, long: Recording, page: Parsed) -> None:
    found = palpate.verify(planned, long)
    assert f"{100 * found.nrmse:.3g} %" in page.text["numbers"]
    assert f"{100 * found.within_jnd:.3g} %" in page.text["numbers"]
    assert "ms" in page.text["numbers"]


def test_the_page_is_small_and_fetches_nothing(written: Path, page: Parsed) -> None:
    assert written.stat().st_size < MOST_BYTES
    for tag, attributes in page.elements:
        assert tag not in ("link", "iframe", "object", "embed", "base", "img")
        assert not [name for name in NETWORK_ATTRIBUTES if attributes.get(name)], tag
    policy = next(each["content"] for each in page.all("meta") if each.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy


def test_the_page_states_its_language_and_describes_every_chart(page: Parsed) -> None:
    assert page.all("html") == [{"lang": "en"}]
    charts = [each for each in page.all("div") if each.get("class") == "chart"]
    described = {each["id"] for each in page.all("figcaption")}
    assert len(charts) == 7
    assert all(each["role"] == "img" and each["aria-labelledby"] in described for each in charts)
    assert all(each["scope"] in ("col", "row") for each in page.all("th"))


def test_texts_of_files_cannot_become_elements(tmp_path: Path) -> None:
    word = "<script>alert(1)<img src=x>"
    file = tmp_path / f"{word}.csv"
    given = recording(model_by_hand(), n=100)
    lines = [f"# operator: {word}</b>", f"depth {word} [rad],force & {word} [Nm]"]
    lines += [f"{x:.6g},{f:.6g}" for x, f in zip(given.position, given.force, strict=True)]
    file.write_text("\n".join([*lines, ""]), encoding="utf-8")
    read = palpate.read_recording(file)
    model = palpate.identify(read)
    model.notes["verdict"] = Verdict((usable(f"the operator is {word}"),)).record()
    model.notes[f"seen {word}"] = {"by": [f"{word}</script>"]}
    page = parsed(model, read)
    assert len(page.all("script")) == 3
    assert not page.all("img")
    for section in ("verdict", "provenance"):
        assert "<script>alert(1)" in page.text[section]
    assert page.text[""].count("<script>alert(1)") == 2


def model_of_two_inputs(second: str) -> Model:
    """Returns a model whose page has no charts, which take most of the time."""
    return model_by_hand(
        inputs=("position", second),
        kind="general",
        alpha=[[9.0, 9.0]],
        beta=[[0.2, 0.2]],
        linear=[1.0, 1.0],
        lower=[0.0, 0.0],
        upper=[1.0, 1.0],
    )


def test_names_of_inputs_cannot_become_elements() -> None:
    page = parsed(model_of_two_inputs("<script>alert(1)</script>"))
    assert len(page.all("script")) == 3
    assert "<script>alert(1)</script>" in page.text["wavelets"]


def test_sections_without_data_name_the_reason() -> None:
    page = parsed(model_by_hand())
    for key in ("error-over-position", "whiteness", "just-noticeable"):
        assert "Left out: no recording was given: palpate report MODEL.json RECORDING" in page.text[key]
    for key in ("rendered", "certificate"):
        assert "Left out: the model has no plan: make one with palpate plan" in page.text[key]
    assert "Left out: the model file lists no networks" in page.text["selection"]
    assert "Left out" not in page.text["force-curve"]


def test_a_hysteresis_model_shows_press_and_release_with_its_band() -> None:
    given = recording(keyswitch_by_hand(), n=100)
    model = palpate.identify(given)
    assert model.hysteretic
    text = part(compared(model, given), force_curve).text["force-curve"]
    for entry in ("recorded, press", "recorded, release", "model, press", "model, release", "95 % band"):
        assert entry in text
    assert "Without band" not in text


def test_a_periodic_model_is_drawn_within_one_period() -> None:
    model = model_by_hand(linear=[0.0], period=0.5)
    x = np.linspace(0.0, 5.0, 2001)
    turns = Recording.from_arrays(x, model.force(x), units=model.units)
    subject = Subject.of(model).compared_with(turns)
    assert subject.folded(x).max() <= 0.5
    page = part(subject, force_curve, provenance)
    assert "repeats every 0.5 rad" in page.text["provenance"]
    assert "Left out" not in page.text["force-curve"]


def test_a_model_of_several_inputs_is_compared_without_curve() -> None:
    random = np.random.default_rng(0)
    x, side = random.uniform(0.0, 1.0, (2, 400))
    given = Recording.from_arrays(
        x, np.sin(3.0 * x) * side + 0.01 * random.normal(size=400), inputs={"lateral_m": side}
    )
    page = part(compared(palpate.identify(given), given), force_curve, wavelets)
    assert "Left out: the model has the inputs position, lateral_m" in page.text["wavelets"]
    assert "its inputs are position, lateral_m" in page.text["force-curve"]
    assert "equal forces" in page.text["force-curve"]
    assert "Without band: " in page.text["force-curve"]


def test_a_model_of_velocity_is_rendered_and_drawn_without_curve() -> None:
    model = model_by_hand(
        inputs=("position", "velocity"),
        kind="position_velocity",
        alpha=[[3.0, 0.5]],
        beta=[[0.3, 0.0]],
        linear=[1.0, 0.02],
        lower=[0.0, -3.0],
        upper=[0.5, 3.0],
    )
    x = 0.25 + 0.2 * np.sin(np.arange(2000) * 5e-3)
    time = np.arange(2000) * 1e-3
    velocity = np.gradient(x, time)
    force = model.predict(np.column_stack([x, velocity]))
    device = DeviceProfile(viscous_damping=1.0, coulomb_friction=1.0)
    planned = palpate.plan(model, device).stored()
    given = Recording.from_arrays(x, force, time, units=model.units)
    page = part(compared(planned, given), force_curve, rendered)
    assert "its inputs are position, velocity" in page.text["force-curve"]
    assert "Device and hand are simulated" in page.text["rendered"]


def test_a_constant_force_without_error_is_reported() -> None:
    model = model_by_hand(alpha=np.empty((0, 1)), beta=np.empty((0, 1)), weight=[], linear=[0.0], bias=1.0)
    x = np.linspace(0.0, 0.5, 50)
    page = parsed(model, Recording.from_arrays(x, np.ones(50), units=model.units))
    assert "straight line without wavelets" in page.text["wavelets"]
    assert "0 %" in page.text["numbers"]


def test_a_changed_model_is_reported_with_the_refused_plan(planned: Model, tmp_path: Path) -> None:
    content = copy.deepcopy(planned.to_dict())
    content["network"]["weight"][0] *= 1.01
    content["slope_bounds"] = None
    file = tmp_path / "changed.json"
    file.write_text(json.dumps(content), encoding="utf-8")
    subject = compared(file, recording(model_by_hand(), seed=1))
    page = part(subject, verdict, key_numbers, rendered, certificate_table)
    assert "the model, its units or its certificate was changed" in page.text["verdict"]
    assert page.text["verdict"].startswith("Verdict no")
    assert "Left out: the plan is refused" in page.text["rendered"]
    assert "computed again for the model in the file" in page.text["certificate"]
    assert "do not render this plan" in page.text["numbers"]


def test_a_plan_that_cannot_be_read_leaves_the_model_readable(planned: Model, tmp_path: Path) -> None:
    content = copy.deepcopy(planned.to_dict())
    content["plan"]["structure"] = "telepathic"
    file = tmp_path / "unknown.json"
    file.write_text(json.dumps(content), encoding="utf-8")
    page = part(compared(file), verdict, certificate_table)
    assert "telepathic" in page.text["verdict"]
    assert "Left out: the plan in the model file cannot be read" in page.text["certificate"]


@pytest.fixture(scope="module")
def refused() -> Subject:
    """Returns a model with a plan whose verdict is no."""
    subject = Subject.of(keyswitch_by_hand()).planned_on(DeviceProfile.load(example_profiles()["touch"][0]))
    assert subject.plan is not None
    assert subject.plan.verdict.level == "no"
    return subject


def test_a_plan_with_verdict_no_sets_the_verdict_of_the_report(refused: Subject) -> None:
    report = report_of(refused)
    assert report.verdict.level == "no"
    assert Parsed(report.html).text["verdict"].startswith("Verdict no")


def test_the_certificate_table_states_each_inequality_in_words(planned: Model, page: Parsed) -> None:
    certificate = palpate.planning.Plan.of(planned).certificate
    assert certificate is not None
    text = page.text["certificate"]
    for line in certificate.inequalities:
        assert f"{line.name[:1].upper()}{line.name[1:]}" in text
        assert f"{line.right:.4g}" in text
        assert f"{line.margin:.4g}" in text
    for word in (
        "condition",
        "needed",
        "present",
        "reserve",
        "basis",
        "result",
        "holds",
        certificate.device.id,
    ):
        assert word in text


def test_the_origin_names_files_fingerprints_rows_and_versions(tmp_path: Path) -> None:
    given = recording(model_by_hand())
    given.write(tmp_path / "a.csv")
    read = palpate.read_recording(tmp_path / "a.csv", rows=(0, 500))
    palpate.identify(read).save(tmp_path / "m.json")
    text = part(compared(tmp_path / "m.json", read), provenance).text["provenance"]
    assert read.source.sha256 in text
    assert "500 rows read of 600 in the file" in text
    assert f"palpate {palpate.__version__}" in text
    assert str(tmp_path / "m.json") in text
    assert "rows 0 to 499 of 0 to 599 are used" in text


def test_held_out_rows_are_compared_and_the_others_give_the_band() -> None:
    given = recording(model_by_hand(), n=100)
    model = palpate.identify(given.split(5)[0])
    subject = Subject.of(model).compared_with(given)
    assert subject.verification is not None
    assert subject.verification.fresh
    assert subject.verification.n == len(given) // 5
    assert "Without band" not in part(subject, force_curve).text["force-curve"]


def test_a_recording_of_another_object_is_refused_for_the_band(planned: Model) -> None:
    other = recording(model_by_hand(), seed=2)
    with pytest.raises(InputError, match="did not identify the model: its SHA-256"):
        Subject.of(planned).compared_with(None, [other])


def test_without_bokeh_the_message_names_the_command(
    planned: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "bokeh.plotting", None)
    with pytest.raises(InputError, match=r"needs bokeh: install it with pip install 'palpate\[report\]'"):
        write_report(planned, to=tmp_path / "report.html")
    assert not list(tmp_path.iterdir())


def test_an_existing_page_keeps_its_mode_and_a_missing_folder_is_named(tmp_path: Path) -> None:
    model = model_of_two_inputs("lateral")
    target = tmp_path / "report.html"
    target.write_text("old", encoding="utf-8")
    target.chmod(0o640)
    write_report(model, to=target)
    assert target.stat().st_mode & 0o777 == 0o640
    assert target.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    with pytest.raises(InputError, match="there is no folder"):
        write_report(model, to=tmp_path / "missing" / "report.html")


@pytest.mark.parametrize("change", [lambda r: dataclasses.replace(r, time=None, direction=None)])
def test_residuals_without_time_are_in_the_order_of_position(
    planned: Model, change: Callable[[Recording], Recording]
) -> None:
    page = part(compared(planned, change(recording(model_by_hand(), seed=1))), whiteness)
    assert "in the order of position" in page.text["whiteness"]


def test_the_section_of_a_plan_states_the_profile_of_the_device(refused: Subject) -> None:
    text = part(refused, certificate_table).text["certificate"]
    for number in (
        "viscous damping b: 0.05 N·s/m",
        "Coulomb friction f_c: 0.13 N",
        "encoder step Delta: 5.5e-05 m",
        "force limit: 3.3 N",
        "delay t_d: 0.001 s",
    ):
        assert number in text
    assert "docs/certificate.md" not in text, "a reader of the page has no folder docs"
    assert "reserve 0 N" not in " ".join(text.split())
    assert "the plan limits the slopes of the force" in str(refused.verdict)


def test_a_line_does_not_break_inside_an_option() -> None:
    finding = Verdict((usable("give --inputs <b>"),))
    html = html_of("t", "s", [Section("verdict", "v", "e", ["s"], verdict=finding)])
    assert ".option { white-space: nowrap; }" in html
    assert '<span class="option">--inputs</span> &lt;b&gt;' in html


def test_one_wavelet_is_not_plural() -> None:
    assert (counted(1, "wavelet"), counted(2, "wavelet")) == ("1 wavelet", "2 wavelets")


def test_notes_of_the_file_are_words_and_no_json(planned: Model) -> None:
    model = Model.from_dict(planned.to_dict())
    model.notes["roles"] = {"moving": 590, "left out": 10}
    model.notes["setup"] = [{"screw": 0.123456, "cells": [1, 2]}, None]
    text = part(compared(model), provenance).text["provenance"]
    assert "moving: 590, left out: 10" in text
    assert "screw: 0.1235, cells: 1, 2" in text
    assert not set('{}"') & set(text)


def labels(subject: Subject) -> list[str]:
    """Returns the labels of the vertical axes of the force curve."""
    charts = force_curve(subject).charts
    return [panel.plot.yaxis.axis_label for chart in charts for panel in chart.panels]


@pytest.mark.parametrize("hysteresis", [True, False])
def test_the_energy_of_a_rotary_object_is_drawn_over_its_angle(*, hysteresis: bool) -> None:
    extra = {"weight_hysteresis": [0.0], "bias_hysteresis": 0.1, "linear_hysteresis": [0.0]}
    rotary = model_by_hand(units={"position": "rad", "force": "N*m"}, **(extra if hysteresis else {}))
    linear = model_by_hand(units={"position": "m", "force": "N"})
    assert any(label.startswith("energy [") for label in labels(Subject.of(rotary)))
    assert not any(label.startswith("energy [") for label in labels(Subject.of(linear)))


def test_a_model_with_memory_is_drawn_along_the_recording() -> None:
    model = relaxing_by_hand()
    time = np.arange(600) * 1e-3
    x = np.interp(time, [0.0, 0.1, 0.5, 0.6], [0.0, 1.0, 1.0, 0.0]) * float(model.upper[0])
    force, _ = model.force_over_time(time, x)
    relaxing = Recording.from_arrays(x, force, time, units=model.units)
    subject = Subject.of(model).compared_with(relaxing)
    section = force_curve(subject)
    over_time = section.charts[-1].panels[0].plot
    assert over_time.xaxis.axis_label == "time [s]"
    drawn = [each.data_source.data["y"] for each in over_time.renderers]
    assert np.ptp(drawn[0] - drawn[1]) < 1e-6 * np.ptp(drawn[0])
    assert "with memory" in " ".join(section.sentences)
