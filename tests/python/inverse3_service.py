# SPDX-License-Identifier: Apache-2.0
"""Small server of the documented messages of the Haply Inverse Service, with a hand on the handle.

It sends one state for each received message. A message is one millisecond of the plant. Unknown keys are
silently ignored, as in the service. The clock of the program under test orders each millisecond of the
server, which then answers all messages that have arrived: no result depends on the speed of the machine.
"""

from __future__ import annotations

import json
import math
import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from select import select
from threading import Thread
from typing import Any

from websockets.frames import Frame
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

STEP_S = 1e-3


@dataclass
class Service:
    """Simulated server of an Inverse3: handle, hand, received commands; a fault occurs at message `after`."""

    devices: int = 1
    device_id: str = "049D"
    calibrated: bool = True
    force_key: str = "vector"
    axis: str = "z"
    """Axis along which the hand moves the handle"""
    force_gate: float | None = 0.3
    added_damping: float | None = 0.5
    directional_damping: dict[str, float] | None = None
    """Filters by which the service changes forces, until the first message sets them; None: not reported"""
    unknown: frozenset[str] = frozenset()
    """Keys of published messages that the service does not know"""
    mass: float = 0.2
    damping: float = 2.0
    hand_stiffness: float = 200.0
    start: float = 0.15
    sweep: float = 0.01
    unplug_after: int | None = None
    close_after: int | None = None
    garbage_after: int | None = None
    garbage_messages: int = 1
    renamed_after: int | None = None
    extra_states: dict[int, int] = field(default_factory=dict)
    """Number of states without a message, sent just before a message arrives"""
    late_answers: dict[int, int | None] = field(default_factory=dict)
    """Number of milliseconds by which the answer to a message is late; None: it is lost"""
    silent_after: int | None = None
    messages: list[dict[str, Any]] = field(default_factory=list)
    forces: list[dict[str, float]] = field(default_factory=list)
    positions: list[float] = field(default_factory=list)
    times: list[int] = field(default_factory=list)
    """Time of each message [ms]"""
    answered: dict[int, int] = field(default_factory=dict)
    """Time at which the answer to a message is sent [ms]"""
    now: int = 0
    """Time of the service [ms]"""
    closed: bool = False
    close_code: int | None = None
    environment: dict[str, str] = field(default_factory=dict)
    """Variables of a program whose clock moves this server"""
    port: int = 0

    def opened(self) -> None:
        """Puts the handle in its first position."""
        self._position, self._velocity = self.start, 0.0
        self._number = -1

    def greeting(self) -> str:
        state = self.state_message({}, with_config=True)
        return json.dumps({"session_id": 7, **state})

    def answers(self, text: str) -> Iterator[tuple[int, str | None]]:
        """Moves the handle for 1 ms, and returns the answers to a message; None ends the connection.

        Each answer has the number of milliseconds by which it is late.
        """
        self._number += 1
        number = self._number
        message = json.loads(text)
        self.messages.append(message)
        (device,) = message["inverse3"]
        if device["device_id"] == self.device_id:
            self._configure(device.get("configure", {}))
        full = "force_render_full_state" in message.get("session", {}).keys() - self.unknown
        command = device["commands"]["set_cursor_force"]
        force = command.get(self.force_key, {"x": 0.0, "y": 0.0, "z": 0.0})
        self.forces.append(force)
        self.times.append(self.now)
        for _ in range(self.extra_states.get(number, 0)):
            yield 0, json.dumps(self.state_message(self.forces[number - 1]))
        lead = 0.5 * self.sweep * (1.0 - math.cos(2.0 * math.pi * number * STEP_S))
        hand = self.hand_stiffness * (self.start + lead - self._position)
        for _ in range(10):
            push = hand + force[self.axis] - self.damping * self._velocity
            self._velocity += 0.1 * STEP_S * push / self.mass
            self._position += 0.1 * STEP_S * self._velocity
        self.positions.append(self._position)
        if self.close_after == number:
            yield 0, None
        if self.silent_after is not None and number >= self.silent_after:
            return
        first = number + 1 if self.garbage_after is None else self.garbage_after
        if first <= number < first + self.garbage_messages:
            yield 0, "{"
            return
        if self.renamed_after == number:
            self.device_id = "0000"
        unplugged = self.unplug_after is not None and number >= self.unplug_after
        late = self.late_answers.get(number, 0)
        if late is not None:
            self.answered[number] = self.now + late
            yield late, json.dumps(self.state_message(force, with_config=full, unplugged=unplugged))

    def _configure(self, settings: dict[str, Any]) -> None:
        known = settings.keys() - self.unknown
        if "force_gate" in known:
            self.force_gate = settings["force_gate"]["gain"]
        if "damping" in known:
            damping = settings["damping"]
            self.added_damping = damping.get("scalar", self.added_damping)
            if "vector" in damping.keys() - self.unknown:
                self.directional_damping = damping["vector"]

    def state_message(
        self, force: dict[str, float], *, with_config: bool = False, unplugged: bool = False
    ) -> dict[str, Any]:
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        device: dict[str, Any] = {
            "device_id": self.device_id,
            "state": {
                "cursor_position": {"x": 0.01, "y": -0.12, "z": 0.1, self.axis: self._position},
                "cursor_velocity": {**zero, self.axis: self._velocity},
                "current_cursor_force": {**zero, **force},
                "control_domain": "cartesian",
                "control_mode": "force" if force else "idle",
            },
            "status": {"calibrated": self.calibrated},
        }
        if with_config:
            filters: dict[str, Any] = {}
            if self.force_gate is not None:
                filters["force_gate"] = {"gain": self.force_gate}
            if self.added_damping is not None:
                filters["damping"] = {"scalar": self.added_damping}
            if self.directional_damping is not None:
                filters["damping"] = {**filters.get("damping", {}), "vector": self.directional_damping}
            device["config"] = {
                "type": "inverse3",
                "device_info": {"major_version": 7, "minor_version": 4, "id": "049D"},
                "filters": filters,
            }
        return {"inverse3": [] if unplugged else [device] * self.devices}


