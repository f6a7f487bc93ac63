# SPDX-License-Identifier: Apache-2.0
"""Tests the comparison of methods: its page, its figures, and its claims about complete cases."""

import itertools
import json
import re
from pathlib import Path
from typing import Any

import pytest
from bench.rivals import rivals
from bench.rivals.rivals import contests, device_table, loss_table, method_table, published_table, write
from bench.studies import ROOT

PAGE = ROOT / "docs" / rivals.PAGE
NUMBERS: dict[str, Any] = json.loads((PAGE.parent / "figures" / "rivals.json").read_text(encoding="utf-8"))
TABLES = ("losses", "methods", "claims", "published", "devices", "where")
MOST_LINES = 60
"""Largest number of lines of code of a method, without comments and empty lines"""


def case(method: str, *, stiffness: float, error: float, energy: float = 0.0) -> dict[str, Any]:
    """Returns a case of one device and object."""
    spread = {"stiffness": stiffness, "force_error": error, "energy": energy, "acts": 0.0}
    return {
        "method": method,
        "device": "knob",
        "object": "wall",
        "delay": 0,
        "over_bound": None,
        "nanoseconds": 8.0,
        **{name: [value] * 3 for name, value in spread.items()},
    }


def output(*cases: dict[str, Any]) -> dict[str, Any]:
    """Returns the output of the program with a method of the package, a method of the project and a rival."""
    kinds = {"package": (True, False), "project": (False, True), "rival": (False, False)}
    methods = [
        {"name": name, "source": "s", "proved": "p", "knows": "k", "in_package": package, "ours": ours}
        for name, (package, ours) in kinds.items()
    ]
    return {"methods": methods, "cases": list(cases)}


def test_every_method_is_measured_on_every_device_object_and_delay() -> None:
    methods = {each["name"] for each in NUMBERS["methods"]}
    devices = {each["name"] for each in NUMBERS["devices"]}
    objects = {each["object"] for each in NUMBERS["cases"]}
    assert (len(methods), len(devices), len(objects)) >= (12, 4, 6)
    wanted = set(itertools.product(methods, objects, devices, range(3)))
    found = [(each["method"], each["object"], each["device"], each["delay"]) for each in NUMBERS["cases"]]
    assert len(found) == len(set(found))
    assert set(found) == wanted
    assert NUMBERS["draws"] == rivals.DRAWS


def test_published_limits_are_found_within_five_percent() -> None:
    assert len(NUMBERS["published"]) >= 9
    for each in NUMBERS["published"]:
        assert each["found"] == pytest.approx(each["published"], rel=0.05), each["limit"]


def test_page_and_json_file_contain_the_same_numbers() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name, table in (
        ("losses", loss_table),
        ("methods", method_table),
        ("published", published_table),
        ("devices", device_table),
    ):
        assert f"<!-- {name} -->\n{table(NUMBERS)}<!-- end -->" in text
    assert NUMBERS["date"] in text


def test_losses_are_the_first_table() -> None:
    marks = re.findall(r"<!-- (\w+) -->", PAGE.read_text(encoding="utf-8"))
    assert next(mark for mark in marks if mark not in {"end", "where"}) == "losses"
    assert set(marks) - {"end"} == set(TABLES)


def test_a_method_has_one_short_file() -> None:
    files = list((ROOT / "bench" / "rivals" / "methods").glob("*.cpp"))
    assert len(files) == len(NUMBERS["methods"])
    for file in files:
        lines = file.read_text(encoding="utf-8").splitlines()
        code = [line for line in lines if line.strip() and not line.strip().startswith("//")]
        assert len(code) <= MOST_LINES, file.name


def test_a_rival_that_gives_too_much_energy_wins_no_force_error() -> None:
    own = case("package", stiffness=1.0, error=0.1)
    for energy, lost in ((0.5, 1), (2.0, 0)):
        rival = case("rival", stiffness=1.0, error=0.01, energy=energy)
        found = contests(output(own, rival), {"package"}, "force_error", 0)
        assert sum(contest.lost for contest in found) == lost


def test_loss_table_names_the_largest_loss_and_counts_the_methods_of_the_project() -> None:
    cases = (
        case("package", stiffness=1.0, error=0.1),
        case("project", stiffness=9.0, error=0.1),
        case("rival", stiffness=3.0, error=0.2),
    )
    lines = loss_table(output(*cases)).splitlines()
    row = next(line for line in lines if "stiffness [2b/T], delay 0" in line)
    assert row.endswith("| 1 of 1 | 0 | wall, knob | package: 1 | rival: 3 |")


@pytest.mark.full
def test_writes_figures_numbers_and_tables_of_a_part_of_the_cases(tmp_path: Path) -> None:
    page = tmp_path / PAGE.name
    page.write_text(
        "".join(f"<!-- {name} -->\nobsolete\n<!-- end -->\n" for name in TABLES), encoding="utf-8"
    )
    part = {key: NUMBERS[key] for key in ("draws", "devices", "methods", "published")}
    part["cases"] = NUMBERS["cases"][::25]
    write(part, tmp_path, 1.6)
    assert "obsolete" not in page.read_text(encoding="utf-8")
    numbers = json.loads((tmp_path / "figures" / "rivals.json").read_text(encoding="utf-8"))
    assert numbers["cases"] == part["cases"]
    assert numbers["processor_s"] == 2
    for name in ("stiffness", "time"):
        assert (tmp_path / "figures" / f"rivals-{name}.png").stat().st_size > 5000
