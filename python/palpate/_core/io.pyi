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
    Checks the content of a model file and recomputes its certificate. ValueError names the path of the
    first wrong field, its value and the correct ones.
    """
def checked_certificate(model: palpate._core.model.ForceModel, plan: typing.Any, certificate: typing.Any) -> palpate._core.stability.Certificate:
    """
    Returns the certificate of a model file after recomputing it from the rendered model. ValueError
    names the field that differs, its value and the correct one.
    """
def profile_of(content: typing.Any) -> palpate._core.device.DeviceProfile:
    """
    Returns the device profile in the content of a file. ValueError names the first wrong field, its
    value and the correct ones.
    """
def read_json(path: str) -> typing.Any:
    """
    Returns the content of a JSON file. ValueError has one sentence that begins with the name of the file.
    """
def scheme_of(plan: typing.Any) -> palpate._core.rendering.Scheme:
    """
    Returns the scheme of the plan of a model file.
    """
