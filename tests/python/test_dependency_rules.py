# SPDX-License-Identifier: Apache-2.0
"""Dependency rules of ARCHITECTURE.md, and the licence line on every source file."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "palpate"
HEADERS = ROOT / "cpp" / "include" / "palpate"

# Modules that every folder may import: the error type, the checks of arguments, the verdict, the names of
# array shapes and the compiled core.
COMMON = {"errors", "arguments", "verdict", "_typing", "_core"}

# A module may import the modules before it.
ROOMS = ["recording", "model", "identification", "verification", "planning", "devices", "cli"]

# These modules may import any module except cli; only cli imports them.
LEAVES = {"plotting", "baselines"}

# Folder of the headers -> the folders that it may include, besides itself, status.hpp and fields.
INCLUDES = {
    "fields": set(),
    "model": set(),
    "dynamics": {"model"},
    "solver": {"dynamics", "model"},
    "rendering": {"solver", "dynamics", "model", "device"},
    "stability": {"rendering", "solver", "dynamics", "model", "device"},
    "guard": {"rendering", "solver", "dynamics", "model", "device"},
    "device": {"realtime"},
    "realtime": set(),
    "io": {"model", "device", "realtime", "rendering", "stability"},
    "run": {
        "guard",
        "stability",
        "rendering",
        "solver",
        "dynamics",
        "model",
        "device",
        "realtime",
        "io",
    },
    "simulation": {"run", "io", "guard", "stability", "rendering", "solver", "dynamics", "model", "device"},
}

# Headers that need a library besides the standard one. Only these include each other; palpate.hpp does not.
LEAF_HEADERS = {
    "device/detail/usb_connection.hpp",
    "device/detail/usb_text.hpp",
    "device/detail/usb_transfers.hpp",
    "device/inverse3.hpp",
    "device/usb.hpp",
    "io/json_field.hpp",
    "io/json_text.hpp",
    "io/model_file.hpp",
    "io/plan_file.hpp",
    "run/open_inverse3.hpp",
    "run/open_usb.hpp",
    "simulation/open_device.hpp",
}

# System headers that a folder may use besides the standard library: the clock, the scheduler, memory and
# latency in realtime; files and sockets in io.
SYSTEM_HEADERS = {
    "realtime": {"fcntl.h", "pthread.h", "sched.h", "signal.h", "sys/mman.h", "time.h", "unistd.h"}
    | {"linux/futex.h", "sys/syscall.h"},
    "io": {"fcntl.h", "netinet/in.h", "sys/file.h", "sys/socket.h", "sys/stat.h", "unistd.h"},
}

# Headers that print, lock or open files are not allowed in the computation of a force.
NOT_IN_REAL_TIME = {
    "iostream",
    "fstream",
    "sstream",
    "cstdio",
    "mutex",
    "condition_variable",
    "future",
    "regex",
}
MAY_TALK = {"io", "realtime"}


def room_of(path: Path) -> str:
    """Returns the module of a path: `recording` for recording/rows.py, `errors` for errors.py."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_rooms(path: Path) -> set[str]:
    """Returns the modules of the package that a file imports, imports within functions included.

    The package itself, which exports names of all modules, is ".".
    """
    place = ("palpate", *path.relative_to(PACKAGE).parts[:-1])
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        targets: list[tuple[str, ...]] = []
        if isinstance(node, ast.Import):
            targets = [tuple(alias.name.split(".")) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = place[: len(place) - node.level + 1] if node.level else ()
            module = (*base, *(node.module.split(".") if node.module else ()))
            targets = [(*module, alias.name) for alias in node.names]
        for target in targets:
            if target[0] == "palpate":
                known = len(target) > 1 and target[1] in {*COMMON, *ROOMS, *LEAVES}
                found.add(target[1] if known else ".")
    return found


def may_import(room: str) -> set[str]:
    if room in ("__init__", "__main__"):
        return {*COMMON, *ROOMS} if room == "__main__" else {*COMMON, *ROOMS} - {"cli"}
    if room in LEAVES:
        return {*COMMON, room, *ROOMS} - {"cli"}
    if room == "cli":
        return {*COMMON, *ROOMS, *LEAVES, "."}
    if room in ROOMS:
        return {*COMMON, *ROOMS[: ROOMS.index(room) + 1]}
    return COMMON


PYTHON_FILES = sorted(PACKAGE.rglob("*.py"))
HEADER_FILES = sorted(HEADERS.rglob("*.hpp"))


@pytest.mark.parametrize("path", PYTHON_FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_python_imports_point_one_way(path: Path) -> None:
    room = room_of(path)
    wrong = imported_rooms(path) - may_import(room)
    assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


def test_every_python_room_is_drawn() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    assert folders <= {*ROOMS, *LEAVES}


def included(path: Path) -> list[str]:
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.parametrize("path", HEADER_FILES, ids=lambda path: str(path.relative_to(HEADERS)))
def test_headers_include_only_what_stands_below_them(path: Path) -> None:
    name = path.relative_to(HEADERS)
    here = name.parts[0].removesuffix(".hpp")
    if len(name.parts) == 1:
        assert name.name in {"palpate.hpp", "status.hpp"}
    ours = [include.removeprefix("palpate/") for include in included(path) if include.startswith("palpate/")]
    if name.as_posix() not in LEAF_HEADERS:
        assert not LEAF_HEADERS & set(ours), "a header that needs a third-party library is included by nobody"
    if here in ("palpate", "status"):
        return
    rooms = {include.split("/")[0].removesuffix(".hpp") for include in ours}
    assert here in INCLUDES, f"{here} is not drawn"
    assert rooms <= {here, "status", "fields", *INCLUDES[here]}, f"{name} includes {sorted(rooms)}"


@pytest.mark.parametrize("path", HEADER_FILES, ids=lambda path: str(path.relative_to(HEADERS)))
def test_headers_need_the_standard_library_only_and_cannot_talk(path: Path) -> None:
    name = path.relative_to(HEADERS)
    others = {include for include in included(path) if not include.startswith("palpate/")}
    if str(name) not in LEAF_HEADERS:
        system = SYSTEM_HEADERS.get(name.parts[0], set())
        foreign = {include for include in others if "/" in include or include.endswith((".h", ".hpp"))}
        foreign -= system
        assert not foreign, f"{name} includes {sorted(foreign)}"
    if name.parts[0] not in MAY_TALK:
        assert not others & NOT_IN_REAL_TIME


def test_the_umbrella_header_holds_every_header_but_the_leaves() -> None:
    held = set(included(HEADERS / "palpate.hpp"))
    headers = {f"palpate/{path.relative_to(HEADERS).as_posix()}" for path in HEADER_FILES}
    leaves = {f"palpate/{leaf}" for leaf in LEAF_HEADERS}
    reached = set(held)
    while (
        more := {i for h in reached for i in included(HEADERS.parent / h) if i.startswith("palpate/")}
        - reached
    ):
        reached |= more
    assert headers - leaves - {"palpate/palpate.hpp"} == reached


def test_a_cpp_test_is_named_after_a_header_of_its_folder() -> None:
    tests = ROOT / "tests" / "cpp"
    files = sorted(tests.rglob("test_*.cpp"))
    for file in files:
        header = file.relative_to(tests).with_name(f"{file.stem.removeprefix('test_')}.hpp")
        assert any((folder / header).exists() for folder in (HEADERS, tests, ROOT)), file
    assert len({file.name for file in files}) == len(files)


def test_bindings_include_pybind11_and_our_headers_only() -> None:
    for path in sorted((ROOT / "cpp" / "bindings").glob("*.?pp")):
        foreign = {
            include
            for include in included(path)
            if ("/" in include or include.endswith(".h"))
            and not include.startswith(("palpate/", "pybind11/"))
        }
        assert not foreign, f"{path.name} includes {sorted(foreign)}"


def sources() -> list[Path]:
    folders = ["bench", "cmake", "cpp", "docs", "examples", "python", "tests", "tools", ".ci"]
    names = ["Makefile", "CMakeLists.txt", "pyproject.toml", ".clang-format", ".clang-tidy", "CITATION.cff"]
    suffixes = {".py", ".pyi", ".hpp", ".cpp", ".cmake", ".in", ".sh", ".toml", ".yml"}
    return [ROOT / name for name in names] + [
        path
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*"))
        if path.is_file()
        and (path.suffix in suffixes or path.name in {"CMakeLists.txt", "run"})
        and "__pycache__" not in path.parts
    ]


def test_every_source_file_begins_with_its_licence() -> None:
    bare = []
    for path in sources():
        lines = path.read_text(encoding="utf-8").splitlines()
        first = next((line for line in lines if not line.startswith("#!")), "")
        if not re.fullmatch(r"(#|//) SPDX-License-Identifier: Apache-2\.0", first):
            bare.append(str(path.relative_to(ROOT)))
    assert not bare
