# SPDX-License-Identifier: Apache-2.0
"""Imports of the package: only optional or slow packages inside functions, and no cycle."""

import ast
from functools import cache
from pathlib import Path

import pytest

from conftest import nodes_of

PACKAGE = Path(__file__).parents[2] / "python" / "palpate"
FILES = sorted(PACKAGE.rglob("*.py"))

# Packages that are optional, that a system may lack, or whose import takes longer than a run of most verbs;
# these are imported inside functions. The module plotting imports matplotlib.
IMPORTED_LATE = {
    "matplotlib",
    "palpate.plotting",
    "pandas",
    "sklearn",
    "joblib",
    "distributed",
    "pyarrow",
    "python_calamine",
    "mcap",
    "bokeh",
    "jinja2",
    "tornado",
    "pywt",
    "usb",
    "resource",
    "palpate._core.run",
}


def module_of(path: Path) -> str:
    parts = ("palpate", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def targets_of(path: Path, node: ast.Import | ast.ImportFrom) -> list[str]:
    """Yields the modules, or names in modules, that an import statement loads."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    folder = ("palpate", *path.relative_to(PACKAGE).parts[:-1])
    base = folder[: len(folder) - node.level + 1] if node.level else ()
    module = ".".join((*base, *((node.module,) if node.module else ())))
    return [f"{module}.{alias.name}" for alias in node.names]


@cache
def imports_of(path: Path) -> set[str]:
    """Returns what all import statements of a file load."""
    imports = [node for node in nodes_of(path) if isinstance(node, (ast.Import, ast.ImportFrom))]
    return {target for node in imports for target in targets_of(path, node)}


def is_late(target: str) -> bool:
    return any(f"{target}.".startswith(f"{each}.") for each in IMPORTED_LATE)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_functions_import_only_optional_or_slow_packages(path: Path) -> None:
    forbidden = {
        target
        for function in nodes_of(path)
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        for node in ast.walk(function)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for target in targets_of(path, node)
        if not is_late(target)
    }
    assert not forbidden, f"{path.name} imports {sorted(forbidden)} inside a function"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_module_of_scipy_is_loaded_by_its_first_use(path: Path) -> None:
    """After `import scipy`, SciPy loads a module such as `scipy.linalg` at its first use."""
    assert not [target for target in imports_of(path) if target.startswith("scipy.")]


def imported_modules(path: Path, all_modules: set[str]) -> set[str]:
    """Returns the modules of palpate that a file imports, in functions too, except for type checking."""
    pending: list[ast.AST] = [nodes_of(path)[0]]
    modules = set()
    while pending:
        node = pending.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            for target in targets_of(path, node):
                names = {target, target.rpartition(".")[0]} & all_modules
                modules |= {max(names, key=len)} if names else set()
        pending += ast.iter_child_nodes(node)
    return modules


def test_imports_have_no_cycle() -> None:
    all_modules = {module_of(path) for path in FILES}
    imports = {module_of(path): imported_modules(path, all_modules) for path in FILES}
    while without_imports := [name for name, imported in imports.items() if not imported & set(imports)]:
        for name in without_imports:
            del imports[name]
    in_cycle = {name: sorted(imported & set(imports)) for name, imported in imports.items()}
    assert not in_cycle, f"in or behind a cycle: {in_cycle}"


NETWORK = {
    "asyncio",
    "ftplib",
    "http",
    "requests",
    "smtplib",
    "socket",
    "ssl",
    "tornado",
    "urllib",
    "websockets",
    "xmlrpc",
}
"""Packages that can open a connection. joblib and distributed do so when the user starts them."""


LISTENING = {PACKAGE / "app" / name for name in ("server.py", "live.py")}
"""Files of the app, which listen on 127.0.0.1; tests/python/app/test_server.py tests what they answer."""


@pytest.mark.parametrize(
    "path", sorted({*FILES} - LISTENING), ids=lambda path: str(path.relative_to(PACKAGE))
)
def test_no_module_imports_a_network_library(path: Path) -> None:
    assert not {target.split(".")[0] for target in imports_of(path)} & NETWORK
