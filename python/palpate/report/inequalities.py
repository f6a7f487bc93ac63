# SPDX-License-Identifier: Apache-2.0
"""Inequalities of a certificate in words, for readers who do not know their symbols."""

from __future__ import annotations

import re
from collections.abc import Iterable

MEANINGS = {
    "damping-hold": (
        "damping",
        "The force is held between two samples, which feeds energy into the handle; the viscous damping of "
        "the device must absorb it.",
    ),
    "damping-coupling": (
        "damping",
        "The force of the virtual coupling is held between two samples, which feeds energy into the handle; "
        "the viscous damping of the device must absorb it.",
    ),
    "friction-steps": (
        "force",
        "Steps of encoder and force feed energy into the handle; the Coulomb friction of the device must "
        "absorb it.",
    ),
    "friction-force-step": (
        "force",
        "Steps of the force feed energy into the handle; the Coulomb friction of the device must absorb it.",
    ),
    "encoder-step-coupling": ("position", "No proof covers an encoder with steps in this structure."),
    "loss-nonnegative": (
        "force",
        "The release force must not be above the press force, because the object would then generate energy.",
    ),
    "unique-solution": (
        "stiffness",
        "The position of the virtual object must have one solution at every sample, so the force must not "
        "fall too steeply.",
    ),
    "solution-exists": (
        "stiffness",
        "The position of the virtual object must have a solution at every sample, so the force must not fall "
        "too steeply.",
    ),
    "falling-slope-coupling": (
        "stiffness",
        "The virtual coupling must be stiffer than the steepest fall of the force.",
    ),
    "falling-slope-limit": (
        "stiffness",
        "With a force limit, the damping of the virtual object must hold the steepest fall of the force.",
    ),
    "explicit-slope": (
        "stiffness",
        "Object and coupling must not be stiffer than the mass can follow from one sample to the next.",
    ),
    "explicit-damping": (
        "mass",
        "Object and coupling must not have more damping than the mass can follow from one sample to the "
        "next.",
    ),
    "explicit-damping-positive": ("damping", "Object or coupling must have damping, so that motion decays."),
    "explicit-falling-slope": (
        "stiffness",
        "The virtual coupling must be stiffer than the steepest fall of the force.",
    ),
    "explicit-port-damping": (
        "damping",
        "The viscous damping of the device must absorb the energy that the linearised rendering feeds in.",
    ),
    "account-force": (
        "energy",
        "The energy account must be able to hold the largest force of the object at rest.",
    ),
    "damping-line": (
        "damping",
        "The controller samples and delays the line that it holds, and the line differs from the force; both "
        "feed energy into the handle, which the viscous damping of the device must absorb.",
    ),
    "friction-line": (
        "force",
        "Steps of the encoders and of the force feed energy into the handle; the Coulomb friction of the "
        "device must absorb it.",
    ),
    "line-controller": ("", "The controller of the device must hold a line between two commands."),
    "line-limit": (
        "",
        "The controller must limit the force of the line, because a limit in the host is late.",
    ),
    "line-spring": ("", "A controller that takes springs holds lines of one slope only."),
    "line-delay": ("time", "No proof covers a delay with a line of this rule."),
    "line-hysteresis": ("stiffness", "No proof covers hysteresis with a line of this rule."),
    "line-stiffness": ("stiffness", "The controller must be able to hold the slope of the line."),
    "line-watchdog": ("time", "The controller must not stop the force before the next command."),
    "line-motion": (
        "position",
        "The motion in a period up to which the certificate holds must be one that the encoder can measure.",
    ),
    "admittance-structure": ("", "The object must have mass, and no coupling, because it moves the display."),
    "admittance-damping": (
        "damping",
        "Delay, servo and integration feed energy into the hand; the damping of the object must absorb it, "
        "for every hand of the profile.",
    ),
    "admittance-explicit-mass": (
        "mass",
        "The object must not have more damping than the mass can follow from one sample to the next.",
    ),
    "admittance-jitter": ("time", "No proof covers samples at unequal times on this kind of device."),
    "admittance-mean": ("force", "No proof covers a periodic force that pushes to one side in the mean."),
    "admittance-force-error": ("force", "No proof covers an error of the force on this kind of device."),
    "admittance-velocity": (
        "",
        "No proof covers a force of velocity or with a memory on this kind of device.",
    ),
    "account-renderer": ("rate", "A motor controller has no energy account."),
    "velocity-coupling": (
        "damping",
        "No proof covers a force that depends on velocity behind a coupling.",
    ),
    "velocity-prediction": (
        "damping",
        "No proof covers a prediction of a force that depends on velocity.",
    ),
}
"""Kind of quantity on both sides of an inequality, and its meaning in words, by the id of the inequality"""

