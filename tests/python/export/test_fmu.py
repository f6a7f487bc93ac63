# SPDX-License-Identifier: Apache-2.0
"""An FMU has the force and derivative of its model, is accepted by FMPy, and compiles from its sources."""

import json
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from conftest import sampled
from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import InputError, Model
from palpate.cli.main import main
from palpate.export import Request, fmu, fmu_binary

MODELS = {
    "position": model_by_hand,
    "hysteresis": keyswitch_by_hand,
    "periodic": lambda: model_by_hand(linear=[0.0], below="free", above="free", period=0.5),
    "far": lambda: model_by_hand(beta=[[7.3]], lower=[7.0], upper=[7.5]),
}


@pytest.fixture(scope="module", params=sampled(MODELS, "hysteresis", "far"))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def model(name: str) -> Model:
    made: Model = MODELS[name]()
    return made


@pytest.fixture(scope="module")
def fmu_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Returns a function that gives the FMU of a model by name, which the tests only read."""
    return cache(lambda name: exported(MODELS[name](), tmp_path_factory.mktemp("fmu")))


@pytest.fixture(scope="module")
def file(name: str, fmu_of: Callable[[str], Path]) -> Path:
    return fmu_of(name)


def exported(model: Model, folder: Path) -> Path:
    """Returns the FMU of a model."""
    output = folder / "object.fmu"
    written = fmu.write(Request(output, model.save(folder / "object.json")))
    assert written.verdict.level == "good", written.verdict
    return output


def with_radius(model: Model) -> Model:
    """Returns the model with the play radius that the FMU uses if the model has none."""
    if not model.hysteretic:
        return model
    travel = float(model.upper[0] - model.lower[0])
    return Model.from_dict(model.to_dict() | {"play_radius": 0.01 * travel})


BINARIES: dict[str, bytes] = {}
"""Compiled binary of each C source"""


@pytest.fixture
def compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiles equal sources only once, for tests of what follows the compilation."""

    def compile_once(source: Path, binary: Path) -> None:
        text = "".join(each.read_text(encoding="utf-8") for each in sorted(source.parent.glob("*.[ch]")))
        if text not in BINARIES:
            fmu_binary.compile_sources(source, binary)
            BINARIES[text] = binary.read_bytes()
        binary.write_bytes(BINARIES[text])

    monkeypatch.setattr(fmu, "compile_sources", compile_once)


@pytest.fixture
def fmpy() -> Any:
    return pytest.importorskip("fmpy", reason="needs fmpy")


