"""Who is answered by the server of a view."""

import http.client
import socket
from collections.abc import Iterator
from contextlib import closing
from urllib.parse import urlsplit

import pytest
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from mjspace.errors import InputError
from mjspace.view.server import Guard, is_loopback, serving

VISER = Subprotocol("viser-v0")  # of another version: what is let in is told so and closed


@pytest.fixture(scope="module")
def local() -> Iterator[str]:
    """The address of a server on loopback."""
    with serving("127.0.0.1", 0, "test") as (_, address):
        yield address


@pytest.fixture(scope="module")
def exposed() -> Iterator[str]:
    """The address, with its token, of a server on every interface."""
    with serving("0.0.0.0", 0, "test") as (_, address):
        place = urlsplit(address)
        assert place.hostname == socket.gethostname().lower()
        yield f"http://127.0.0.1:{place.port}/?{place.query}"


def status(address: str, path: str = "/", **headers: str) -> tuple[int, dict[str, str]]:
    """Return the status and the headers of the answer to a GET."""
    place = urlsplit(address)
    connection = http.client.HTTPConnection(place.hostname or "", place.port, timeout=20)
    connection.request("GET", path, headers=headers)
    with closing(connection), connection.getresponse() as answer:
        answer.read()
        return answer.status, dict(answer.getheaders())


def test_this_machine_is_answered_without_a_token(local: str) -> None:
    assert "token" not in local
    code, headers = status(local)
    assert code == 200
    assert "Set-Cookie" not in headers
    assert headers["X-Frame-Options"] == "DENY"


@pytest.mark.parametrize(
    "headers", [{"Host": "evil.example"}, {"Host": "evil.example:80"}, {"Host": ""}]
)
def test_a_name_that_was_made_to_lead_here_is_refused(local: str, headers: dict[str, str]) -> None:
    assert status(local, **headers)[0] == 403


def test_a_page_of_another_site_cannot_connect(local: str) -> None:
    socket_address = local.replace("http", "ws")
    with pytest.raises(InvalidStatus, match="403"):
        connect(socket_address, origin="http://evil.example", subprotocols=[VISER])
    with connect(socket_address, origin=local, subprotocols=[VISER]):
        pass


def test_another_address_demands_the_token_that_is_printed(exposed: str) -> None:
    path = f"/?{urlsplit(exposed).query}"
    assert status(exposed)[0] == 403
    assert status(exposed, path[:-1])[0] == 403
    code, headers = status(exposed, path)
    assert code == 200
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert "HttpOnly" in headers["Set-Cookie"]
    assert status(exposed, Cookie=cookie)[0] == 200
    plain = exposed.partition("/?")[0].replace("http", "ws")
    with pytest.raises(InvalidStatus, match="403"):
        connect(plain, subprotocols=[VISER])
    with connect(plain, subprotocols=[VISER], additional_headers={"Cookie": cookie}):
        pass


@pytest.mark.parametrize("token", ["", "x\u00e9", "secre", "secrets"])
def test_a_wrong_token_is_refused(token: str) -> None:
    assert Guard("secret").refusal(f"/?token={token}", Headers(Host="a:1"))


@pytest.mark.parametrize(
    ("host", "alone"),
    [("127.0.0.1", True), ("127.1.2.3", True), ("::1", True), ("localhost", True),
     ("0.0.0.0", False), ("192.168.0.4", False), ("example.org", False)],
)  # fmt: skip
def test_only_loopback_goes_without_a_token(host: str, alone: bool) -> None:
    assert is_loopback(host) == alone


def test_a_taken_port_and_another_machine_are_refused_in_one_line() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"--port {port}.*in use"):
            serving("127.0.0.1", port, "test").__enter__()
    with pytest.raises(InputError, match=r"--host 192\.0\.2\.1 .*Cannot assign"):
        serving("192.0.2.1", 0, "test").__enter__()


def test_no_browser_makes_it_open_a_tunnel(local: str) -> None:
    with serving("127.0.0.1", 0, "test") as (server, _):
        server.request_share_url()
        assert server._share_tunnel is None
