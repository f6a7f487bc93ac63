# SPDX-License-Identifier: Apache-2.0
"""Tests of the installed package: version, type information, installed commands."""

import importlib.metadata
import importlib.resources
import json
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import palpate
from conftest import sampled
from palpate import _core

ROOT = Path(__file__).parents[2]


def version_of_the_build() -> str:
    match = re.search(
        r"project\(\s*palpate\s+VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    )
    assert match
    return match[1]


def test_package_core_citation_and_changelog_have_one_version() -> None:
    version = version_of_the_build()
    assert importlib.metadata.version("palpate") == version
    assert palpate.__version__ == _core.__version__ == version
    assert f"version: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_headers_and_packages_have_the_version_of_the_build() -> None:
    version = version_of_the_build()
    header = (ROOT / "cpp" / "include" / "palpate" / "version.hpp").read_text(encoding="utf-8")
    assert f'library_version = "{version}";' in header
    port = ROOT / "packaging" / "vcpkg" / "ports" / "palpate" / "vcpkg.json"
    assert json.loads(port.read_text(encoding="utf-8"))["version-semver"] == version


def test_the_package_contains_its_type_information() -> None:
    files = importlib.resources.files("palpate")
    assert files.joinpath("py.typed").is_file()
    assert files.joinpath("_core.pyi").is_file() or files.joinpath("_core", "__init__.pyi").is_file()


@pytest.mark.parametrize("name", palpate.__all__)
def test_every_public_name_can_be_imported(name: str) -> None:
    assert getattr(palpate, name) is not None


@pytest.mark.parametrize("name", [name for name in palpate.__all__ if not name.startswith("_")])
def test_every_public_name_is_documented(name: str) -> None:
    assert (getattr(palpate, name).__doc__ or "").strip()


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'flavour'"):
        palpate.flavour  # noqa: B018


def command_lines() -> dict[str, list[str]]:
    return {
        "installed": [str(Path(sysconfig.get_path("scripts")) / "palpate")],
        "python -m": [sys.executable, "-m", "palpate"],
    }


@pytest.mark.parametrize("program", command_lines())
@pytest.mark.parametrize(
    "verb", sampled(["", "identify", "verify", "simulate", "render", "show", "demo"], "")
)
def test_help_shows_usage_and_an_example(program: str, verb: str) -> None:
    command = [*command_lines()[program], *([verb] if verb else []), "--help"]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert completed.returncode == 0, completed.stderr
    assert completed.stdout.startswith("Usage:")
    assert "xample" in completed.stdout


def test_the_command_prints_its_version() -> None:
    completed = subprocess.run(
        [*command_lines()["installed"], "--version"], capture_output=True, text=True, check=True
    )
    assert completed.stdout == f"palpate {version_of_the_build()}\n"
