# SPDX-License-Identifier: Apache-2.0
"""Every model file of the corpus: its verdict, and the field that an error names."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from conftest import ROOT
from palpate import InputError, load_model
from palpate.model.schema import json_schema

CORPUS = ROOT / "tests" / "models"
MANIFEST: dict[str, list[dict[str, Any]]] = json.loads((CORPUS / "manifest.json").read_text(encoding="utf-8"))


def name_of(entry: dict[str, Any]) -> str:
    return Path(entry["file"]).stem


def test_the_manifest_lists_every_file() -> None:
    listed = {entry["file"] for entries in MANIFEST.values() for entry in entries}
    assert listed == {f"{path.parent.name}/{path.name}" for path in CORPUS.glob("*/*.json")}


@pytest.mark.parametrize("entry", MANIFEST["good"], ids=name_of)
def test_a_good_file_loads_and_is_saved_the_same(entry: dict[str, Any], tmp_path: Path) -> None:
    original = json.loads((CORPUS / entry["file"]).read_text(encoding="utf-8"))
    saved = load_model(CORPUS / entry["file"]).save(tmp_path / "again.json")
    again = json.loads(saved.read_text(encoding="utf-8"))
    assert again == {"notes": {}, **original}


@pytest.mark.parametrize("entry", MANIFEST["bad"], ids=name_of)
def test_a_bad_file_is_refused_with_its_name_and_field(entry: dict[str, Any]) -> None:
    path = CORPUS / entry["file"]
    with pytest.raises(InputError) as refused:
        load_model(path)
    sentence = str(refused.value)
    assert "\n" not in sentence
    assert sentence.startswith(str(path))
    if entry["field"]:
        assert sentence.removeprefix(f"{path}: ").startswith(f"{entry['field']} ")


@pytest.mark.parametrize(
    ("file", "sentence"),
    [
        ("alpha_negative", "network.alpha[0][0] is -1.0: must be > 0"),
        ("alpha_text", 'network.alpha[0][0] is "40": must be a number'),
        ("missing_network_weight", "network.weight is missing"),
        ("unknown_key", "colour is not a key of this format (free keys go under notes)"),
        ("version_2", "version is 2: must be 1, the version that this palpate reads"),
        ("beta_too_short", "network.beta has 1 values: must have 2, one for each wavelet of alpha"),
        ("unknown_position_unit", "units.position is \"mm\": must be 'rad', 'm', 'count' or ''"),
        ("nan", "network.weight[0] is nan: must be a finite number"),
        ("overflow", "network.bias is inf: must be a finite number"),
        ("dimension_fraction", "network.dimension is 1.5: must be a whole number"),
        ("plan_text", 'plan is "direct": must be an object'),
        ("domain_reversed", "domain.lower[0] is 0.7: must be below domain.upper[0] = 0.6"),
        ("n_wavelets_other", "fit.n_wavelets is 3: must be 2, the wavelets of the network"),
    ],
)
def test_errors_say_path_value_and_what_would_be_right(file: str, sentence: str) -> None:
    path = CORPUS / "bad" / f"{file}.json"
    with pytest.raises(InputError) as refused:
        load_model(path)
    assert str(refused.value) == f"{path}: {sentence}"


def test_what_is_not_json_is_told_with_its_line() -> None:
    path = CORPUS / "bad" / "comment.json"
    with pytest.raises(InputError, match=r"comment\.json, line 2: this is not JSON: "):
        load_model(path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is empty"),
        (b"\xff\xfe{}", "byte 0 is not UTF-8"),
        (b"[" * 100_000, "nested more than 100 levels deep"),
    ],
    ids=["empty", "binary", "deep"],
)
def test_what_is_no_text_of_json_is_told(tmp_path: Path, content: bytes, sentence: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        load_model(path)


def test_a_model_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^there is no file .*none\.json$"):
        load_model(tmp_path / "none.json")


def test_a_long_value_is_shortened(tmp_path: Path) -> None:
    content = json.loads((CORPUS / "good" / "position.json").read_text(encoding="utf-8"))
    content["kind"] = "x" * 1000
    path = tmp_path / "a.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_model(path)
    assert len(str(refused.value)) < 250


def test_the_schema_is_printed() -> None:
    printed = subprocess.run(
        [sys.executable, "-m", "palpate.model"], capture_output=True, text=True, check=True
    )
    assert json.loads(printed.stdout) == json_schema()


def test_the_schema_closes_every_object_but_the_free_ones() -> None:
    schema = json_schema()
    for name, part in {"file": schema, **schema["$defs"]}.items():
        assert part["additionalProperties"] is False, name
    assert schema["required"] == [key for key in schema["properties"] if key != "notes"]
