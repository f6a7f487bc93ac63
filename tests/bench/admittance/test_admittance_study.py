# SPDX-License-Identifier: Apache-2.0
"""Tests the tables of admittance displays against their numbers."""

import json
import re
from pathlib import Path

import pytest
from bench.admittance import admittance
from bench.limits.failure_maps import map_table

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "certificate.md").read_text(encoding="utf-8")
MAPS = json.loads((DOCS / "figures" / "admittance.json").read_text(encoding="utf-8"))


def table(name: str, page: str = PAGE) -> list[list[str]]:
    """Returns the cells of the table behind a mark, without its header."""
    rows = page.split(f"<!-- {name} -->\n")[1].split("<!-- end -->")[0].strip().splitlines()
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]


@pytest.mark.parametrize("name", [each["name"] for each in MAPS])
def test_page_shows_the_stored_map(name: str) -> None:
    stored = next(each for each in MAPS if each["name"] == name)
    assert f"<!-- admittance-{name} -->\n{map_table(stored)}<!-- end -->" in PAGE
    assert f"figures/admittance-{name}.png" in PAGE


def test_simulated_limits_are_the_exact_ones_to_a_thousandth() -> None:
    lines = [line for each in MAPS for line in each["lines"] if "certified" not in line["name"]]
    assert len(lines) == 10
    for line in lines:
        assert line["measured"] == pytest.approx(line["theory"], rel=1e-3)


def test_certified_damping_is_above_the_exact_limit_at_every_mass() -> None:
    lines = [line for each in MAPS for line in each["lines"] if "certified" in line["name"]]
    assert len(lines) == 2
    for line in lines:
        assert all(m > t for m, t in zip(line["measured"], line["theory"], strict=True))


def test_search_found_no_energy_at_the_certified_damping_and_some_below() -> None:
    rows = {float(share): int(found) for share, _, found in table("admittance-search")}
    assert rows[1.0] == 0
    assert rows[0.9] > 0


def test_measured_damping_is_below_the_certified_one() -> None:
    cells = [cell for row in table("admittance-measured") for cell in row[1:] if cell != "–"]
    largest = [float(re.split(" / ", cell)[1]) for cell in cells]
    assert 0.9 < max(largest) < 1.0


def test_certified_clutch_rests_and_position_over_force_oscillates() -> None:
    rows = {row[0]: row[1:] for row in table("clutch", (DOCS / "how-to" / "pedal.md").read_text("utf-8"))}
    assert rows["virtual object, 1 of the certified damping"] == ["0", "0"]
    assert float(rows["position over force, filter of 0 ms"][0].split()[0]) > 1.0


def test_unknown_part_is_refused_with_the_parts(monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.argv", ["admittance.py", "--to", "nowhere", "maps"])
    with pytest.raises(SystemExit):
        admittance.main()
    assert "part is 'maps', must be search, limits, map" in capsys.readouterr().err
