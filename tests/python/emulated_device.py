# SPDX-License-Identifier: Apache-2.0
"""Runs an emulated device on a Unix socket, in a test or as a separate program."""

from __future__ import annotations

import contextlib
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from typing import Protocol, TypeVar


class Served(Protocol):
    """Device that answers the messages of one connection."""

    def serve(self, connection: socket.socket) -> None:
        """Answers the messages of one connection until it is closed."""


_Device = TypeVar("_Device", bound=Served)


def _listening(path: Path) -> socket.socket:
    """Returns a listening socket of this name, which exists only after the socket accepts connections."""
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    early = path.with_suffix(".new")
    listening.bind(str(early))
    listening.listen()
    early.rename(path)
    return listening


@contextlib.contextmanager
def emulated(path: Path, device: _Device) -> Iterator[_Device]:
    """Runs a device on a socket of this name as long as the context lasts."""

    def run() -> None:
        with contextlib.suppress(OSError):
            while True:
                device.serve(listening.accept()[0])

    with _listening(path) as listening:
        Thread(target=run, daemon=True).start()
        yield device
        listening.shutdown(socket.SHUT_RDWR)


MOST_BYTES = 8192
"""Number of bytes of the largest message."""


def answer_next(connection: socket.socket, replies: Callable[[bytes], list[bytes]]) -> bool:
    """Answers the next message of a connection; returns False if the connection is closed.

    The message is taken from the socket only after its answers were sent. A program in virtual time waits for
    this, and then knows whether an answer follows.
    """
    message = connection.recv(MOST_BYTES, socket.MSG_PEEK)
    if message:
        for answer in replies(message):
            connection.send(answer)
        connection.recv(MOST_BYTES)
    return bool(message)


def main(device: Served) -> None:
    """Runs a device on the socket that the command line names, until the program is ended."""
    listening = _listening(Path(sys.argv[1]))
    while True:
        device.serve(listening.accept()[0])
