# SPDX-License-Identifier: Apache-2.0
"""Python decoder of the device's GET_INFO answer: SI units, and errors that name the wrong field."""

from __future__ import annotations

import struct
from typing import Any

import pytest

from palpate import InputError
from palpate._core.device import decode_info, decode_model

VALID_FIELDS: dict[str, Any] = {
    "magic": ord("I"),
    "version": 1,
    "firmware": 0x0203,
    "counts": 4096,
    "torque": 250_000,
    "rate": 1000,
    "watchdog": 20,
    "capabilities": 1,
    "in_size": 32,
    "out_size": 16,
    "dof": 1,
    "reserved": 0,
    "uid": 7,
}


def info(**changed: Any) -> bytes:
    return struct.pack("<BBHIiHHIBBBBQ", *{**VALID_FIELDS, **changed}.values())


def test_the_identity_of_a_device_is_decoded_in_si_units() -> None:
    read = decode_info(info())
    assert (read["max_torque"], read["rate_hz"], read["watchdog_ms"]) == (0.25, 1000, 20)
    assert read["encoder_step"] == pytest.approx(2 * 3.14159265358979 / 4096)
    assert (read["transducer"], read["measures_velocity"]) == (True, False)


@pytest.mark.parametrize("size", [0, 31, 33])
def test_an_answer_of_another_size_is_refused(size: int) -> None:
    with pytest.raises(InputError, match=f"has {size} bytes, must have 32"):
        decode_info(bytes(size))


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"magic": ord("H")}, "begins with 0x48, must begin with 'I'"),
        ({"version": 2}, "version is 2, must be 1"),
        ({"in_size": 64}, "in_size is 64, must be 32"),
        ({"out_size": 0}, "out_size is 0, must be 16"),
        ({"dof": 3}, "dof is 3, must be 1"),
        ({"reserved": 1}, "the reserved byte is 1, must be 0"),
        ({"capabilities": 4}, "the value of undefined capability bits is 4, must be 0"),
        ({"counts": 0}, "counts_per_rev is 0, must be > 0"),
        ({"torque": -1}, "max_torque_uNm is -1, must be > 0"),
        ({"rate": 0}, "rate_hz is 0, must be > 0"),
        ({"watchdog": 0}, "watchdog_ms is 0, must be > 0"),
    ],
)
def test_an_invalid_field_is_refused_by_name(changed: dict[str, int], sentence: str) -> None:
    with pytest.raises(InputError, match="the answer to GET_INFO") as caught:
        decode_info(info(**changed))
    assert sentence in str(caught.value)


def test_the_model_of_a_device_is_decoded() -> None:
    answer = struct.pack("<QQIBBBB", 0x0123456789ABCDEF, 0xFEDC, 40_000, 1, 0, 0, 0)
    assert decode_model(answer) == {
        "fingerprint": "0123456789abcdef",
        "certificate": "000000000000fedc",
        "rate_hz": 40_000,
        "is_rendered": True,
    }


@pytest.mark.parametrize(
    ("answer", "sentence"),
    [
        (bytes(16), "the answer to GET_MODEL has 16 bytes, must have 24"),
        (bytes(24), "rate_hz is 0, must be > 0"),
        (struct.pack("<QQIBBBB", 1, 1, 1, 2, 0, 0, 0), "renderer is 2, must be 0 or 1"),
        (struct.pack("<QQIBBBB", 1, 1, 1, 1, 1, 0, 0), "renderer is 257, must be 0 or 1"),
    ],
)
def test_an_invalid_answer_to_get_model_is_refused(answer: bytes, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        decode_model(answer)
