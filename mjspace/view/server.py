"""The web server of a view: viser's, behind a check of who asks."""

import contextlib
import hmac
import ipaddress
import logging
import os
import secrets
import socket
from collections.abc import Callable, Iterator
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import viser
import websockets.asyncio.server as sockets
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from mjspace.errors import InputError

LOOPBACK = "127.0.0.1"
_HERE = {"localhost", "127.0.0.1", "::1"}
"""Names of this machine that a browser may have asked for: under another one it was led here."""

_EVERYWHERE = {"0.0.0.0", "::"}
"""Every address of this machine, and none that a browser can open."""


class Server(viser.ViserServer):
    """A viser server that never opens a tunnel to another machine, whatever a browser asks for."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse."""


class Guard:
    """Decides which requests are answered: those of our own page, with the token where one is due.

    A page of another site can make a browser connect to this machine as well. It is told by its
    ``Origin``, and where its name was made to lead here by its ``Host``.
    """

    def __init__(self, token: str | None) -> None:
        """Demand the ``token``; None: only that the request is for this machine itself."""
        self._token = token

    def refusal(self, path: str, headers: Headers) -> str | None:
        """Return why a request for ``path`` is refused; None where it is answered."""
        host = headers.get("Host", "")
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return "a page of another site asks"
        if self._token is None:
            return None if _name_of(host) in _HERE else f"the host is not {LOOPBACK}"
        given = _token_in(path) or _token_of_cookie(headers, cookie_name(host))
        if given is None or not hmac.compare_digest(given.encode(), self._token.encode()):
            return "the token is missing or wrong: open the address that mjspace view printed"
        return None

    def seal(self, headers: Headers, request: Request) -> None:
        """Add to an answer's ``headers`` what keeps the token, and other sites out."""
        headers["X-Frame-Options"] = "DENY"
        headers["Referrer-Policy"] = "no-referrer"
        if self._token is not None and _token_in(request.path):
            name = cookie_name(request.headers.get("Host", ""))
            headers["Set-Cookie"] = f"{name}={self._token}; HttpOnly; SameSite=Strict; Path=/"


def cookie_name(host: str) -> str:
    """Return the name of the cookie that has the token: cookies do not differ by port."""
    return f"mjspace_{host.rpartition(':')[2]}"


@contextlib.contextmanager
def serving(host: str, port: int, label: str) -> Iterator[tuple[Server, str]]:
    """Yield a server and the address to open.

    On loopback it answers this machine's own pages alone; on another ``host`` those alone that
    know a token, which is in the address. ``port`` 0 is any that is free.

    Raises:
        InputError: nothing can be served on that host and port.
    """
    # Who connects and says nothing, as a browser does for later, is no error of ours.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    token = None if is_loopback(host) else secrets.token_urlsafe(16)
    with _refuse_taken(host, port), _guarded(Guard(token)) as guarded, _quiet():
        server = Server(host=host, port=port, label=label, verbose=False)
    try:
        if not guarded:
            raise RuntimeError("this version of viser serves otherwise: its requests are unchecked")
        name = socket.gethostname() if host in _EVERYWHERE else host
        shown = f"[{name}]" if ":" in name else name
        secret = f"/?token={token}" if token else ""
        yield server, f"http://{shown}:{server.get_port()}{secret}"
    finally:
        with _quiet():
            server.stop()


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine, seen by itself alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@contextlib.contextmanager
def _refuse_taken(host: str, port: int) -> Iterator[None]:
    # viser would go on to the next port, or to none at all, without a word.
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind((host, port))
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--host {host} --port {port}: cannot be served on: {reason}") from error
    yield


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[list[bool]]:
    """Let servers that are begun within check their requests; the list has an entry for each.

    viser has no place for a check of its own, and websockets takes it when a server begins.
    """
    plain, begun = sockets.serve, list[bool]()

    def serve(handler: Any, *arguments: Any, process_request: Any, **options: Any) -> Any:
        begun.append(True)
        checked = _checked(guard, process_request)
        return plain(handler, *arguments, process_request=checked, **options)

    sockets.serve = serve  # type: ignore[assignment, misc]
    try:
        yield begun
    finally:
        sockets.serve = plain  # type: ignore[misc]


def _checked(
    guard: Guard, process: Callable[[Any, Request], Response | None]
) -> Callable[[Any, Request], Response | None]:
    def checked(connection: Any, request: Request) -> Response | None:
        if (why := guard.refusal(request.path, request.headers)) is not None:
            answer: Response = connection.respond(HTTPStatus.FORBIDDEN, f"mjspace: {why}\n")
            return answer
        response = process(connection, request)
        if response is not None:
            guard.seal(response.headers, request)
        return response

    return checked


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser's own words off the terminal: it names addresses without the token."""
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stdout(nowhere):
        yield


def _name_of(host: str) -> str:
    return (urlsplit(f"//{host}").hostname or "").lower()


def _token_in(path: str) -> str | None:
    return next(iter(parse_qs(urlsplit(path).query).get("token", [])), None)


def _token_of_cookie(headers: Headers, name: str) -> str | None:
    try:
        found = SimpleCookie(headers.get("Cookie", "")).get(name)
    except CookieError:
        return None
    return None if found is None else found.value
