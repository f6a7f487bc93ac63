# SPDX-License-Identifier: Apache-2.0
"""
Model files.
"""
from __future__ import annotations
import os
import palpate._core.device
import palpate._core.model
import palpate._core.rendering
import palpate._core.stability
import pathlib
import typing
__all__: list[str] = ['check_model', 'checked_certificate', 'follow_links', 'largest_json_bytes', 'profile_of', 'read_json', 'scheme_of']
def check_model(content: typing.Any) -> None:
    """
    Checks the content of a model file and computes its certificate again. Raises ValueError with
    the path of the first wrong field, its value and the correct values.
    """
def checked_certificate(model: palpate._core.model.ForceModel, plan: typing.Any, certificate: typing.Any) -> palpate._core.stability.Certificate:
    """
    Computes the certificate of a model file again from the rendered model and returns it. Raises
    ValueError with the field that differs, its value and the correct value.
    """
def follow_links(path: os.PathLike | str | bytes) -> pathlib.Path:
    """
    Returns the file to which a chain of symbolic links leads; the file may be missing. Raises
    InputError if a link in a folder that all users share belongs to another user.
    """
def profile_of(content: typing.Any) -> palpate._core.device.DeviceProfile:
    """
    Returns the device profile in the content of a file. Raises ValueError with the first wrong
    field, its value and the correct values.
    """
def read_json(path: os.PathLike | str | bytes) -> typing.Any:
    """
    Returns the content of a JSON file. Raises ValueError with one sentence that begins with the
    name of the file.
    """
def scheme_of(plan: typing.Any) -> palpate._core.rendering.Scheme:
    """
    Returns the scheme (structure and its numbers) in the plan of a model file. Raises ValueError
    with the first wrong field, its value and the correct values.
    """
largest_json_bytes: int = 8388608
