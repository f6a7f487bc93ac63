# SPDX-License-Identifier: Apache-2.0
"""Server of the page: listens on 127.0.0.1 only, and answers only requests that know its token.

The token is a part of every address. A page from elsewhere does not know it, and requests with another origin
or another host name are refused, so that such a page cannot start anything.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import secrets
import threading
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from typing import Any
from urllib.parse import quote

import click

from ..errors import InputError
from .session import File, Session, StoppedError, sentence_of
from .view import View

ADDRESS = "127.0.0.1"

MOST_BYTES = 2**31
"""Largest size of a file that is dropped on the page [bytes]"""

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; form-action 'none'; base-uri 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Headers of every answer: the page loads nothing from elsewhere, and no other page may show it."""


def serve(
    session: Session, *, port: int = 0, idle_s: float = float("inf"), opened: Callable[[str, str], None]
) -> None:
    """Serves the page until it is interrupted, or no page was open for `idle_s` [s].

    Parameters
    ----------
    session : Session
    port : int
        Port on 127.0.0.1; 0 takes a free one.
    idle_s : float
        Time without a request after which the server ends [s].
    opened : function of two addresses
        Called when the server listens, with the address of the page, and one that leads there once: other
        users can read it in the command line of the browser.

    Raises
    ------
    InputError
        Bokeh is not installed, or the port is in use.
    """
    asyncio.run(_serve(session, port, idle_s, opened))


async def _serve(session: Session, port: int, idle_s: float, opened: Callable[[str, str], None]) -> None:
    try:
        from tornado.httpserver import HTTPServer
        from tornado.netutil import bind_sockets
        from tornado.web import Application
    except ImportError:
        raise InputError("the app needs bokeh: install it with pip install 'palpate[report]'") from None
    token = secrets.token_urlsafe(24)
    try:
        sockets = bind_sockets(port, ADDRESS)
    except OSError as error:
        raise InputError(f"port {port} of {ADDRESS} cannot be used: {error.strerror}") from None
    port = sockets[0].getsockname()[1]
    server = Server(session, token, f"{ADDRESS}:{port}")
    application = Application([(r"/([^/]*)/(.*)", _handler(server))], log_function=lambda handler: None)
    http = HTTPServer(application, max_body_size=MOST_BYTES, max_buffer_size=MOST_BYTES)
    http.add_sockets(sockets)
    try:
        opened(*(f"http://{ADDRESS}:{port}/{each}/" for each in (token, server.once)))
        while time.monotonic() - server.last_request_s < idle_s:
            await asyncio.sleep(min(0.1, idle_s))
    finally:
        http.stop()
        session.live.stop()


class Server:
    """What all requests share."""

    def __init__(self, session: Session, token: str, host: str) -> None:
        self.session, self.token, self.host = session, token, host
        self.view = View(session)
        self.last_request_s = time.monotonic()
        self.once = secrets.token_urlsafe(24)
        """Token that leads to the page; it is valid for the first request only"""

    def redeems(self, token: str) -> bool:
        """Returns True for the first request with the token that is valid once."""
        is_valid = hmac.compare_digest(token.encode(), self.once.encode())
        if is_valid:
            self.once = secrets.token_urlsafe(24)
        return is_valid

    def knows(self, token: str) -> bool:
        """Returns True for the token of the page."""
        return hmac.compare_digest(token.encode(), self.token.encode())

    def is_own(self, host: str, origin: str | None) -> bool:
        """Returns True for a request to this computer that no page from elsewhere sent."""
        return host == self.host and origin in (None, f"http://{self.host}")

    def answer(self, work: Callable[[], None], known: Collection[str] = ()) -> dict[str, Any]:
        """Does some work and returns the parts of the page, without the charts that it knows.

        A refusal of the work is one of the parts. Work that the user stops leaves the state before it.
        """
        with self.session.lock:
            message = ""
            try:
                work()
            except (ValueError, click.ClickException, OSError) as error:
                message = sentence_of(error)
            while True:
                try:
                    return self.view.answer(known, message)
                except StoppedError as stopped:
                    self.session.undo()
                    message = str(stopped)

    def acted(self, body: bytes) -> dict[str, Any]:
        """Does the action in the body of a request and returns the parts of the page."""
        given = json.loads(body)
        return self.answer(lambda: self.session.act(given["action"], given["given"]), given["known"])

    def added(self, name: str, content: bytes) -> dict[str, Any]:
        """Adds a file and returns the parts of the page."""
        return self.answer(lambda: self.session.add_file(name, content))

    def stopped(self) -> dict[str, str]:
        """Stops the device; returns the refusal, which is empty if it has ended."""
        try:
            self.session.live.stop()
        except InputError as error:
            return {"refused": sentence_of(error)}
        return {"refused": ""}

    def identification_stopped(self) -> dict[str, str]:
        """Stops a running identification; the request that waits for it answers the page."""
        self.session.command_line.stop_identification()
        return {}

    def exported(self, kind: str) -> File:
        """Returns a file for the downloads of the browser."""
        with self.session.lock:
            return self.session.exported(kind)


