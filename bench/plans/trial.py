# SPDX-License-Identifier: Apache-2.0
"""Compares the plan for an object on a device with the best of many simulated structures (the trial)."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate import DeviceProfile, Hand, Model, Scheme, identify, plan, read_recording
from palpate._core.simulation import motion_driven, simulate
from palpate._core.stability import certify, force_bounds
from palpate.identification.network.constraints import slope_limited
from palpate.planning import Plan
from palpate.planning.limited_network import renderable_slopes
from palpate.recording import Recording

SAMPLES = 1001
PUSH_SHARE = 0.01
"""The simulation starts with the handle at this distance from the steepest position [share of the travel]"""
LARGEST_OSCILLATION = 4.0
"""Largest handle oscillation that counts as no oscillation, after four seconds [encoder steps]"""
ROTARY_DEVICES = (
    DeviceProfile(id="knob", coulomb_friction=0.005),
    DeviceProfile(id="weak knob", viscous_damping=0.005, coulomb_friction=0.002),
    DeviceProfile(id="late knob", coulomb_friction=0.01, delay_s=1e-3),
)
LINEAR_PROPERTIES = {"position_unit": "m", "inertia": 0.05, "encoder_step": 1e-6, "force_limit": 20.0}
LINEAR_DEVICES = (
    DeviceProfile(id="slide", viscous_damping=6.0, coulomb_friction=0.05, **LINEAR_PROPERTIES),
    DeviceProfile(id="weak slide", viscous_damping=1.0, coulomb_friction=0.01, **LINEAR_PROPERTIES),
    DeviceProfile(
        id="late slide", viscous_damping=6.0, coulomb_friction=0.05, **LINEAR_PROPERTIES, delay_s=1e-3
    ),
)


@dataclass(frozen=True)
class Row:
    """Force errors of the plan and of the best simulated structures, for one object on one device."""

    object: str
    device: str
    plan: str
    verdict: str
    error: float
    best: str
    """Tried structure with the least force error that is certified, or stable at every equilibrium"""
    best_error: float
    best_at_rest: str
    """Tried structure with the least force error that does not oscillate in simulation, proved or not"""
    best_at_rest_error: float
    oscillates: bool
    """True if the handle keeps oscillating after a push when the plan is simulated"""
    direct_oscillates: bool
    """True if the handle keeps oscillating after a push when the model is rendered directly"""
    force_range: float
    force_error_rms: float | None
    force_error_largest: float | None
    unchanged_share: float | None
    """Share of the travel in which the plan leaves the slope of the force unchanged"""
    unchanged_force_error: float | None
    """Largest force error in the part of the travel with unchanged slope"""

    @property
    def ratio(self) -> float:
        return self.error / self.best_error


def model_of(force: np.ndarray, x: np.ndarray) -> Model:
    """Returns the model identified from exact forces at the positions x."""
    return identify(
        Recording.from_arrays(x, force, units={"position": "rad", "force": "N*m"}), inputs=("position",)
    )


def objects(switches: int) -> Iterator[tuple[str, Model, tuple[DeviceProfile, ...]]]:
    """Yields the name of an object, its model, and the devices with the position unit of the model."""
    x = np.linspace(0.0, 0.47, 3000)
    yield (
        "spring and wall",
        model_of(2.0 * x + 0.24 * np.logaddexp(0.0, (x - 0.4) / 0.004), x),
        ROTARY_DEVICES,
    )
    yield "snap-through", model_of(4.0 * x + 0.5 * np.exp(-(((x - 0.2) / 0.03) ** 2)), x), ROTARY_DEVICES
    for file in measured_switches(switches):
        yield file.stem.replace("__", ": ").replace("_", " "), identify(read_recording(file)), LINEAR_DEVICES


def measured_switches(n_files: int) -> list[Path]:
    """Returns n_files evenly chosen files of the measured switches; an empty list without measured data."""
    data_folder = os.environ.get("PALPATE_DATA")
    files = sorted((Path(data_folder) / "keyswitches").glob("*.csv")) if data_folder else []
    return files[:: max(1, len(files) // max(1, n_files))][:n_files]


def strokes(model: Model, x: np.ndarray) -> np.ndarray:
    """Returns the model force (1, n), or press and release force (2, n), at the positions x."""
    return np.array(
        [model.force(x, direction=direction) for direction in ((1.0, -1.0) if model.hysteretic else (None,))]
    )


def sweep(model: Model, device: DeviceProfile) -> Hand:
    """Returns a hand that moves through the domain where the force is below 80 % of the force limit."""
    lower, upper = float(model.lower[0]), float(model.upper[0])
    x = np.linspace(lower + 0.02 * (upper - lower), upper - 0.02 * (upper - lower), 500)
    force = strokes(model, x)[0]
    within_limit = np.abs(force) < 0.8 * device.force_limit
    x, force = x[within_limit], force[within_limit]
    stiffness = max(2.0 * float(np.abs(force).max()) / (upper - lower), 1e-6)
    target = x + force / stiffness
    return Hand(
        stiffness=stiffness, damping=0.002 * stiffness, lower=float(target.min()), upper=float(target.max())
    )


def error(
    model: Model, rendered: Model, scheme: Scheme, device: DeviceProfile, hand: Hand, seconds: float
) -> float:
    """Returns the RMS of commanded minus identified force at the ends of ticks; infinity if it diverges."""
    start = float(np.clip(0.0, model.lower[0], model.upper[0]))
    try:
        trace = simulate(rendered, scheme, device, hand, seconds, start_position=start)
    except ValueError:
        return float("inf")
    end = np.asarray(trace["handle_end"])
    if not np.isfinite(end).all() or np.abs(end).max() > 1e3:
        return float("inf")
    direct = Scheme(structure="direct", play_radius=scheme.play_radius if model.hysteretic else 0.0)
    identified_force = motion_driven(model, direct, end, device.period_s)["force"]
    return float(np.sqrt(np.mean((np.asarray(trace["force"]) - identified_force) ** 2)))


def oscillates(model: Model, rendered: Model, scheme: Scheme, device: DeviceProfile) -> bool:
    """Returns True if a hand without damping on the steepest part keeps oscillating after a push.

    One hand is massless. The other is so heavy that the force is 0.03 rad of the oscillation late.
    """
    lower, upper = float(model.lower[0]), float(model.upper[0])
    x = np.linspace(lower, upper, SAMPLES)
    force = strokes(model, x)[0]
    slope = np.where(np.abs(force) < 0.8 * device.force_limit, np.gradient(force, x), -np.inf)
    steepest_position, steepest = float(x[np.argmax(slope)]), float(slope.max())
    delay_s = 0.5 * device.period_s + device.delay_s
    stiffness = 0.05 * steepest
    target = steepest_position + float(strokes(rendered, np.array([steepest_position]))[0, 0]) / stiffness
    hand = Hand(stiffness=stiffness, damping=0.0, lower=target, upper=target)
    for inertia in (device.inertia, max(device.inertia, steepest * (delay_s / 0.03) ** 2)):
        loaded_device = DeviceProfile(
            inertia=inertia,
            viscous_damping=device.viscous_damping,
            coulomb_friction=device.coulomb_friction,
            encoder_step=device.encoder_step,
            delay_s=device.delay_s,
            force_limit=device.force_limit,
            position_unit=device.position_unit,
        )
        start = steepest_position + PUSH_SHARE * (upper - lower)
        trace = simulate(rendered, scheme, loaded_device, hand, 4.0, start_position=start)
        if not np.ptp(np.asarray(trace["handle_end"])[-500:]) <= LARGEST_OSCILLATION * device.encoder_step:
            return True
    return False


def candidates(model: Model, device: DeviceProfile, play_radius: float, grid: int) -> Iterator[Scheme]:
    """Yields each structure with couplings, masses and dampings below and above the stability limits."""
    play = {"play_radius": play_radius}
    yield Scheme(structure="direct", **play)
    stiffness_limit = 2.0 * device.viscous_damping / device.period_s
    for stiffness, damping_share in itertools.product(
        np.geomspace(0.05 * stiffness_limit, 2.0 * stiffness_limit, grid), (0.0, 2e-4)
    ):
        coupling = {"coupling_stiffness": stiffness, "coupling_damping": damping_share * stiffness, **play}
        yield Scheme(structure="massless", **coupling)
        if not model.hysteretic:
            yield Scheme(structure="massless", compensated=True, **coupling)
        for structure, stability_factor, ratio in itertools.product(
            ("implicit", "energy-consistent", "explicit"), (0.02, 2.0), (0.0, 0.5)
        ):
            mass = stability_factor * (stiffness_limit + stiffness) * device.period_s**2
            yield Scheme(
                structure=structure, mass=mass, object_damping=ratio * mass / device.period_s, **coupling
            )


def unchanged_part(model: Model, chosen: Plan, device: DeviceProfile) -> tuple[float, float]:
    """Returns the share of the travel where the plan keeps the slope, and the largest force error there.

    Hysteresis divided by play radius counts as slope.
    """
    x = np.linspace(float(model.lower[0]), float(model.upper[0]), SAMPLES)
    hysteresis_slope = force_bounds(chosen.rendered, chosen.scheme.play_radius).loss_per_play
    lowest_slope, highest_slope = renderable_slopes(device, hysteresis_slope, model)
    forces = strokes(model, x)
    unchanged = np.ones(SAMPLES, dtype=bool)
    for force in forces:
        nearest = slope_limited(x, force, lowest_slope, highest_slope)
        unchanged &= np.abs(nearest - force) <= 1e-6 * np.ptp(force)
    # Limiting the slope rounds kinks over 0.5 % of the travel, so 3 % around a kink counts as limited.
    margin = round(0.03 * SAMPLES)
    unchanged = np.convolve(~unchanged, np.ones(2 * margin + 1), mode="same") < 0.5
    force_error = np.abs(strokes(chosen.rendered, x) - forces).max(axis=0)
    return float(unchanged.mean()), float(force_error[unchanged].max(initial=0.0))


def compare(name: str, model: Model, device: DeviceProfile, seconds: float, grid: int) -> Row:
    chosen = plan(model, device, energy_account=False)
    certificate = chosen.certificate
    limited_error = None if chosen.limited is None else chosen.force_error
    assert certificate is not None
    hand = sweep(chosen.rendered, device)
    best_certified = at_rest = (float("inf"), "none")
    rendered = {"": model} if limited_error is None else {"": model, ", slope limited": chosen.rendered}
    for (suffix, rendered_model), scheme in itertools.product(
        rendered.items(), candidates(model, device, chosen.scheme.play_radius, grid)
    ):
        try:
            is_certified = not certify(rendered_model, scheme, device).refused
        except ValueError:
            continue  # compensating fails if the model is too steep for its coupling
        candidate = error(model, rendered_model, scheme, device, hand, seconds), scheme.structure + suffix
        if is_certified:
            best_certified = min(best_certified, candidate)
        if candidate[0] < at_rest[0] and not oscillates(model, rendered_model, scheme, device):
            at_rest = candidate
    share, force_error = (None, None) if limited_error is None else unchanged_part(model, chosen, device)
    direct = Scheme(structure="direct", play_radius=chosen.scheme.play_radius)
    return Row(
        object=name,
        device=device.id,
        plan=chosen.structure + ("" if limited_error is None else ", slope limited"),
        verdict=certificate.verdict,
        error=error(model, chosen.rendered, chosen.scheme, device, hand, seconds),
        best=best_certified[1],
        best_error=best_certified[0],
        best_at_rest=at_rest[1],
        best_at_rest_error=at_rest[0],
        oscillates=oscillates(model, chosen.rendered, chosen.scheme, device),
        direct_oscillates=oscillates(model, model, direct, device),
        force_range=float(np.ptp(strokes(model, np.linspace(model.lower[0], model.upper[0], SAMPLES)))),
        force_error_rms=None if limited_error is None else limited_error.rms,
        force_error_largest=None if limited_error is None else limited_error.largest,
        unchanged_share=share,
        unchanged_force_error=force_error,
    )
