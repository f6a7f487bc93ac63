# SPDX-License-Identifier: Apache-2.0
"""Imports of the package: only optional or slow packages inside functions, and no cycle."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "python" / "palpate"
FILES = sorted(PACKAGE.rglob("*.py"))

# Packages that are optional, or whose import takes longer than most verbs; plotting imports matplotlib.
LATE = {"matplotlib", "palpate.plotting", "sklearn", "joblib", "distributed", "pyarrow", "openpyxl", "mcap"}
LATE |= {"scipy.io", "usb"}


def module_of(path: Path) -> str:
    parts = ("palpate", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def targets_of(path: Path, node: ast.Import | ast.ImportFrom) -> list[str]:
    """Yields modules, or names in modules, that an import loads."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    folder = ("palpate", *path.relative_to(PACKAGE).parts[:-1])
    base = folder[: len(folder) - node.level + 1] if node.level else ()
    module = ".".join((*base, *((node.module,) if node.module else ())))
    return [f"{module}.{alias.name}" for alias in node.names]


def is_late(target: str) -> bool:
    return any(f"{target}.".startswith(f"{each}.") for each in LATE)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_functions_import_only_optional_or_slow_packages(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    wrong = {
        target
        for function in ast.walk(tree)
        if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        for node in ast.walk(function)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for target in targets_of(path, node)
        if not is_late(target)
    }
    assert not wrong, f"{path.name} imports {sorted(wrong)} inside a function"


def imported_modules(path: Path, known: set[str]) -> set[str]:
    """Returns the modules of the package that a file imports when it is loaded, except for type checking."""
    waiting: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    found = set()
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            for target in targets_of(path, node):
                names = {target, target.rpartition(".")[0]} & known
                found |= {max(names, key=len)} if names else set()
        waiting += ast.iter_child_nodes(node)
    return found


def test_no_module_imports_itself_through_others() -> None:
    known = {module_of(path) for path in FILES}
    imports = {module_of(path): imported_modules(path, known) for path in FILES}
    while leaves := [name for name, others in imports.items() if not others & set(imports)]:
        for name in leaves:
            del imports[name]
    left = {name: sorted(others & set(imports)) for name, others in imports.items()}
    assert not left, f"in or behind a cycle: {left}"
