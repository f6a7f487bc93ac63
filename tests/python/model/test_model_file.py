# SPDX-License-Identifier: Apache-2.0
"""Reading the stored test model files, the published schema, and files that are not JSON."""

from __future__ import annotations

import copy
import json
import os
import random
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palpate.model
from conftest import ROOT
from palpate import InputError, Model, identify, load_model
from palpate._core.io import check_model, checked_certificate, largest_json_bytes, scheme_of
from palpate._core.model import most_wavelets
from palpate.cli.main import main

CORPUS = ROOT / "tests" / "models"
GOOD: list[dict[str, str]] = json.loads((CORPUS / "good.json").read_text(encoding="utf-8"))
BAD: dict[str, dict[str, Any]] = {
    entry["name"]: entry for entry in json.loads((CORPUS / "bad.json").read_text(encoding="utf-8"))
}
SCHEMA: dict[str, Any] = json.loads(
    (Path(palpate.model.__file__).parent / "model.schema.json").read_text(encoding="utf-8")
)


def good_text(name: str) -> str:
    return (CORPUS / "good" / f"{name}.json").read_text(encoding="utf-8")


def patched(content: Any, patch: list[dict[str, Any]]) -> Any:
    """Returns the content of a model file after a JSON patch with add, replace and remove."""
    for change in patch:
        *parents, last = change["path"].split("/")[1:]
        parent = content
        for key in parents:
            parent = parent[int(key) if isinstance(parent, list) else key]
        place = int(last) if isinstance(parent, list) else last
        if change["op"] == "remove":
            del parent[place]
        else:
            parent[place] = change["value"]
    return content


def bad_bytes(entry: dict[str, Any]) -> bytes:
    if "text" in entry:
        return str(entry["text"]).encode()
    text = good_text(entry["base"])
    if "patch" in entry:
        return json.dumps(patched(json.loads(text), entry["patch"])).encode()
    by = entry["by"].replace("@", entry["repeat"] * entry["times"]) if "times" in entry else entry["by"]
    return text.encode().replace(entry["replace"].encode("latin-1"), by.encode("latin-1"), 1)


def refusal(path: Path, content: bytes) -> str:
    """Returns the error message of reading a model file with this content, without the file name."""
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        load_model(path)
    sentence = str(refused.value)
    assert "\n" not in sentence
    assert sentence.startswith(f"{path}: ")
    return sentence.removeprefix(f"{path}: ")


def refused(path: Path) -> str | None:
    """Returns the error message of reading a model file, or None if the file is read."""
    try:
        load_model(path)
    except InputError as error:
        return str(error)
    return None


@pytest.mark.skipif(sys.platform != "linux", reason="needs file names of any bytes")
def test_a_file_whose_name_is_not_utf_8_is_written_read_and_named_in_messages(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / os.fsdecode(b"kn\xffob.json")
    model = load_model(CORPUS / "good" / "position.json")
    assert model.save(path) == path
    assert load_model(path).to_dict() == model.to_dict()
    assert main(["show", str(path)]) == 0
    assert main(["report", str(path), "-o", str(tmp_path / "knob.html")]) == 0
    recording = tmp_path / os.fsdecode(b"pr\xffess.csv")
    recording.write_text("position_rad,force_N*m\n" + "\n".join(f"{k / 100},{k / 50}" for k in range(100)))
    assert identify(recording).save(path) == path
    assert load_model(path).data.files == (str(tmp_path / "pr\\udcffess.csv"),)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match=f"{path}: this is not JSON"):
        load_model(path)
    assert main(["show", str(path)]) == 2
    assert "kn\\udcffob.json: this is not JSON" in capsys.readouterr().err


def test_the_list_of_the_corpus_names_every_good_file() -> None:
    assert {entry["file"] for entry in GOOD} == {f"good/{path.name}" for path in CORPUS.glob("good/*.json")}


