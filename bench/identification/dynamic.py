# SPDX-License-Identifier: Apache-2.0
"""Measures dynamic benchmarks one step ahead and in free run, and prints the published errors.

python bench/identification/dynamic.py [SET ...] [--json FILE]     PALPATE_DATA names the folder of recordings

"physical": input force = m a + f(position) or m a + f(velocity), solved for the motion. "black box": the
next output from the last outputs and inputs. In free run only the first outputs are measured. Published
errors are free runs; "other rows" marks errors that were measured on other rows.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[2]))

from bench.identification.lagged import N_FITS, Lagged
from bench.studies import SCALE, measured_data, write_results

from palpate import WaveletNetworkRegressor

Array = NDArray[np.float64]

PUBLISHED = ("LTI SS", "polynomial NARX", "best known (SOTA row)")
"""Names of published models whose errors are printed: linear, polynomial, the one with the least error."""

DRIVE_MASS = 90.0
"""First value in the numerical search for the mass of a drive [kg]."""

SUBSTEPS = 10
"""Integration steps in each sample period of the simulated drive."""


@dataclass(frozen=True)
class Set:
    """One published benchmark file: its name, its unit, and the test rows whose error is computed."""

    name: str
    unit: str
    factor: float = 1.0
    """Factor that converts an error in the unit of the benchmark file into the printed unit"""
    skip: int = 0
    """Number of rows at the beginning of the test set that do not count in the error"""
    comparable: bool = True
    """True if the published errors of other models were measured on the test rows that are used here"""


@dataclass(frozen=True)
class Row:
    """Errors of one model on one test set."""

    benchmark: str
    test_set: str
    form: str
    n_parameters: int
    one_step: float
    free_run: float
    unit: str
    comparable: bool
    published: str = ""


def rms(error: Array) -> float:
    """Returns the root mean square of a prediction error; NaN if the prediction diverged."""
    return float(np.sqrt(np.mean(error**2)))


def score(
    kind: Set,
    form: str,
    model: Lagged,
    estimation: tuple[Array, Array],
    tests: Mapping[str, tuple[Array, Array]],
) -> list[Row]:
    model.fit(*estimation)
    rows = []
    for test_set, (u, y) in tests.items():
        measured = y[model.start :]
        errors = [predict(u, y) - measured for predict in (model.one_step, model.free_run)]
        one_step, free_run = (kind.factor * rms(error[kind.skip :]) for error in errors)
        rows.append(
            Row(kind.name, test_set, form, model.n_parameters, one_step, free_run, kind.unit, kind.comparable)
        )
    return rows


def silverbox(folder: Path) -> list[Row]:
    """Fits a measured electronic oscillator with a cubic spring; in the test "arrow" the amplitude grows."""
    table = pd.read_csv(folder / "silverbox" / "silverbox_snls80mv.csv")
    u, y = table.input_V1_V.to_numpy(), table.output_V2_V.to_numpy()
    multisine, last = slice(40_650, 127_410), 8_700
    data = (u[multisine][:-last][:30_000], y[multisine][:-last][:30_000])
    tests = {
        "multisine": (u[multisine][-last:], y[multisine][-last:]),
        "arrow no extrapolation": (u[:30_000], y[:30_000]),
        "arrow full": (u[:40_650], y[:40_650]),
    }
    kind = Set("silverbox", "mV", 1e3, 50)
    return [
        *score(kind, "physical", Lagged(3, 3, (0,)), data, tests),
        *score(kind, "black box", Lagged(3, 2, None), data, tests),
    ]


def cascaded_tanks(folder: Path) -> list[Row]:
    table = pd.read_csv(folder / "sysid_benchmarks" / "cascaded_tanks.csv")
    data, test = (
        (rows.pump_voltage_V.to_numpy(), rows.level_sensor_V.to_numpy())
        for rows in (table[table.split == "estimation"], table[table.split != "estimation"])
    )
    kind = Set("cascaded_tanks", "V")
    return [
        *score(kind, "linear + f(level)", Lagged(3, 3, (0,)), data, {"test": test}),
        *score(kind, "black box", Lagged(2, 3, None), data, {"test": test}),
    ]


def study_of_halves(name: str, file: str, inputs: str, output: str, lags: int) -> Callable[[Path], list[Row]]:
    """Returns the study of a file without stated test rows: one half is fitted, the other tested."""

    def rows(folder: Path) -> list[Row]:
        table = pd.read_csv(folder / "sysid_benchmarks" / file)
        u, y = table[inputs].to_numpy(dtype=float), table[output].to_numpy(dtype=float)
        half = len(y) // 2
        data, tests = (u[:half], y[:half]), {"second half": (u[half:], y[half:])}
        kind = Set(name, "data units", comparable=False)
        return [
            *score(kind, "linear + f(output)", Lagged(lags, lags, (0,)), data, tests),
            *score(kind, "black box", Lagged(lags, lags, None), data, tests),
        ]

    return rows


def emps(folder: Path) -> list[Row]:
    """Identifies force = m a + f(velocity) of a drive, then simulates the motion from the force.

    The force is that of the motor, in both files the same multiple of its voltage. Only the second file has
    additional pulses. The controller of the drive decides if the voltage includes them.
    """
    files = {"estimation": "emps_estimation_250hz.csv", "test": "emps_validation_pulses_250hz.csv"}
    tables = {name: pd.read_csv(folder / "sysid_benchmarks" / file) for name, file in files.items()}
    estimation_rows = tables["estimation"]
    period = float(np.median(np.diff(estimation_rows.time_s)))
    x = estimation_rows.position_m.to_numpy()
    force, velocity, acceleration = (
        smooth(estimation_rows.motor_force_N.to_numpy(), period, 0),
        smooth(x, period, 1),
        smooth(x, period, 2),
    )
    mass, friction = DRIVE_MASS, WaveletNetworkRegressor(max_wavelets=16)
    for _ in range(N_FITS):
        friction.fit(velocity[:, None], force - mass * acceleration)
        remaining_force = force - friction.predict(velocity[:, None])
        mass = float(acceleration @ remaining_force / (acceleration @ acceleration))
    rows = []
    for test_set, table in tables.items():
        x, motor_force = table.position_m.to_numpy(), table.motor_force_N.to_numpy()
        if "pulse_force_N" in table and not includes_pulses(estimation_rows, table, period):
            motor_force = motor_force + table.pulse_force_N.to_numpy()
        v = smooth(x, period, 1)
        a = (motor_force - friction.predict(v[:, None])) / mass
        predicted = x[:-1] + v[:-1] * period + 0.5 * period**2 * a[:-1]
        free_run_motion = simulate(motor_force, x[0], mass, friction.network_.force, period)
        one_step, free_run = 1e3 * rms(predicted - x[1:]), 1e3 * rms(free_run_motion - x)
        n_parameters = friction.n_parameters_ + 1
        rows.append(Row("emps", test_set, "physical", n_parameters, one_step, free_run, "mm", False))
    return rows


def includes_pulses(estimation_rows: pd.DataFrame, table: pd.DataFrame, period: float) -> bool:
    """Returns true if the voltage of the motor rises with the pulses beyond the command of the controller.

    The controller, voltage over position error and both velocities, is fitted to the file without pulses,
    without a model of the motion. Pulses that act on the drive from outside do not change its law.
    """

    def controller_inputs(rows: pd.DataFrame) -> Array:
        reference, x = rows.reference_position_m.to_numpy(), rows.position_m.to_numpy()
        return np.column_stack(
            [reference - x, smooth(reference, period, 1), smooth(x, period, 1), np.ones(len(x))]
        )

    controller = np.linalg.lstsq(
        controller_inputs(estimation_rows), estimation_rows.motor_voltage_V.to_numpy(), rcond=None
    )[0]
    remaining_voltage = table.motor_voltage_V.to_numpy() - controller_inputs(table) @ controller
    pulses = table.pulse_force_N.to_numpy()
    share = float(np.polyfit(pulses, remaining_voltage, 1)[0])
    print(f"{'':20}motor voltage includes {share:.2f} V for each unit of the pulses", flush=True)
    return share > 0.5


def smooth(signal: Array, period: float, derivative: int) -> Array:
    """Returns a signal or its time derivative, smoothed by cubic polynomials over windows of 0.1 s."""
    return np.asarray(savgol_filter(signal, 25, 3, deriv=derivative, delta=period))


def simulate(
    force: Array, start: float, mass: float, friction: Callable[[float], float], period: float
) -> Array:
    """Solves m dv/dt = F - f(v) for the velocity v by semi-implicit Euler steps."""
    position, velocity, result, step = start, 0.0, np.empty(len(force)), period / SUBSTEPS
    for k, force_of_sample in enumerate(force):
        result[k] = position
        for _ in range(SUBSTEPS):
            velocity += step * (force_of_sample - float(friction(velocity))) / mass
            position += step * velocity
    return result


SETS: dict[str, Callable[[Path], list[Row]]] = {
    "silverbox": silverbox,
    "cascaded_tanks": cascaded_tanks,
    "emps": emps,
    "coupled_drives": study_of_halves(
        "coupled_drives", "coupled_drives_prbs_amp1.csv", "input_V", "speed_out", 3
    ),
    "ball_and_beam": study_of_halves("ball_and_beam", "ball_and_beam.csv", "beam_angle", "ball_position", 2),
    "flexible_robot_arm": study_of_halves(
        "flexible_robot_arm", "flexible_robot_arm.csv", "reaction_torque", "acceleration", 4
    ),
}


def with_published(folder: Path, row: Row) -> Row:
    """Returns a row of the error table, completed with published errors of other models on its test set."""
    table = pd.read_csv(folder / "sysid_benchmarks" / "published_results.csv")
    rows = table[(table.benchmark == row.benchmark) & (table.test_set == row.test_set)]
    errors = rows[(rows.metric == "RMSE") & (rows.unit == row.unit)].set_index("method").value
    published = ", ".join(f"{name} {errors[name]}" for name in PUBLISHED if name in errors.index)
    if published and not row.comparable:
        published = f"other rows: {published}"
    return Row(**{**asdict(row), "published": published})


def line(row: Row) -> str:
    free_run = "diverges" if np.isnan(row.free_run) else f"{row.free_run:.4g}"
    return (
        f"{row.benchmark:20}{row.test_set:24}{row.form:20}{row.n_parameters:10d}{row.one_step:11.4g}"
        f"{free_run:>11}  {row.unit:12}{row.published}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default_sets = SETS if SCALE >= 0.1 else ("cascaded_tanks",)
    parser.add_argument("sets", nargs="*", default=list(default_sets), metavar="SET ...")
    parser.add_argument("--json", type=Path, default=None)
    options = parser.parse_args()
    if (folder := measured_data()) is None:
        return
    print(
        f"{'RMSE':20}{'test set':24}{'form':20}{'parameters':>10}{'one step':>11}{'free run':>11}  "
        f"{'unit':12}published, free run"
    )
    rows: list[Row] = []
    with threadpool_limits(limits=1):
        for name in options.sets:
            for row in SETS[name](folder):
                rows.append(with_published(folder, row))
                print(line(rows[-1]), flush=True)
    write_results(options.json, [asdict(row) for row in rows])


if __name__ == "__main__":
    main()
