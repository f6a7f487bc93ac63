# SPDX-License-Identifier: Apache-2.0
"""The Python functions identify and verify take files, data frames and arrays; help; model comparison."""

import inspect
import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd
import pytest

import palpate
from palpate import IdentifyOptions, InputError, Model, Recording, SearchOptions, identify, load_model, verify
from palpate.cli.identify import identify as identify_verb

X = np.concatenate([np.linspace(0.0, 4.0, 80), np.linspace(4.0, 0.0, 80)])
DIRECTION = np.repeat([1.0, -1.0], 80)


def force(seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0.0, 0.01, len(X))
    return np.asarray(X + np.sin(2.0 * X) + 0.2 * DIRECTION + noise)


def frame(seed: int = 0) -> pd.DataFrame:
    direction_words = np.where(DIRECTION > 0, "press", "release")
    return pd.DataFrame(
        {"depth_mm": X, "force_mN": 1e3 * force(seed), "direction": direction_words, "operator": "A"}
    )


@cache
def model_of_the_frame() -> Model:
    return identify(frame())


@cache
def model_of_a_line() -> Model:
    return identify(X, 2.0 * X)


@pytest.fixture
def press(tmp_path: Path) -> Path:
    frame().to_csv(tmp_path / "press.csv", index=False)
    return tmp_path / "press.csv"


def test_a_frame_a_file_and_arrays_give_the_same_model(press: Path) -> None:
    def identified(*given: Any, **more: Any) -> Model:
        return identify(*given, inputs="position,hysteresis", max_wavelets=1, **more)

    model = identified(palpate.read_recording(press))
    assert model.kind == "hysteresis"
    of_frame = identified(frame())
    assert of_frame.units == model.units == {"position": "m", "force": "N"}
    for result in (
        identified(press),
        identified(str(press)),
        identified([press]),
        of_frame,
        identified(1e-3 * X, 1e-3 * (1e3 * force()), direction=DIRECTION),
        identified(list(1e-3 * X), pd.Series(1e-3 * (1e3 * force())), direction=list(DIRECTION)),
    ):
        assert np.array_equal(result.alpha, model.alpha)
        assert np.array_equal(result.weight, model.weight)
        assert result.fit.nrmse == model.fit.nrmse


def test_a_list_may_mix_recordings_files_and_frames(press: Path) -> None:
    mixed = [press, frame(1), Recording.from_frame(frame(2))]
    model = identify(mixed, inputs="position,hysteresis", max_wavelets=1)
    assert model.data.rows == 3 * len(X)
    assert model.data.files == (str(press),)


def test_verify_takes_files_frames_and_arrays(press: Path) -> None:
    model = identify(press, inputs="position,hysteresis")
    fresh = verify(model, frame(1))
    assert fresh.fresh
    assert fresh.nrmse == pytest.approx(model.fit.nrmse, rel=0.3)
    arrays = verify(model, 1e-3 * X, 1e-3 * (1e3 * force(1)), direction=DIRECTION)
    assert arrays.nrmse == fresh.nrmse
    on_training_file = verify(model, press)
    assert not on_training_file.fresh
    assert on_training_file.nrmse == verify(model, str(press)).nrmse
    assert not verify(model_of_the_frame(), frame()).fresh