def simulated(fmpy: Any, file: Path, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns positions and forces that FMPy simulates for an input, one step for each position.

    FMPy holds the input of a row until the next row, so the positions of the output are one row late.
    """
    time = 1e-3 * np.arange(len(positions))
    rows = list(zip(time, positions, strict=True))
    given = np.array(rows, dtype=[("time", float), ("position", float)])
    found = fmpy.simulate_fmu(
        str(file),
        stop_time=time[-1],
        output_interval=1e-3,
        step_size=1e-3,
        input=given,
        output=["position", "force"],
    )
    assert found["position"][1:] == pytest.approx(positions[:-1], abs=1e-12)
    return np.asarray(found["position"]), np.asarray(found["force"])


def test_force_is_that_of_the_model_to_1e_9(model: Model, file: Path, fmpy: Any) -> None:
    lower, upper = float(model.lower[0]), float(model.upper[0])
    beyond = 0.2 * (upper - lower)
    there = np.linspace(lower - beyond, upper + beyond, 301)
    back = there[::-1][:200]
    positions, found = simulated(fmpy, file, np.concatenate([there, back, back[::-1]]))
    expected = with_radius(model)
    before = np.concatenate([positions[:1], positions[:-1]])
    play = expected.play(before) if expected.hysteretic else None
    force = np.asarray(expected.force(positions, play=play))
    assert np.max(np.abs(found - force)) <= 1e-9 * np.max(np.abs(force))


def test_fmpy_finds_no_problem_and_all_functions(file: Path, tmp_path: Path, fmpy: Any) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(file)) == []
    header = (Path(fmpy.__file__).parent / "c-code" / "fmi3Functions.h").read_text()
    standard = set(re.findall(r"^FMI3_Export \w+ +(\w+);", header, re.MULTILINE))
    assert len(standard) == 75
    with zipfile.ZipFile(file) as archive:
        [binary] = [name for name in archive.namelist() if name.startswith("binaries/")]
        archive.extract(binary, tmp_path)
    symbols = subprocess.run(
        ["nm", "-D", "--defined-only", str(tmp_path / binary)], capture_output=True, text=True, check=True
    ).stdout
    assert set(re.findall(r" T (\w+)$", symbols, re.MULTILINE)) == standard


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_sources_agree_with_the_headers_of_the_standard(
    compiler: str, fmu_of: Callable[[str], Path], tmp_path: Path, fmpy: Any
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    with zipfile.ZipFile(fmu_of("hysteresis")) as archive:
        archive.extractall(tmp_path)
    header = Path(fmpy.__file__).parent / "c-code" / "fmi3Functions.h"
    command = [compiler, "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    for more in ([], ["-include", str(header)]):
        subprocess.run([*command, *more, str(tmp_path / "sources" / "fmu.c")], check=True)


@pytest.mark.full
@pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")
def test_fmpy_compiles_the_sources_to_the_same_force(tmp_path: Path, fmpy: Any) -> None:
    model = keyswitch_by_hand()
    file = exported(model, tmp_path)
    positions = np.linspace(0.0, 0.004, 101)
    _, before = simulated(fmpy, file, positions)
    without = tmp_path / "sources.fmu"
    with zipfile.ZipFile(file) as whole, zipfile.ZipFile(without, "w") as rest:
        for name in whole.namelist():
            if not name.startswith("binaries/"):
                rest.writestr(name, whole.read(name))
    command = [sys.executable, "-m", "fmpy", "compile", str(without)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    _, after = simulated(fmpy, without, positions)
    assert after == pytest.approx(before, rel=1e-12)


class Instance:
    """An FMU in FMPy's low-level interface."""

    def __init__(self, fmpy: Any, file: Path) -> None:
        from fmpy.fmi3 import FMU3Slave

        description = fmpy.read_model_description(str(file))
        folder = fmpy.extract(str(file))
        self.references = {each.name: each.valueReference for each in description.modelVariables}
        self.fmu = FMU3Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="object",
        )
        self.fmu.instantiate()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, name: str) -> float:
        return float(self.fmu.getFloat64([self.references[name]])[0])

    def move(self, position: float, step: bool = True) -> float:
        self.fmu.setFloat64([self.references["position"]], [position])
        force = self.get("force")
        if step:
            self.fmu.doStep(0.0, 1e-3)
        return force


def test_both_derivatives_are_the_slope_of_the_model(model: Model, file: Path, fmpy: Any) -> None:
    instance = Instance(fmpy, file)
    expected = with_radius(model)
    lower, upper = float(model.lower[0]), float(model.upper[0])
    position, force = instance.references["position"], instance.references["force"]
    steepest = float(np.max(np.abs(expected.slope_range(expected.play_radius))))
    visited = [instance.get("position")]
    for x in np.linspace(lower, upper, 23):
        instance.move(float(x))
        visited.append(float(x))
        ahead = float(x) + 1e-3 * (upper - lower)
        instance.move(ahead, step=False)
        play = float(expected.play(visited)[-1]) if expected.hysteretic else None
        slope = expected.slope(ahead, play=play)
        for derivative in (instance.fmu.getDirectionalDerivative, instance.fmu.getAdjointDerivative):
            found = derivative([force], [position], [2.0])[0]
            assert found == pytest.approx(2.0 * slope, abs=1e-6 * steepest)
        assert instance.get("slope") == pytest.approx(slope, abs=1e-6 * steepest)


def test_a_restored_state_gives_the_same_force(fmu_of: Callable[[str], Path], fmpy: Any) -> None:
    instance = Instance(fmpy, fmu_of("hysteresis"))
    for x in (0.0, 0.001, 0.002):
        instance.move(x)
    state = instance.fmu.getFMUState()
    stored = instance.fmu.serializeFMUState(state)
    pressed = instance.move(0.00199)
    instance.move(0.001)
    released = instance.move(0.00199)
    assert abs(pressed - released) > 0.01
    instance.fmu.setFMUState(state)
    assert instance.move(0.00199) == pressed
    instance.fmu.setFMUState(instance.fmu.deserializeFMUState(stored))
    assert instance.move(0.00199) == pressed


