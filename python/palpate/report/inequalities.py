# SPDX-License-Identifier: Apache-2.0
"""Inequalities of a certificate in words, for readers who do not know their symbols."""

from __future__ import annotations

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
    "stable-locally": "The linearised system is stable near each equilibrium; nothing is proved about its "
    "energy.",
    "refused": "The certificate is refused: an inequality does not hold, or no bound is known.",
}
"""Verdict of a certificate in words"""
