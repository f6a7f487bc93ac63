# SPDX-License-Identifier: Apache-2.0
"""Files that are read part by part give what all rows at once give, whoever reads them."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import palpate
from palpate.cli.main import main
from palpate.errors import InputError
from palpate.identification.identify_files import MOST_CELLS, Summary, merged, summarise
from palpate.recording.reading import open_long_recording

SCALE = float(os.environ.get("PALPATE_TEST_SCALE", "1"))


def rows(n: int, seed: int = 0, step: float = 0.0) -> pd.DataFrame:
    """A soft spring that ends at a wall, press and release apart; positions in steps where asked for."""
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
    arrays = table_of(rows(40_000, step=step))
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
    x, y, side = table_of(rows(20_000))
    near, far = in_blocks((x, y, side), 9, 100), in_blocks((x, y + 1e6, side), 9, 100)
    assert far.yy.sum() == pytest.approx(near.yy.sum(), rel=1e-6)


def test_the_number_of_cells_is_bounded_whatever_comes() -> None:
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


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("step", [0.0, 1e-3], ids=["any-position", "encoder"])
def test_the_model_is_that_of_all_rows_at_once(tmp_path: Path, suffix: str, step: float) -> None:
    file, frame = tmp_path / f"press.{suffix}", rows(30_000, step=step)
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=4_000)
    model = palpate.identify_files(file, part_rows=7_000)
    at_once = palpate.identify(palpate.read_recording(file))
    assert model.fit.model_class == at_once.fit.model_class == "hysteresis"
    assert model.data.rows == 30_000
    assert model.data.sha256 == at_once.data.sha256
    assert model.fit.nrmse == pytest.approx(at_once.fit.nrmse, rel=2e-2)
    assert model.n_parameters == pytest.approx(at_once.n_parameters, abs=12)
    x = np.linspace(0.01, 0.59, 200)
    for side in (1.0, -1.0):
        difference = model.force(x, direction=np.full(200, side)) - at_once.force(
            x, direction=np.full(200, side)
        )
        assert np.sqrt(np.mean(difference**2)) < 0.004


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_parts_hold_every_row_once(tmp_path: Path, suffix: str) -> None:
    file, frame = tmp_path / f"press.{suffix}", rows(5_000)
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=300)
    recording = open_long_recording(file, part_rows=700)
    assert len(recording.parts) > 4
    read = [block for part in recording.parts for block in recording.blocks(part)]
    assert np.array_equal(np.concatenate([block.position for block in read]), frame.position_rad)
    assert np.array_equal(np.concatenate([block.force for block in read]), frame.torque_Nm)
    assert sum(block.rows for block in read) == recording.rows == len(frame)


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
    file, frame = tmp_path / f"press.{suffix}", rows(5_000).drop(columns=["direction"])
    frame.loc[4_000, "torque_Nm"] = np.nan
    frame.to_csv(file, index=False) if suffix == "csv" else frame.to_parquet(file, row_group_size=300)
    place = "line 4002" if suffix == "csv" else "row 4000"
    with pytest.raises(InputError, match=f"press.{suffix}, {place}: column torque_Nm holds"):
        palpate.identify_files(file, part_rows=700)
    assert palpate.identify_files(file, part_rows=700, invalid="drop").data.rows == 4_999


def test_text_in_a_number_column_is_named_with_its_line(tmp_path: Path) -> None:
    file, frame = tmp_path / "press.csv", rows(3_000).astype({"torque_Nm": object})
    frame.loc[2_500, "torque_Nm"] = "much"
    frame.to_csv(file, index=False)
    with pytest.raises(InputError, match=r"line 2502: column torque_Nm holds 'much'"):
        palpate.identify_files(file, part_rows=600)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [({"inputs": "position,velocity"}, "inputs names velocity"), ({"loss": "huber"}, "loss is 'huber'")],
)
def test_what_needs_all_rows_is_refused(tmp_path: Path, options: dict[str, str], sentence: str) -> None:
    rows(100).to_csv(tmp_path / "press.csv", index=False)
    with pytest.raises(InputError, match=sentence):
        palpate.identify_files(tmp_path / "press.csv", **options)


def same(first: palpate.Model, second: palpate.Model) -> bool:
    return json.dumps(first.to_dict()) == json.dumps(second.to_dict())


def test_several_processes_give_the_same_to_the_last_bit(tmp_path: Path) -> None:
    rows(20_000).to_parquet(tmp_path / "press.parquet", row_group_size=1_500)
    one = palpate.identify_files(tmp_path / "press.parquet", part_rows=1_500)
    two = palpate.identify_files(tmp_path / "press.parquet", part_rows=1_500, jobs=2)
    assert same(one, two)


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A real scheduler and worker processes of this machine: its address, and the workers."""
    place = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    with ExitStack() as stack:

        def started(*arguments: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen([*dask, *arguments], **quiet)
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        started(
            "scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(place),
        )
        worker = ("worker", "--scheduler-file", str(place), "--nthreads", "1", "--no-nanny", "--no-dashboard")
        processes = [started(*worker) for _ in range(workers)]
        deadline = time.monotonic() + 60
        while not (place.exists() and place.stat().st_size) and time.monotonic() < deadline:
            time.sleep(0.1)
        yield json.loads(place.read_text())["address"], processes


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_loses_a_worker_gives_the_same_to_the_last_bit(tmp_path: Path) -> None:
    file = tmp_path / "press.parquet"
    rows(24_000).to_parquet(file, row_group_size=1_000)
    one = palpate.identify_files(file, part_rows=1_000)
    with cluster(tmp_path, 2) as (address, workers):
        from distributed import Client

        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        killed = []

        def half_way(done: int, total: int) -> None:
            if done >= total // 3 and not killed:
                workers[0].kill()
                killed.append(done)

        lost_one = palpate.identify_files(file, part_rows=1_000, scheduler=address, progress=half_way)
        assert killed
        assert killed[0] < 24
    assert same(one, lost_one)


def test_no_scheduler_is_told_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows(1_000).to_csv(tmp_path / "press.csv", index=False)
    command = ["identify", str(tmp_path / "press.csv"), "-o", str(tmp_path / "m.json")]
    assert main([*command, "--scheduler", "nonsense://127.0.0.1:1"]) == 2
    assert "no Dask scheduler answers at nonsense://127.0.0.1:1" in capsys.readouterr().err
    assert not (tmp_path / "m.json").exists()


def test_the_command_shows_how_far_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.cli.printing._EVERY_S", 0.0)
    rows(5_000).to_csv(tmp_path / "press.csv", index=False)
    command = ["identify", str(tmp_path / "press.csv"), "-o", str(tmp_path / "m.json"), "--out-of-core"]
    assert main(command) == 0
    told = capsys.readouterr()
    assert "read 1 of 1 parts (100 %)" in told.err
    assert "read 5000 rows; position is position_rad" in told.err
    assert main([*command, "--hold-out-every", "5"]) == 2
    assert "--hold-out-every needs all rows at once" in capsys.readouterr().err


def test_an_interrupted_run_leaves_no_output(tmp_path: Path) -> None:
    rows(200_000).to_csv(tmp_path / "press.csv", index=False)
    command = [sys.executable, "-m", "palpate", "identify", "press.csv", "-o", "m.json", "--out-of-core"]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert "identifying" in process.stderr.readline()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 130
    assert "interrupted" in process.stderr.read()
    process.stderr.close()
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
