# SPDX-License-Identifier: Apache-2.0
"""Where each method fails: maps from the core, their pictures and the page."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from palpate.analysis import failure_map_names, measure_failure_map
from palpate.cli.pages import with_tables

from palpate import analysis
from palpate.cli.main import main

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "where-each-method-fails.md"


def test_a_map_says_what_was_measured_and_what_theory_says() -> None:
    pole = measure_failure_map("pole", 4)
    assert pole.linear
    assert [line.at.shape for line in pole.lines] == [(4,)] * 3
    np.testing.assert_allclose(pole.lines[0].measured, pole.lines[0].theory, atol=1e-6)
    assert np.isnan(pole.lines[1].theory).all()


def test_nothing_that_was_measured_lies_below_its_bound() -> None:
    for line in measure_failure_map("encoder", 4).lines:
        assert line.ratio.min() >= 1.0


def test_what_is_not_known_is_null_in_the_file() -> None:
    written = measure_failure_map("guard", 2).as_json()
    assert written["lines"][0]["theory"] == [None, None]
    assert json.loads(json.dumps(written, allow_nan=False)) == written


@pytest.mark.parametrize(("name", "points", "says"), [("nothing", 4, "nothing"), ("pole", 1, "points is 1")])
def test_impossible_maps_are_refused(name: str, points: int, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        measure_failure_map(name, points)


def test_the_command_draws_writes_and_fills_the_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = ("encoder", "pole", "guard")
    monkeypatch.setattr(analysis, "failure_map_names", quick)
    page = tmp_path / PAGE.name
    page.write_text("".join(f"<!-- {name} -->\nold\n<!-- end -->\n" for name in (*quick, "guards", "where")))
    assert main(["chart", "failures", "--to", str(tmp_path), "--points", "3"]) == 0
    for name in quick:
        assert (tmp_path / "figures" / f"failure-{name}.png").stat().st_size > 5000
    numbers = json.loads((tmp_path / "figures" / "failure-maps.json").read_text())
    assert [each["name"] for each in numbers["maps"]] == list(quick)
    assert {"machine", "date", "palpate", "seconds", "simulated"} <= set(numbers)
    text = page.read_text()
    assert "old" not in text
    assert "measured over theory" in text
    assert numbers["date"] in text


def test_a_page_without_its_marks_is_refused_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(analysis, "failure_map_names", ("pole",))
    page = tmp_path / PAGE.name
    page.write_text("nothing to fill\n")
    assert main(["chart", "failures", "--to", str(tmp_path), "--points", "2"]) == 2
    assert "'<!-- pole -->'" in capsys.readouterr().err
    assert page.read_text() == "nothing to fill\n"


def test_marks_with_nothing_between_are_filled_too(tmp_path: Path) -> None:
    bare = "<!-- one -->\n<!-- end -->\nbetween\n<!-- two -->\nold\n<!-- end -->\n"
    assert with_tables(bare, tmp_path, {"one": "1\n", "two": "2\n"}) == (
        "<!-- one -->\n1\n<!-- end -->\nbetween\n<!-- two -->\n2\n<!-- end -->\n"
    )


def test_the_page_has_a_picture_and_a_table_for_every_map() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in failure_map_names:
        assert text.count(f"(figures/failure-{name}.png)") == 1
        assert text.count(f"<!-- {name} -->\n") == 1
        assert (PAGE.parent / "figures" / f"failure-{name}.png").exists()
    assert text.count("<!-- guards -->\n") == 1
    assert len(re.findall(r"<!-- end -->", text)) == len(failure_map_names) + 2


def test_the_numbers_of_the_page_are_those_of_its_file() -> None:
    numbers = json.loads((PAGE.parent / "figures" / "failure-maps.json").read_text(encoding="utf-8"))
    assert [each["name"] for each in numbers["maps"]] == list(failure_map_names)
    assert numbers["date"] in PAGE.read_text(encoding="utf-8")
