# SPDX-License-Identifier: Apache-2.0
"""DeviceProfile: what is known of a haptic device, and its TOML file."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import tomli_w

from .. import _core
from ..errors import InputError
from ..model.certified import device_record
from ..recording.files import replacing, require_file

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

EXAMPLES = Path(__file__).parent / "profiles"
"""Profiles of published devices, each with its sources in the comment at its top."""


def example_profiles() -> dict[str, tuple[Path, tuple[str, ...]]]:
    """The example profiles: name -> file, and the paragraphs that say where its numbers are from."""
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
    """The file of this name where there is one, else the example of this name."""
    file, example = Path(name), EXAMPLES / f"{name}.toml"
    return example if not file.exists() and example.exists() else file


class DeviceProfile(_core.DeviceProfile):
    """What is known of a haptic device of one degree of freedom; SI units, rotary or linear.

    ``b`` and ``f_c`` are what the mechanism itself brakes with: a certificate spends them. Where one of them
    is not known, a lower bound is right; where delay, steps or jitter are not known, an upper one.

    Parameters
    ----------
    id : str
        Its name; a certificate holds for the device of this name and these numbers.
    position_unit : {"rad", "m"}
        Forces are then in N*m or N.
    period_s : float
        T, time between two samples [s].
    jitter_s : float
        How much longer than T it can get [s].
    inertia : float
        Of handle and motor [kg*m^2 or kg].
    viscous_damping : float
        b, physical [N*m*s/rad or N*s/m].
    coulomb_friction : float
        f_c, physical [N*m or N].
    encoder_step : float
        Delta [rad or m]; 0 = not quantised.
    force_step : float
        Delta_F, of the command [N*m or N]; 0 = not quantised.
    delay_samples : int
        n_d, whole samples between command and force, 0 to 16.
    force_limit : float
        [N*m or N]

    Raises
    ------
    ValueError
        Naming the field, its value and what would be right.
    """

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> DeviceProfile:
        """Read a profile from a TOML file: every field, and no other.

        Raises
        ------
        InputError
            The file is not there or not TOML, or a field is missing, unknown or impossible: one sentence with
            the file's name, the field and its value.
        """
        file = Path(path)
        require_file(file)
        try:
            content = tomllib.loads(file.read_text(encoding="utf-8"))
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{file} is not TOML: {error}") from None
        except UnicodeDecodeError:
            raise InputError(f"{file} is not TOML: it is not text") from None
        expected = device_record(_core.DeviceProfile())
        for name in content:
            if name not in expected:
                raise InputError(f"{file}: {name} is not a field of a device profile")
        for name, example in expected.items():
            if name not in content:
                raise InputError(f"{file}: {name} is missing")
            content[name] = _typed(file, name, content[name], example)
        try:
            return cls(**content)
        except ValueError as error:
            raise InputError(f"{file}: {error}") from None

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the profile as a TOML file; it appears under its name only when it is complete."""
        with replacing(Path(path)) as temporary:
            temporary.write_text(tomli_w.dumps(device_record(self)), encoding="utf-8")
        return Path(path)


def _typed(file: Path, name: str, value: Any, example: Any) -> Any:
    if isinstance(example, str):
        right, fits = "text", isinstance(value, str)
    elif isinstance(example, int):
        right, fits = "a whole number", isinstance(value, int) and not isinstance(value, bool)
    else:
        right, fits = "a number", isinstance(value, (int, float)) and not isinstance(value, bool)
    if not fits:
        raise InputError(f"{file}: {name} is {value!r}, must be {right}")
    return float(value) if isinstance(example, float) else value
