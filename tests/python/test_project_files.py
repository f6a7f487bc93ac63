# SPDX-License-Identifier: Apache-2.0
"""Files that other services read are valid: workflows, forms for issues, citation, package descriptions."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from conftest import ROOT

GITHUB = ROOT / ".github"
WORKFLOWS = sorted((GITHUB / "workflows").glob("*.yml"))
FORMS = sorted((GITHUB / "ISSUE_TEMPLATE").glob("[!c]*.yml"))
PORT = ROOT / "packaging" / "vcpkg" / "ports" / "palpate"

LOCKED = sorted((ROOT / "tools" / "locked").glob("*.txt"))

FILES = {
    "github-workflows": WORKFLOWS,
    "github-issue-forms": FORMS,
    "github-issue-config": [GITHUB / "ISSUE_TEMPLATE" / "config.yml"],
    "citation-file-format": [ROOT / "CITATION.cff"],
}
"""Files for each schema of check-jsonschema"""


@pytest.mark.parametrize("schema", FILES)
def test_files_have_the_form_that_their_service_requires(schema: str) -> None:
    pytest.importorskip("check_jsonschema")
    assert FILES[schema]
    command = [
        sys.executable,
        "-m",
        "check_jsonschema",
        "--builtin-schema",
        f"vendor.{schema}",
        *FILES[schema],
    ]
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
    assert set(re.findall(r"tools/locked/([\w-]+)\.txt", commands)) == {"build"}


def test_make_installs_only_locked_versions_with_their_hashes() -> None:
    command = ["make", "--always-make", "--dry-run", "setup", "docs", "test-packages", "test-full"]
    dry_run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    installs = [line for line in dry_run.replace("\\\n", " ").splitlines() if " pip install " in line]
    assert len(installs) >= 6
    for line in installs:
        locked = "--require-hashes --only-binary :all: --requirement" in line
        assert locked or ("--no-deps --no-build-isolation" in line and line.endswith("--editable .")), line
    workflows = "".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    for line in re.findall(r".*pip install.*", workflows):
        assert "--require-hashes" in line


def test_the_locked_files_contain_every_tool_with_its_hashes() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    groups = settings["dependency-groups"]
    groups["build"] = groups["build"] + settings["project"]["dependencies"]
    assert {path.stem for path in LOCKED} == groups.keys()
    for path in LOCKED:
        content = path.read_text(encoding="utf-8").replace("\\\n", " ")
        entries = [line for line in content.splitlines() if not line.startswith("#")]
        names = {re.split(r"[=\[]", entry)[0] for entry in entries}
        for entry in entries:
            assert re.match(r"[\w.-]+==[\w.!]+ .*--hash=sha256:[0-9a-f]{64}", entry), entry
        for requirement in groups[path.stem]:
            name = re.split(r"[<>=;\[ ]", requirement)[0].lower().replace("_", "-")
            assert name in names, f"{name} is not in {path.name}: call tools/lock.sh"


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda file: file.name)
def test_a_workflow_names_each_action_by_its_commit(workflow: Path) -> None:
    for action in re.findall(r"uses: (.*)", workflow.read_text(encoding="utf-8")):
        assert re.fullmatch(r"[\w/-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", action), action


def test_every_download_of_cmake_has_a_checksum() -> None:
    for path in [
        *(ROOT / "cmake").glob("*.cmake"),
        *ROOT.glob("*/**/CMakeLists.txt"),
        ROOT / "CMakeLists.txt",
    ]:
        if {"build", ".venv"} & set(path.relative_to(ROOT).parts):
            continue
        content = path.read_text(encoding="utf-8")
        for checksum in re.findall(r"https://\S+\.(?:tar\.\w+|zip)\s*([^\s)]*)", content):
            assert re.fullmatch(r"[0-9a-f]{64}", checksum), f"{path}: {checksum}"
        assert not re.search(r"GIT_TAG\s+(?![0-9a-f]{40}\b)", content), path


def test_the_ci_of_a_change_runs_the_commands_of_the_workflows() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    commands = re.findall(r"^(make [^>\n]+?)(?: >.*)?$", script, re.MULTILINE)
    workflows = "".join(path.read_text(encoding="utf-8") for path in (GITHUB / "workflows").glob("*.yml"))
    assert len(commands) == 4
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
