# SPDX-License-Identifier: Apache-2.0
"""DeviceProfile: properties of a haptic device, and its TOML file."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from .. import _core
from ..arguments import path_of
from ..errors import InputError, command_word
from ..model import Model
from ..recording.files import replacing, require_file

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_LARGEST_BYTES = 20_000
"""Largest size of a profile; the examples have less than 2000, and tomllib takes long for more [bytes]."""

_MOST_ERRORS = 20
"""Largest number of wrong fields that a message names."""

EXAMPLES = Path(__file__).parent / "profiles"
"""Example profiles; a comment at the top of each gives the sources of its numbers."""


def example_profiles() -> dict[str, tuple[Path, tuple[str, ...]]]:
    """Returns the example profiles: name -> file and paragraphs with the sources of its numbers."""
    examples = {}
    for file in sorted(EXAMPLES.glob("*.toml")):
        comment = []
        for line in file.read_text(encoding="utf-8").splitlines()[1:]:  # after the licence
            if not line.startswith("#"):
                break
            comment.append(line.removeprefix("#").strip())
        paragraphs = "\n".join(comment).split("\n\n")
        examples[file.stem] = (file, tuple(" ".join(text.split()) for text in paragraphs))
    return examples


def profile_file(name: str) -> Path:
    """Returns the file of this name if it exists, else the example profile of this name."""
    file, example = Path(name), EXAMPLES / f"{name}.toml"
    return example if not file.exists() and example.exists() else file


def mechanical_units(position_unit: str) -> tuple[str, str, str]:
    """Returns the units of inertia, damping and force of a rotary ("rad") or linear device."""
    return ("kg*m^2", "N*m*s/rad", "N*m") if position_unit == "rad" else ("kg", "N*s/m", "N")


class DeviceProfile(_core.device.DeviceProfile):
    """Properties of a rotary or linear haptic device of one degree of freedom, in SI units.

    A certificate relies on the damping ``b`` and the friction ``f_c`` of the mechanism. Use a lower bound for
    unknown damping or friction, and an upper bound for unknown delay, steps or jitter.

    The keyword arguments are the fields of the core's DeviceProfile, listed there with their units. The
    defaults are those of a simulated knob. Three fields are tables in the TOML file: ``on_device``
    is an :class:`palpate.planning.OnDevice`, ``held_line`` a :class:`palpate.planning.HeldLine`, and
    ``admittance`` an :class:`palpate.planning.AdmittanceDisplay`. A device with the table ``admittance``
    measures the force and moves to a commanded position, like a force-feedback pedal.

    Raises
    ------
    ValueError
        Names the field, its value and the bound.
    """

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> DeviceProfile:
        """Reads a profile from a TOML file. Every required field must be present, and no unknown field.

        Raises
        ------
        InputError
            The file does not exist or is not TOML, or fields are missing, unknown or impossible. The message
            names the file, and every such field with its value.
        """
        file = path_of("path", path)
        require_file(file)
        if (size := file.stat().st_size) > _LARGEST_BYTES:
            raise InputError(
                f"{file} has {size} bytes: a device profile must have at most {_LARGEST_BYTES}; remove "
                "comments"
            )
        try:
            content = tomllib.loads(file.read_text(encoding="utf-8"))
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{file} is not TOML: {error}") from None
        except UnicodeDecodeError:
            raise InputError(f"{file} is not TOML: the file is not text") from None
        except RecursionError:
            raise InputError(
                f"{file}: the file is nested too deeply; a profile has no tables but on_device, admittance "
                "and held_line"
            ) from None
        except ValueError as error:  # TOML with an integer of too many digits for Python, or an invalid date
            reason = str(error)
            if "integer string conversion" in reason:
                reason = f"a number has more than {sys.get_int_max_str_digits()} digits; write 17 or fewer"
            raise InputError(f"{file}: a value cannot be read: {reason}") from None
        try:
            return cls(**_core.io.profile_of(content).to_dict())
        except ValueError as error:
            raise InputError(f"{file}: {'; '.join(_wrong_fields(content) or [str(error)])}") from None

    def save(self, path: str | os.PathLike[str], *, notes: Sequence[str] = ()) -> Path:
        """Writes the profile as a TOML file. The file gets its name only when it is complete.

        Parameters
        ----------
        path : str or path
            The file.
        notes : sequence of str
            Sources of the numbers: comments at the top of the file.
        """
        file = path_of("path", path)
        comment = "".join(f"# {note}\n" for note in notes)
        with replacing(file) as temporary:
            temporary.write_text(comment + tomli_w.dumps(self.to_dict()), encoding="utf-8")
        return file


def _wrong_fields(content: Mapping[str, Any]) -> list[str]:
    """Returns the error of each field of a profile that is missing, unknown or impossible."""
    # In a long period any delay is possible, so that each field is checked independently of the others.
    possible = _core.device.DeviceProfile().to_dict() | {"period_s": 1e9}
    errors = []
    for name in {**content, **possible}:
        fields = {key: value for key, value in possible.items() if key != name}
        if name in content:
            fields[name] = content[name]
        try:
            _core.io.profile_of(fields)
        except ValueError as error:
            errors.append(str(error))
        if len(errors) > _MOST_ERRORS:
            return [*errors[:-1], "and more"]
    return errors


def find_profile(device: _core.device.DeviceProfile | str | os.PathLike[str]) -> _core.device.DeviceProfile:
    """Returns a device from an object, the name of an example profile, or the path of a TOML file.

    Raises
    ------
    InputError
        The value is not a device; the message names the argument, or file and field.
    """
    if isinstance(device, _core.device.DeviceProfile):
        return device
    if not isinstance(device, (str, os.PathLike)):
        raise InputError(
            f"device is a {type(device).__name__}: must be a DeviceProfile, the path of its TOML file, or "
            f"one of the examples {_example_names()}"
        )
    file = profile_file(os.fspath(device))
    if not file.exists() and file == Path(file.name) and not file.suffix:
        raise InputError(
            f"device is '{device}': must be the path of an existing TOML file, or one of the examples "
            f"{_example_names()}"
        )
    return DeviceProfile.load(file)


def step_cure(model: Model) -> str:
    """Returns how to identify a model whose positions are counts, in the unit that suits its force."""
    step, steps = (
        ("mm/35", "35 steps a mm") if model.units["force"] == "N" else ("rev/4096", "4096 steps a turn")
    )
    word = command_word(f"{model.data.columns.get('position', 'NAME')}={step}")
    return f"identify it with the step of the encoder: --units {word} for {steps}"


def require_unit(device: _core.device.DeviceProfile, model: Model) -> None:
    """Refuses a device that moves in another unit than a model. The unit of a model can be empty."""
    unit = model.units["position"]
    if unit not in ("", device.position_unit):
        cure = f"the example profiles in {unit} are {_example_names(unit)}"
        if unit == "count":
            cure = step_cure(model)
        raise InputError(
            f"position_unit of the device {device.id} is {device.position_unit}: must be {unit}, the "
            f"position unit of the model; {cure}"
        )


def require_profile(name: str, unit: str) -> Path:
    """Returns the file or example profile of this name; the message of a refusal names the examples in the
    unit of a model."""
    file = profile_file(name)
    if not file.exists():
        raise InputError(
            f"there is no file {name}, and no example profile of this name; the examples for a model with "
            f"positions in {unit or 'any unit'} are {_example_names(unit)}"
        )
    return file


def _example_names(unit: str = "") -> str:
    """Returns the names of the example profiles with positions in a unit; of all examples without a unit."""
    usable = (
        name
        for name, (file, _) in example_profiles().items()
        if unit in ("", DeviceProfile.load(file).position_unit)
    )
    return ", ".join(usable) or "none"
