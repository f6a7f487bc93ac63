# SPDX-License-Identifier: Apache-2.0
"""Dependency rules of ARCHITECTURE.md, and the licence line on every source file."""

import ast
import re
from pathlib import Path

import pytest

from conftest import nodes_of

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "palpate"
HEADERS = ROOT / "cpp" / "include" / "palpate"

# Modules that every folder may import: the error type, what differs between systems, the checks of arguments,
# the verdict, the HTML of a result, pandas, the names of array shapes and the compiled core.
COMMON = {"errors", "arguments", "system", "verdict", "html_table", "frames", "_typing", "_core"}

# Modules of the package, lowest first: a module may import the modules that are listed before it.
MODULE_ORDER = ["recording", "model", "identification", "verification", "planning", "devices", "cli"]

# Modules of the package that may import any module except cli; only the module cli imports them.
SIDE_MODULES = {"plotting", "baselines", "report", "export", "app"}

# A report uses the units, labels and strokes of plotting; the page uses these, reports and exports.
SIDE_IMPORTS = {"report": {"plotting"}, "app": {"plotting", "report", "export"}}

# Folder of C++ headers -> folders whose headers it may include, besides its own, status.hpp and fields.
INCLUDES = {
    "fields": set(),
    "model": set(),
    "dynamics": {"model"},
    "solver": {"dynamics", "model"},
    "rendering": {"solver", "dynamics", "model", "device"},
    "stability": {"guard", "rendering", "solver", "dynamics", "model", "device"},
    "portable": {"rendering", "solver", "dynamics", "model", "device"},
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
OPTIONAL_HEADERS = {
    "device/can_bus.hpp",
    "device/can_motor.hpp",
    "device/detail/packet_socket.hpp",
    "device/detail/usb_connection.hpp",
    "device/detail/usb_text.hpp",
    "device/detail/usb_transfers.hpp",
    "device/hid_node.hpp",
    "device/inverse3.hpp",
    "device/inverse3_messages.hpp",
    "device/mit_device.hpp",
    "device/moteus_device.hpp",
    "device/usb.hpp",
    "device/web_socket.hpp",
    "device/wheel_device.hpp",
    "io/detail/model_file.hpp",
    "io/detail/plan_file.hpp",
    "io/json_field.hpp",
    "io/json_text.hpp",
    "io/model_file.hpp",
    "io/parse_model.hpp",
    "io/plan_file.hpp",
    "run/detail/open_inverse3.hpp",
    "run/open_can.hpp",
    "run/open_inverse3.hpp",
    "run/open_usb.hpp",
    "run/open_wheel.hpp",
    "simulation/detail/open_device.hpp",
    "simulation/open_device.hpp",
}

# System headers that a folder may use besides the standard library: the clock, the scheduler, memory and
# latency in realtime; files and sockets in io; the CAN bus and hidraw in device.
SYSTEM_HEADERS = {
    "device": {"linux/can.h", "linux/can/error.h", "linux/can/raw.h", "net/if.h", "poll.h", "sys/socket.h"}
    | {"fcntl.h", "linux/hidraw.h", "sys/file.h", "sys/ioctl.h", "sys/stat.h", "sys/un.h", "unistd.h"},
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
MAY_USE_FILES = {"io", "realtime"}


def module_of(path: Path) -> str:
    """Returns the module of a path: `recording` for recording/rows.py, `errors` for errors.py."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_modules(path: Path) -> set[str]:
    """Returns the modules of the package that a file imports, imports within functions included.

    The package itself, which exports names of all modules, is ".".
    """
    package_parts = ("palpate", *path.relative_to(PACKAGE).parts[:-1])
    found = set()
    for node in nodes_of(path):
        targets: list[tuple[str, ...]] = []
        if isinstance(node, ast.Import):
            targets = [tuple(alias.name.split(".")) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parent = package_parts[: len(package_parts) - node.level + 1] if node.level else ()
            parts = (*parent, *(node.module.split(".") if node.module else ()))
            targets = [(*parts, alias.name) for alias in node.names]
        for target in targets:
            if target[0] == "palpate":
                is_module = len(target) > 1 and target[1] in {*COMMON, *MODULE_ORDER, *SIDE_MODULES}
                found.add(target[1] if is_module else ".")
    return found


def may_import(module: str) -> set[str]:
    if module in ("__init__", "__main__"):
        return {*COMMON, *MODULE_ORDER} if module == "__main__" else {*COMMON, *MODULE_ORDER} - {"cli"}
    if module in SIDE_MODULES:
        return {*COMMON, module, *MODULE_ORDER, *SIDE_IMPORTS.get(module, ())} - {"cli"}
    if module == "cli":
        return {*COMMON, *MODULE_ORDER, *SIDE_MODULES, "."}
    if module in MODULE_ORDER:
        return {*COMMON, *MODULE_ORDER[: MODULE_ORDER.index(module) + 1]}
    return COMMON


PYTHON_FILES = sorted(PACKAGE.rglob("*.py"))
HEADER_FILES = sorted(HEADERS.rglob("*.hpp"))


@pytest.mark.parametrize("path", PYTHON_FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_python_modules_import_only_modules_before_them(path: Path) -> None:
    module = module_of(path)
    forbidden = imported_modules(path) - may_import(module)
    assert not forbidden, f"{path.relative_to(ROOT)} imports {sorted(forbidden)}"


def test_every_python_folder_has_a_dependency_rule() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()}
    assert folders <= {*MODULE_ORDER, *SIDE_MODULES}


def includes_of(path: Path) -> list[str]:
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.parametrize("path", HEADER_FILES, ids=lambda path: str(path.relative_to(HEADERS)))
def test_headers_include_only_the_folders_allowed_for_them(path: Path) -> None:
    name = path.relative_to(HEADERS)
    folder = name.parts[0].removesuffix(".hpp")
    if len(name.parts) == 1:
        assert name.name in {"palpate.hpp", "status.hpp", "version.hpp", "inline.hpp"}
    own_includes = [
        include.removeprefix("palpate/") for include in includes_of(path) if include.startswith("palpate/")
    ]
    if name.as_posix() not in OPTIONAL_HEADERS:
        assert not OPTIONAL_HEADERS & set(own_includes), f"{name} includes an optional header"
    if folder in ("palpate", "status", "version", "inline"):
        return
    folders = {include.split("/")[0].removesuffix(".hpp") for include in own_includes}
    assert folder in INCLUDES, f"{folder} has no dependency rule: add it to INCLUDES"
    allowed = {folder, "status", "version", "inline", "fields", *INCLUDES[folder]}
    assert folders <= allowed, f"{name} includes {sorted(folders)}"


def test_one_header_reads_the_time() -> None:
    reads = re.compile(r"_clock\b|clock_gettime|gettimeofday")
    readers = [path for path in HEADER_FILES if reads.search(path.read_text(encoding="utf-8"))]
    assert [path.relative_to(HEADERS).as_posix() for path in readers] == ["realtime/periodic.hpp"]


@pytest.mark.parametrize("path", HEADER_FILES, ids=lambda path: str(path.relative_to(HEADERS)))
def test_headers_include_only_the_standard_library_and_no_output_header(path: Path) -> None:
    name = path.relative_to(HEADERS)
    foreign_includes = {include for include in includes_of(path) if not include.startswith("palpate/")}
    if str(name) not in OPTIONAL_HEADERS:
        system = SYSTEM_HEADERS.get(name.parts[0], set())
        third_party = {
            include for include in foreign_includes if "/" in include or include.endswith((".h", ".hpp"))
        }
        third_party -= system
        assert not third_party, f"{name} includes {sorted(third_party)}"
    if name.parts[0] not in MAY_USE_FILES:
        assert not foreign_includes & NOT_IN_REAL_TIME


def test_palpate_hpp_includes_every_header_except_the_optional_ones() -> None:
    included_directly = set(includes_of(HEADERS / "palpate.hpp"))
    headers = {f"palpate/{path.relative_to(HEADERS).as_posix()}" for path in HEADER_FILES}
    optional_headers = {f"palpate/{optional}" for optional in OPTIONAL_HEADERS}
    reached = set(included_directly)
    while (
        new_headers := {
            i for h in reached for i in includes_of(HEADERS.parent / h) if i.startswith("palpate/")
        }
        - reached
    ):
        reached |= new_headers
    assert headers - optional_headers - {"palpate/palpate.hpp"} == reached


def test_a_cpp_test_is_named_after_a_header_of_its_folder() -> None:
    tests = ROOT / "tests" / "cpp"
    files = sorted(tests.rglob("test_*.cpp"))
    for file in files:
        header = file.relative_to(tests).with_name(f"{file.stem.removeprefix('test_')}.hpp")
        assert any((folder / header).exists() for folder in (HEADERS, tests, ROOT, ROOT / "cpp")), file
    assert len({file.name for file in files}) == len(files)


def test_bindings_include_pybind11_and_our_headers_only() -> None:
    for path in sorted((ROOT / "cpp" / "bindings").glob("*.?pp")):
        third_party = {
            include
            for include in includes_of(path)
            if ("/" in include or include.endswith(".h"))
            and not include.startswith(("palpate/", "pybind11/"))
        }
        assert not third_party, f"{path.name} includes {sorted(third_party)}"


def sources() -> list[Path]:
    folders = ["bench", "cmake", "cpp", "docs", "examples", "packaging", "python", "tests", "tools"]
    folders += [".ci", ".github"]
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
    without_licence = []
    for path in sources():
        lines = path.read_text(encoding="utf-8").splitlines()
        first = next((line for line in lines if not line.startswith("#!")), "")
        if not re.fullmatch(r"(#|//) SPDX-License-Identifier: Apache-2\.0", first):
            without_licence.append(str(path.relative_to(ROOT)))
    assert not without_licence
