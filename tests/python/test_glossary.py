# SPDX-License-Identifier: Apache-2.0
"""The names in docs/glossary.md exist, and each term has one entry."""

import re
from pathlib import Path

import click
import pytest

import palpate
from palpate._core import rendering
from palpate._core.model import Memory
from palpate.cli.main import palpate as group
from palpate.identification.options import IdentifyOptions
from palpate.model import Fit

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("| ") and not line.startswith("| term")
]
NAMES = [name for row in ROWS for name in re.findall(r"`([^`]+)`", row[-1])]
CONTEXT = click.Context(group)
PARAMETERS = {
    option: parameter
    for verb in group.list_commands(CONTEXT)
    for parameter in getattr(group.get_command(CONTEXT, verb), "params", [])
    for option in parameter.opts
}
CONTROL_OPTIONS = {
    option
    for path in (ROOT / "cpp" / "control").glob("*.cpp")
    for option in re.findall(r"--[a-z][a-z-]*", path.read_text(encoding="utf-8"))
}
HEADERS = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "cpp/include").rglob("*.hpp"))
OWNERS = {"Fit": Fit, "IdentifyOptions": IdentifyOptions, "Memory": Memory, "Scheme": rendering.Scheme}
"""Classes that `palpate` does not export"""


def has_member(owner: type, member: str) -> bool:
    fields = {name for base in owner.__mro__ for name in getattr(base, "__annotations__", {})}
    return member in fields or hasattr(owner, member)


@pytest.mark.parametrize("name", NAMES)
def test_a_name_of_the_glossary_exists(name: str) -> None:
    if name.startswith("palpate::"):
        assert re.search(rf"\b(?:class|struct|enum class) {name.removeprefix('palpate::')}\b", HEADERS)
    elif name.startswith("--"):
        option, _, value = name.partition(" ")
        assert option in {*PARAMETERS, *CONTROL_OPTIONS}
        assert not value or value in getattr(PARAMETERS[option].type, "choices", ())
    else:
        owner, _, member = name.partition(".")
        owner_class = OWNERS.get(owner) or getattr(palpate, owner)
        assert not member or has_member(owner_class, member)


def test_a_term_has_one_entry_of_one_sentence() -> None:
    terms = [term for row in ROWS for term in row[0].split(", ")]
    assert len(terms) == len(set(terms))
    assert len(terms) > 50
    assert len(NAMES) > 30
    for row in ROWS:
        assert len(row) in (3, 4)
        assert re.fullmatch(r"(?:[^.]|\.(?! ))+\.", row[1]), row[1]
