# SPDX-License-Identifier: Apache-2.0
"""
Model files.
"""
from __future__ import annotations
import palpate._core.device
import palpate._core.model
import palpate._core.rendering
import palpate._core.stability
import typing
__all__: list[str] = ['check_model', 'checked_certificate', 'profile_of', 'read_json', 'scheme_of']
def check_model(content: typing.Any) -> None:
    """
    Checks the content of a model file; a certificate is computed again. ValueError: the path of the
    first wrong field, its value, what would be right.
    """
def checked_certificate(model: palpate._core.model.ForceModel, plan: typing.Any, certificate: typing.Any) -> palpate._core.stability.Certificate:
    """
    Certificate of a model file, computed again from the rendered model and found the same. ValueError:
    the field that differs, its value, what would be right.
    """
def profile_of(content: typing.Any) -> palpate._core.device.DeviceProfile:
    """
    Returns the device profile in the content of a file. ValueError names the first wrong field, its
    value and the correct ones.
    """
def read_json(path: str) -> typing.Any:
    """
    Content of a JSON file. ValueError: one sentence that begins with the name of the file.
    """
def scheme_of(plan: typing.Any) -> palpate._core.rendering.Scheme:
    """
    Scheme of the plan of a model file.
    """
