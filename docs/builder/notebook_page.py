# SPDX-License-Identifier: Apache-2.0
"""Runs the notebook of the documentation and makes its page, with the output of each cell."""

from __future__ import annotations

import os
import shutil
from base64 import b64decode
from pathlib import Path

import nbformat
import once
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
NOTEBOOK = ROOT / "docs" / "notebook.ipynb"
FOLDER = ROOT / "build" / "docs" / "notebook"


def executed() -> nbformat.NotebookNode:
    """Returns the notebook with the outputs of its cells."""
    text = NOTEBOOK.read_text(encoding="utf-8")
    stored = once.kept(FOLDER / "executed.json", text, lambda: nbformat.writes(_run(text)))
    return nbformat.reads(stored, as_version=4)


def _run(text: str) -> nbformat.NotebookNode:
    """Runs the notebook in an empty folder."""
    folder = FOLDER / "run"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    notebook = nbformat.reads(text, as_version=4)
    client = NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}})
    backend = "module://matplotlib_inline.backend_inline"
    client.execute(env={**os.environ, "IPYTHONDIR": str(folder), "MPLBACKEND": backend})
    return notebook


def write_page(folder: Path) -> None:
    """Writes the page `notebook.md` and its pictures to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = []
    n_pictures = 0
    for cell in executed().cells:
        parts.append(cell.source if cell.cell_type == "markdown" else f"```python\n{cell.source}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                n_pictures += 1
                picture = f"notebook-{n_pictures}.png"
                (folder / picture).write_bytes(b64decode(data["image/png"]))
                parts.append(f"![Output of the cell above]({picture})")
            elif "text/html" in data:
                parts.append(f"```{{raw}} html\n{data['text/html']}\n```")
            else:
                parts.append(f"```text\n{output.get('text') or data['text/plain']}\n```")
    title, *rest = parts
    download = "{download}`Download the notebook <../notebook.ipynb>` and run it in Jupyter."
    (folder / "notebook.md").write_text("\n\n".join([title, download, *rest, ""]), encoding="utf-8")