def _handler(server: Server) -> Any:
    """Returns the class that handles requests."""
    from tornado.web import HTTPError, RequestHandler

    texts = {
        "": ("text/html", server.view.page),
        "style.css": ("text/css", server.view.style),
        "script.js": ("text/javascript", server.view.script),
        "library.js": ("text/javascript", server.view.library),
        "pulse": ("application/json", lambda: json.dumps(server.view.ticked())),
    }

    class Handler(RequestHandler):
        """Answers a request of the page."""

        def set_default_headers(self) -> None:
            for name, value in _HEADERS.items():
                self.set_header(name, value)

        def prepare(self) -> None:
            token = self.request.path.split("/")[1]
            is_own = server.is_own(self.request.host, self.request.headers.get("Origin"))
            if is_own and server.redeems(token):
                self.redirect(f"/{server.token}/")
                return
            if not is_own or not server.knows(token):
                raise HTTPError(403)
            server.last_request_s = time.monotonic()

        async def get(self, token: str, path: str) -> None:
            if path.startswith("file/"):
                await self._download(path.removeprefix("file/"))
            elif path in texts:
                kind, text = texts[path]
                self.set_header("Content-Type", f"{kind}; charset=utf-8")
                self.finish(text())
            else:
                raise HTTPError(404)

        async def post(self, token: str, path: str) -> None:
            body = self.request.body
            if path == "add":
                name = self.get_query_argument("name")
                self.finish(await in_thread(lambda: server.added(name, body)))
            elif path == "stop":  # does not wait for other work
                self.finish(await in_thread(server.stopped))
            elif path == "stop-identification":
                self.finish(server.identification_stopped())
            elif path == "start":
                device = self.get_query_argument("device")
                self.finish(await in_thread(lambda: server.answer(lambda: server.session.start(device))))
            elif path == "act":
                self.finish(await in_thread(lambda: server.acted(body)))
            else:
                raise HTTPError(404)

        async def _download(self, kind: str) -> None:
            try:
                file = await in_thread(lambda: server.exported(kind))
            except (ValueError, OSError) as error:
                self.set_status(409)
                self.finish(sentence_of(error))
                return
            self.set_header("Content-Type", "application/octet-stream")
            self.set_header("X-Name", quote(file.name))
            self.finish(file.content)

        def write_error(self, status_code: int, **given: Any) -> None:
            """Answers a request that failed with one sentence."""
            error = given.get("exc_info", (None, None))[1]
            if error is not None and not isinstance(error, HTTPError):
                self.finish(f"this is a defect of palpate, please report it: {type(error).__name__}: {error}")
            else:
                self.finish(f"the request is refused ({status_code}): use the page of palpate app")

        def log_exception(self, *error: Any) -> None:
            """Prints nothing for a refused request; the answer states the reason."""
            if not issubclass(error[0], HTTPError):
                super().log_exception(*error)

    return Handler


async def in_thread(work: Callable[[], Any]) -> Any:
    """Returns the result of some work in a thread that does not delay the end of the program."""
    loop = asyncio.get_running_loop()
    done = loop.create_future()

    def run() -> None:
        try:
            finish, value = done.set_result, work()
        except Exception as error:
            finish, value = done.set_exception, error
        with suppress(RuntimeError):  # the server has ended
            loop.call_soon_threadsafe(lambda: None if done.done() else finish(value))

    threading.Thread(target=run, daemon=True).start()
    return await done
