# SPDX-License-Identifier: Apache-2.0
"""Files that do not fit into memory are read in parts."""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import palpate
from conftest import sampled
from palpate.cli.main import main
from palpate.errors import InputError
from palpate.identification.identify_files import (
    MOST_CELLS,
    PartRead,
    Summary,
    merged,
    read_part,
    require_all_rows,
    summarise,
)
from palpate.recording.reading import LongRecording, open_long_recording

SCALE = float(os.environ.get("PALPATE_TEST_SCALE", "1"))


def rows(n: int, seed: int = 0, step: float = 0.0) -> pd.DataFrame:
    """Returns a soft spring that ends at a wall, with hysteresis; `step` quantises positions."""
    random = np.random.default_rng(seed)
    phase = 2.0 * np.pi * 0.8e-3 * np.arange(n)
    x = 0.3 - 0.3 * np.cos(phase)
    if step:
        x = np.round(x / step) * step
    press = np.sin(phase) >= 0
    y = 2.0 * x + 0.58 * np.logaddexp(0.0, (x - 0.4) / 0.01) + np.where(press, 0.05, -0.05)
    y += random.normal(0.0, 0.02, n)
    return pd.DataFrame(
        {"position_rad": x, "torque_Nm": y, "direction": np.where(press, "press", "release"), "note": "text"}
    )


def table_of(frame: pd.DataFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    side = np.where(frame.direction == "press", 1, -1).astype(np.int8)
    return frame.position_rad.to_numpy(), frame.torque_Nm.to_numpy(), side


def in_blocks(arrays: tuple[np.ndarray, ...], blocks: int, most_cells: int = MOST_CELLS) -> Summary:
    parts = zip(*(np.array_split(array, blocks) for array in arrays), strict=True)
    return reduce(lambda a, b: merged(a, b, most_cells), (summarise(*part, most_cells) for part in parts))


@pytest.mark.parametrize("step", [0.0, 1e-3], ids=["any-position", "encoder"])
@pytest.mark.parametrize("blocks", [1, 2, 7, 50])
def test_blocks_sum_up_to_the_whole(step: float, blocks: int) -> None:
    arrays = table_of(rows(10_000, step=step))
    whole, parts = (
        summarise(*arrays, 500 if not step else MOST_CELLS),
        in_blocks(arrays, blocks, 500 if not step else MOST_CELLS),
    )
    assert (parts.level is None) == bool(step)
    assert parts.level == whole.level
    for name in ("cell", "side", "count", "position", "force", "xx", "xy", "yy"):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), rel=1e-9, abs=1e-12)
    assert parts.rows == len(arrays[0])
    assert parts.variance == pytest.approx(np.var(arrays[1]))
    assert (parts.lower, parts.upper) == (arrays[0].min(), arrays[0].max())


def test_no_digits_are_lost_to_a_large_offset() -> None:
    x, y, side = table_of(rows(10_000))
    near, far = in_blocks((x, y, side), 9, 100), in_blocks((x, y + 1e6, side), 9, 100)
    assert far.yy.sum() == pytest.approx(near.yy.sum(), rel=1e-6)


def test_number_of_cells_is_bounded_for_any_rows() -> None:
    random = np.random.default_rng(0)
    summary = None
    for scale in (1e-6, 1.0, 1e3, 1e-3, 1e5):
        x = scale * random.normal(size=3000)
        block = summarise(x, x, None, 256)
        summary = block if summary is None else merged(summary, block, 256)
    assert summary is not None
    assert len(summary.cell) <= 258
    assert summary.rows == 15_000


def test_scatter_within_cells_is_the_noise() -> None:
    arrays = table_of(rows(200_000))
    summary = in_blocks(arrays, 5, 512)
    assert np.sqrt(summary.within / summary.rows) == pytest.approx(0.02, rel=0.03)


