# SPDX-License-Identifier: Apache-2.0
"""Texts of schemes and plans."""

from __future__ import annotations

from .._core.rendering import Scheme
from .._core.stability import felt_slope
from .plan import Plan

_CERTIFICATE = {
    "certified": "certified",
    "stable-locally": "stable (local), passivity not certified",
    "refused": "refused",
}


def describe(scheme: Scheme) -> str:
    """A scheme in words: "implicit, m = 0.001, B_o = 0.5"."""
    words = _words(scheme)
    if scheme.structure not in ("direct", "massless"):
        words += [f"m = {scheme.mass:.3g}", f"B_o = {scheme.damping:.3g}"]
    return ", ".join(words)


def structure_words(plan: Plan) -> str:
    """The structure of a plan, and its changes to the identified network."""
    return ", ".join([*_words(plan.scheme), *([] if plan.limited is None else ["with a limited network"])])


def _words(scheme: Scheme) -> list[str]:
    words = [scheme.structure]
    if scheme.compensated:
        words.append("compensated")
    if scheme.predict:
        words.append(f"predict {scheme.predict}")
    return words


def felt_slopes(plan: Plan) -> tuple[float, float]:
    """The steepest slope that is felt, and that of the model: a coupling makes it softer [force/position].

    Where the coupling was taken out of the model, the bounds of the certificate are those of the rest.
    """
    assert plan.certificate is not None
    steepest = max(0.0, plan.certificate.bounds.slope_max)
    if plan.structure == "direct":
        return steepest, steepest
    felt = felt_slope(steepest, plan.scheme.coupling_stiffness)
    return felt, felt if plan.scheme.compensated else steepest


def plan_rows(plan: Plan) -> dict[str, str]:
    """The numbers of a certified plan, each under its name."""
    assert plan.certificate is not None
    scheme, error = plan.scheme, plan.force_error
    rows = {"structure": structure_words(plan)}
    if plan.solver is not None:
        rows["solver"] = plan.solver
    if plan.structure != "direct":
        rows["coupling"] = f"K_c = {scheme.coupling_stiffness:.4g}, B_c = {scheme.coupling_damping:.4g}"
    if plan.structure not in ("direct", "massless"):
        rows["object"] = f"m = {scheme.mass:.4g}, B_o = {scheme.damping:.4g}"
    if scheme.predict:
        rows["prediction"] = f"half a sample ahead, from {scheme.predict} samples before"
    if scheme.play_radius:
        rows["play radius"] = f"{scheme.play_radius:.4g}"
    unit = plan.model.units["force"] or "in the model's unit"
    felt, steepest = felt_slopes(plan)
    if felt < steepest:
        rows["softer"] = f"slopes up to {steepest:.4g} are felt as up to {felt:.4g}"
    rows["force error"] = (
        f"up to {error.largest:.4g} {unit}, "
        f"{100.0 * error.share:.3g} % of the range; RMS {100.0 * error.rms_share:.3g} % of the spread"
        if error.largest
        else "none"
    )
    rows["certificate"] = _CERTIFICATE[plan.certificate.verdict]
    rows["holds for"] = f"up to {1e3 * plan.certificate.longest_period_s:.4g} ms between two samples"
    return rows