@pytest.mark.parametrize("entry", GOOD, ids=lambda entry: Path(entry["file"]).stem)
def test_a_good_file_loads_and_is_saved_the_same(entry: dict[str, str], tmp_path: Path) -> None:
    original = json.loads((CORPUS / entry["file"]).read_text(encoding="utf-8"))
    saved = load_model(CORPUS / entry["file"]).save(tmp_path / "again.json")
    again = json.loads(saved.read_text(encoding="utf-8"))
    assert again == {"notes": {}, **original}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_with_its_name_and_field(name: str, tmp_path: Path) -> None:
    sentence = refusal(tmp_path / "bad.json", bad_bytes(BAD[name]))
    if BAD[name]["field"]:
        assert sentence.startswith(f"{BAD[name]['field']} ")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("alpha_negative", "network.alpha[0][0] is -1.0: must be > 0"),
        ("alpha_text", 'network.alpha[0][0] is "40": must be a number'),
        ("missing_network_weight", "network.weight is missing"),
        ("unknown_key", "colour is not a key of this format; put keys of your own under notes"),
        ("version_2", "version is 2: must be 1, the version that this palpate reads"),
        ("beta_too_short", "network.beta has 1 values: must have 2, one for each wavelet of alpha"),
        ("unknown_position_unit", "units.position is \"mm\": must be 'rad', 'm', 'count' or ''"),
        ("dimension_fraction", "network.dimension is 1.5: must be a whole number"),
        ("plan_text", 'plan is "direct": must be an object'),
        ("domain_reversed", "domain.lower[0] is 0.7: must be below domain.upper[0] = 0.6"),
        ("n_wavelets_other", "fit.n_wavelets is 3: must be 2, the wavelets of the network"),
    ],
)
def test_errors_state_path_value_and_bound(name: str, sentence: str, tmp_path: Path) -> None:
    assert refusal(tmp_path / "bad.json", bad_bytes(BAD[name])) == sentence


def test_text_that_is_not_json_is_refused_with_its_line(tmp_path: Path) -> None:
    assert re.match(r"this is not JSON: .*line 2, column", refusal(tmp_path / "a", bad_bytes(BAD["comment"])))


def test_a_missing_model_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^there is no file .*none\.json$"):
        load_model(tmp_path / "none.json")


def test_a_long_value_is_shortened(tmp_path: Path) -> None:
    content = json.loads(good_text("position"))
    content["kind"] = "x" * 1000
    assert len(refusal(tmp_path / "a.json", json.dumps(content).encode())) < 150


def objects(schema: dict[str, Any], content: Any, path: str) -> Iterator[tuple[str, dict[str, Any], Any]]:
    """Yields each JSON object in a model file with the object's path and schema."""
    if "$ref" in schema:
        schema = SCHEMA["$defs"][schema["$ref"].split("/")[-1]]
    for choice in schema.get("anyOf", ()):
        if content is not None and choice != {"type": "null"}:
            yield from objects(choice, content, path)
    if schema.get("type") == "array":
        for index, item in enumerate(content[:1]):
            yield from objects(schema["items"], item, f"{path}/{index}")
    if "properties" in schema:
        yield path, schema, content
        for name, part in schema["properties"].items():
            if name in content:
                yield from objects(part, content[name], f"{path}/{name}")


