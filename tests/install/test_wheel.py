# SPDX-License-Identifier: Apache-2.0
"""The Python package as users install it: from this folder, the source package, a wheel for all machines.

The environments of the tests use numpy and the other dependencies of .venv, and nothing else of it.
"""

from __future__ import annotations

import importlib.metadata
import json
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path
from typing import Any

import pytest

from consumer import ROOT, run

TRY = Path(__file__).with_name("try_wheel.py")

TOOLS = sysconfig.get_path("scripts")

needs_tools = pytest.mark.skipif(
    any(shutil.which(tool, path=TOOLS) is None for tool in ("auditwheel", "pyproject-build")),
    reason="needs build and auditwheel: make test-packages",
)


def clean_environment(folder: Path) -> Path:
    """Creates an environment without palpate; returns its Python."""
    run(sys.executable, "-m", "venv", "--without-pip", folder)
    python = folder / "bin" / "python"
    site = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip()
    # The editable installation is a .pth file in this folder, which Python does not read from here.
    Path(site, "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return python


def install(python: Path, *arguments: object) -> None:
    command = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps"]
    run(*command, "--ignore-installed", "--no-build-isolation", *arguments, cwd=ROOT)


def try_package(python: Path, *arguments: str) -> None:
    """Runs both programs in an environment without variables, in another folder than that of the source."""
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(python.parent)}
    assert run(python, TRY, *arguments, cwd=python.parent, env=environment).endswith("ok\n")


