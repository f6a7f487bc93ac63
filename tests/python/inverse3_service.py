# SPDX-License-Identifier: Apache-2.0
"""Small server of the documented messages of the Haply Inverse Service, with a hand on the handle.

It sends one state for each received message. A message is one millisecond of the plant, so that the speed of
the machine has no effect. Unknown keys are silently ignored, as in the service.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Thread
from typing import Any

import websockets
from websockets.sync.server import ServerConnection, serve

STEP_S = 1e-3


@dataclass
class Service:
    """Simulated server of an Inverse3: handle, hand, received commands; a fault occurs at message `after`."""

    devices: int = 1
    device_id: str = "049D"
    calibrated: bool = True
    force_key: str = "vector"
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
    extra_after: int | None = None
    extra_states: int = 0
    silent_after: int | None = None
    messages: list[dict[str, Any]] = field(default_factory=list)
    forces: list[dict[str, float]] = field(default_factory=list)
    positions: list[float] = field(default_factory=list)
    closed: bool = False
    close_code: int | None = None
    port: int = 0

    def answer(self, connection: ServerConnection) -> None:
        position, velocity = self.start, 0.0
        connection.send(
            json.dumps({"session_id": 7, **self.state_message(position, velocity, {}, with_config=True)})
        )
        try:
            for number, text in enumerate(connection):
                message = json.loads(text)
                self.messages.append(message)
                command = message["inverse3"][0]["commands"]["set_cursor_force"]
                force = command.get(self.force_key, {"x": 0.0, "y": 0.0, "z": 0.0})
                self.forces.append(force)
                lead = 0.5 * self.sweep * (1.0 - math.cos(2.0 * math.pi * number * STEP_S))
                hand = self.hand_stiffness * (self.start + lead - position)
                for _ in range(10):
                    push = hand + force["z"] - self.damping * velocity
                    velocity += 0.1 * STEP_S * push / self.mass
                    position += 0.1 * STEP_S * velocity
                self.positions.append(position)
                if self.close_after == number:
                    return
                if self.silent_after is not None and number >= self.silent_after:
                    continue
                first = number + 1 if self.garbage_after is None else self.garbage_after
                if first <= number < first + self.garbage_messages:
                    connection.send("{")
                    continue
                if self.renamed_after == number:
                    self.device_id = "0000"
                for _ in range(self.extra_states if self.extra_after == number else 0):
                    connection.send(json.dumps(self.state_message(position, velocity, force)))
                unplugged = self.unplug_after is not None and number >= self.unplug_after
                connection.send(
                    json.dumps(self.state_message(position, velocity, force, unplugged=unplugged))
                )
        except websockets.ConnectionClosed:
            pass
        finally:
            self.closed = True
            self.close_code = connection.close_code

    def state_message(
        self,
        position: float,
        velocity: float,
        force: dict[str, float],
        *,
        with_config: bool = False,
        unplugged: bool = False,
    ) -> dict[str, Any]:
        zero_force = {"x": 0.0, "y": 0.0, "z": 0.0}
        device: dict[str, Any] = {
            "device_id": self.device_id,
            "state": {
                "cursor_position": {"x": 0.01, "y": -0.12, "z": position},
                "cursor_velocity": {"x": 0.0, "y": 0.0, "z": velocity},
                "current_cursor_force": {**zero_force, **force},
                "control_domain": "cartesian",
                "control_mode": "force" if force else "idle",
            },
            "status": {"calibrated": self.calibrated},
        }
        if with_config:
            device["config"] = {
                "type": "inverse3",
                "device_info": {"major_version": 7, "minor_version": 4, "id": "049D"},
                "filters": {"force_gate": {"gain": 0.3}, "damping": {"scalar": 0.5}},
            }
        return {"inverse3": [] if unplugged else [device] * self.devices}


@contextmanager
def serving(service: Service) -> Iterator[Service]:
    """Runs the simulated server at a free network port of this machine."""
    with serve(service.answer, "127.0.0.1", 0, compression=None) as server:
        service.port = server.socket.getsockname()[1]
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield service
        finally:
            server.shutdown()
            thread.join()
