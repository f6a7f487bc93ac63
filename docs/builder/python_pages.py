# SPDX-License-Identifier: Apache-2.0
"""Makes the pages of the Python reference: one page for each public package, and one for each of its names.

The public names are those in `__all__` of palpate and of its packages. A name that `palpate` exports has its
page there only.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import shutil
from pathlib import Path
from typing import Any

import palpate


def public_packages() -> dict[str, list[str]]:
    """Returns each package with its public names; `palpate` is first."""
    found = {"palpate": sorted(palpate.__all__)}
    for module in pkgutil.iter_modules(palpate.__path__, "palpate."):
        if module.ispkg and module.name != "palpate.cli":
            names = getattr(importlib.import_module(module.name), "__all__", None)
            if names:
                found[module.name] = sorted(names)
    return found


def page_names() -> dict[str, list[str]]:
    """Returns each package with the names that have their page there."""
    packages = public_packages()
    exported = {id(getattr(palpate, name)) for name in packages["palpate"]}
    pages = {"palpate": [name for name in packages["palpate"] if name != "__version__"]}
    for package, names in list(packages.items())[1:]:
        module = importlib.import_module(package)
        pages[package] = [name for name in names if id(getattr(module, name)) not in exported]
    return pages


def write_pages(folder: Path) -> list[str]:
    """Writes the page of each package to `folder`; returns the files.

    From them autosummary makes the pages of the names.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    packages = public_packages()
    for package, names in page_names().items():
        module = importlib.import_module(package)
        elsewhere = sorted(set(packages[package]) - set(names) - {"__version__"})
        also = ", ".join(f":py:obj:`~palpate.{name}`" for name in elsewhere)
        lines = [package, "=" * len(package), "", inspect.getdoc(module) or "", ""]
        lines += [f"Documented with the package ``palpate``: {also}.", ""] if also else []
        lines += [f".. currentmodule:: {package}", "", ".. autosummary::", "   :toctree: names", ""]
        lines += [f"   {name}" for name in names]
        (folder / f"{package}.rst").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return sorted(map(str, folder.glob("*.rst")))


_SHORTER = (
    (r"[~\w.]*_Buffer \|.*?_NestedSequence\[complex \| bytes \| str\]", "ArrayLike"),
    (r"[~\w.]*ndarray\[tuple\[[~\w.]*Any, \.\.\.\], [~\w.]*dtype\[[~\w.]*\]\]", "ndarray"),
    (r"SearchOptions\((?:[^()]|\([^()]*\))*\)", "SearchOptions()"),
)
"""Patterns of types and defaults that are too long for a signature, and the shorter form"""


def shorten_signature(
    _app: Any, _kind: str, _name: str, _object: Any, _options: Any, arguments: str | None, result: str | None
) -> tuple[str | None, str | None]:
    """Writes the types of arrays in a signature by their names."""
    for pattern, name in _SHORTER:
        arguments, result = (text and re.sub(pattern, name, text) for text in (arguments, result))
    return arguments, result


def escape_formulas(_app: Any, kind: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Escapes the signs | and * of formulas and units in a docstring, outside of code and literal blocks."""
    block: int | None = None
    """Indentation of the paragraph that announces a literal block"""
    for at, line in enumerate(lines):
        indentation = len(line) - len(line.lstrip())
        if block is not None and line.strip() and indentation <= block:
            block = None
        if block is None and not line.lstrip().startswith(">>>"):
            parts = re.split(r"(``.*?``|`[^`]*`)", line)
            parts[::2] = [re.sub(r"(?<!\\)([|*])", r"\\\1", part) for part in parts[::2]]
            lines[at] = re.sub(r"^(\s*)\\\* ", r"\1* ", "".join(parts))
        if block is None and line.rstrip().endswith("::"):
            block = indentation
    if kind in ("attribute", "data", "property"):
        # Napoleon takes the text before a colon in the first line for a type; this line is an empty comment.
        lines[:0] = ["..", ""]
