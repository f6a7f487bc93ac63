# SPDX-License-Identifier: Apache-2.0
"""Tests the study that switches off one rule of the identification at a time."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from bench.identification import ablation
from bench.identification.ablation import CASES, RULES, Fit, Rule, changed, main, measure, result_of

import palpate

NAMED = {rule.name: rule for rule in RULES}


def waiting_spring() -> Fit:
    """Returns a press of a stiffening spring, held at the end while its force relaxes."""
    position = np.concatenate([np.linspace(0.0, 0.01, 500), np.full(1500, 0.01)])
    relaxed = np.concatenate([np.zeros(500), np.linspace(0.0, 1.0, 1500)])
    noise = np.random.default_rng(0).normal(0.0, 0.01, 2000)
    force = 300.0 * position + 3e4 * position**2 - relaxed + noise
    recording = palpate.Recording.from_arrays(position, force, units={"position": "m", "force": "N"})
    press = np.linspace(0.0, 0.01, 100)

    def error(model: palpate.Model) -> float:
        return float(np.abs(model.force(press) - 300.0 * press - 3e4 * press**2).max())

    return Fit([recording], error, {})


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.attribute)
def test_every_rule_names_a_function_or_constant_of_the_package(rule: Rule) -> None:
    owner, name = rule.place
    kept = getattr(owner, name)
    with rule.off():
        assert getattr(owner, name) is rule.without
    assert getattr(owner, name) is kept


@pytest.mark.full
def test_rows_that_wait_change_the_fit_if_they_are_fitted() -> None:
    row = measure("held spring", waiting_spring)
    without = row["without"]["rows that wait are not fitted"]
    assert changed(row["all"], without)
    assert without["error"] > 5.0 * row["all"]["error"]
    assert not changed(row["all"], row["without"]["harmonics"])


def test_a_rule_with_the_same_values_in_every_call_is_not_switched_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = "identification.data.rows"
    step = NAMED["force step hides errors"]
    seen: list[str] = []

    def zero(*_: object) -> float:
        seen.append("off")
        return 0.0

    monkeypatch.setattr(ablation, "RULES", (Rule(step.name, module, "force_step", zero),))
    row = measure("held spring", waiting_spring)
    assert seen == ["off"]  # only in the comparison of the values
    assert row["without"][step.name] == row["all"]


def test_the_judgement_of_a_model_uses_every_rule() -> None:
    fit = waiting_spring()
    inside: list[object] = []
    rule = NAMED["rows that wait are not fitted"]

    def error(model: palpate.Model) -> float:
        inside.append(getattr(*rule.place))
        return 0.0

    kept = getattr(*rule.place)
    result_of(Fit(fit.recordings, error, {}), rule.off())
    assert inside == [kept]


@pytest.mark.parametrize("number", [4, len(RULES)])
@pytest.mark.full
def test_the_study_prints_each_rule_and_writes_its_results(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = [NAMED[name] for name in ("pruning", "repeated rows are dropped", "check of drift")]
    rules = (*printed, *(rule for rule in RULES if rule not in printed))[:number]
    monkeypatch.setattr(ablation, "RULES", rules)
    monkeypatch.delenv("PALPATE_DATA", raising=False)
    file = tmp_path / "ablation.json"
    given = ["--draws", "1", "--files", "1", "--jobs", "1", "--json", str(file)]
    monkeypatch.setattr(sys, "argv", ["ablation.py", *given])
    monkeypatch.setattr(ablation, "CASES", {"each row 5 times": CASES["each row 5 times"]})
    main()
    results = json.loads(file.read_text())["results"]["rules"]
    assert [each["rule"] for each in results] == [rule.name for rule in rules]
    changes = {each["rule"]: each["changed"] for each in results}
    assert changes["pruning"] > changes["repeated rows are dropped"] == 1
    table = capsys.readouterr().out
    assert f"| pruning | {changes['pruning']} |" in table
    assert "| check of drift | no change |" in table
