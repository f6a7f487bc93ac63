# SPDX-License-Identifier: Apache-2.0
"""The one exception of the package: bad input, told in one sentence."""


class InputError(ValueError):
    """Bad input: one sentence that names the file, line or field, the value, and what would be right."""
