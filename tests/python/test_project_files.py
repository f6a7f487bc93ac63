# SPDX-License-Identifier: Apache-2.0
"""Files that other services read are valid: workflows, forms for issues, citation, package descriptions."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

GITHUB = ROOT / ".github"
WORKFLOWS = sorted((GITHUB / "workflows").glob("*.yml"))
FORMS = sorted((GITHUB / "ISSUE_TEMPLATE").glob("[!c]*.yml"))
PORT = ROOT / "packaging" / "vcpkg" / "ports" / "palpate"

SCHEMAS = {
    **dict.fromkeys(WORKFLOWS, "github-workflows"),
    **dict.fromkeys(FORMS, "github-issue-forms"),
    GITHUB / "ISSUE_TEMPLATE" / "config.yml": "github-issue-config",
    ROOT / "CITATION.cff": "citation-file-format",
}
"""Schema of check-jsonschema for each file"""


@pytest.mark.parametrize("file", SCHEMAS, ids=lambda file: file.name)
def test_a_file_has_the_form_that_its_service_requires(file: Path) -> None:
    pytest.importorskip("check_jsonschema")
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{SCHEMAS[file]}", file]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert completed.returncode == 0, completed.stdout + completed.stderr


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda file: file.name)
def test_a_workflow_calls_targets_of_the_makefile(workflow: Path) -> None:
    targets = re.findall(r"^\s*- run: make ([\w-]+)", workflow.read_text(encoding="utf-8"), re.MULTILINE)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in targets:
        assert re.search(rf"^[\w -]*\b{target}\b[\w -]*:", makefile, re.MULTILINE), target


def test_make_control_installs_neither_linters_nor_test_tools() -> None:
    command = ["make", "--always-make", "--dry-run", "control"]
    commands = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "cmake --build --preset control" in commands
    assert set(re.findall(r"--group ([\w-]+)", commands)) == {"build"}


def test_the_ci_of_a_change_runs_the_commands_of_the_workflows() -> None:
    commands = re.findall(r"^make .+$", (ROOT / ".ci" / "run").read_text(encoding="utf-8"), re.MULTILINE)
    workflows = "".join(path.read_text(encoding="utf-8") for path in (GITHUB / "workflows").glob("*.yml"))
    assert commands
    assert all(f"- run: {command}\n" in workflows for command in commands)


def test_the_bug_form_requests_the_output_of_the_programs() -> None:
    form = (GITHUB / "ISSUE_TEMPLATE" / "bug.yml").read_text(encoding="utf-8")
    for command in ("palpate --version", "palpate-control --version", "palpate check-device"):
        assert f"`{command}" in form


def test_the_vcpkg_port_states_name_licence_and_the_tools_that_it_calls() -> None:
    port = json.loads((PORT / "vcpkg.json").read_text(encoding="utf-8"))
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", port["name"])
    assert port["name"] == PORT.name
    assert port["license"] == "Apache-2.0"
    tools = {dependency["name"] for dependency in port["dependencies"] if dependency["host"]}
    calls = (PORT / "portfile.cmake").read_text(encoding="utf-8")
    assert ("vcpkg-cmake" in tools) == ("vcpkg_cmake_configure(" in calls)
    assert ("vcpkg-cmake-config" in tools) == ("vcpkg_cmake_config_fixup(" in calls)
