# SPDX-License-Identifier: Apache-2.0
"""Delay and lag of the position servo of an admittance display, measured with a chirp of commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from .._core.simulation import display_motion
from .._typing import Float1D
from ..errors import InputError
from ..planning import AdmittanceDisplay, DeviceProfile

SIGMAS = 3.0
"""Stated error of each number [standard errors]"""

_HIGHEST_FREQUENCY = 0.1
"""Highest frequency of the chirp [1 / period]"""
_LOWEST_HZ = 0.5
"""Lowest frequency of the chirp [Hz]"""
_RATE_SHARE = 0.5
"""Largest speed of the chirp [share of the rate limit]"""
_LONGEST_DELAY = 6.0
"""Longest delay at which the search for the delay starts [periods]"""
_AMPLITUDE = {"m": 2e-3, "rad": 0.05}
"""Amplitude of the chirp by unit [m or rad]"""
_LEAST_SAMPLES = 100
"""Least number of samples from which a servo is measured"""


@dataclass(frozen=True)
class ServoEstimate:
    """Delay and lag of a position servo, each with its error of `SIGMAS` standard errors."""

    delay_s: float
    delay_error_s: float
    """Half a period for a servo without lag, because its samples do not show a part of a period"""
    bandwidth_hz: float | None = None
    """Natural frequency, or corner frequency of a servo of first order; None: the servo moves at once"""
    bandwidth_error_hz: float = 0.0
    damping: float | None = None
    """Damping ratio of a servo of second order; None: first order"""
    damping_error: float = 0.0
    residual: float = 0.0
    """RMS of measured minus modelled position [m or rad]"""

    @property
    def lag_s(self) -> float:
        """Delay of slow motion by the servo, in addition to `delay_s` [s]: 1/w, or 2 zeta/w."""
        if self.bandwidth_hz is None:
            return 0.0
        factor = 1.0 if self.damping is None else 2.0 * self.damping
        return factor / (2.0 * np.pi * self.bandwidth_hz)


def chirp(device: DeviceProfile, amplitude: float, duration_s: float) -> Float1D:
    """Returns position commands (n,) whose frequency rises from 0.5 Hz to a tenth of the sampling rate.

    The frequency rises exponentially, f(t) = f_0 (f_1/f_0)^(t/duration). The amplitude falls where half the
    rate limit of the display requires it.

    Parameters
    ----------
    device : DeviceProfile
        The admittance display.
    amplitude : float
        Largest distance from the middle [m or rad].
    duration_s : float
        Duration of the motion [s].
    """
    time = np.arange(0.0, duration_s, device.period_s)
    highest = _HIGHEST_FREQUENCY / device.period_s
    rise = np.log(highest / _LOWEST_HZ) / duration_s
    speed = 2.0 * np.pi * _LOWEST_HZ * np.exp(rise * time)
    phase = 2.0 * np.pi * _LOWEST_HZ * np.expm1(rise * time) / rise
    display = device.admittance
    size = np.full(len(time), amplitude)
    if display is not None and display.rate_limit is not None:
        size = np.minimum(amplitude, _RATE_SHARE * display.rate_limit / speed)
    return np.asarray(size * np.sin(phase), dtype=np.float64)


def measure_servo(device: DeviceProfile, duration_s: float) -> ServoEstimate:
    """Returns delay and lag of the servo of a simulated admittance display, from a chirp.

    The encoder of the profile reads the positions in its steps.

    Parameters
    ----------
    device : DeviceProfile
        The simulated display.
    duration_s : float
        Duration of the chirp [s].
    """
    command = chirp(device, _AMPLITUDE[device.position_unit], duration_s)
    motion = np.asarray(display_motion(device, command))
    step = device.encoder_step
    return identify_servo(
        command, np.round(motion / step) * step if step > 0.0 else motion, device.period_s, step
    )


def identify_servo(
    command: Float1D, position: Float1D, period_s: float, position_step: float = 0.0
) -> ServoEstimate:
    """Returns delay and lag of a position servo from commands and measured positions.

    Least squares of the measured minus the simulated position, for a servo without lag, of first order and of
    second order. The order with the least Bayesian information criterion is chosen.

    Parameters
    ----------
    command : array_like, shape (n,)
        Position commands, one for each period [m or rad].
    position : array_like, shape (n,)
        Position of the handle at the end of each period [m or rad].
    period_s : float
        Time between two samples [s].
    position_step : float
        Smallest change of position that the encoder reports [m or rad]; the errors include it.

    Raises
    ------
    InputError
        There are fewer than 100 samples, or the commands do not move.
    """
    command, position = np.asarray(command, dtype=np.float64), np.asarray(position, dtype=np.float64)
    if command.shape != position.shape or command.ndim != 1 or len(command) < _LEAST_SAMPLES:
        raise InputError(
            f"command has the shape {command.shape} and position {position.shape}: both need one shape (n,) "
            f"with at least {_LEAST_SAMPLES} samples"
        )
    if not np.ptp(command) > position_step or not np.isfinite(command + position).all():
        raise InputError("the servo was not measured: command and position must be finite, and must move")
    fits = [_fit(order, command, position, period_s, position_step) for order in (0, 1, 2)]
    return min(fits, key=lambda fit: fit[0])[1]


def _fit(
    order: int, command: Float1D, position: Float1D, period_s: float, step: float
) -> tuple[float, ServoEstimate]:
    """Returns the criterion and the estimate of a servo of one order."""
    start = float(command[0])

    def motion(parameters: Float1D) -> Float1D:
        late, *servo = parameters
        display = AdmittanceDisplay(
            servo_bandwidth_hz=float(np.exp(servo[0])) if order > 0 else None,
            servo_damping=float(np.exp(servo[1])) if order > 1 else None,
        )
        device = DeviceProfile(
            period_s=period_s, delay_s=min(max(float(late), 0.0), 16.0) * period_s, admittance=display
        )
        return np.asarray(display_motion(device, command, start))

    n, scale = len(command), float(np.ptp(command))
    if order == 0:
        # Every delay between two whole periods gives the same positions at the samples
        middles = [np.array([whole + 0.5]) for whole in range(16)]
        best = min(middles, key=lambda each: float(np.sum((motion(each) - position) ** 2)))
        residual = float(np.sqrt(np.mean((motion(best) - position) ** 2)))
        noise = max(residual, step / np.sqrt(12.0), 1e-9 * scale)
        return n * np.log(noise**2) + np.log(n), ServoEstimate(
            float(best[0]) * period_s, 0.5 * period_s, residual=residual
        )
    bandwidths = np.geomspace(2.0, 0.2 / period_s, 8)
    starts = [
        np.array([late, np.log(each), 0.0][: order + 1])
        for late in np.arange(0.0, _LONGEST_DELAY, 1.0) + 0.5
        for each in bandwidths
    ]
    first = min(starts, key=lambda each: float(np.sum((motion(each) - position) ** 2)))
    lower = np.array([0.0, np.log(0.1), np.log(0.05)][: order + 1])
    upper = np.array([16.0, np.log(0.5 / period_s), np.log(20.0)][: order + 1])

    def difference(parameters: Float1D) -> Float1D:
        return np.asarray((motion(parameters) - position) / scale, dtype=np.float64)

    found = scipy.optimize.least_squares(difference, first, bounds=(lower, upper), xtol=1e-14, ftol=1e-14)
    residual = float(np.sqrt(np.mean(found.fun**2))) * scale
    noise = max(residual, step / np.sqrt(12.0), 1e-9 * scale)
    jacobian = np.asarray(found.jac, dtype=np.float64) * scale
    errors = SIGMAS * noise * np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian)))
    late, bandwidth = float(found.x[0]) * period_s, float(np.exp(found.x[1]))
    damping = None if order == 1 else float(np.exp(found.x[2]))
    estimate = ServoEstimate(
        late,
        float(errors[0]) * period_s,
        bandwidth,
        bandwidth * float(errors[1]),
        damping,
        0.0 if damping is None else damping * float(errors[2]),
        residual,
    )
    return n * np.log(noise**2) + (order + 1) * np.log(n), estimate
