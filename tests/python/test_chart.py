# SPDX-License-Identifier: Apache-2.0
"""palpate chart: figures of what the benchmarks printed, and of nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from palpate.cli.speed_over_size import BOUNDS

from palpate.cli.main import main

PNG = b"\x89PNG"


def _step(name: str, period_s: float, nanoseconds: float, error: float) -> dict[str, Any]:
    diverges = error == 0.0
    return {
        "name": f"{name}/period_ns:{round(1e9 * period_s)}",
        "cpu_time": nanoseconds,
        "period_s": period_s,
        "motion_error_rad": error,
        "diverges": float(diverges),
    }


def _force(name: str, nanoseconds: float, end: float, instant: float) -> dict[str, Any]:
    return {
        "name": name,
        "cpu_time": nanoseconds,
        "evaluations": 1.0,
        "force_rms_Nm": 0.5,
        "force_error_end_Nm": end,
        "force_error_instant_Nm": instant,
    }


def _model(name: str, wavelets: int, error: float) -> dict[str, Any]:
    return {
        "name": name,
        "cpu_time": 3.0 + wavelets,
        "nrmse": error,
        "n_parameters": 3 * wavelets + 2,
        "n_wavelets": wavelets,
    }


def _sized(name: str, **counters: float) -> list[dict[str, Any]]:
    """A benchmark for 8 and 16 wavelets, in three repetitions and with their mean."""
    rows: list[dict[str, Any]] = []
    for wavelets in (8, 16):
        of = f"{name}/wavelets:{wavelets}"
        for time in (1.0, 2.0, 30.0):
            row = {"name": of, "run_name": of, "run_type": "iteration", "cpu_time": time, "time_unit": "us"}
            rows.append({**row, **counters})
        rows.append({"name": f"{of}_mean", "run_name": of, "run_type": "aggregate", "cpu_time": 11.0})
    return rows


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """What the benchmarks leave, with a time step that diverges."""
    context = {"num_cpus": 2, "mhz_per_cpu": 2000, "date": "2026-01-02T03:04:05", "commit": "abc"}
    benchmarks = {
        "bench_work_precision": [
            _step("explicit_euler", 4e-3, 20.0, 0.0),
            _step("explicit_euler", 2e-3, 20.0, 4e-5),
            _step("implicit_table", 4e-3, 20.0, 8e-5),
            _step("implicit_table", 2e-3, 20.0, 4e-5),
        ],
        "bench_rendered_force": [
            _force("direct_table", 8.0, 4e-3, 4e-4),
            _force("massless_table", 20.0, 0.12, 0.12),
        ],
        "bench_controller": [{"name": "tick/direct", "cpu_time": 30.0, "p50_ns": 29.0, "p999_ns": 120.0}],
        "bench_model_error": [
            _model("P1/wavelet network/0", 2, 1e-2),
            _model("P1/wavelet network/1", 6, 3e-4),
            _model("P1/lookup table/2", 0, 2e-2),
        ],
        "bench_evaluation": [
            row
            for method in ("ExpLoop", "Network", "Compiled", "Table", "CubicSpline")
            for row in _sized(f"latency<{method}>")
        ],
        "bench_bounds": [row for name in BOUNDS for row in _sized(name, excess=0.004)],
        "ratios": [{"name": "table / explicit step", "measured": 0.93, "most": 1.0}],
    }
    for name, rows in benchmarks.items():
        (tmp_path / f"{name}.json").write_text(json.dumps({"context": context, "benchmarks": rows}))
    return tmp_path


def test_draws_every_figure_and_writes_its_numbers_with_machine_and_date(results: Path) -> None:
    to = results / "figures"
    assert main(["chart", "speed", str(results), "--to", str(to)]) == 0
    for name in (
        "work-precision",
        "rendered-force",
        "model-error-size",
        "model-error-time",
        "evaluation",
        "bounds",
    ):
        assert (to / f"{name}.png").read_bytes().startswith(PNG)
    text = (to / "speed.md").read_text(encoding="utf-8")
    assert "| explicit euler | 4 | 20 | 5 | diverges |" in text
    assert "| massless table | 20 | 1 | 0.12 | 0.12 |" in text
    assert "| P1, wavelet network | 6 | 20 | 9 | 0.0003 |" in text
    assert "| table / explicit step | 0.93 | 1 |" in text
    assert "| direct | 30 | 29 | 120 |" in text
    assert "2 cores at 2000 MHz" in text
    assert "2026-01-02" in text
    assert "commit abc" in text


def test_takes_the_median_of_the_repetitions_and_no_mean_for_one(results: Path) -> None:
    to = results / "figures"
    assert main(["chart", "speed", str(results), "--to", str(to)]) == 0
    text = (to / "speed.md").read_text(encoding="utf-8")
    assert "| compiled network | 16 | 2000 |" in text
    assert "| one input | 8 | 2000 | 0.4 |" in text
    assert "11000" not in text


def test_refuses_a_folder_without_results(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["chart", "speed", str(tmp_path), "--to", str(tmp_path / "figures")]) == 2
    assert "bench_work_precision.json does not exist; make bench writes it" in capsys.readouterr().err
    assert not (tmp_path / "figures").exists()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        pytest.param({"error_occurred": True, "error_message": "0.7 N*m"}, "wrong answer", id="wrong-answer"),
        pytest.param({"force_error_end_Nm": None}, "has no number force_error_end_Nm", id="no-number"),
    ],
)
def test_draws_no_benchmark_that_is_wrong(
    results: Path, capsys: pytest.CaptureFixture[str], change: dict[str, Any], says: str
) -> None:
    path = results / "bench_rendered_force.json"
    content = json.loads(path.read_text())
    content["benchmarks"][1] |= change
    path.write_text(json.dumps(content))
    assert main(["chart", "speed", str(results), "--to", str(results / "figures")]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert "massless_table" in said


def test_refuses_what_is_no_benchmark_output(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (results / "bench_work_precision.json").write_text("[1, 2")
    assert main(["chart", "speed", str(results), "--to", str(results / "figures")]) == 2
    assert "is no output of Google Benchmark" in capsys.readouterr().err


def _left(folder: Path, name: str, results: Any) -> None:
    where = {
        "machine": "2 cores",
        "python": "3",
        "date": "2026-01-02",
        "commit": "abc",
        "scale": 1.0,
        "load": 0.5,
    }
    (folder / f"{name}.json").write_text(json.dumps({"where": where, "results": results}))


def _reached(problem: str, method: str, nrmse: float, n_parameters: int) -> dict[str, Any]:
    times = {"fit_s": 0.25, "tuning_s": 0.5, "over_ours": 3.0, "draws": 12}
    ours = method == "palpate"
    return {
        "problem": problem,
        "method": method,
        "nrmse": nrmse,
        "nrmse_range": [nrmse / 2, 2 * nrmse],
        "n_parameters": n_parameters,
        "n_parameters_range": [n_parameters - 3, n_parameters + 3],
        "n_wavelets": 6 if ours else None,
        "n_wavelets_range": [5, 7] if ours else None,
        **times,
    }


@pytest.fixture
def identified(tmp_path: Path) -> Path:
    """What the benchmarks of identification leave where there is no measured data."""
    rows = [
        _reached("P1", "palpate", 3e-4, 20),
        _reached("P1", "splines", 5e-4, 44),
        {"problem": "P1", "method": "MARS", "skipped": "needs pyearth"},
        _reached("P3", "palpate", 8e-4, 58),
    ]
    _left(tmp_path, "identification", rows)
    _left(tmp_path, "filters", [{"way": "matched", "fastest_hz": [1.0, 2.0], "nrmse": [1e-3, 2e-3]}])
    _left(tmp_path, "parsimony", [{"claim": "no wavelet", "right": 99, "draws": 100, "seconds": 0.1}])
    return tmp_path


def test_identification_is_drawn_and_the_tables_of_its_page_follow(identified: Path) -> None:
    names = ("identification", "filters", "parsimony", "real_data", "dynamic")
    page = identified / "identification.md"
    tables = "".join(f"<!-- {name} -->\nold {name}\n<!-- end -->\n" for name in names)
    # the first time a table is filled there is none
    page.write_text(tables.replace("old filters\n", ""))
    assert main(["chart", "identification", str(identified), "--to", str(identified)]) == 0
    for name in ("parameters", "time", "filters"):
        assert (identified / "figures" / f"identification-{name}.png").read_bytes().startswith(PNG)
    text = page.read_text(encoding="utf-8")
    assert "| P1, palpate | 3.00e-04 (1.50e-04 to 6.00e-04) | 6 (5 to 7) | 20 (17 to 23) |" in text
    assert "| P1, splines | 5.00e-04 (2.50e-04 to 1.00e-03) |  | 44 (41 to 47) | 0.25 |" in text
    assert "MARS" not in text
    assert "| no wavelet | 99 | 100 |" in text
    assert "2026-01-02, 2 cores, load 0.5, Python 3, commit abc; median (least" in text
    assert "of up to 12 draws" in text
    # what was not measured this time stays as it was
    assert "old real_data" in text
    assert "old parsimony" not in text
    assert text.count("| matched |") == 1


def _measured(nrmse: float, **more: Any) -> dict[str, Any]:
    splines = {"nrmse": 0.01, "n_parameters": 200, "seconds": 0.1}
    row = {"file": "dome", "nrmse": nrmse, "n_parameters": 100, "seconds": 1.0, "finite": True}
    both = {"splines": splines, "passive_splines": {**splines, "nrmse": 0.02}}
    return {**row, **both, "baselines": {"splines": splines}, **more}


def test_measured_objects_stand_beside_their_splines_and_where_strokes_cross(identified: Path) -> None:
    domes = [_measured(0.015, floor=0.009, share_at_turn=0.8), _measured(0.03)]
    variants = {"domes_h_of_any_sign": [_measured(0.011)], "domes_force_25_ms_earlier": [_measured(0.006)]}
    _left(identified, "real_data", {"domes": domes, **variants, "springs": [_measured(0.009)]})
    page = identified / "identification.md"
    names = ("identification", "filters", "parsimony", "real_data", "crossing")
    page.write_text("".join(f"<!-- {name} -->\n<!-- end -->\n" for name in names))
    assert main(["chart", "identification", str(identified), "--to", str(identified)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "| domes (2 files), palpate | 0.0225 | 100 | 1 | 3.00 (2 above 1.3) | 1.50 (1 above 1.3) |" in text
    assert "| springs (1 files), palpate | 0.0090 | 100 | 1 | 0.90 | 0.45 |" in text
    assert "| dome | 0.0150 | 0.0110 | 0.0100 | 0.0200 | 0.0090 | 80 % | 0.0060 | 0.0100 |" in text


def test_identification_without_its_benchmark_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["chart", "identification", str(tmp_path), "--to", str(tmp_path)]) == 2
    assert "identification.json does not exist; make bench writes it" in capsys.readouterr().err
    (tmp_path / "identification.json").write_text("[1, 2]")
    assert main(["chart", "identification", str(tmp_path), "--to", str(tmp_path)]) == 2
    assert "is no output of bench/identification.py" in capsys.readouterr().err