def test_inputs_named_as_columns_are_read_from_files_and_frames(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    depth, lateral = random.uniform(0, 3, 300), random.uniform(0, 40, 300)
    table = pd.DataFrame(
        {
            "depth_mm": depth,
            "lateral_mm": lateral,
            "force_N": depth * (1 + np.exp(-((lateral - 20) ** 2) / 40)),
        }
    )
    table.columns = pd.Index(["depth_mm", "lateral_mm", "force_N"])
    table.to_csv(tmp_path / "probe.csv", index=False)
    expected = palpate.read_recording(tmp_path / "probe.csv", position="depth_mm", inputs=["lateral_mm"])
    assert expected.input_names == ("lateral_m",)
    recording = Recording.from_frame(table, position="depth_mm", inputs=["lateral_mm"])
    assert np.array_equal(recording.inputs, expected.inputs)
    assert identify(recording, max_wavelets=3).inputs == ("position", "lateral_m")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.assign(force_mN=[np.nan, *t.force_mN[1:]]), r"row 0 \(index 0\).*force_mN holds 'nan'"),
        (lambda t: t.assign(force_mN=["x", *t.force_mN[1:]]), r'holds \'x\'.*invalid="drop"'),
        (lambda t: t.assign(force_mN=t.force_mN * 1j), "force_mN holds complex numbers"),
        (lambda t: t.assign(direction="sideways"), "'sideways', which is not a direction"),
        (lambda t: t.drop(columns="depth_mm"), r'no column name has a unit of position.*position="operator"'),
        (lambda t: t.rename(columns={"operator": "force_mN"}), "several columns called force_mN"),
        (lambda t: t.rename(columns={"operator": 7}), "a column called 7"),
        (lambda t: t.iloc[:0], "has 0 usable rows; .* needs at least 10"),
    ],
    ids=["nan", "text", "complex", "direction", "no_position", "twice", "number", "no_rows"],
)
def test_an_unusable_frame_is_refused_with_its_column_and_row(
    change: Callable[[pd.DataFrame], pd.DataFrame], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        identify(change(frame()))


def test_the_cures_in_the_messages_about_frames_work() -> None:
    table = frame().assign(force_mN=[np.nan, *frame().force_mN[1:]])
    result = Recording.from_frame(table, invalid="drop")
    assert len(result) == len(table) - 1
    assert any("dropped 1 row" in note for note in result.notes)
    without_unit = frame().rename(columns={"depth_mm": "depth"})
    expected = Recording.from_frame(without_unit, position="depth", units={"depth": "mm"})
    assert expected.position.max() == pytest.approx(0.004)


def test_frames_of_every_column_type_give_the_same_recording() -> None:
    reference = Recording.from_frame(frame())
    assert reference.columns["operator"][0] == "A"
    assert reference.source.columns["direction"] == "direction"
    for table in (
        frame().set_index("depth_mm"),
        frame().convert_dtypes(),
        frame().astype({"direction": "category"}),
        frame().astype({"force_mN": object}),
        frame().assign(direction=DIRECTION),
        frame().assign(direction=DIRECTION.astype(int)),
        frame().iloc[::-1].iloc[::-1],
    ):
        result = Recording.from_frame(table)
        assert np.array_equal(result.position, reference.position)
        assert np.array_equal(result.force, reference.force)
        assert result.direction is not None
        assert reference.direction is not None
        assert np.array_equal(result.direction, reference.direction)
    assert Recording.from_frame(frame().assign(segment=1).drop(columns="direction")).direction is None


def test_options_of_identify_are_in_its_signature_and_help() -> None:
    parameters = inspect.signature(identify).parameters
    for each in fields(IdentifyOptions):
        assert parameters[each.name].default == getattr(IdentifyOptions(), each.name)
        assert f"\n{each.name} : " in (identify.__doc__ or "")
        assert f"\n{each.name} : " in (IdentifyOptions.__doc__ or "")
    assert "Largest number of wavelets" in (identify.__doc__ or "")
    assert list(parameters)[:4] == ["recording", "force", "time", "direction"]
    with pytest.raises(InputError, match="identify has no option 'wavelets'"):
        identify(X, force(), wavelets=3)


def texts_on(option: click.Option, documentation: str) -> list[str]:
    """Returns each entry on an option in a docstring, found by its Python name or its flag."""
    flags = "|".join(f"``{flag}``" for flag in option.opts)
    entries = re.findall(
        rf"^((?:{option.name} : |.*(?:{flags})).*\n(?: +.*\n)+)", documentation, re.MULTILINE
    )
    return [" ".join(entry.split()).replace(" [-]", "") for entry in entries]


def python_default(name: str) -> object:
    """Returns the default of an argument of `read_recording`, or of an option of `identify`."""
    of_reading = inspect.signature(palpate.read_recording).parameters
    options = vars(IdentifyOptions())
    return options[name] if name in options else of_reading[name].default


def test_help_of_identify_has_every_option_of_the_command_line_with_its_meaning() -> None:
    documentation = inspect.getdoc(identify) or ""
    for option in identify_verb.params:
        if not isinstance(option, click.Option):
            continue
        entries, name = texts_on(option, documentation), option.name or ""
        assert entries, f"{option.opts[-1]} is missing"
        if all(entry.startswith("``--") for entry in entries):
            continue  # this option is another function in Python, which the entry names
        meaning = (option.help or "").removesuffix(" Repeatable.").rstrip(".")
        text = next((each for each in entries if meaning in each or name == "search"), None)
        assert text is not None, f"{name}: no entry begins with the help of the command line"
        default = "SearchOptions(" if name == "search" else repr(python_default(name))
        assert f"default {default}" in text, name
        if isinstance(option.type, click.Choice):
            assert all(str(word) in text for word in option.type.choices), name
    for setting in fields(SearchOptions):
        assert f"{setting.name}={getattr(SearchOptions(), setting.name)!r}" in documentation


def test_the_example_of_identify_runs() -> None:
    import doctest

    from palpate.identification import identify as module

    runner = doctest.DocTestRunner()
    for test in doctest.DocTestFinder().find(module, "identify", globs={}):
        runner.run(test)
    assert runner.tries > 0
    assert not runner.failures


WITHOUT_SCIKIT_LEARN = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "sklearn":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocked())
import palpate
"""


def run_without_scikit_learn(code: str) -> str:
    completed = subprocess.run(
        [sys.executable, "-c", WITHOUT_SCIKIT_LEARN + code], capture_output=True, text=True, check=False
    )
    assert completed.returncode == 0, completed.stderr
    return completed.stdout


def test_help_and_members_work_without_scikit_learn() -> None:
    output = run_without_scikit_learn(
        "import inspect, pydoc\n"
        "print(len(inspect.getmembers(palpate)), pydoc.render_doc(palpate, renderer=pydoc.plaintext))\n"
        "from palpate import *\n"
        "try: palpate.WaveletNetworkRegressor\n"
        "except ImportError as error: print(error)\n"
    )
    assert "identify(recording" in output
    assert "WaveletNetworkRegressor needs scikit-learn" in output
    assert "pip install palpate[sklearn]" in output


@pytest.mark.full
def test_pydoc_shows_the_public_names() -> None:
    completed = subprocess.run(
        [sys.executable, "-m", "pydoc", "palpate"], capture_output=True, text=True, check=True
    )
    assert "class WaveletNetworkRegressor" in completed.stdout
    assert "max_wavelets" in completed.stdout


def test_dir_lists_public_names_only() -> None:
    assert dir(palpate) == sorted(palpate.__all__)
    assert not [name for name in dir(palpate) if name.startswith("_") and name != "__version__"]
    assert "WaveletNetworkRegressor" in dir(palpate)


def models() -> dict[str, Model]:
    t = np.arange(0.0, 4.0, 0.002)
    x = 0.5 - 0.5 * np.cos(2.0 * np.pi * (0.5 * t + 0.1 * t**2))
    noise = np.random.default_rng(1).normal(0.0, 0.01, len(t))
    random = np.random.default_rng(0)
    depth, lateral = random.uniform(0, 1, 200), random.uniform(0, 1, 200)
    return {
        "line": model_of_a_line(),
        "hysteresis": model_of_the_frame(),
        "damping": identify(x, 2.0 * x + 0.3 * np.gradient(x, t) + noise, time=t, max_wavelets=2),
        "two_inputs": identify(
            Recording.from_arrays(depth, depth * lateral, inputs={"lateral": lateral}), max_wavelets=2
        ),
    }


def test_a_saved_and_reloaded_model_equals_the_original(tmp_path: Path) -> None:
    models_by_name = models()
    for name, model in models_by_name.items():
        loaded = load_model(model.save(tmp_path / "model.json"))
        assert loaded == model, name
        assert hash(loaded) == hash(model)
        assert pickle.loads(pickle.dumps(model)) == model
        assert model != name
        assert [other for other in models_by_name.values() if other == model] == [model]


def test_a_printed_model_states_its_verdict_first() -> None:
    assert str(model_of_a_line()).splitlines()[0] == "verdict: good"
    ascending = np.argsort(X, kind="stable")
    unsorted_model = identify(X[ascending], force()[ascending])
    lines = str(unsorted_model).splitlines()
    assert lines[0] == "verdict: usable"
    assert lines[1].startswith("  the NRMSE on rows that were left out of the fit is")
    assert "record time or direction" in lines[1]
    assert unsorted_model.verdict.level == "usable"
