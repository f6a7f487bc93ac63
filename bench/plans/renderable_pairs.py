# SPDX-License-Identifier: Apache-2.0
"""Counts the pairs of a measured object and a linear device that can be rendered.

    PALPATE_DATA=FOLDER python bench/plans/renderable_pairs.py --to docs [--every 1] [--models FOLDER]

The objects are all key switches, domes and springs of the measured data, one recording each, whose model has
not the verdict no. The devices are all example profiles in metres that apply a force. Each pair is planned;
nothing else is measured. --every 10 takes every tenth object. --models keeps the identified models for a
further run.

Prints the tables of FOLDER/renderable-pairs.md, writes them there if that page exists, and writes all numbers
to FOLDER/figures/renderable-pairs.json.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import fill_tables, markdown_table, measured_data, where, write_json

import palpate
from palpate import DeviceProfile, Model, Plan
from palpate.planning import ACCEPTED_FORCE_ERROR, example_profiles
from palpate.planning.candidates import Task
from palpate.planning.plan import PLAN_WORDS, network_of, with_network
from palpate.planning.search import choose

WORDS = ("proved", "by account", "near rest", "no")
SETS = {"keyswitches": "switch", "rubber_domes": "dome", "switch_springs": "spring"}


@dataclass(frozen=True)
class Pair:
    """Plan of one object on one device."""

    kind: str
    object: str
    device: str
    word: str
    """proved, by account, near rest; no: the force error is not accepted, or nothing is proved or stable"""
    force_error: float
    """[share of the range]"""
    ratio: float | None
    """slopes / proved slopes, if the energy account holds the plan"""
    acting: float | None
    """largest share of the ticks of a press or rest in which the account acts"""


def recordings(folder: Path) -> list[tuple[str, Path]]:
    """Returns kind and file of each object; of repeated runs and equal units the first."""
    files: dict[str, tuple[str, Path]] = {}
    for name, kind in SETS.items():
        for file in sorted((folder / name).glob("*.csv")):
            stem = file.stem.removesuffix("__run1").removesuffix("__run2")
            files.setdefault(stem.partition("__unit")[0], (kind, file))
    return list(files.values())


def model_of(file: Path, models: Path | None) -> Model:
    """Returns the identified model of a recording, from the folder of models if it is there."""
    kept = None if models is None else models / f"{file.stem}.json"
    if kept is not None and kept.exists():
        return palpate.load_model(kept)
    model = palpate.identify(file)
    return model if kept is None else palpate.load_model(model.save(kept))


def planned(kind: str, name: str, model: Model, device: DeviceProfile) -> Pair:
    """Plans an object on a device, without the search for a better device."""
    task = Task(with_network(model), device, mass=model.mass, object_damping=model.damping)
    chosen, refused = choose(task, ACCEPTED_FORCE_ERROR)
    limited = None if chosen.rendered is task.model else model.with_network(**network_of(chosen.rendered))
    plan = Plan(model, chosen.scheme, chosen.certificate, refused, limited)
    verdicts = dict(zip(PLAN_WORDS, ("proved", "by account", "near rest", "no"), strict=True))
    accepted = plan.force_error.share <= ACCEPTED_FORCE_ERROR
    account = plan.account
    return Pair(
        kind,
        name,
        device.id,
        verdicts[chosen.certificate.verdict] if accepted else "no",
        plan.force_error.share,
        None if account is None else plan.proved_ratio,
        None if account is None else account.share,
    )


def cell(pair: Pair) -> str:
    """Returns word, force error and slopes of a pair for a table."""
    slopes = f" at {pair.ratio:.2g} ×" if pair.word == "by account" and pair.ratio is not None else ""
    return f"{pair.word}{slopes}, {100.0 * pair.force_error:.2g} %"


def tables(pairs: list[Pair], omitted: list[str]) -> dict[str, str]:
    """Returns the tables of the page; a key is the name in the mark before the table."""
    devices = list(dict.fromkeys(pair.device for pair in pairs))
    objects = list(dict.fromkeys((pair.kind, pair.object) for pair in pairs))
    at = {(pair.object, pair.device): pair for pair in pairs}
    counts = []
    for kind in dict.fromkeys(kind for kind, _ in objects):
        for device in devices:
            words = [pair.word for pair in pairs if (pair.kind, pair.device) == (kind, device)]
            counts.append((kind, device, *(str(words.count(word)) for word in WORDS), str(len(words))))
    total = [pair.word for pair in pairs]
    counts.append(("all", "all", *(str(total.count(word)) for word in WORDS), str(len(total))))
    renderable = sum(word != "no" for word in total)
    acting = max(
        (pair.acting for pair in pairs if pair.acting is not None and pair.word != "no"), default=0.0
    )
    machine = where()
    return {
        "where": "Measured by `python bench/plans/renderable_pairs.py --to docs`: "
        f"palpate {machine['palpate']}, {machine['date']}, {machine['machine']}. "
        f"{len(objects)} objects, {len(devices)} devices. {renderable} of {len(total)} pairs "
        f"({100.0 * renderable / len(total):.0f} %) can be rendered with an accepted force error, "
        f"{total.count('by account')} of them by the energy account, which acts in at most "
        f"{100.0 * acting:.2g} % of the ticks of a press or rest.\n"
        + (f"Omitted, because the model has the verdict no: {', '.join(omitted)}.\n" if omitted else ""),
        "counts": markdown_table(("object", "device", *WORDS, "pairs"), counts, text_columns=(0, 1)),
        "pairs": markdown_table(
            ("object", *devices),
            [(f"{kind} {name}", *(cell(at[name, device]) for device in devices)) for kind, name in objects],
            text_columns=range(len(devices) + 1),
        ),
    }


def options_of(description: str | None, every: int) -> argparse.Namespace:
    """Returns the options of a study of every k-th measured object: folders of pages and models, and k."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--to", type=Path, required=True)
    parser.add_argument("--every", type=int, default=every)
    parser.add_argument("--models", type=Path)
    options = parser.parse_args()
    if options.models is not None:
        options.models.mkdir(parents=True, exist_ok=True)
    return options


def main() -> int:
    options, folder = options_of(__doc__, every=1), measured_data()
    if folder is None:
        return 0
    profiles = [DeviceProfile.load(file) for file, _ in example_profiles().values()]
    devices = [each for each in profiles if each.position_unit == "m" and each.admittance is None]
    pairs, omitted = [], []
    for kind, file in recordings(folder)[:: options.every]:
        model = model_of(file, options.models)
        name = file.stem.removesuffix("__run1")
        if model.verdict.level == "no":
            omitted.append(name)
            continue
        for device in devices:
            pairs.append(planned(kind, name, model, device))
            print(f"{kind} {name} on {device.id}: {cell(pairs[-1])}", file=sys.stderr, flush=True)
    filled = tables(pairs, omitted)
    print("\n".join(filled.values()))
    write_json(options.to / "figures" / "renderable-pairs.json", [asdict(pair) for pair in pairs])
    fill_tables(options.to / "renderable-pairs.md", filled)
    return 0


if __name__ == "__main__":
    sys.exit(main())