BASES = {
    "proved": "for every motion",
    "linear": "for small motion near an equilibrium only",
    "none": "no bound is known",
}
"""Basis of an inequality in words"""

VERDICTS = {
    "certified": "The certificate holds: a hand cannot take more energy out of the device than it put in.",
    "held-by-account": "The energy account holds: a hand cannot take more energy out of the device than E_0, "
    "in any motion.",
    "stable-locally": "The linearised system is stable near each equilibrium; nothing is proved about its "
    "energy.",
    "refused": "The certificate is refused: an inequality does not hold, or no bound is known.",
}
"""Verdict of a certificate in words"""

SYMBOLS = {
    "b": "viscous damping of the device",
    "f_c": "Coulomb friction of the device",
    "T": "longest time between two samples",
    "t_d": "delay from a sample to its force",
    "Delta": "step of the encoder",
    "Delta_F": "step of the force command",
    "c": "force limit: c(f) is the force after the limit",
    "B": "damping per sample period that a hold, a delay or a prediction needs",
    "M": "steepest rising slope of the force",
    "s_": "steepest falling slope of the force",
    "L": "steepest slope of the force, rising or falling",
    "M_h": "steepest rising slope with hysteresis: the largest value of g' + |h'| + h / r, at least 0",
    "s_h": "steepest falling slope with hysteresis: the largest value of |h'| - g', at least 0",
    "L_h": "the larger of M_h and s_h",
    "M_g": "steepest rising slope of the force at rest, without the branches of a memory",
    "L_g": "steepest slope of the force at rest, rising or falling",
    "P": "largest ratio of a memory; P' is its steepest slope",
    "U": "largest stretch of a branch",
    "R": "change of the slope of the branches by their relaxation during T",
    "n": "number of samples in the delay",
    "L_x": "steepest slope of the force over position, at any velocity",
    "B_v": "largest change of the force per velocity",
    "period": "nominal time between two samples",
    "K": "slope of the force of the object; with memory the stiffness of all branches together",
    "p": "slope of the line whose crossing with the force is the next position",
    "gamma": "largest change of the rendered force per error of the position",
    "epsilon": "largest error of the force by the program that renders it",
    "e": "increase of the slope of the hysteresis by a step of the encoder",
    "E_F": "largest energy that the largest force can take in one period",
    "W": "largest energy that the object stores",
    "f": "force of the model; f' is its slope",
    "g": "mean force of press and release; g' is its slope",
    "h": "half the difference between press and release force; h' is its slope",
    "r": "play radius",
    "m": "number of samples of the prediction, or mass of the virtual object",
    "K_c": "stiffness of the virtual coupling",
    "B_c": "damping of the virtual coupling",
    "B_o": "damping of the virtual object",
    "H": "response of the rendering to motion at one frequency",
    "z": "shift by one sample",
    "theta": "frequency in radians for each sample",
    "kappa": "slope of the line that the controller holds",
    "kappa_max": "largest slope of a line that the controller can hold",
    "w": "largest motion in one period up to which the certificate holds",
    "C": "steepest change of the slope of the force",
    "T_in": "time between two samples of the controller",
    "t_in": "delay of the controller from a sample to its force",
    "t_w": "time after the last command at which the controller makes zero force",
    "Delta_in": "step of the controller's encoder",
}
"""Meaning of the symbols in the formulas of inequalities"""


_SYMBOL = r"[A-Za-z][A-Za-z_]*"


def symbols_in(formulas: Iterable[str]) -> list[str]:
    """Returns "symbol: meaning" for each symbol in the formulas, in the order of `SYMBOLS`."""
    used = {word for formula in formulas for word in re.findall(_SYMBOL, formula)}
    return [f"{symbol}: {meaning}" for symbol, meaning in SYMBOLS.items() if symbol in used]
