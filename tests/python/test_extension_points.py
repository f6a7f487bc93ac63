# SPDX-License-Identifier: Apache-2.0
"""A new field, structure or command is added to one table only; the program makes other lists from it."""

from __future__ import annotations

import ast
import json
from importlib import import_module
from pathlib import Path

import click
import pytest

from conftest import ROOT, nodes_of
from palpate import DeviceProfile, Scheme
from palpate._core.rendering import structure_names
from palpate.cli.main import palpate
from palpate.planning import AdmittanceDisplay
from palpate.planning.candidates import CANDIDATES

PACKAGE = ROOT / "python" / "palpate"
SCHEMA = json.loads((PACKAGE / "model" / "model.schema.json").read_text(encoding="utf-8"))["$defs"]
FIELDS: list[str] = list(DeviceProfile().__reduce__()[0].keywords)  # type: ignore[attr-defined]

PROFILE_ONLY = "on_device"
"""Table of a profile file that no certificate contains"""


def options_of(verb: str) -> dict[str, click.Parameter]:
    command = palpate.get_command(click.Context(palpate), verb)
    assert command is not None
    return {str(option.name): option for option in command.params}


@pytest.mark.parametrize("verb", ["simulate", "render"])
def test_a_verb_accepts_the_structures_of_the_core(verb: str) -> None:
    kind = options_of(verb)["structure"].type
    assert isinstance(kind, click.Choice)
    assert tuple(kind.choices) == structure_names


def test_the_schema_names_the_structures_of_the_core() -> None:
    assert tuple(SCHEMA["Structure"]["enum"]) == structure_names


def test_every_structure_is_a_candidate_of_the_plan_and_described_in_its_help() -> None:
    assert {name.partition(",")[0] for name in CANDIDATES} == set(structure_names)
    command = palpate.get_command(click.Context(palpate), "plan")
    assert command is not None
    for name, candidate in CANDIDATES.items():
        assert f"{name}: {candidate.use}\n" in (command.help or "")


def test_an_unknown_structure_is_refused_with_all_names() -> None:
    with pytest.raises(ValueError, match="structure is 'soft'") as refused:
        Scheme(structure="soft")
    assert all(name in str(refused.value) for name in structure_names)


def strings_in(node: ast.AST) -> set[str]:
    """Returns the words in the source text of a tuple, list or dictionary."""
    parts = node.keys if isinstance(node, ast.Dict) else getattr(node, "elts", [])
    return {item.value for item in parts if isinstance(item, ast.Constant) and isinstance(item.value, str)}


@pytest.mark.parametrize(
    ("names", "largest_overlap"),
    [(structure_names, 3), (FIELDS, len(FIELDS) - 1)],
    ids=["structures", "fields of a profile"],
)
def test_no_other_file_lists_structures_or_profile_fields(names: list[str], largest_overlap: int) -> None:
    files_with_list = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        for node in nodes_of(path)
        if isinstance(node, (ast.Dict, ast.List, ast.Set, ast.Tuple))
        and len(set(names) & strings_in(node)) > largest_overlap
    }
    assert files_with_list <= {"planning/candidates.py"}


def test_no_line_of_the_pages_lists_all_structures() -> None:
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    lines = [line for page in pages for line in page.read_text(encoding="utf-8").splitlines()]
    assert [line for line in lines if all(name in line for name in structure_names)] == []


def test_every_field_of_a_profile_is_in_schema_and_stub_with_its_unit() -> None:
    stub = (PACKAGE / "_core" / "device.pyi").read_text(encoding="utf-8")
    assert list(SCHEMA["Device"]["properties"]) == [name for name in FIELDS if name != PROFILE_ONLY]
    display = AdmittanceDisplay(
        servo_bandwidth_hz=60.0, servo_damping=0.8, rate_limit=0.5, drive_stiffness=300.0, drive_damping=0.9
    )
    assert list(SCHEMA["AdmittanceDisplay"]["properties"]) == list(display.to_dict())
    assert SCHEMA["AdmittanceDisplay"]["required"] == list(AdmittanceDisplay().to_dict())
    for name in FIELDS:
        assert f"    def {name}(self)" in stub
        if SCHEMA["Device"]["properties"].get(name, {}).get("type") == "number":
            unit = getattr(DeviceProfile, name).__doc__
            assert "[" in unit, f"{name} has no unit: {unit}"


def test_a_profile_file_must_have_the_fields_that_the_schema_requires(tmp_path: Path) -> None:
    assert set(SCHEMA["Device"]["required"]) == set(DeviceProfile().to_dict())
    types = {name: each.get("type", "table") for name, each in SCHEMA["Device"]["properties"].items()}
    values = {name: 1e-3 for name, kind in types.items() if kind == "number"}
    profile = DeviceProfile(**values)
    required = SCHEMA["Device"]["required"]
    assert list(profile.to_dict()) == [name for name in FIELDS if name in required]
    loaded = DeviceProfile.load(profile.save(tmp_path / "device.toml"))
    assert loaded == profile
    for name, value in values.items():
        assert getattr(loaded, name) == value


def test_every_verb_is_one_file() -> None:
    for verb in palpate.list_commands(click.Context(palpate)):
        name = verb.replace("-", "_")
        assert isinstance(getattr(import_module(f"palpate.cli.{name}"), name), click.Command)
