# SPDX-License-Identifier: Apache-2.0
"""Files are replaced as a whole, keep their mode, and never use a predictable temporary name."""

from __future__ import annotations

import json
import os
import stat
import threading
from pathlib import Path

import pytest

from conftest import ROOT
from models_by_hand import model_by_hand
from palpate import InputError, Model, load_model, read_recording
from palpate.recording.files import replacing

MODEL = ROOT / "tests" / "models" / "good" / "position.json"


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def write(path: Path, text: str, *, replace: bool = True) -> None:
    with replacing(path, replace=replace) as temporary:
        temporary.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("existing_mode", [0o600, 0o640, 0o444, 0o666, 0o755])
def test_an_existing_file_keeps_its_mode(tmp_path: Path, existing_mode: int) -> None:
    path = tmp_path / "model.json"
    path.write_text("old", encoding="utf-8")
    path.chmod(existing_mode)
    write(path, "new")
    assert path.read_text(encoding="utf-8") == "new"
    assert mode(path) == existing_mode


def test_a_saved_model_keeps_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    model_by_hand().save(path)
    path.chmod(0o600)
    model_by_hand().save(path)
    assert mode(path) == 0o600


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_new_file_follows_the_umask(tmp_path: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        write(tmp_path / "new", "x")
    finally:
        os.umask(before)
    assert mode(tmp_path / "new") == 0o666 & ~umask


def test_the_temporary_name_differs_every_time_and_is_readable_by_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text("old", encoding="utf-8")
    path.chmod(0o600)
    names = set()
    for _ in range(8):
        with replacing(path) as temporary:
            names.add(temporary.name)
            assert mode(temporary) == 0o600
            temporary.write_text("new", encoding="utf-8")
    assert len(names) == 8
    assert os.listdir(tmp_path) == ["m.json"]


def test_a_symbolic_link_at_a_predictable_temporary_name_is_not_followed(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_text("precious", encoding="utf-8")
    (tmp_path / f".m.json.{os.getpid()}.tmp").symlink_to(target)
    write(tmp_path / "m.json", "new")
    assert target.read_text(encoding="utf-8") == "precious"
    assert not (tmp_path / "m.json").is_symlink()


def test_a_symbolic_link_is_kept_and_its_target_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "store").mkdir()
    target = tmp_path / "store" / "real.json"
    target.write_text("old", encoding="utf-8")
    target.chmod(0o640)
    link = tmp_path / "link.json"
    link.symlink_to(target)
    write(link, "new")
    assert link.is_symlink()
    assert target.read_text(encoding="utf-8") == "new"
    assert mode(target) == 0o640
    assert os.listdir(target.parent) == ["real.json"]


def test_a_link_to_a_missing_file_creates_that_file(tmp_path: Path) -> None:
    link = tmp_path / "link.json"
    link.symlink_to(tmp_path / "real.json")
    write(link, "new")
    assert link.is_symlink()
    assert (tmp_path / "real.json").read_text(encoding="utf-8") == "new"


def test_a_pipe_is_refused_and_kept(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="it is not an ordinary file"):
        write(pipe, "x")
    assert pipe.is_fifo()


def test_a_failed_write_keeps_the_old_file_and_leaves_no_temporary_file(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text("old", encoding="utf-8")
    with pytest.raises(UnicodeEncodeError):
        write(path, "half \ud800")
    assert path.read_text(encoding="utf-8") == "old"
    assert os.listdir(tmp_path) == ["m.json"]


def save(model: Model, path: Path, start: threading.Barrier, errors: list[BaseException]) -> None:
    try:
        start.wait()
        model.save(path)
    except BaseException as error:
        errors.append(error)


def test_six_threads_that_save_one_path_always_leave_a_complete_file(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    models = [load_model(MODEL) for _ in range(6)]
    for k, model in enumerate(models):
        model.notes["filler"] = str(k) * (50_000 * (k + 1))
    for _ in range(12):
        errors: list[BaseException] = []
        start = threading.Barrier(len(models))
        threads = [threading.Thread(target=save, args=(model, path, start, errors)) for model in models]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert errors == []
        filler = json.loads(path.read_text(encoding="utf-8"))["notes"]["filler"]
        assert len(filler) == 50_000 * (int(filler[0]) + 1)
        assert os.listdir(tmp_path) == ["m.json"]


def test_without_replace_an_existing_file_is_refused_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "rendered.csv"
    path.write_text("precious", encoding="utf-8")
    with pytest.raises(InputError, match=r"rendered.csv exists already; choose another name, or .* --force"):
        write(path, "new", replace=False)
    assert path.read_text(encoding="utf-8") == "precious"


def test_without_replace_a_file_created_during_the_write_is_refused_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "rendered.csv"

    def write_while_it_appears() -> None:
        with replacing(path, replace=False) as temporary:
            temporary.write_text("new", encoding="utf-8")
            path.write_text("precious", encoding="utf-8")

    with pytest.raises(InputError, match="exists already"):
        write_while_it_appears()
    assert path.read_text(encoding="utf-8") == "precious"
    assert os.listdir(tmp_path) == ["rendered.csv"]


def test_a_broken_link_counts_as_an_existing_file(tmp_path: Path) -> None:
    link = tmp_path / "rendered.csv"
    link.symlink_to(tmp_path / "gone.csv")
    with pytest.raises(InputError, match="exists already"):
        write(link, "new", replace=False)


def test_without_replace_a_recording_is_not_overwritten(tmp_path: Path) -> None:
    from palpate.recording.sample import sample_recording

    recording = sample_recording(seed=1, duration_s=1.0)
    path = tmp_path / "a.csv"
    recording.write(path, replace=False)
    with pytest.raises(InputError, match="exists already"):
        recording.write(path, replace=False)
    recording.write(path)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to create a link of another user")
def test_a_link_of_another_user_in_a_shared_folder_is_not_followed(tmp_path: Path) -> None:
    victim, shared = tmp_path / "victim.json", tmp_path / "shared"
    victim.write_text("precious", encoding="utf-8")
    shared.mkdir()
    os.chown(shared, 1000, 1000)
    shared.chmod(0o1777)
    link = shared / "m.json"
    link.symlink_to(victim)
    os.lchown(link, 1001, 1001)
    with pytest.raises(InputError, match="symbolic link of another user in a shared folder"):
        write(link, "new")
    assert victim.read_text(encoding="utf-8") == "precious"
    os.lchown(link, 0, 0)
    write(link, "new")
    assert victim.read_text(encoding="utf-8") == "new"


def test_a_csv_file_above_the_limit_of_memory_is_refused_before_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "long.csv"
    file.write_text("position_m,force_N\n" + "1,2\n" * 1_000 + "3,not a number\n")
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", 16_000)
    with pytest.raises(InputError, match=r"long.csv needs at least .* GiB of memory, and the limit is"):
        read_recording(file)


def test_words_count_as_memory_if_they_differ_in_each_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    same, different = tmp_path / "same.csv", tmp_path / "different.csv"
    for file, words in ((same, ["wet"] * 1_000), (different, [f"word {k}" for k in range(1_000)])):
        lines = [f"{k / 1000},{k / 500},{word}" for k, word in enumerate(words)]
        file.write_text("\n".join(["position_m,force_N,note", *lines]) + "\n")
    monkeypatch.setattr("palpate.recording.files.MEMORY_LIMIT", 32_000)
    assert len(read_recording(same)) == 1_000
    with pytest.raises(InputError, match=r"different.csv needs at least"):
        read_recording(different)
