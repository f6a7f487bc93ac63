# SPDX-License-Identifier: Apache-2.0
"""A model as a table of its wavelets, as a figure, and as HTML."""

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models_by_hand import keyswitch_by_hand, model_by_hand
from palpate import InputError, Model
from palpate.plotting import plot


def two_inputs() -> Model:
    return Model.from_network(
        inputs=("position", "lateral_m"),
        units={"position": "rad", "force": "N*m"},
        alpha=[[1.0, 2.0]],
        beta=[[0.5, 0.25]],
        weight=[1.0],
        lower=[0.0, 0.0],
        upper=[1.0, 0.5],
    )


def test_the_table_of_wavelets_names_its_units() -> None:
    frame = keyswitch_by_hand().to_frame()
    assert frame.to_dict("list") == {
        "alpha_per_m": [2000.0],
        "beta_m": [0.002],
        "weight_N": [-0.2],
        "weight_hysteresis_N": [0.0],
    }
    assert list(model_by_hand().to_frame().columns) == ["alpha_per_rad", "beta_rad", "weight_Nm"]
    assert list(two_inputs().to_frame().columns) == [
        "alpha_position_per_rad",
        "beta_position_rad",
        "alpha_lateral_per_m",
        "beta_lateral_m",
        "weight_Nm",
    ]


def test_the_table_restores_the_network() -> None:
    model = model_by_hand()
    frame = model.to_frame()
    restored = Model.from_network(
        alpha=frame[["alpha_per_rad"]],
        beta=frame[["beta_rad"]],
        weight=frame["weight_Nm"],
        linear=model.linear,
        bias=model.bias,
        lower=model.lower,
        upper=model.upper,
    )
    assert restored.force(0.3) == model.force(0.3)


def test_a_model_without_wavelets_has_an_empty_table() -> None:
    line = model_by_hand(alpha=np.empty((0, 1)), beta=np.empty((0, 1)), weight=[])
    assert len(line.to_frame()) == 0


def labels(axes: Axes) -> list[str]:
    return [str(line.get_label()) for line in axes.lines]


def test_plot_draws_press_and_release_on_the_given_axes() -> None:
    given = Figure().subplots()
    model = keyswitch_by_hand()
    assert plot(model, given) is given
    assert labels(given) == ["model, press", "model, release"]
    press = given.lines[0]
    assert np.asarray(press.get_xdata())[-1] == pytest.approx(4.0)
    assert np.asarray(press.get_ydata())[-1] == pytest.approx(model.force(0.004, direction=1))
    assert (given.get_xlabel(), given.get_ylabel()) == ("position [mm]", "force [N]")


def test_plot_of_several_inputs_has_a_curve_for_least_middle_and_largest_values() -> None:
    given = Figure().subplots()
    model = two_inputs()
    plot(model, given)
    assert labels(given) == ["model, lateral_m 0", "model, lateral_m 0.25", "model, lateral_m 0.5"]
    assert np.asarray(given.lines[1].get_ydata())[0] == model.predict([[0.0, 0.25]])[0]


def test_two_models_on_the_same_axes_have_their_names_and_colours() -> None:
    given = Figure().subplots()
    plot(model_by_hand(), given, label="first")
    assert given.get_legend() is None
    plot(model_by_hand(bias=1.0), given, label="second", color="red")
    assert labels(given) == ["first", "second"]
    assert [line.get_color() for line in given.lines] == ["black", "red"]
    assert given.get_legend() is not None


def test_plot_without_axes_makes_a_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    axes = plot(model_by_hand())
    assert axes.figure in [plt.figure(number) for number in plt.get_fignums()]
    plt.close(axes.figure)  # type: ignore[arg-type]


def test_plot_refuses_another_object_than_axes() -> None:
    with pytest.raises(InputError, match=r"ax is 'red'; it must be a Axes: leave it out"):
        plot(model_by_hand(), "red")  # type: ignore[arg-type]


def test_html_begins_with_the_verdict_and_its_reasons() -> None:
    notes = {"verdict": [{"level": "usable", "sentence": "a <reason> & its cure"}]}
    html = model_by_hand(notes=notes)._repr_html_()
    assert html.index("<b>usable</b>") < html.index("a &lt;reason&gt; &amp; its cure") < html.index("NRMSE")
    assert "<script" not in html
    assert "0 to 0.5 rad" in html
    assert html.count("<path") == 1
    assert keyswitch_by_hand()._repr_html_().count("<path") == 2
    assert "<svg" not in two_inputs()._repr_html_()


@pytest.mark.parametrize(
    ("units", "mass", "damping"),
    [
        ({"position": "m", "force": "N"}, "mass 0.5 kg", "damping 2 N*s/m"),
        ({"position": "rad", "force": "N*m"}, "mass 0.5 kg*m^2", "damping 2 N*m*s/rad"),
        ({"position": "count", "force": "N"}, "mass 0.5 N*s^2/count", "damping 2 N*s/count"),
        ({"position": "", "force": ""}, "mass 0.5", "damping 2"),
    ],
)
def test_mass_and_damping_are_shown_with_their_units(units: dict[str, str], mass: str, damping: str) -> None:
    lines = str(model_by_hand(units=units, mass=0.5, damping=2.0)).splitlines()
    assert [f"  {mass}", f"  {damping}"] == [
        line for line in lines if line.startswith(("  mass", "  damping"))
    ]
