# SPDX-License-Identifier: Apache-2.0
"""A model in words and a table, for a person."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .model import Model


def describe(model: Model) -> str:
    """Verdict, terms, domain, units and history of a model."""
    position, force = (model.units[role] or "SI" for role in ("position", "force"))
    fit, data = model.fit, model.data
    lines = [
        f"verdict: {model.verdict.level}",
        *(f"  {reason}" for reason in model.verdict.reasons),
        f"{model.kind} model: {model.n_wavelets} wavelets, {model.n_parameters} parameters "
        f"(model class {fit.model_class}, stopped by {fit.stop_reason})",
        f"  NRMSE {fit.nrmse:.4g} on {data.rows} rows of {_names(data.files) or 'arrays'}",
    ]
    if data.held_out_every:
        lines.append(f"  every {data.held_out_every}th row was held out")
    for index, name in enumerate(model.inputs):
        unit = f" {position}" if name == "position" else ""
        lines.append(f"  {_names([name])} from {model.lower[index]:.6g} to {model.upper[index]:.6g}{unit}")
    outside = f"below: {model.below}, above: {model.above}"
    lines.append(
        f"  outside: {outside}" if model.period is None else f"  repeats every {model.period:.6g} {position}"
    )
    if model.slope_bounds is not None:
        low, high = model.slope_bounds
        lines.append(f"  slope from {low:.4g} to {high:.4g} {force}/{position}")
    if model.play_radius is not None:
        lines.append(f"  play radius {model.play_radius:.4g} {position}")
    if model.mass is not None:
        lines.append(f"  mass {model.mass:.4g}")
    if model.damping is not None:
        lines.append(f"  damping {model.damping:.4g}")
    lines += ["", *_terms(model, force)]
    return "\n".join(lines)


def _terms(model: Model, force: str) -> list[str]:
    """The force as a formula, and its wavelets as a table."""
    names = ["x"] if model.dimension == 1 else [f"x{k + 1}" for k in range(model.dimension)]
    linear = " ".join(f"{c:+.6g} {name}" for c, name in zip(model.linear, names, strict=True))
    network = "sum_i w_i psi(alpha_i (x - beta_i)) " if model.n_wavelets else ""
    tail = f"  [{force}]"
    hysteretic = model.weight_hysteresis is not None and model.linear_hysteresis is not None
    if not hysteretic:
        formula = [f"  f(x) = {network}{linear} {model.bias:+.6g}{tail}"]
    else:
        assert model.linear_hysteresis is not None
        loss = f"{model.linear_hysteresis[0]:+.6g} x {model.bias_hysteresis:+.6g}"
        network_h = network.replace("w_i", "v_i")
        formula = [
            f"  f(x, s) = g(x) + s h(x){tail}, s = +1 pressing, -1 releasing",
            f"  g(x) = {network}{linear} {model.bias:+.6g}",
            f"  h(x) = {network_h}{loss}",
        ]
    if not model.n_wavelets:
        return formula
    head = ["i", *(f"{word}{k}" for word in ("alpha", "beta") for k in _numbers(model.dimension)), "w"]
    table = [head + (["v"] if hysteretic else [])]
    for i in range(model.n_wavelets):
        row = [
            str(i),
            *(f"{value:.6g}" for value in (*model.alpha[i], *model.beta[i])),
            f"{model.weight[i]:.6g}",
        ]
        if model.weight_hysteresis is not None:
            row.append(f"{model.weight_hysteresis[i]:.6g}")
        table.append(row)
    widths = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
    return formula + [
        "  " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in table
    ]


def _names(names: Iterable[str]) -> str:
    """Names joined by commas; control characters are escaped, so that no name can control a terminal."""
    return ", ".join(name if name.isprintable() else repr(name)[1:-1] for name in names)


def _numbers(dimension: int) -> list[str]:
    return [""] if dimension == 1 else [str(k + 1) for k in range(dimension)]
