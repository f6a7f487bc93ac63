# SPDX-License-Identifier: Apache-2.0
"""The server of the page answers only its own page, and writes only into its folder."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from palpate.app.server import Server
from palpate.app.session import Session
from palpate.cli.app import CommandLine
from palpate.recording.sample import sample_recording


class Served:
    """A running palpate app."""

    def __init__(self, process: subprocess.Popen[str], address: str) -> None:
        self.process, self.address = process, urlsplit(address)

    def request(
        self,
        method: str,
        path: str = "",
        body: bytes | None = None,
        headers: Mapping[str, str] | None = None,
        *,
        token: str | None = None,
    ) -> tuple[int, bytes, Mapping[str, str]]:
        """Returns status, content and headers of an answer."""
        assert self.address.hostname is not None
        connection = HTTPConnection(self.address.hostname, self.address.port)
        folder = self.address.path if token is None else f"/{token}/"
        with closing(connection):
            connection.request(method, folder + path, body, dict(headers or {}))
            answer = connection.getresponse()
            return answer.status, answer.read(), dict(answer.getheaders())

    def act(self, action: str, **given: object) -> dict[str, str]:
        """Does an action and returns the parts of the page."""
        body = json.dumps({"action": action, "given": given, "known": []}).encode()
        parts: dict[str, str] = json.loads(self.request("POST", "act", body)[1])["parts"]
        return parts


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("temporary")
    command = [sys.executable, "-m", "palpate", "app", "--no-browser", "--json"]
    environment = {**os.environ, "TMPDIR": str(folder)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        address = json.loads(process.stdout.readline())["address"]
        yield Served(process, address)
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
    assert list(folder.iterdir()) == []


def test_the_address_is_local_and_has_a_long_token(served: Served) -> None:
    assert served.address.hostname == "127.0.0.1"
    assert len(served.address.path.strip("/")) >= 32


def test_the_address_that_the_browser_gets_leads_to_the_page_only_once() -> None:
    server = Server(Session(Path(), CommandLine()), "token", "127.0.0.1:1")
    once = server.once
    assert not server.redeems("another")
    assert not server.redeems("token")
    assert server.redeems(once)
    assert not server.redeems(once)


@pytest.mark.parametrize("path", ["", "script.js", "library.js", "pulse", "file/model"])
def test_a_request_without_the_token_is_refused(path: str, served: Served) -> None:
    assert served.request("GET", path, token="x" * 32)[0] == 403


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://example.org"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Host": "example.org"},
        {"Host": "localhost"},
    ],
    ids=str,
)
@pytest.mark.parametrize("path", ["act", "add?name=x.csv", "start?device=simulated", "stop"])
def test_a_request_from_elsewhere_is_refused_even_with_the_token(
    path: str, headers: dict[str, str], served: Served
) -> None:
    body = json.dumps({"action": "refresh", "given": {}, "known": []}).encode()
    assert served.request("POST", path, body, headers)[0] == 403


def test_the_page_loads_nothing_from_elsewhere_and_no_other_page_shows_it(served: Served) -> None:
    status, _, headers = served.request("GET")
    assert status == 200
    policy = headers["Content-Security-Policy"]
    for rule in ("default-src 'none'", "connect-src 'self'", "frame-ancestors 'none'"):
        assert rule in policy
    assert headers["Referrer-Policy"] == "no-referrer"


@pytest.mark.parametrize(
    "name", ["../../above.csv", "/etc/root.csv", "..%5C..%5Cother.csv", ".hidden.csv", "-option.csv"]
)
def test_a_dropped_file_stays_in_the_folder(name: str, served: Served) -> None:
    _, content, _ = served.request("POST", f"add?name={name}", b"position_m,force_N\n")
    plain = re.split(r"[/.-]|%5C", name)[-2]
    assert f">{plain}.csv</button>" in json.loads(content)["parts"]["objects"]


def test_a_file_with_a_used_name_and_another_content_gets_a_number(served: Served) -> None:
    served.request("POST", "add?name=twice.csv", b"position_m,force_N\n1,2\n")
    _, content, _ = served.request("POST", "add?name=twice.csv", b"position_m,force_N\n3,4\n")
    assert "twice_2.csv" in json.loads(content)["parts"]["objects"]
    _, content, _ = served.request("POST", "add?name=twice.csv", b"position_m,force_N\n1,2\n")
    assert "twice_3.csv" not in json.loads(content)["parts"]["objects"]


@pytest.mark.parametrize(
    ("action", "given", "sentence"),
    [
        ("explode", {}, "There is no action"),
        ("cure", {"words": ["--plot", "x.png"]}, "is not an option of palpate identify or palpate plan"),
        ("cure", {"words": ["-o", "/etc/passwd"]}, "is not an option of palpate identify or palpate plan"),
        ("mark-course", {"kind": "rows", "from": "a", "to": "2"}, "must be"),
        pytest.param("identify", {"more": 1}, "", marks=pytest.mark.full),
    ],
)
def test_a_wrong_action_is_refused_with_a_sentence(
    action: str, given: dict[str, object], sentence: str, served: Served, tmp_path: Path
) -> None:
    rows = "\n".join(f"{0.001 * k},{k}" for k in range(60))
    served.request("POST", "add?name=line.csv", f"position_m,force_N\n{rows}\n".encode())
    assert sentence in served.act(action, **given)["message"]


def test_a_download_that_cannot_be_made_is_refused_with_a_sentence(served: Served) -> None:
    served.request("POST", "add?name=none.csv", b"position_m,force_N\n1,2\n")
    status, content, _ = served.request("GET", "file/header")
    assert (status, content.decode()) == (409, "there is no model yet: identify one")


class Impatient(CommandLine):
    """Stops an identification at its first report of progress, a given number of times."""

    stops = 1

    def __setattr__(self, name: str, value: object) -> None:
        super().__setattr__(name, value)
        if name == "progress" and value and self.stops:
            self.stops -= 1
            self.stop_identification()


def test_a_stopped_identification_leaves_the_page_as_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    sample_recording(seed=1, duration_s=0.5).write("knob.csv")
    server = Server(Session(tmp_path, Impatient()), "token", "127.0.0.1:1")
    server.added("knob.csv", Path("knob.csv").read_bytes())
    before = server.session.state
    identify = json.dumps({"action": "identify", "given": {"more": 1}, "known": []}).encode()
    stopped = server.acted(identify)["parts"]
    assert "The identification was stopped" in stopped["message"]
    assert server.session.state == before
    assert server.session.command_line.progress == ""
    assert "wavelets" in server.acted(identify)["parts"]["model"]