@pytest.mark.parametrize("suffix", sampled(["csv", "parquet"], "parquet"))
@pytest.mark.parametrize("step", sampled([0.0, 1e-3], 1e-3), ids=["any-position", "encoder"])
def test_the_model_is_that_of_all_rows_at_once(tmp_path: Path, suffix: str, step: float) -> None:
    file, frame = tmp_path / f"press.{suffix}", rows(8_000, step=step)
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=1_000)
    model = palpate.identify_files(file, part_rows=2_000)
    at_once = palpate.identify(palpate.read_recording(file))
    assert model.fit.model_class == at_once.fit.model_class == "hysteresis"
    assert model.data.rows == 8_000
    assert model.data.sha256 == at_once.data.sha256
    assert model.fit.nrmse == pytest.approx(at_once.fit.nrmse, rel=5e-2)  # waits are fitted as well
    assert model.n_parameters == pytest.approx(at_once.n_parameters, abs=12)
    x = np.linspace(0.01, 0.59, 200)
    for side in (1.0, -1.0):
        difference = model.force(x, direction=np.full(200, side)) - at_once.force(
            x, direction=np.full(200, side)
        )
        assert np.sqrt(np.mean(difference**2)) < 0.004


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_parts_hold_every_row_once(tmp_path: Path, suffix: str) -> None:
    file, frame = tmp_path / f"press.{suffix}", rows(2_000)
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=150)
    recording = open_long_recording(file, part_rows=350)
    assert len(recording.parts) > 4
    read = [block for part in recording.parts for block in recording.blocks(part)]
    assert np.array_equal(np.concatenate([block.position for block in read]), frame.position_rad)
    assert np.array_equal(np.concatenate([block.force for block in read]), frame.torque_Nm)
    assert sum(len(block.kept) for block in read) == recording.rows == len(frame)


def test_units_signs_and_several_files(tmp_path: Path) -> None:
    x = np.linspace(0.0, 4.0, 400)
    for name in "ab":
        pd.DataFrame({"depth_mm": -x, "force_mN": 500.0 * x}).to_csv(tmp_path / f"{name}.csv", index=False)
    model = palpate.identify_files([tmp_path / "a.csv", tmp_path / "b.csv"], negate=["position"])
    assert model.force(0.002) == pytest.approx(1.0, rel=1e-6)
    assert model.units == {"position": "m", "force": "N"}
    assert (model.fit.model_class, model.data.rows, len(model.data.files)) == ("linear", 800, 2)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_bad_row_is_named_or_dropped(tmp_path: Path, suffix: str) -> None:
    file, frame = tmp_path / f"press.{suffix}", rows(2_000).drop(columns=["direction"])
    frame.loc[1_600, "torque_Nm"] = np.nan
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=300)
    place = "line 1602" if suffix == "csv" else "row 1600"
    with pytest.raises(InputError, match=f"press.{suffix}, {place}: column torque_Nm holds"):
        palpate.identify_files(file, part_rows=700)
    assert palpate.identify_files(file, part_rows=700, invalid="drop", max_wavelets=1).data.rows == 1_999


def test_text_in_a_number_column_is_named_with_its_line(tmp_path: Path) -> None:
    file, frame = tmp_path / "press.csv", rows(1_500).astype({"torque_Nm": object})
    frame.loc[1_300, "torque_Nm"] = "much"
    frame.to_csv(file, index=False)
    with pytest.raises(InputError, match=r"line 1302: column torque_Nm holds 'much'"):
        palpate.identify_files(file, part_rows=600)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"inputs": "position,velocity"}, "inputs names velocity"),
    ],
)
def test_options_that_need_all_rows_are_refused(
    tmp_path: Path, options: dict[str, str], sentence: str
) -> None:
    rows(100).to_csv(tmp_path / "press.csv", index=False)
    with pytest.raises(InputError, match=sentence):
        palpate.identify_files(tmp_path / "press.csv", **options)


def same(first: palpate.Model, second: palpate.Model) -> bool:
    return json.dumps(first.to_dict()) == json.dumps(second.to_dict())


