# SPDX-License-Identifier: Apache-2.0
"""Measures the model class memory and usual methods on known objects and on measured relaxation.

python bench/identification/memory.py [PART ...]     PALPATE_DATA names the folder of recordings

Parts: truths (objects of 1 to 3 branches at three noise levels), controls (static, hysteretic and viscous
objects, which have no branch), rendered (known objects, rendered in simulation, recorded and identified
again), relaxation (the elastomer VHB 4910, in sample, without one stretch and without
one rate), others (measured files with and without memory). By default all parts are run.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import nnls

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.studies import SCALE, count, measured_data

import palpate
from palpate import Hand, Model, Recording, read_recording
from palpate._core.model import Memory, play, stretches
from palpate.baselines.methods import HuntCrossley
from palpate.planning import hand_for, rig_for
from palpate.planning.simulation import holding_hand

Array = NDArray[np.float64]

NOISES = (0.003, 0.01, 0.03)
"""Standard deviation of the force noise divided by that of the force"""

CLOSEST = 4.0
"""Least ratio of two time constants of a random object"""

SPLINES = 8
"""Number of B-splines of the force at rest in the standard errors of time constants"""

QLV_TERMS = 12
"""Number of time constants of the Prony series"""

NARX_STEP_S = 0.2
"""Sample time of the difference equation [s]"""

SLACK = 0.02
"""Force over the largest force below which the specimen is slack after a stroke"""


def random_motion(random: np.random.Generator) -> tuple[Array, Array]:
    """Returns time and position of 40 s of ramps at 0.3 to 6 travels a second, each followed by a hold."""
    time = np.arange(0.0, 40.0, 0.02)
    knots, places = [0.0], [0.0]
    for rate in np.exp(random.uniform(np.log(0.3), np.log(6.0), 12)):
        place = random.uniform(0.05, 1.0)
        knots.append(knots[-1] + abs(place - places[-1]) / rate)
        knots.append(knots[-1] + np.exp(random.uniform(np.log(0.3), np.log(8.0))))
        places += [place, place]
    return time, np.interp(time, knots, places)


def random_object(random: np.random.Generator, branches: int) -> Model:
    """Returns an object whose time constants of 0.1 to 8 s differ at least by the factor CLOSEST."""
    stiffness = random.uniform(0.5, 3.0, branches)
    tau = np.ones(branches)
    while (tau == 1.0).all() or (branches > 1 and (tau[1:] / tau[:-1]).min() < CLOSEST):
        tau = np.sort(np.exp(random.uniform(np.log(0.1), np.log(8.0), branches)))
    memory = Memory(
        alpha=[], beta=[], weight=[], linear=0.0, bias=1.0, stiffness=stiffness, time_constant_s=tau
    )
    return Model.from_network(
        alpha=[[random.uniform(2.0, 5.0)]],
        beta=[[random.uniform(0.0, 1.0)]],
        weight=[random.uniform(-0.3, 0.3)],
        linear=[random.uniform(1.0, 3.0)],
        lower=[0.0],
        upper=[1.0],
        memory=memory,
    )


def noisy(random: np.random.Generator, force: Array, noise: float) -> Array:
    return force + noise * force.std() * random.standard_normal(len(force))


def resolvable(model: Model, time: Array, position: Array, deviation: float) -> NDArray[np.bool_]:
    """Returns True for each time constant whose standard error permits 10 % in 19 of 20 recordings.

    The standard errors are the Cramer-Rao bound of a fit of force at rest (cubic B-splines), stiffnesses and
    time constants, for independent noise.
    """
    memory = model.memory
    assert memory is not None
    tau = memory.time_constant_s
    coordinate = position[:, None]

    def branches(factor: float) -> Array:
        return np.asarray(stretches(time, coordinate, tau * factor)[:, 0])

    step = 1e-4
    by_log_tau = memory.stiffness * (branches(1.0 + step) - branches(1.0 - step)) / (2.0 * step)
    knots = np.r_[np.zeros(3), np.linspace(0.0, 1.0, SPLINES - 2), np.ones(3)]
    at_rest = BSpline.design_matrix(np.clip(position, 0.0, 1.0), knots, 3).toarray()
    used = at_rest.any(axis=0)
    columns = np.column_stack([by_log_tau, branches(1.0), at_rest[:, used]])
    size = np.linalg.norm(columns, axis=0)
    covariance = np.linalg.pinv((columns / size).T @ (columns / size))
    error = deviation * np.sqrt(np.diag(covariance)) / size
    return np.asarray(1.96 * error[: len(tau)] <= 0.1)


def truths(draws: int) -> None:
    print("branches  noise  right number  resolvable constants  of these within 10 %  median error")
    for branches in (1, 2, 3)[: count(3)]:
        for noise in NOISES[: count(len(NOISES))]:
            right, errors, wrong = 0, [], []
            for draw in range(draws):
                random = np.random.default_rng(draw)
                time, position = random_motion(random)
                model = random_object(random, branches)
                exact = model.force_over_time(time, position)[0]
                force = noisy(random, exact, noise)
                found = palpate.identify(position, force, time=time).memory
                assert model.memory is not None
                right += found is not None and len(found.time_constant_s) == branches
                tau = np.inf if found is None else found.time_constant_s
                true = model.memory.time_constant_s[
                    resolvable(model, time, position, noise * float(exact.std()))
                ]
                error = [float(np.abs(np.log(tau / each)).min()) for each in true]
                errors += error
                if any(each > np.log(1.1) for each in error):
                    wrong.append(draw)
            close = sum(each <= np.log(1.1) for each in errors)
            shares = f"{right:5d} of {draws:3d}  {len(errors):20d}  {close:20d}"
            median = float(np.median(errors)) if errors else np.nan
            print(f"{branches:8d}  {noise:5g}  {shares}  {median:12.4f}  wrong draws: {wrong}", flush=True)


def controls(draws: int) -> None:
    def static(x: Array, _t: Array, _size: float) -> Array:
        return 2.0 * x + 0.3 * np.sin(5.0 * x)

    def hysteretic(x: Array, t: Array, size: float) -> Array:
        radius = 0.01
        return static(x, t, size) + size * (x - play(x, radius)) / radius

    def viscous(x: Array, t: Array, size: float) -> Array:
        return static(x, t, size) + size * np.gradient(x, t)

    for name, law in (("static", static), ("hysteretic", hysteretic), ("viscous", viscous)):
        without = 0
        for draw in range(draws):
            random = np.random.default_rng(1000 + draw)
            time, position = random_motion(random)
            position = gaussian_filter1d(position, 5)
            force = law(position, time, random.uniform(0.05, 0.3))
            found = palpate.identify(position, noisy(random, force, NOISES[draw % len(NOISES)]), time=time)
            without += found.memory is None
        print(f"{name}: 0 branches in {without} of {draws}", flush=True)


def nrmse(recording: Recording, force: Array, used: NDArray[np.bool_]) -> float:
    difference = force[used] - recording.force[used]
    return float(np.sqrt(np.mean(difference**2)) / recording.force[used].std())


def taut(recording: Recording) -> NDArray[np.bool_]:
    """Returns True for rows before the specimen is slack; a slack specimen has no force to predict."""
    low = recording.force < SLACK * recording.force.max()
    after = np.arange(len(recording)) > int(np.argmax(recording.position))
    slack = np.flatnonzero(low & after)
    return np.arange(len(recording)) < (slack[0] if len(slack) else len(recording))


Method = Callable[[Sequence[Recording]], Callable[[Recording], Array]]
"""Fits recordings and returns a prediction of the force over a recording"""


def with_memory(recordings: Sequence[Recording]) -> Callable[[Recording], Array]:
    model = palpate.identify(recordings)

    def predict(recording: Recording) -> Array:
        check, time = palpate.verify(model, recording), recording.time_or_row
        return np.interp(time, time[check.rows], check.force)

    return predict


def of_position(recordings: Sequence[Recording]) -> Callable[[Recording], Array]:
    model = palpate.identify(recordings, inputs=("position",))
    return lambda recording: np.asarray(model.force(recording.position))


def hunt_crossley(recordings: Sequence[Recording]) -> Callable[[Recording], Array]:
    def inputs(recording: Recording) -> Array:
        return np.column_stack([recording.position, np.gradient(recording.position, recording.time)])

    rows = [taut(part) for part in recordings]
    X = np.concatenate([inputs(part)[used] for part, used in zip(recordings, rows, strict=True)])
    y = np.concatenate([part.force[used] for part, used in zip(recordings, rows, strict=True)])
    found = HuntCrossley().fit(X, y)
    return lambda recording: found.predict(inputs(recording))


def prony(recordings: Sequence[Recording]) -> Callable[[Recording], Array]:
    """Linear spring with a Prony series, whose coefficients are >= 0."""
    longest = max(float(part.time[-1]) for part in recordings if part.time is not None)
    tau = np.geomspace(0.05, longest, QLV_TERMS)

    def columns(recording: Recording) -> Array:
        x = recording.position[:, None]
        return np.column_stack([x, stretches(recording.time, x, tau)[:, 0]])

    rows = [taut(part) for part in recordings]
    table = np.concatenate([columns(part)[used] for part, used in zip(recordings, rows, strict=True)])
    force = np.concatenate([part.force[used] for part, used in zip(recordings, rows, strict=True)])
    found = nnls(table, force)[0]
    return lambda recording: columns(recording) @ found


def narx(recordings: Sequence[Recording]) -> Callable[[Recording], Array]:
    """Polynomial difference equation of two past forces, in free run."""
    travel = max(float(np.ptp(part.position)) for part in recordings)
    size = max(float(part.force.max()) for part in recordings)

    def lags(x: Array, before: Array, f1: Array, f2: Array) -> Array:
        moved = x - before
        return np.stack(
            [np.ones_like(x), x, x**2, x**3, moved, x * moved, moved**2, f1, f2, x * f1, f1**2], axis=-1
        )

    def even(recording: Recording, values: Array) -> Array:
        assert recording.time is not None
        grid = np.arange(recording.time[0], recording.time[-1], NARX_STEP_S)
        return np.interp(grid, recording.time, values)

    tables, targets = [], []
    for part in recordings:
        x, f = even(part, part.position) / travel, even(part, part.force) / size
        tables.append(lags(x[2:], x[1:-1], f[1:-1], f[:-2]))
        targets.append(f[2:])
    found = np.linalg.lstsq(np.concatenate(tables), np.concatenate(targets), rcond=1e-10)[0]

    def predict(recording: Recording) -> Array:
        x, f = even(recording, recording.position) / travel, even(recording, recording.force) / size
        for k in range(2, len(x)):
            f[k] = np.clip(lags(x[k], x[k - 1], f[k - 1], f[k - 2]) @ found, -3.0, 3.0)
        assert recording.time is not None
        grid = np.arange(recording.time[0], recording.time[-1], NARX_STEP_S)
        return size * np.interp(recording.time, grid, f)

    return predict


METHODS: dict[str, Method] = {
    "memory": with_memory,
    "position": of_position,
    "Hunt-Crossley": hunt_crossley,
    "QLV": prony,
    "NARX": narx,
}


def compare(title: str, splits: Iterable[tuple[Sequence[Recording], Sequence[Recording]]]) -> None:
    """Prints the median NRMSE of each method on the second recordings of each split."""
    splits = list(splits)
    splits = splits[: count(len(splits))]
    print(title)
    for name, method in METHODS.items():
        errors = []
        for fitted, tested in splits:
            predict = method(fitted)
            errors.append(np.median([nrmse(part, predict(part), taut(part)) for part in tested]))
        listed = " ".join(f"{error:.3f}" for error in errors)
        print(f"  {name:14s} median {np.median(errors):.3f}   {listed}", flush=True)


def relaxation(folder: Path) -> None:
    files = sorted((folder / "vhb4910_viscoelastic").glob("*.csv"))
    held = {path.stem: read_recording(path) for path in files if path.stem.startswith("relax")}
    cycled = {path.stem: read_recording(path) for path in files if path.stem.startswith("load")}
    compare("in sample, one model for all relaxation files", [([*held.values()], [*held.values()])])
    compare("in sample, each relaxation file", [([part], [part]) for part in held.values()])
    compare("in sample, one model for all cycles", [([*cycled.values()], [*cycled.values()])])

    def without(parts: dict[str, Recording], word: int) -> Iterable[tuple[list[Recording], list[Recording]]]:
        for group in sorted({name.split("_")[word] for name in parts}):
            kept = [part for name, part in parts.items() if name.split("_")[word] != group]
            yield kept, [part for name, part in parts.items() if name.split("_")[word] == group]

    compare("relaxation without one stretch", without(held, 2))
    compare("cycles without one stretch", without(cycled, 3))
    compare("cycles without one rate", without(cycled, 2))


def others(folder: Path) -> None:
    """Compares a force of position and the found model on measured files.

    The position of the force microscopes falls during the press, so it is negated.
    """
    print("file: NRMSE of position alone; of the found model, its class; decision on memory")
    for name, negate in (("afm_indentation", ("position",)), ("organ_probing", ())):
        paths = sorted((folder / name).glob("*.csv"))
        for path in paths[: count(len(paths))]:
            try:
                recording = read_recording(path, negate=negate)
                found = palpate.identify(recording)
            except palpate.InputError as error:
                print(f"  {path.stem}: refused ({error})")
                continue
            plain = palpate.identify(recording, inputs=("position",)).fit.nrmse
            decision = [line for line in found.notes["model_selection"] if line.startswith("memory")]
            reason = decision[0] if decision else "memory: not tested (the recording has no time)"
            print(f"  {path.stem}: {plain:.4f}; {found.fit.nrmse:.4f} {found.fit.model_class}; {reason}")
            sys.stdout.flush()


def rendered(draws: int) -> None:
    """Identifies known objects again from recordings of their simulated rendering."""
    print(
        "time constants: true; identified from the rendering; fresh held motion: NRMSE, rows within one JND"
    )
    seconds = 20.0 if SCALE >= 0.1 else 4.0
    for draw in range(draws):
        model = random_object(np.random.default_rng(2000 + draw), 1 + draw % 3)
        device = rig_for(model).device
        plan = palpate.plan(model, device)
        sweep = hand_for(plan, device)
        hands = [
            *(Hand(**{**sweep.to_dict(), "frequency_hz": rate}) for rate in (0.1, 0.5, 2.0)),
            *(holding_hand(plan, place) for place in (0.3, 0.9)),
        ]
        found = palpate.identify([palpate.simulate(plan, device, hand, seconds) for hand in hands])
        fresh = palpate.verify(found, palpate.simulate(plan, device, holding_hand(plan, 0.6), seconds))
        assert model.memory is not None
        tau = [] if found.memory is None else found.memory.time_constant_s
        pair = (model.memory.time_constant_s, tau)
        listed = "; ".join(" ".join(f"{each:.3g}" for each in part) for part in pair)
        print(f"  {listed}; {fresh.nrmse:.5f}, {100.0 * fresh.within_jnd:.1f} %", flush=True)


def main(parts: Sequence[str]) -> None:
    warnings.simplefilter("ignore")
    chosen = parts or ("truths", "controls", "rendered", "relaxation", "others")
    if "truths" in chosen:
        truths(count(50))
    if "controls" in chosen:
        controls(count(100))
    if "rendered" in chosen:
        rendered(count(12))
    if {"relaxation", "others"} & set(chosen) and (folder := measured_data()):
        if "relaxation" in chosen:
            relaxation(folder)
        if "others" in chosen:
            others(folder)


if __name__ == "__main__":
    main(sys.argv[1:])