def test_wrong_calls_return_an_error(fmu_of: Callable[[str], Path], fmpy: Any) -> None:
    from fmpy.fmi1 import FMICallException

    instance = Instance(fmpy, fmu_of("far"))
    force, position = instance.references["force"], instance.references["position"]
    for call in (
        lambda: instance.fmu.setFloat64([force], [1.0]),
        lambda: instance.fmu.setFloat64([position], [np.nan]),
        lambda: instance.fmu.getFloat64([99]),
        lambda: instance.fmu.getDirectionalDerivative([position], [force], [1.0]),
        lambda: instance.fmu.doStep(0.0, -1.0),
        lambda: instance.fmu.enterInitializationMode(),
    ):
        with pytest.raises(FMICallException):
            call()
    assert np.isfinite(instance.move(7.1))


@pytest.mark.usefixtures("compiled_once")
def test_the_verb_prints_the_verdict_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, output = model_by_hand().save(tmp_path / "m.json"), tmp_path / "knob.fmu"
    assert main(["export", str(file), "--fmu", "-o", str(output)]) == 0
    assert capsys.readouterr().out.startswith("verdict: good\n")
    assert main(["export", str(file), "--fmu", "-o", str(output), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["name"] == "knob"
    assert record["force_error_share"] <= 1e-9


def test_equal_models_give_equal_files(fmu_of: Callable[[str], Path], tmp_path: Path) -> None:
    again = exported(MODELS["far"](), tmp_path)
    assert again.read_bytes() == fmu_of("far").read_bytes()
    with zipfile.ZipFile(again) as archive:
        names = archive.namelist()
    assert {"modelDescription.xml", "sources/fmu.c", "sources/buildDescription.xml"} <= set(names)


NAMES = ["<a&'b\">\x01\x1bé.json", "<a&'b\">.json", "\x01\x1b.json", "é.json"]


@pytest.mark.usefixtures("compiled_once")
@pytest.mark.parametrize("file_name", sampled(NAMES, NAMES[0]))
def test_every_name_of_a_model_file_gives_a_description_in_xml(file_name: str, tmp_path: Path) -> None:
    path = tmp_path / file_name
    model_by_hand().save(tmp_path / "m.json").rename(path)
    fmu.write(Request(tmp_path / "m.fmu", path))
    with zipfile.ZipFile(tmp_path / "m.fmu") as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    shown = "".join(c if c.isprintable() else "?" for c in path.name)
    assert root.attrib["description"].startswith(f"Force law of {shown};")


def test_a_missing_compiler_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    file = model_by_hand().save(tmp_path / "m.json")
    with pytest.raises(InputError, match="needs a C compiler, and cc was not found: apt install gcc"):
        fmu.write(Request(tmp_path / "m.fmu", file))
    assert not (tmp_path / "m.fmu").exists()


def test_a_failing_compiler_is_quoted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = tmp_path / "mycc"
    compiler.write_text("#!/bin/sh\necho 'fmu.c:1: broken' >&2\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    file = model_by_hand().save(tmp_path / "m.json")
    with pytest.raises(InputError, match=r"mycc refused the sources of the FMU: fmu\.c:1: broken"):
        fmu.write(Request(tmp_path / "m.fmu", file))


@pytest.mark.usefixtures("compiled_once")
def test_a_binary_that_differs_from_the_model_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = model_by_hand(bias=0.01)
    compared = fmu_binary.errors_of_binary
    monkeypatch.setattr(fmu, "errors_of_binary", lambda binary, token, _: compared(binary, token, other))
    written = fmu.write(Request(tmp_path / "m.fmu", model_by_hand().save(tmp_path / "m.json")))
    assert written.verdict.level == "no"
    assert "the force of the compiled FMU differs from the model" in str(written.verdict)
    assert not (tmp_path / "m.fmu").exists()