def test_files_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    newtons, directed, empty = tmp_path / "newtons.csv", tmp_path / "directed.csv", tmp_path / "empty.csv"
    rows(400).drop(columns=["direction"]).to_csv(newtons, index=False)
    rows(400).to_csv(directed, index=False)
    rows(400).assign(torque_Nm=np.nan).to_csv(empty, index=False)
    with pytest.raises(InputError, match=r"files is empty: give a path or a list of paths"):
        palpate.identify_files([])
    with pytest.raises(
        InputError, match=r"directed\.csv and .*newtons\.csv differ in their units, or only one"
    ):
        palpate.identify_files([newtons, directed])
    with pytest.raises(InputError, match=r"empty\.csv: no row is usable"):
        palpate.identify_files(empty, invalid="drop")


def test_a_period_and_inputs_without_hysteresis_apply_part_by_part(tmp_path: Path) -> None:
    """Error on all rows of a knob that was turned by several turns: that of the noise."""
    file, random = tmp_path / "knob.csv", np.random.default_rng(1)
    angle = np.concatenate([np.linspace(0.0, 19.0, 4_000), np.linspace(19.0, 0.0, 4_000)])
    torque = 0.5 * np.sin(angle) + random.normal(0.0, 0.02, len(angle))
    pd.DataFrame({"angle_rad": angle, "torque_Nm": torque}).to_csv(file, index=False)
    model = palpate.identify_files(file, part_rows=2_000, period=2 * np.pi, inputs="position")
    assert model.fit.model_class == "position"
    assert model.fit.nrmse == pytest.approx(0.02 / torque.std(), rel=0.05)
    x = np.linspace(30.0, 36.0, 50)
    assert np.abs(model.force(x) - 0.5 * np.sin(x)).max() < 0.01


