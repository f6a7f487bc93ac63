# SPDX-License-Identifier: Apache-2.0
"""Tests figures and page of identification, which are made from the output of the studies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from bench.identification.figures import main
from bench.identification.repeats import SEVERAL

PNG = b"\x89PNG"


def write_results(folder: Path, name: str, results: Any) -> None:
    machine = {
        "machine": "2 cores",
        "python": "3",
        "date": "2026-01-02",
        "commit": "abc",
        "scale": 1.0,
        "load": 0.5,
    }
    (folder / f"{name}.json").write_text(json.dumps({"where": machine, "results": results}))


def result_row(problem: str, method: str, nrmse: float, n_parameters: int) -> dict[str, Any]:
    times = {"fit_s": 0.25, "tuning_s": 0.5, "time_over_palpate": 3.0, "draws": 12}
    is_palpate = method == "palpate"
    return {
        "problem": problem,
        "method": method,
        "nrmse": nrmse,
        "nrmse_range": [nrmse / 2, 2 * nrmse],
        "n_parameters": n_parameters,
        "n_parameters_range": [n_parameters - 3, n_parameters + 3],
        "n_wavelets": 6 if is_palpate else None,
        "n_wavelets_range": [5, 7] if is_palpate else None,
        **times,
    }


def measured_row(nrmse: float, **fields: Any) -> dict[str, Any]:
    splines = {"nrmse": 0.01, "n_parameters": 200, "seconds": 0.1}
    row = {"file": "dome", "nrmse": nrmse, "n_parameters": 100, "seconds": 1.0, "finite": True}
    spline_results = {"splines": splines, "passive_splines": {**splines, "nrmse": 0.02}}
    return {**row, **spline_results, "baselines": {"splines": splines}, **fields}


PROBLEM = "contact, 6 inputs, 20000 rows"


def results_of_methods() -> list[dict[str, Any]]:
    """Returns the results of four methods; one method is missing on the machine."""
    return [
        result_row("P1", "palpate", 3e-4, 20),
        result_row("P1", "splines", 5e-4, 44),
        {"problem": "P1", "method": "MARS", "skipped": "needs pyearth"},
        result_row("P3", "palpate", 8e-4, 58),
    ]


def results_of_repeats() -> list[dict[str, Any]]:
    draws = {"n_parameters": [11, 14, 17], "repeat": [1.0, 2.0, 3.0], "sample": [4.0, 5.0, 6.0]}
    curve = [0.0, 1.0]
    row = {
        "silicone": "soft",
        "methods": {
            SEVERAL: {**draws, "coverage": [0.9, 1.0, 1.0], "seconds": [1.0] * 3},
            "spline": {**draws, "coverage": [None] * 3, "seconds": [1.0] * 3},
        },
        "within_kPa": 0.5,
        "both_kPa": 1.0,
        "published_kPa": {"Yeoh_o3": 0.7, "Ogden_o1": 2.0},
        "curves": {"position": [0.0, 0.02], "half_width": curve, "A": [curve], "B": [curve]},
    }
    return [row]


def results_of_several_inputs() -> list[dict[str, Any]]:
    return [
        result_row(PROBLEM, "palpate", 2e-3, 71),
        result_row(PROBLEM, "HistGradientBoosting", 3e-2, 900),
        result_row(PROBLEM, "Nystrom + Ridge", 4e-3, 1000),
        result_row(PROBLEM, "Gaussian process", 1e-3, 2000),
    ]


def results_of_measured_objects() -> dict[str, list[dict[str, Any]]]:
    return {
        "domes": [measured_row(0.015, floor=0.009, share_at_turn=0.8), measured_row(0.03)],
        "domes_h_of_any_sign": [measured_row(0.011)],
        "domes_force_25_ms_earlier": [measured_row(0.006)],
        "springs": [measured_row(0.009)],
    }


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns a folder with the figures and the page of all studies except that of moving objects."""
    folder = tmp_path_factory.mktemp("results")
    write_results(folder, "compare_methods", results_of_methods())
    write_results(folder, "filters", [{"way": "matched", "fastest_hz": [1.0, 2.0], "nrmse": [1e-3, 2e-3]}])
    write_results(folder, "parsimony", [{"claim": "no wavelet", "right": 99, "draws": 100, "seconds": 0.1}])
    write_results(folder, "repeats", results_of_repeats())
    write_results(folder, "several_inputs", results_of_several_inputs())
    write_results(folder, "real_data", results_of_measured_objects())
    names = (
        "compare_methods",
        "filters",
        "parsimony",
        "repeats",
        "published",
        "several_inputs",
        "real_data",
        "crossing",
        "dynamic",
    )
    tables = "".join(f"<!-- {name} -->\nold {name}\n<!-- end -->\n" for name in names)
    # a new table of the page is empty until its study has run
    (folder / "identification.md").write_text(tables.replace("old filters\n", ""))
    main([str(folder), "--to", str(folder)])
    return folder


