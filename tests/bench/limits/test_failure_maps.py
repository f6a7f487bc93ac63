# SPDX-License-Identifier: Apache-2.0
"""Tests figures and documentation page of the failure maps (figures of simulated stability limits)."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from bench import studies
from bench.limits import failure_maps
from bench.limits.failure_maps import map_table, write
from bench.studies import ROOT, fill_tables

PAGE = ROOT / "docs" / failure_maps.PAGE
NUMBERS = json.loads((PAGE.parent / "figures" / "failure-maps.json").read_text(encoding="utf-8"))
NAMES = [each["name"] for each in NUMBERS["maps"]]


def program_output(*names: str) -> dict[str, Any]:
    """Returns the output of the failure map program, reduced to the maps with these names."""
    maps = [each for each in NUMBERS["maps"] if each["name"] in names]
    return {"maps": maps, "guards": NUMBERS["guards"]}


def test_writes_figures_numbers_and_tables(tmp_path: Path) -> None:
    names = ("encoder", "pole", "guard")
    page = tmp_path / PAGE.name
    page.write_text("".join(f"<!-- {name} -->\nold\n<!-- end -->\n" for name in (*names, "guards", "where")))
    write(program_output(*names), tmp_path, 1.25)
    for name in names:
        assert (tmp_path / "figures" / f"failure-{name}.png").stat().st_size > 5000
    numbers = json.loads((tmp_path / "figures" / "failure-maps.json").read_text())
    assert [each["name"] for each in numbers["maps"]] == list(names)
    assert numbers["seconds"] == 1.2
    assert {"machine", "date", "palpate", "simulated"} <= set(numbers)
    text = page.read_text()
    assert "old" not in text
    assert "measured over theory" in text
    assert numbers["date"] in text


def test_refuses_a_page_without_marks(tmp_path: Path) -> None:
    page = tmp_path / PAGE.name
    page.write_text("nothing to fill\n")
    with pytest.raises(SystemExit, match="'<!-- guards -->'"):
        write(program_output(), tmp_path, 1.0)
    assert page.read_text() == "nothing to fill\n"


def test_table_states_the_ratio_and_the_largest_value_without_failure() -> None:
    line = {"name": "one", "at": [1, 2, 3], "measured": [4.0, 6.0, None], "theory": [4.0, 5.0, 6.0]}
    failure_map = {
        "name": "map",
        "along": "x",
        "limit": "y",
        "searched": 10.0,
        "linear": False,
        "lines": [line],
    }
    assert "| one | 1.0000 to 1.2000; elsewhere nothing failed up to 10 |" in map_table(failure_map)
    failure_map |= {"linear": True}
    assert map_table(failure_map).startswith("| x | 1 | 2 | 3 |\n")
    assert "| one | 4 | 6 | nan |" in map_table(failure_map)


def test_fills_empty_tables(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- one -->\n<!-- end -->\nbetween\n<!-- two -->\nold\n<!-- end -->\n")
    fill_tables(page, {"one": "1\n", "two": "2\n"})
    assert page.read_text() == "<!-- one -->\n1\n<!-- end -->\nbetween\n<!-- two -->\n2\n<!-- end -->\n"


def test_missing_program_names_its_build_target(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(studies, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", ["failure_maps.py", "--to", str(tmp_path)])
    with pytest.raises(SystemExit, match="--target failure_maps"):
        failure_maps.main()


@pytest.mark.full
def test_the_script_names_the_build_target_of_a_missing_program(tmp_path: Path) -> None:
    script = tmp_path / "bench" / "limits" / "failure_maps.py"
    script.parent.mkdir(parents=True)
    script.write_text(Path(failure_maps.__file__).read_text(encoding="utf-8"), encoding="utf-8")
    functions = Path(studies.__file__)
    (tmp_path / "bench" / functions.name).write_text(functions.read_text(encoding="utf-8"), encoding="utf-8")
    command = [sys.executable, str(script), "--to", str(tmp_path)]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)
    assert completed.returncode == 1
    assert "--target failure_maps" in completed.stderr


def test_page_has_a_figure_and_a_table_for_every_map() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in NAMES:
        assert text.count(f"(figures/failure-{name}.png)") == 1
        assert text.count(f"<!-- {name} -->\n") == 1
        assert (PAGE.parent / "figures" / f"failure-{name}.png").exists()
    assert text.count("<!-- guards -->\n") == 1
    assert len(re.findall(r"<!-- end -->", text)) == len(NAMES) + 2


def test_page_and_json_file_contain_the_same_numbers() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert NUMBERS["date"] in text
    for each in NUMBERS["maps"]:
        assert f"<!-- {each['name']} -->\n{map_table(each)}<!-- end -->" in text