def names_of(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_pip_install_of_this_folder_gives_both_programs(tmp_path: Path) -> None:
    python = clean_environment(tmp_path)
    # The option of the editable installation, so that its compiled module is used again.
    install(python, "--config-settings", "cmake.define.PALPATE_WARNINGS_AS_ERRORS=ON", ".")
    try_package(python)


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sdist")
    run(sys.executable, "-m", "build", "--no-isolation", "--sdist", "--outdir", folder, ROOT)
    return next(folder.glob("palpate-*.tar.gz"))


@pytest.fixture(scope="module")
def wheel(sdist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns the wheel that is built from the source package; this takes minutes."""
    folder = tmp_path_factory.mktemp("wheel")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    source = folder / sdist.name.removesuffix(".tar.gz")
    run(sys.executable, "-m", "build", "--no-isolation", "--wheel", "--outdir", folder, source)
    return next(folder.glob("palpate-*.whl"))


@pytest.fixture(scope="module")
def repaired(wheel: Path) -> Path:
    """Returns the wheel with copies of the libraries that other machines may lack."""
    environment = {"PATH": f"{TOOLS}:/usr/bin:/bin"}
    run(f"{TOOLS}/auditwheel", "repair", "--wheel-dir", wheel.parent / "repaired", wheel, env=environment)
    return next((wheel.parent / "repaired").glob("palpate-*.whl"))


@needs_tools
def test_the_source_package_contains_all_sources_and_no_result_of_a_build(sdist: Path) -> None:
    with tarfile.open(sdist) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
    command = [
        "git",
        "ls-files",
        "cmake",
        "cpp",
        "licenses",
        "python",
        "CMakeLists.txt",
        "LICENSE",
        "pyproject.toml",
    ]
    tracked = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    assert set(tracked) <= names
    assert not [
        name for name in names if re.search(r"^(build|dist|\.venv|\.github|\.ci)/|\.(so|o|pyc)$", name)
    ]


@needs_tools
def test_the_wheel_contains_types_licence_and_both_programs(wheel: Path) -> None:
    names = names_of(wheel)
    version = wheel.name.split("-")[1]
    tops = {name.split("/")[0] for name in names}
    assert tops == {"palpate", f"palpate-{version}.dist-info", f"palpate-{version}.data"}
    assert f"palpate-{version}.data/scripts/palpate-control" in names
    assert {
        "palpate/py.typed",
        "palpate/_core/__init__.pyi",
        "palpate/model/model.schema.json",
        "palpate/glossary.md",
    } <= names
    assert f"palpate-{version}.dist-info/licenses/LICENSE" in names
    assert not [name for name in names if name.endswith((".hpp", ".cmake"))]


def list_of_libraries(wheel: Path, name: str) -> dict[str, Any]:
    """Returns a list of components in a wheel, after a check against the schema of CycloneDX."""
    schema = pytest.importorskip("cyclonedx.schema", reason="needs cyclonedx-python-lib: make test-packages")
    validation = pytest.importorskip("cyclonedx.validation.json")
    with zipfile.ZipFile(wheel) as archive:
        text = archive.read(f"palpate-{wheel.name.split('-')[1]}.dist-info/sboms/{name}").decode()
    listed: dict[str, Any] = json.loads(text)
    version = schema.SchemaVersion.from_version(listed["specVersion"])
    errors = validation.JsonStrictValidator(version).validate_str(text)
    assert errors is None, errors
    return listed


@needs_tools
def test_the_wheel_lists_the_libraries_that_are_compiled_into_it(wheel: Path) -> None:
    listed = list_of_libraries(wheel, "palpate.cdx.json")
    assert listed["metadata"]["component"]["version"] == wheel.name.split("-")[1]
    components = {each["name"]: each for each in listed["components"]}
    with zipfile.ZipFile(wheel) as archive:
        module = next(archive.read(name) for name in archive.namelist() if "/_core." in name)
    # Names of the libraries in the module; CLI11 is in palpate-control.
    compiled = {"nlohmann-json": b"nlohmann", "pybind11": b"pybind11"}
    expected = {name for name, word in compiled.items() if word in module} | {"CLI11"}
    assert {"nlohmann-json", "pybind11"} <= expected
    assert components.keys() == expected
    assert components["pybind11"]["version"] == importlib.metadata.version("pybind11")
    for component in components.values():
        assert re.fullmatch(r"\d+\.\d+\.\d+", component["version"]), component
        assert component["purl"].endswith(component["version"])


@needs_tools
def test_the_wheel_contains_the_licence_of_each_library(wheel: Path) -> None:
    listed = list_of_libraries(wheel, "palpate.cdx.json")
    folder = f"palpate-{wheel.name.split('-')[1]}.dist-info/licenses/licenses/"
    texts = {name.removeprefix(folder) for name in names_of(wheel) if name.startswith(folder)}
    assert texts == {f"{each['name'].lower()}.txt" for each in listed["components"]} | {"libusb.txt"}
    for path in (ROOT / "licenses").iterdir():
        assert "opyright" in path.read_text(encoding="utf-8")


@needs_tools
def test_the_repaired_wheel_lists_the_libraries_that_were_copied_into_it(repaired: Path) -> None:
    copied = [name for name in names_of(repaired) if name.startswith("palpate.libs/")]
    listed = list_of_libraries(repaired, "auditwheel.cdx.json")
    assert any("libusb" in name for name in copied)
    assert any("libusb" in each["name"] for each in listed["components"])


@needs_tools
def test_the_wheel_of_the_source_package_works(wheel: Path, tmp_path: Path) -> None:
    python = clean_environment(tmp_path)
    install(python, wheel)
    try_package(python)


@needs_tools
def test_the_repaired_wheel_has_the_tag_of_a_c_library(repaired: Path) -> None:
    assert re.search(r"-manylinux_2_\d+_\w+\.whl$", repaired.name)


@needs_tools
def test_the_repaired_wheel_works_with_the_libusb_that_it_contains(repaired: Path, tmp_path: Path) -> None:
    python = clean_environment(tmp_path)
    install(python, repaired)
    try_package(python, "--repaired")


@pytest.mark.skipif(sys.version_info < (3, 11), reason="cibuildwheel needs Python 3.11")
def test_cibuildwheel_accepts_its_settings() -> None:
    pytest.importorskip("cibuildwheel", reason="needs cibuildwheel: make test-packages")
    options = ["--platform", "linux", "--archs", "x86_64,aarch64"]
    printed = run(sys.executable, "-m", "cibuildwheel", *options, "--print-build-identifiers", cwd=ROOT)
    versions = re.findall(r"Python :: 3\.(\d+)", (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    expected = {f"cp3{minor}-manylinux_{arch}" for minor in versions for arch in ("x86_64", "aarch64")}
    assert set(printed.split()) == expected