def page_of(folder: Path) -> str:
    return (folder / "identification.md").read_text(encoding="utf-8")


def has_figure(folder: Path, name: str) -> bool:
    return (folder / "figures" / f"identification-{name}.png").read_bytes().startswith(PNG)


def test_draws_figures_and_fills_tables_of_the_page(filled: Path) -> None:
    for name in ("parameters", "time", "filters"):
        assert has_figure(filled, name)
    text = page_of(filled)
    assert "| P1, palpate | 3.00e-04 (1.50e-04 to 6.00e-04) | 6 (5 to 7) | 20 (17 to 23) |" in text
    assert "| P1, splines | 5.00e-04 (2.50e-04 to 1.00e-03) |  | 44 (41 to 47) | 0.25 |" in text
    assert "MARS" not in text
    assert "| no wavelet | 99 | 100 |" in text
    assert "2026-01-02, 2 cores, load 0.5, Python 3, commit abc; median (least" in text
    assert "of up to 12 draws" in text
    # the page keeps the table of a study that did not run
    assert "old dynamic" in text
    assert "old parsimony" not in text
    assert text.count("| matched |") == 1


def test_fills_the_tables_of_repeats_and_of_published_fits(filled: Path) -> None:
    text = page_of(filled)
    assert f"| soft, {SEVERAL} | 14 (11 to 17) | 2.00 (1.00 to 3.00) | 5.00 (4.00 to 6.00) | 96.7 % |" in text
    assert "| soft, spline | 14 (11 to 17) | 2.00 (1.00 to 3.00) | 5.00 (4.00 to 6.00) |  | 1 |" in text
    assert "| soft | 0.50 | 1.00 | Yeoh 3 0.70, Ogden 1 2.00 | 1 of 2 | Yeoh 3 |" in text
    assert has_figure(filled, "repeats")


def test_fills_the_table_of_several_inputs(filled: Path) -> None:
    (line,) = [each for each in page_of(filled).splitlines() if PROBLEM in each]
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[:2] == [f"{PROBLEM} (12 draws)", "0.2 (0.1 to 0.4)"]
    assert cells[4:7] == ["0.1 (0.05 to 0.2)", "71", "0.75"]
    assert has_figure(filled, "several")


def test_fills_the_tables_of_measured_objects_and_of_crossing_strokes(filled: Path) -> None:
    text = page_of(filled)
    assert "| domes (2 files), palpate | 0.0225 | 100 | 1 | 3.00 (2 above 1.3) | 1.50 (1 above 1.3) |" in text
    assert "| springs (1 files), palpate | 0.0090 | 100 | 1 | 0.90 | 0.45 |" in text
    assert "| dome | 0.0150 | 0.0110 | 0.0100 | 0.0200 | 0.0090 | 80 % | 0.0060 | 0.0100 |" in text


def test_refuses_a_missing_or_foreign_file(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"compare_methods.json does not exist; make bench writes it"):
        main([str(tmp_path), "--to", str(tmp_path)])
    (tmp_path / "compare_methods.json").write_text("[1, 2]")
    with pytest.raises(SystemExit, match=r"is not from bench/identification/compare_methods.py"):
        main([str(tmp_path), "--to", str(tmp_path)])
