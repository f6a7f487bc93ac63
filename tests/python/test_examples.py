# SPDX-License-Identifier: Apache-2.0
"""The examples run, print the results that they state, and give the same results in C++ and Python."""

import ast
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))
IN_CPP = sorted(path.stem for path in (ROOT / "examples").glob("*.cpp"))
PROGRAMS = ROOT / "build" / "dev" / "examples"
"""Folder of the compiled examples in C++"""
MOST_LINES = 60
"""Largest number of lines of an example that are not empty."""

RESULTS = {
    "01_detent_knob": [(r"explicit is (\S+) times", 50.0, 150.0)],
    "02_key_switch_click": [(r"keeps (\S+) % of the drop", 98.0, 102.0)],
    "03_spring_and_wall": [
        (r"RMS error (\S+) N\*m, sensor", 0.019, 0.021),
        (r"stiffness (\S+) N\*m/rad before", 1.9, 2.1),
        (r"wall, (\S+) N\*m/rad in it", 57.0, 63.0),
    ],
    "04_tissue_with_hysteresis": [
        (r"NRMSE (\S+) with hysteresis", 0.0, 0.01),
        (r"(\S+) with one curve", 0.2, 0.4),
    ],
    "05_viscous_knob": [(r"damping (\S+) N\*m\*s/rad, of", 0.0198, 0.0202)],
    "06_motor_cogging": [
        (r"(\d+) harmonics in place of", 2, 2),
        (r"after 100 revolutions (\S+) mN\*m", 0.0, 0.5),
    ],
    "07_several_inputs": [(r"NRMSE (\S+) with the gap", 0.0, 0.025), (r"(\S+) without it", 0.3, 0.6)],
    "08_scikit_learn_pipeline": [(r"R2 (\S+) with", 0.995, 0.998), (r"wavelets, (\d+) parameters", 10, 40)],
    "09_certificate_and_device": [
        (r"required b > (\S+),", 0.0499, 0.0501),
        (r"oscillation at b <= (\S+)", 0.03, 0.0499),
        (r"with a certificate (\S+) mrad", 0.0, 2.0),
    ],
    "10_implicit_and_explicit": [(r"explicit is (\S+) times", 2.0, 4.0)],
    "11_own_device": [
        (r"spring 0\.0 N\*m/rad: (\S+) Hz", 0.709, 0.714),
        (r"spring 1\.0 N\*m/rad: (\S+) Hz", 1.740, 1.746),
    ],
    "12_flight_record_to_model": [(r"within (\S+) % of its force range", 0.0, 1.0)],
    "13_drake_force_element": [(r"radau3 is within (\S+) µm", 0.0, 200.0)],
}
"""For each example: pattern of a printed number, and the least and largest value that its text allows."""


@cache
def output_in_python(example: str) -> str:
    command = [sys.executable, "-W", "error", str(ROOT / "examples" / f"{example}.py")]
    # Without a display the figures are drawn, but no window is opened.
    environment = {name: value for name, value in os.environ.items() if "DISPLAY" not in name}
    environment |= {"MPLBACKEND": "agg"}
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def output_in_cpp(example: str) -> str:
    program = PROGRAMS / example
    if not program.is_file():
        pytest.skip("needs the examples in C++, run make examples")
    # A C++ example runs the command `palpate identify`.
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    return subprocess.run(
        [str(program)], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
    ).stdout


def test_every_cpp_example_has_a_python_example_of_the_same_name() -> None:
    assert IN_CPP
    assert set(IN_CPP) <= set(EXAMPLES)


def test_every_example_states_a_result_that_is_tested() -> None:
    assert sorted(RESULTS) == EXAMPLES


@pytest.mark.parametrize("example", EXAMPLES)
@pytest.mark.full
def test_an_example_prints_the_numbers_of_its_result(example: str) -> None:
    output = output_in_python(example)
    if skipped := re.search(r"^skipped: (needs .*)", output):
        pytest.skip(skipped[1])
    for pattern, least, most in RESULTS[example]:
        found = re.search(pattern, output)
        assert found, f"{pattern} is not in the output: {output}"
        assert least <= float(found[1]) <= most, f"{pattern}: {found[1]} is not from {least} to {most}"


@pytest.mark.parametrize("example", IN_CPP)
@pytest.mark.full
def test_both_languages_print_the_same_numbers(example: str) -> None:
    assert output_in_cpp(example) == output_in_python(example)


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_is_a_short_page_of_a_gallery(example: str) -> None:
    text = (ROOT / "examples" / f"{example}.py").read_text(encoding="utf-8")
    title, underline, empty, *_ = (ast.get_docstring(ast.parse(text)) or "").splitlines()
    assert underline == "=" * len(title)
    assert not empty
    assert "\n# %%\n# Result\n# ------\n# " in text
    assert " fails " in text.split("# Result", 1)[1], "the limit of the method is missing"
    assert "plt.subplots" in text
    for path in (ROOT / "examples").glob(f"{example}.[pc]*"):
        lines = path.read_text(encoding="utf-8").splitlines()
        assert sum(bool(line.strip()) for line in lines) <= MOST_LINES, path.name


def test_no_page_names_an_example_that_does_not_exist() -> None:
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "examples").glob("*.*")]
    for page in pages:
        for name in re.findall(r"\b(\d\d_[a-z_]+)\.(?:py|cpp|json)\b", page.read_text(encoding="utf-8")):
            assert name in EXAMPLES, f"{page.name} names {name}"
