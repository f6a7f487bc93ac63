# SPDX-License-Identifier: Apache-2.0
"""Tests figures and page of speed, which are made from the output of the benchmarks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from bench.solvers.ratios import measured_claims
from bench.solvers.speed import BOUNDS, main

PNG = b"\x89PNG"


def step_row(name: str, period_s: float, nanoseconds: float, error: float) -> dict[str, Any]:
    diverges = error == 0.0
    return {
        "name": f"{name}/period_ns:{round(1e9 * period_s)}",
        "cpu_time": nanoseconds,
        "period_s": period_s,
        "motion_error_rad": error,
        "diverges": float(diverges),
    }


def force_row(name: str, nanoseconds: float, end: float, instant: float) -> dict[str, Any]:
    return {
        "name": name,
        "cpu_time": nanoseconds,
        "evaluations": 1.0,
        "force_rms_Nm": 0.5,
        "force_error_end_Nm": end,
        "force_error_instant_Nm": instant,
    }


def model_row(name: str, wavelets: int, error: float) -> dict[str, Any]:
    return {
        "name": name,
        "cpu_time": 3.0 + wavelets,
        "nrmse": error,
        "n_parameters": 3 * wavelets + 2,
        "n_wavelets": wavelets,
    }


def rows_of_both_sizes(name: str, **counters: float) -> list[dict[str, Any]]:
    """Returns result rows of a benchmark for 8 and 16 wavelets: three repetitions and their mean."""
    rows: list[dict[str, Any]] = []
    for wavelets in (8, 16):
        benchmark = f"{name}/wavelets:{wavelets}"
        for time in (1.0, 2.0, 30.0):
            row = {
                "name": benchmark,
                "run_name": benchmark,
                "run_type": "iteration",
                "cpu_time": time,
                "time_unit": "us",
            }
            rows.append({**row, **counters})
        rows.append(
            {"name": f"{benchmark}_mean", "run_name": benchmark, "run_type": "aggregate", "cpu_time": 11.0}
        )
    return rows


def write_results(folder: Path) -> Path:
    """Writes benchmark results, in which one integration method diverges, to a folder and returns it."""
    context = {"num_cpus": 2, "mhz_per_cpu": 2000, "date": "2026-01-02T03:04:05", "commit": "abc"}
    benchmarks = {
        "bench_work_precision": [
            step_row("explicit_euler", 4e-3, 20.0, 0.0),
            step_row("explicit_euler", 2e-3, 20.0, 4e-5),
            step_row("implicit_table", 4e-3, 20.0, 8e-5),
            step_row("implicit_table", 2e-3, 20.0, 4e-5),
        ],
        "bench_rendered_force": [
            force_row("direct_table", 8.0, 4e-3, 4e-4),
            force_row("massless_table", 20.0, 0.12, 0.12),
        ],
        "bench_controller": [{"name": "tick/direct", "cpu_time": 30.0, "p50_ns": 29.0, "p999_ns": 120.0}],
        "bench_model_error": [
            model_row("P1/wavelet network/0", 2, 1e-2),
            model_row("P1/wavelet network/1", 6, 3e-4),
            model_row("P1/lookup table/2", 0, 2e-2),
        ],
        "bench_evaluation": [
            row
            for method in ("ExpLoop", "Network", "Compiled", "Table", "CubicSpline")
            for row in rows_of_both_sizes(f"latency<{method}>")
        ],
        "bench_bounds": [row for name in BOUNDS for row in rows_of_both_sizes(name, excess=0.004)],
    }
    for name, rows in benchmarks.items():
        (folder / f"{name}.json").write_text(json.dumps({"context": context, "benchmarks": rows}))
    return folder


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return write_results(tmp_path)


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Draws the figures of the results and returns their folder."""
    folder = write_results(tmp_path_factory.mktemp("results"))
    main([str(folder), "--to", str(folder / "figures")])
    return folder / "figures"


def test_draws_every_figure_and_writes_its_numbers_with_machine_and_date(figures: Path) -> None:
    for name in (
        "work-precision",
        "rendered-force",
        "model-error-size",
        "model-error-time",
        "evaluation",
        "bounds",
    ):
        assert (figures / f"{name}.png").read_bytes().startswith(PNG)
    text = (figures / "speed.md").read_text(encoding="utf-8")
    assert "| explicit euler | 4 | 20 | 5 | diverges |" in text
    assert "| massless table | 20 | 1 | 0.12 | 0.12 |" in text
    assert "| P1, wavelet network | 6 | 20 | 9 | 0.0003 |" in text
    assert "| compiled value and slope / std::exp loop, 16 wavelets | 1 | 0.1667 |" in text
    assert "10^6 predictions" not in text, "a claim whose benchmark did not run"
    assert "| direct | 30 | 29 | 120 |" in text
    assert "2 cores at 2000 MHz" in text
    assert "2026-01-02" in text
    assert "commit abc" in text


def test_uses_the_median_of_the_repetitions_and_ignores_the_mean(figures: Path) -> None:
    text = (figures / "speed.md").read_text(encoding="utf-8")
    assert "| compiled network | 16 | 2000 |" in text
    assert "| one input | 8 | 2000 | 0.4 |" in text
    assert "11000" not in text


def test_refuses_a_folder_without_results(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"bench_work_precision.json does not exist; make bench writes it"):
        main([str(tmp_path), "--to", str(tmp_path / "figures")])
    assert not (tmp_path / "figures").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param({"error_occurred": True, "error_message": "0.7 N*m"}, "wrong result", id="wrong-result"),
        pytest.param(
            {"force_error_end_Nm": None}, "lacks the number force_error_end_Nm", id="missing-number"
        ),
    ],
)
def test_refuses_a_wrong_benchmark(results: Path, change: dict[str, Any], message: str) -> None:
    path = results / "bench_rendered_force.json"
    content = json.loads(path.read_text())
    content["benchmarks"][1] |= change
    path.write_text(json.dumps(content))
    with pytest.raises(SystemExit, match=message) as refused:
        main([str(results), "--to", str(results / "figures")])
    assert "massless_table" in str(refused.value)


def test_refuses_a_file_of_another_format(results: Path) -> None:
    (results / "bench_work_precision.json").write_text("[1, 2")
    with pytest.raises(SystemExit, match="is not JSON output of Google Benchmark"):
        main([str(results), "--to", str(results / "figures")])


def test_claim_has_a_measured_and_a_required_value(results: Path) -> None:
    claims = {text: (measured, most) for text, measured, most in measured_claims(results)}
    assert claims["99.9th percentile of a whole tick [ns]"] == (120.0, 500.0)
    assert claims["one prediction from Python / np.interp"] == (None, 1.0)