class _Connection:
    """A connection to the server, whose messages wait until the next millisecond."""

    def __init__(self, accepted: socket.socket, service: Service) -> None:
        self.socket, self.service = accepted, service
        accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.protocol = ServerProtocol()
        self.late: list[tuple[int, str]] = []
        service.opened()

    def step(self) -> bool:
        """Answers all messages that have arrived; returns False at the end of the connection."""
        self.service.now += 1
        self.late = [(left - 1, text) for left, text in self.late]
        for _, text in filter(lambda each: each[0] <= 0, self.late):
            self._send_text(text)
        self.late = [each for each in self.late if each[0] > 0]
        over = self._send()
        while not over and select([self.socket], [], [], 0.0)[0]:
            try:
                received = self.socket.recv(65536)
            except ConnectionError:
                received = b""
            if received:
                self.protocol.receive_data(received)
            else:
                self.protocol.receive_eof()
            over = not received
            for event in self.protocol.events_received():
                self._answer(event)
            over = self._send() or over
        if over:
            self.service.closed = True
            received_close = self.protocol.close_rcvd
            self.service.close_code = received_close.code if received_close else None
            self.socket.close()
        return not over

    def _answer(self, event: Any) -> None:
        if isinstance(event, Request):
            self.protocol.send_response(self.protocol.accept(event))
            self.protocol.send_text(self.service.greeting().encode())
        elif isinstance(event, Frame) and event.opcode.name == "TEXT":
            for late, text in self.service.answers(event.data.decode()):
                if text is None:
                    self.protocol.send_close(1000)
                elif late or self.late:  # the answers keep their order
                    self.late.append((max(late, *(left for left, _ in self.late), 0), text))
                else:
                    self._send_text(text)

    def _send_text(self, text: str) -> None:
        if self.protocol.state is State.OPEN:
            self.protocol.send_text(text.encode())

    def _send(self) -> bool:
        """Sends the answers; returns True if they end the connection."""
        for data in self.protocol.data_to_send():
            if data == b"":
                return True
            try:
                self.socket.sendall(data)
            except ConnectionError:
                return True
        return False


def _serve(listener: socket.socket, clock: socket.socket, service: Service) -> None:
    connections: list[_Connection] = []
    while True:
        order, sender = clock.recvfrom(64)
        while select([listener], [], [], 0.0)[0]:
            connections.append(_Connection(listener.accept()[0], service))
        connections = [connection for connection in connections if connection.step()]
        if order == b"end":
            break
        clock.sendto(b"%d" % round(STEP_S * 1e9), sender)
    for connection in connections:
        connection.socket.close()


@contextmanager
def serving(service: Service) -> Iterator[Service]:
    """Runs the simulated server at a free network port of this machine."""
    with (
        tempfile.TemporaryDirectory() as folder,
        socket.create_server(("127.0.0.1", 0)) as listener,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as clock,
    ):
        path = str(Path(folder) / "clock")
        clock.bind(path)
        service.port = listener.getsockname()[1]
        service.environment = {**os.environ, "PALPATE_EMULATOR": path}
        server = Thread(target=_serve, args=(listener, clock, service))
        server.start()
        try:
            yield service
        finally:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
                end.sendto(b"end", path)
            server.join()
