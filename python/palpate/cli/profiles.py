# SPDX-License-Identifier: Apache-2.0
"""Option --device of the verbs that make a plan: the profile of a device, or the name of an example."""

from __future__ import annotations

import click
from click.shell_completion import CompletionItem

from ..errors import InputError
from ..model import Model
from ..planning import DeviceProfile, example_profiles, profile_file
from .completion import files_with


class ProfileName(click.ParamType[str]):
    """Value of --device in a verb that makes a plan: a file, or the name of an example profile."""

    name = "PROFILE.toml"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Returns the examples and the files that complete a name."""
        names = [CompletionItem(name) for name in example_profiles() if name.startswith(incomplete)]
        return names or files_with((".toml",), incomplete)


def device_for(model: Model, name: str) -> DeviceProfile:
    """Returns the device profile of this file or example.

    Raises
    ------
    InputError
        There is no such file or example, the file is not a profile, or the device moves in another
        unit than the model. The message names the examples that can be used.
    """
    unit = model.units["position"]
    examples = {each: DeviceProfile.load(file) for each, (file, _) in example_profiles().items()}
    usable = ", ".join(each for each, profile in examples.items() if unit in ("", profile.position_unit))
    file = profile_file(name)
    if not file.exists():
        raise InputError(
            f"there is no file {name}, and no example profile of this name; the examples for a model with "
            f"positions in {unit or 'any unit'} are {usable or 'none'}"
        )
    profile = DeviceProfile.load(file)
    if unit not in ("", profile.position_unit):
        raise InputError(
            f"position_unit of the device {profile.id} is {profile.position_unit}: must be {unit}, the "
            f"position unit of the model; the example profiles in {unit} are {usable or 'none'}"
        )
    return profile
