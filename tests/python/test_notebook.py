# SPDX-License-Identifier: Apache-2.0
"""The notebook of the documentation runs, has no stored outputs, and is written in plain English."""

import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "builder"))

import notebook_page  # noqa: E402


@pytest.fixture(scope="module")
def notebook() -> nbformat.NotebookNode:
    return nbformat.read(notebook_page.NOTEBOOK, as_version=4)


def test_the_notebook_has_no_stored_outputs(notebook: nbformat.NotebookNode) -> None:
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)


# The kernel is another process, and its client leaves sockets and loops open.
@pytest.mark.filterwarnings("default")
@pytest.mark.full
def test_the_notebook_runs_and_every_result_is_shown() -> None:
    notebook = notebook_page.executed()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert not [output for output in outputs if output.output_type == "stream"], "a cell printed a warning"
    tables = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    results = [table for table in tables if "<b>" in table]
    captions = [table.partition("</caption>")[0].rpartition(">")[2] for table in results]
    assert captions == ["Recording", "Model", "Verification", "Plan", "Recording"]
    assert not [table for table in results if "<b>no</b>" in table]
    figures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(figures) == 5


def test_the_text_of_the_notebook_is_plain_english(notebook: nbformat.NotebookNode, tmp_path: Path) -> None:
    page = tmp_path / "notebook.md"
    text = [cell.source for cell in notebook.cells if cell.cell_type == "markdown"]
    page.write_text("\n\n".join(text), encoding="utf-8")
    checker = [sys.executable, str(ROOT / "tools" / "plain_english.py"), str(page)]
    completed = subprocess.run(checker, cwd=ROOT, capture_output=True, text=True, check=False)
    assert completed.returncode == 0, completed.stdout