def test_several_processes_give_the_same_to_the_last_bit(tmp_path: Path) -> None:
    rows(6_000).to_parquet(tmp_path / "press.parquet", row_group_size=1_500)
    one = palpate.identify_files(tmp_path / "press.parquet", part_rows=1_500, max_wavelets=4)
    two = palpate.identify_files(tmp_path / "press.parquet", part_rows=1_500, jobs=2, max_wavelets=4)
    assert same(one, two)


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """Starts a real scheduler and worker processes; yields its address and the workers."""
    with ExitStack() as stack:

        def started(*arguments: str, stderr: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments],
                stdout=subprocess.DEVNULL,
                stderr=stderr,
                cwd=folder,
                text=True,
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        host = ("--host", "127.0.0.1", "--port", "0")
        scheduler = started("scheduler", *host, "--no-dashboard", stderr=subprocess.PIPE)
        assert scheduler.stderr is not None
        stack.enter_context(scheduler.stderr)
        address = next(line.split()[-1] for line in scheduler.stderr if "Scheduler at:" in line)
        worker = ("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        yield address, [started(*worker) for _ in range(workers)]


@pytest.mark.full
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_loses_a_worker_gives_the_same_to_the_last_bit(tmp_path: Path) -> None:
    file = tmp_path / "press.parquet"
    rows(24_000).to_parquet(file, row_group_size=1_000)
    one = palpate.identify_files(file, part_rows=1_000)
    with cluster(tmp_path, 2) as (address, workers):
        from distributed import Client

        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(2)
        killed = []

        def half_way(done: int, total: int) -> None:
            if done >= total // 3 and not killed:
                workers[0].kill()
                killed.append(done)

        lost_one = palpate.identify_files(file, part_rows=1_000, scheduler=address, progress=half_way)
        assert killed
        assert killed[0] < 24
    assert same(one, lost_one)


def test_missing_scheduler_is_reported_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows(1_000).to_csv(tmp_path / "press.csv", index=False)
    command = ["identify", str(tmp_path / "press.csv"), "-o", str(tmp_path / "m.json")]
    assert main([*command, "--scheduler", "nonsense://127.0.0.1:1"]) == 2
    assert "no Dask scheduler answers at nonsense://127.0.0.1:1" in capsys.readouterr().err
    assert not (tmp_path / "m.json").exists()


def test_command_shows_its_progress(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.cli.printing._EVERY_S", 0.0)
    rows(1_000).to_csv(tmp_path / "press.csv", index=False)
    command = ["identify", str(tmp_path / "press.csv"), "-o", str(tmp_path / "m.json"), "--out-of-core"]
    assert main([*command, "--max-wavelets", "1"]) == 0
    printed = capsys.readouterr()
    assert "read 1 of 1 parts (100 %)" in printed.err
    assert "read 1000 rows; position is position_rad" in printed.err
    assert main([*command, "--hold-out-every", "5"]) == 2
    assert "--hold-out-every needs all rows at once" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_files_above_the_limit_of_memory_are_read_in_parts_without_an_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    file, frame = tmp_path / f"press.{suffix}", rows(2_000).drop(columns=["note"])
    frame["time_s"] = np.arange(2_000) / 1000.0
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=400)
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", 2_000 * 2 * 8)
    command = ["identify", str(file), "-o", str(tmp_path / "m.json"), "--max-wavelets", "1"]
    assert main(command) == 0
    printed = capsys.readouterr()
    assert f"press.{suffix} needs at least " in printed.err
    assert "palpate identify reads longer CSV and Parquet files part by part" in printed.err
    assert "lag of the force were not searched: the files were read part by part" in printed.err
    for name in ("damping", "mass", "curve over position and velocity", "memory"):
        line = next(line for line in printed.out.splitlines() if line.startswith(name))
        assert "not tested (the files were read part by part)" in line
    assert palpate.load_model(tmp_path / "m.json").data.rows == 2_000
    assert main([*command, "--hold-out-every", "5"]) == 2
    assert "--hold-out-every needs all rows at once" in capsys.readouterr().err


def test_files_that_exceed_the_limit_of_memory_together_are_read_in_parts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = [str(tmp_path / f"{name}.csv") for name in "ab"]
    for file in files:
        rows(800).drop(columns=["note"]).to_csv(file, index=False)
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", 1_200 * 3 * 8)
    assert main(["identify", *files, "-o", str(tmp_path / "m.json"), "--max-wavelets", "1"]) == 0
    assert "b.csv, with the files before it, needs at least " in capsys.readouterr().err
    assert palpate.load_model(tmp_path / "m.json").data.rows == 1_600


def test_other_formats_above_the_limit_of_memory_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    x = np.linspace(0.0, 1.0, 2_000)
    np.savez(tmp_path / "press.npz", position_m=x, force_N=x)
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", 10_000)
    assert main(["identify", str(tmp_path / "press.npz"), "-o", str(tmp_path / "m.json")]) == 2
    assert "press.npz needs at least" in capsys.readouterr().err


INTERRUPTED = """
import os, signal, sys
from palpate.cli.main import main
from palpate.identification import identify_files

read_part = identify_files.read_part

def interrupted(work):
    os.kill(os.getpid(), signal.SIGINT)
    return read_part(work)

identify_files.read_part = interrupted
sys.exit(main(["identify", "press.csv", "-o", "m.json", "--out-of-core"]))
"""
"""A program that gets Ctrl-C while it reads the file."""


def test_an_interrupted_run_leaves_no_output(tmp_path: Path) -> None:
    rows(2_000).to_csv(tmp_path / "press.csv", index=False)
    ended = subprocess.run([sys.executable, "-c", INTERRUPTED], cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 130
    assert "identifying" in ended.stderr
    assert "interrupted" in ended.stderr
    assert not (tmp_path / "m.json").exists()


@pytest.mark.skipif(SCALE < 100, reason="10^8 rows belong to make test-full")
def test_a_hundred_million_rows_take_less_than_a_gigabyte(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    file, block = tmp_path / "press.parquet", rows(1_000_000).drop(columns=["direction", "note"])
    with pq.ParquetWriter(file, pa.Schema.from_pandas(block, preserve_index=False)) as writer:
        for k in range(100):
            block["torque_Nm"] += 1e-9 * k
            writer.write_table(pa.Table.from_pandas(block, preserve_index=False))
    code = (
        "import sys, resource, palpate\n"
        f"model = palpate.identify_files({str(file)!r})\n"
        "print(model.data.rows, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    count, kilobytes = map(int, answer.stdout.split())
    assert count == 100_000_000
    assert kilobytes < 1_000_000
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss > 0


BLOCK = 400
"""Number of rows in one part of a file that is read in parts."""

SIZES = {"half": 200, "one": 400, "one-and-a-row": 401, "two": 800, "two-and-a-half": 1000, "five": 2000}


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.recording.reading.BLOCK_ROWS", BLOCK)


def stroke_rows(n: int) -> pd.DataFrame:
    """Returns a spring with hysteresis, pressed and released; every force differs."""
    phase = 2.0 * np.pi * np.arange(n) / 97.0
    press = np.sin(phase) >= 0.0
    x = 0.3 - 0.3 * np.cos(phase)
    y = 2.0 * x + np.where(press, 0.05, -0.05) + 1e-9 * np.arange(n)
    return pd.DataFrame({"position_rad": x, "torque_Nm": y, "direction": np.where(press, "press", "release")})


def written(frame: pd.DataFrame, file: Path) -> Path:
    if file.suffix == ".csv":
        frame.to_csv(file, index=False)
    else:
        frame.to_parquet(file, row_group_size=300)
    return file


def read(recording: LongRecording) -> tuple[np.ndarray, np.ndarray]:
    blocks = [block for part in recording.parts for block in recording.blocks(part)]
    return (
        np.concatenate([block.position for block in blocks]),
        np.concatenate([block.force for block in blocks]),
    )


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("size", sampled(SIZES, "one-and-a-row", "two-and-a-half"))
@pytest.mark.parametrize("columns", ["numbers", "text", "direction"])
def test_every_row_is_used_once(tmp_path: Path, suffix: str, size: str, columns: str) -> None:
    n = SIZES[size]
    frame = stroke_rows(n)
    if columns == "numbers":
        frame = frame.drop(columns="direction")
    if columns == "text":
        frame["direction"] = [f"note {k}" for k in range(n)]
        frame = frame.rename(columns={"direction": "note"})
    file = written(frame, tmp_path / f"press.{suffix}")
    position, force = read(open_long_recording(file))
    assert np.array_equal(position, frame.position_rad)
    assert np.array_equal(force, frame.torque_Nm)
    assert palpate.identify_files(file, max_wavelets=1).data.rows == n


@pytest.mark.parametrize("size", sampled(SIZES, "one-and-a-row"))
@pytest.mark.parametrize("part_rows", [150, 1_000_000], ids=["parts", "one-part"])
def test_every_row_is_used_once_where_text_appears_late(tmp_path: Path, size: str, part_rows: int) -> None:
    n = SIZES[size]
    frame = stroke_rows(n).astype({"torque_Nm": object})
    bad = [n - 1, n // 2]
    frame.loc[bad, "torque_Nm"] = ["none", ""]
    file = written(frame, tmp_path / "press.csv")
    position, _ = read(open_long_recording(file, invalid="drop", part_rows=part_rows))
    assert np.array_equal(position, frame.position_rad.drop(bad))
    model = palpate.identify_files(file, invalid="drop", part_rows=part_rows, max_wavelets=1)
    assert model.data.rows == n - 2
    note = f"dropped 2 rows without a finite number in torque_Nm (first: line {n // 2 + 2})"
    assert model.notes["rows"][0] == note


def test_dropped_rows_are_reported_by_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame = stroke_rows(1000)
    frame.loc[[10, 990], "torque_Nm"] = np.nan
    frame.loc[500, "direction"] = ""
    file = written(frame, tmp_path / "press.csv")
    command = ["identify", str(file), "-o", str(tmp_path / "m.json"), "--out-of-core", "--invalid", "drop"]
    assert main(command) == 0
    printed = capsys.readouterr().err
    assert "read 997 rows;" in printed
    assert "dropped 2 rows without a finite number in torque_Nm (first: line 12)" in printed
    assert "dropped 1 row without a direction in direction (first: line 502)" in printed


@pytest.mark.parametrize("part_rows", sampled([20, 90, 333, 1_000_000], 90, 1_000_000))
@pytest.mark.parametrize("separator", sampled([",", ";", "\t"], "\t"), ids=["comma", "semicolon", "tab"])
def test_line_breaks_in_quotes_and_blank_lines_lose_no_row(
    tmp_path: Path, part_rows: int, separator: str
) -> None:
    lines = [separator.join(["depth_mm", "note", "force_N"])]
    notes = ['"a\nb"', '"say ""x""\n\n, ; \ny"', '5" pipe', "plain", '""', '"a,b;c"']
    for k in range(500):
        note = notes[k % len(notes)]
        lines.append(separator.join([str(k), note if separator not in note else notes[0], str(2 * k)]))
        if k % 7 == 0:
            lines.append(["", "  ", "\r"][k % 3])
    file = tmp_path / "press.csv"
    file.write_bytes(("\n".join(lines) + "\n").encode())
    recording = open_long_recording(file, part_rows=part_rows)
    assert recording.rows == 500
    position, force = read(recording)
    assert np.array_equal(force, 2.0 * np.arange(500))
    assert np.allclose(position, 1e-3 * np.arange(500), rtol=1e-14)
    assert len(palpate.read_recording(file)) == 500


def test_a_bad_row_after_quoted_line_breaks_is_named_with_its_line(tmp_path: Path) -> None:
    lines = ["depth_mm,note,force_N", *(f'{k},"a\nb",{2 * k}' for k in range(100)), "1,x,nan"]
    file = tmp_path / "press.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match=r"press.csv, line 202: column force_N holds 'nan'"):
        palpate.identify_files(file, part_rows=30)


@pytest.mark.parametrize("row", [0, 350, 700, 999])
def test_a_row_with_too_many_cells_is_refused(tmp_path: Path, row: int) -> None:
    lines = [f"{k},{2 * k},press" for k in range(1000)]
    lines[row] = f"{row},5,{2 * row},press"
    file = tmp_path / "press.csv"
    file.write_text("\n".join(["depth_mm,force_N,direction", *lines]), encoding="utf-8")
    with pytest.raises(InputError, match=rf"line {row + 2}: 4 cells, but the header names 3 columns"):
        palpate.identify_files(file, part_rows=350)


def test_a_worker_that_reads_another_file_of_the_same_name_is_noticed(tmp_path: Path) -> None:
    file = written(stroke_rows(1000), tmp_path / "press.csv")
    recording, found = open_long_recording(file, part_rows=300), PartRead()
    kept, _, last = file.read_text(encoding="utf-8").rstrip("\n").rpartition("\n")
    file.write_text(f"{kept}\n{' ' * len(last)}\n", encoding="utf-8")
    for part in recording.parts:
        read = read_part((recording, part))
        found.add(read.summary, read.rows)
    with pytest.raises(InputError, match=r"has 1000 rows, but 999 were used and 0 were not. The workers may"):
        require_all_rows(recording, found)


def test_rows_with_a_force_not_from_the_model_are_dropped_and_counted(tmp_path: Path) -> None:
    frame = stroke_rows(1000)
    frame["status"] = "Ok"
    frame.loc[:20, "status"] = "Starting"
    frame.loc[:20, "torque_Nm"] = 100.0
    file = tmp_path / "press.csv"
    layout = {"position": "position_rad", "force": "torque_Nm", "direction": "direction", "status": "status"}
    file.write_text(
        f"# palpate-columns: {json.dumps(layout)}\n" + frame.to_csv(index=False), encoding="utf-8"
    )
    model = palpate.identify_files(file)
    assert model.data.rows == 979
    assert model.fit.nrmse < 1e-3
    assert model.notes["rows"][0] == ("left out 21 rows whose force is not the model's force (21 Starting)")


def test_segment_numbers_are_not_taken_as_direction(tmp_path: Path) -> None:
    frame = stroke_rows(1000).drop(columns="direction")
    frame["segment"] = np.arange(1000) // 500
    for suffix in ("csv", "parquet"):
        recording = open_long_recording(written(frame, tmp_path / f"press.{suffix}"))
        assert recording.direction is None


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_hysteresis_is_tested_without_a_direction_column(tmp_path: Path, suffix: str) -> None:
    stated = written(stroke_rows(2000), tmp_path / f"stated.{suffix}")
    silent = written(stroke_rows(2000).drop(columns="direction"), tmp_path / f"silent.{suffix}")
    expected, model = palpate.identify_files(stated), palpate.identify_files(silent)
    assert model.fit.model_class == expected.fit.model_class == "hysteresis"
    assert model.fit.nrmse < 0.02
    assert "The direction is taken from the order of rows, block by block." in model.notes["identification"]
    x = np.linspace(0.05, 0.55, 100)
    for side in (1.0, -1.0):
        sides = np.full(100, side)
        assert model.force(x, direction=sides) == pytest.approx(expected.force(x, direction=sides), abs=5e-3)


def test_rows_that_wait_are_in_neither_stroke_nor_error(tmp_path: Path) -> None:
    frame = stroke_rows(2000).drop(columns="direction")
    turn = int(frame["position_rad"].argmax())
    hold = pd.concat([frame.iloc[[turn]]] * 1000)
    hold["torque_Nm"] -= np.linspace(0.0, 0.5, 1000)
    waiting = pd.concat([frame.iloc[: turn + 1], hold, frame.iloc[turn + 1 :]])
    model = palpate.identify_files(written(waiting, tmp_path / "hold.csv"))
    expected = palpate.identify_files(written(frame, tmp_path / "no_hold.csv"))
    assert model.fit.nrmse < 0.01
    x = np.linspace(0.05, 0.55, 100)
    for side in (1.0, -1.0):
        sides = np.full(100, side)
        assert model.force(x, direction=sides) == pytest.approx(expected.force(x, direction=sides), abs=5e-3)


def test_rows_in_no_order_give_a_finding_that_hysteresis_was_not_tested(tmp_path: Path) -> None:
    frame = stroke_rows(2000).drop(columns="direction").sample(frac=1.0, random_state=1)
    model = palpate.identify_files(written(frame, tmp_path / "press.csv"))
    assert model.verdict.level == "usable"
    assert "hysteresis was not tested" in str(model.verdict)
    assert "add a column direction" in str(model.verdict)


def test_a_force_that_falls_with_position_is_reported_part_by_part(tmp_path: Path) -> None:
    frame = stroke_rows(1000)
    frame["position_rad"] *= -1.0
    file = written(frame, tmp_path / "press.csv")
    assert "--negate position" in str(palpate.read_recording(file).verdict)
    model = palpate.identify_files(file, part_rows=300, max_wavelets=1)
    falling = [note for note in model.notes["identification"] if "--negate position" in note]
    assert len(falling) == 1
    assert falling[0].startswith("the force falls with position over the whole file (correlation -")


def test_utf_16_is_refused_part_by_part_and_the_suggested_command_converts_it(tmp_path: Path) -> None:
    file = tmp_path / "press.csv"
    file.write_text(stroke_rows(1000).to_csv(index=False), encoding="utf-16")
    with pytest.raises(InputError, match="cannot be read part by part; convert it: iconv") as refused:
        palpate.identify_files(file)
    command = str(refused.value).split("convert it: ")[1].split(" OLD.csv")[0]
    new = tmp_path / "new.csv"
    new.write_bytes(subprocess.run([*command.split(), str(file)], check=True, capture_output=True).stdout)
    assert palpate.identify_files(new).data.rows == 1000


@pytest.mark.parametrize("decimal", sampled([".", ","], ","))
def test_other_dialects_are_read_part_by_part(tmp_path: Path, decimal: str) -> None:
    file = tmp_path / "press.csv"
    text = stroke_rows(500).to_csv(index=False, sep=";", decimal=decimal)
    header, body = text.split("\n", 1)
    file.write_bytes(
        f"Prüfung 7;\nStoff: Gummi;\n{header};µ\n".encode("latin-1") + body.replace("\n", ";1\n").encode()
    )
    recording = open_long_recording(file, part_rows=300)
    position, force = read(recording)
    assert np.array_equal(position, stroke_rows(500).position_rad)
    assert np.array_equal(force, stroke_rows(500).torque_Nm)
    model = palpate.identify_files(file, part_rows=300, max_wavelets=1)
    form = "read as: Latin-1, separated by semicolons, "
    assert form in model.notes["identification"][0]
