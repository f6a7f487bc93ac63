# SPDX-License-Identifier: Apache-2.0
"""Option --device of the verbs that make a plan: the profile of a device, or the name of an example."""

from __future__ import annotations

import click
from click.shell_completion import CompletionItem

from ..model import Model
from ..planning import DeviceProfile, example_profiles
from ..planning.device_profile import require_profile
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
        There is no such file or example, or the file is not a profile.
    """
    return DeviceProfile.load(require_profile(name, model.units["position"]))