def violations(schema: dict[str, Any], content: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yields JSON patches of an object in a model file after which the object violates the schema."""
    yield "unknown_key", {"op": "add", "value": 0}
    for name in schema["required"]:
        yield name, {"op": "remove"}
    for name, part in schema["properties"].items():
        part = next((choice for choice in part.get("anyOf", ()) if choice != {"type": "null"}), part)
        if part.get("type") in ("number", "integer"):
            wrong: list[Any] = ["text", True]
            wrong += [part["minimum"] - 1] if "minimum" in part else []
            wrong += [part["maximum"] + 1] if "maximum" in part else []
            wrong += [part["exclusiveMinimum"]] if "exclusiveMinimum" in part else []
            wrong += [1.5] if part["type"] == "integer" else []
        else:
            wrong = [1.5]
        for value in wrong:
            yield name, {"op": "add", "value": value}


@pytest.mark.parametrize("file", ["plan_network_hysteresis", "certificate_massless", "position", "periodic"])
def test_the_reader_refuses_every_violation_of_the_schema(file: str) -> None:
    content = json.loads(good_text(file))
    for path, schema, part in objects(SCHEMA, content, ""):
        assert schema["additionalProperties"] is False
        for name, change in violations(schema, part):
            wrong = patched(copy.deepcopy(content), [{"path": f"{path}/{name}", **change}])
            with pytest.raises(InputError):
                check_model(wrong)


def test_the_schema_has_the_fields_that_are_written() -> None:
    parts = SCHEMA["$defs"]
    certificate = load_model(CORPUS / "good" / "plan_and_certificate.json").certificate
    assert certificate is not None
    assert set(parts["Certificate"]["required"]) == set(certificate)
    for name in ("Bounds", "Device"):
        assert set(parts[name]["required"]) == set(certificate[name.lower()])


TEXT = good_text("position")
MUTATIONS = 60 * int(os.environ.get("PALPATE_TEST_SCALE", "1"))
INVALID_NUMBERS = ["1e400", "-1e400", "1" + "0" * 400, "9" * 5000, "01", "+1", ".5", "1.", "0x10", "Infinity"]
INVALID_NUMBERS += ["-Infinity", "NaN", "true", '"1"', "[1]", "{}", "null", "1.7976931348623159e308"]
VALID_NUMBERS = ["-0", "-0.0", "1e-400", "1E+2", "18446744073709551616", "9007199254740993", "4.9e-324"]


def with_bias(number: str) -> bytes:
    return re.sub(r'"bias": [^,\n}]+', f'"bias": {number}', TEXT, count=1).encode()


def with_notes(notes: str) -> bytes:
    return json.dumps({**json.loads(TEXT), "notes": {"x": "@@"}}).replace('"@@"', notes).encode()


def in_text(inside: bytes) -> bytes:
    word = '"created_by": "'
    return TEXT.replace(word, word + "@@").encode().replace(b"@@", inside)


@pytest.mark.parametrize(
    "content",
    [
        TEXT.replace("\n", "\r\n").encode(),
        in_text(b"\\ud83d\\ude00"),
        in_text(b"\\u0000"),
        in_text(b"\x7f"),
        with_notes("[" * 98 + "]" * 98),
        with_notes('[{"a": 1}, {"a": 2}]'),
        *(with_bias(number) for number in VALID_NUMBERS),
    ],
)
def test_unusual_but_valid_json_is_read(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(content)
    load_model(tmp_path / "a.json")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "empty"),
        (b" \n", "this is not JSON"),
        (b"\xff\xfe{}", "this is not JSON"),
        (TEXT.encode("utf-16"), "NUL byte"),
        (b"\xef\xbb\xbf" + TEXT.encode(), "begins with a byte order mark: save it as UTF-8 without one"),
        (TEXT.encode() * 2, "this is not JSON"),
        (TEXT.encode() + b"\0", "contains a NUL byte"),
        (TEXT.encode() + b"\f", "this is not JSON"),
        (b'{"a": 1, "\\u0061": 1}', 'the key "a" occurs twice in one object'),
        (with_notes('{"a": 1, "a": 2}'), 'the key "a" occurs twice in one object'),
        (with_notes("[" * 99 + "]" * 99), "nested more than 100 levels deep"),
        (b"[" * 100_000, "nested more than 100 levels deep"),
        *((in_text(inside), "this is not JSON") for inside in (b"\t", b"\\ud800", b"\\udc00", b"\\x")),
        *((in_text(inside), "this is not JSON") for inside in (b"\xed\xa0\x80", b"\xe9", b"\xc0\xaf")),
        *((with_bias(number), ": ") for number in INVALID_NUMBERS),
    ],
)
def test_ambiguous_json_is_refused(content: bytes, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(InputError, match=re.escape(sentence)) as refused:
        load_model(tmp_path / "a.json")
    assert str(tmp_path / "a.json") in str(refused.value)
    assert str(refused.value).isprintable()


def test_notes_nest_as_deep_when_checked_as_when_read(tmp_path: Path) -> None:
    content = json.loads(TEXT)
    deepest: Any = []
    for _ in range(97):
        deepest = [deepest]  # the file and its notes are two more levels
    content["notes"] = {"a": deepest}
    (tmp_path / "a.json").write_text(json.dumps(content), encoding="utf-8")
    check_model(content)
    load_model(tmp_path / "a.json")
    content["notes"] = {"a": [deepest]}
    with pytest.raises(ValueError, match="nested more than 100 levels deep"):
        check_model(content)


def test_a_file_above_the_largest_size_is_refused_before_it_is_read(tmp_path: Path) -> None:
    sentence = refusal(tmp_path / "a.json", b"[" * (largest_json_bytes + 1))
    assert sentence.startswith(
        f"the file has {largest_json_bytes + 1} bytes: must have at most {largest_json_bytes}; "
    )


def test_an_object_with_many_keys_is_refused_when_read_and_when_saved(tmp_path: Path) -> None:
    many = {f"k{number}": number for number in range(1000)}
    content = {**json.loads(TEXT), "notes": many}
    (tmp_path / "a.json").write_text(json.dumps(content), encoding="utf-8")
    model = load_model(tmp_path / "a.json")
    many["one more"] = 1
    sentence = "an object has more than 1000 keys: store its values in lists"
    assert refusal(tmp_path / "a.json", json.dumps(content).encode()) == sentence
    model.notes = many
    with pytest.raises(ValueError, match=sentence):
        model.save(tmp_path / "b.json")


def test_a_model_that_could_not_be_read_again_is_not_saved(tmp_path: Path) -> None:
    model = load_model(CORPUS / "good" / "position.json")
    model.notes = {"log": "x" * largest_json_bytes}
    with pytest.raises(
        InputError, match=rf"b\.json would have \d+ bytes: must have at most {largest_json_bytes}"
    ):
        model.save(tmp_path / "b.json")
    assert not list(tmp_path.iterdir())


def test_keys_with_a_nul_character_are_checked_by_their_whole_name() -> None:
    content = json.loads(TEXT)
    content["notes"] = {"a\0b": 1.0}
    content["data"]["columns"] = {"force\0": "force_N"}
    check_model(content)
    content["notes"] = {"a": 1.0, "a\0b": float("inf")}
    with pytest.raises(ValueError, match=r"^notes\.a\\u0000b is inf: must be a finite number$"):
        check_model(content)


def test_a_plan_or_certificate_that_is_null_is_refused() -> None:
    model = load_model(CORPUS / "good" / "plan_and_certificate.json")
    with pytest.raises(ValueError, match=r"^plan is null: must be an object$"):
        scheme_of(None)
    with pytest.raises(ValueError, match=r"^plan is null: must be an object$"):
        checked_certificate(model, None, model.certificate)
    with pytest.raises(ValueError, match=r"^certificate is null: must be an object$"):
        checked_certificate(model, model.plan, None)


def test_a_pipe_is_refused_without_waiting_for_a_writer(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe"):
        load_model(tmp_path / "pipe")


def test_mutations_are_read_or_refused_with_one_sentence(tmp_path: Path) -> None:
    chance = random.Random(17)
    path = tmp_path / "a.json"
    for _ in range(MUTATIONS):
        mutated = bytearray(TEXT.encode())
        for _ in range(chance.choice([1, 1, 2])):
            place = chance.randrange(len(mutated))
            mutated[place] = (
                chance.choice(b'0123456789-+.eE"{}[],: \\\n\0\xff')
                if chance.random() < 0.8
                else mutated[place] ^ (1 << chance.randrange(8))
            )
        path.write_bytes(mutated)
        error = refused(path)
        assert error is None or (error.isprintable() and error.startswith(str(path)))


@pytest.mark.parametrize("role", ["position", "force"])
def test_a_certificate_does_not_survive_a_change_of_the_units(tmp_path: Path, role: str) -> None:
    """The units change in the file, in the content of a model, and in a model that is saved."""
    model = load_model(CORPUS / "good" / "plan_and_certificate.json")
    sentence = "certificate.model is .* in its units; the model, its units or its certificate was changed"
    content = model.to_dict()
    content["units"] = {**content["units"], role: ""}
    with pytest.raises(InputError, match=sentence):
        Model.from_dict(content)
    assert Model.from_dict({**content, "certificate": None}).units[role] == ""
    (tmp_path / "edited.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=f"edited.json: {sentence}"):
        load_model(tmp_path / "edited.json")
    model.units[role] = ""
    with pytest.raises(InputError, match=sentence):
        model.save(tmp_path / "saved.json")
    assert not (tmp_path / "saved.json").exists()


def test_a_rendered_model_has_at_most_the_wavelets_of_a_tick() -> None:
    content = load_model(CORPUS / "good" / "position.json").to_dict()
    for name in ("alpha", "beta", "weight"):
        content["network"][name] = (most_wavelets + 1) * content["network"][name][:1]
    content["fit"]["n_wavelets"] = most_wavelets + 1
    with pytest.raises(InputError, match=r"^network.alpha has 1001 values: must have at most 1000, which"):
        Model.from_dict(content)


def test_more_wavelets_than_a_tick_can_evaluate_are_refused_before_the_identification() -> None:
    x = np.linspace(0.0, 1.0, 50)
    with pytest.raises(InputError, match=r"^max_wavelets is 1001: must be at most 1000 for a force of"):
        identify(x, x, max_wavelets=most_wavelets + 1)
