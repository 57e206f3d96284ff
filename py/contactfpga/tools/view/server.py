"""viser's server with a guard."""

from __future__ import annotations

import contextlib
import dataclasses
import hmac
import io
import ipaddress
import logging
import secrets
import socket
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from contactfpga.errors import ContactFPGAError, MissingExtra, pip_install

if TYPE_CHECKING:
    import viser

TOKEN_BYTES = 16


@dataclasses.dataclass(frozen=True)
class Response:
    status: int
    text: str
    headers: Mapping[str, str] = dataclasses.field(default_factory=dict)


class Guard:
    """Decides whether each request is served, by Host, Origin and token.

    Another site's page can make this browser send requests, even to 127.0.0.1, but can choose neither Host nor Origin,
    and does not know the token. The token is in the first address, then in a cookie, which browsers do not send for
    other sites.
    """

    def __init__(self, host: str, token: str | None = None):
        self.host = host
        self.token = token or secrets.token_urlsafe(TOKEN_BYTES)

    def check(self, path: str, headers: Mapping[str, str], port: int, upgrade: bool) -> Response | None:
        """A refusing answer; None: the request may pass. ``headers``: by name, in any case; ``upgrade``: it requests a
        WebSocket, which carries all reading and pressing.
        """
        host = _one(headers, "Host")
        if not self._is_ours(host, port):
            return Response(403, f"Host {host!r} is not this server's name; use the address that it printed.\n")
        origin = _one(headers, "Origin")
        if (upgrade or origin) and origin != f"http://{host}":
            return Response(403, f"Origin {origin!r} is another page; open the address that the server printed.\n")
        address = urlsplit(path)
        given = parse_qs(address.query).get("token", [""])[0]
        if given and not upgrade:
            return self._welcome(port) if self._is_token(given) else _NO_TOKEN
        return None if self._is_token(_cookie(headers, self.cookie(port))) else _NO_TOKEN

    def page_headers(self, headers: Mapping[str, str]) -> dict[str, str]:
        """Headers of a page: no other page may frame it, and it loads nothing from elsewhere."""
        here = f"ws://{_one(headers, 'Host')}"
        policy = (
            "default-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' data: blob:; "
            f"connect-src 'self' {here} data: blob:; frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
        )
        return {
            "Content-Security-Policy": policy,
            "X-Frame-Options": "DENY",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-store",
        }

    def url(self, port: int) -> str:
        """The address to open, with the token."""
        host = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(self.host, self.host)
        return f"http://{f'[{host}]' if ':' in host and not host.startswith('[') else host}:{port}/?token={self.token}"

    @staticmethod
    def cookie(port: int) -> str:
        """Name of the cookie, by port, as browsers keep one jar for all ports of a host."""
        return f"contactfpga-view-{port}"

    def _is_ours(self, host: str, port: int) -> bool:
        """Whether the browser used a safe host name: another site's name could resolve to 127.0.0.1."""
        try:
            found = urlsplit(f"http://{host}")
            name, given = found.hostname or "", found.port or 80
        except ValueError:
            return False
        if found.netloc != host or "@" in host or given != port:
            return False
        return name in ("localhost", self.host) or _is_address(name)

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())

    def _welcome(self, port: int) -> Response:
        """Lead the browser to the page without the token, by the page itself: a redirect from another site would
        withhold the cookie.
        """
        cookie = f"{self.cookie(port)}={self.token}; HttpOnly; SameSite=Strict; Path=/"
        dark = "matchMedia('(prefers-color-scheme: dark)').matches"
        page = (
            "<!doctype html><title>contactfpga</title>"
            f"<script>location.replace({dark} ? {_DARK!r} : {_PAGE!r})</script>\n"
        )
        return Response(200, page, {**_HEADERS, "Content-Type": "text/html; charset=utf-8", "Set-Cookie": cookie})


_PAGE, _DARK = "/", "/?darkMode"
_HEADERS = {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Frame-Options": "DENY"}
_NO_TOKEN = Response(403, "The token is missing or is another one; open the whole address that the server printed.\n")


def _one(headers: Mapping[str, str], name: str) -> str:
    return next((value for key, value in headers.items() if key.lower() == name.lower()), "")


def _cookie(headers: Mapping[str, str], name: str) -> str:
    try:
        found = SimpleCookie(_one(headers, "Cookie")).get(name)
    except CookieError:
        return ""
    return found.value if found else ""


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


LOCAL = "127.0.0.1"
PORT = 8080
PORTS_TRIED = 20


def serve(host: str = LOCAL, port: int | None = None, guard: Guard | None = None) -> tuple[viser.ViserServer, Guard]:
    """Start a server behind the guard; returns both. ``port``: 0 is any free one.

    Raises :class:`~contactfpga.ContactFPGAError` if it cannot listen there, :class:`~contactfpga.MissingExtra`.
    """
    try:
        import viser
    except ModuleNotFoundError as error:
        raise MissingExtra(f"the view ({error})", "view") from None
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # its tracebacks of clients that break off
    guard = guard or Guard(host)
    port = _free_port(host, port)
    with _guarded(guard) as is_guarded, contextlib.redirect_stdout(io.StringIO()):  # it prints an address of its own
        server = viser.ViserServer(host=host, port=port, label="contactfpga", verbose=False)
    if not is_guarded():
        server.stop()
        right = f"install the right version with {pip_install('view')}"
        raise ContactFPGAError(f"viser {viser.__version__} lets no guard in; {right}")
    _forget_tunnel(server)
    return server, guard


def _free_port(host: str, port: int | None) -> int:
    """A free port: viser would try 1000, or wait forever for a foreign host."""
    reason = ""
    for candidate in [port] if port is not None else range(PORT, PORT + PORTS_TRIED):
        try:
            found = socket.getaddrinfo(host, candidate, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
            family, kind, _, _, address = found[0]
            with socket.socket(family, kind) as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind(address)
                return int(probe.getsockname()[1])
        except (OSError, UnicodeError) as error:
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
    where = f"port {port}" if port is not None else f"any port from {PORT} to {PORT + PORTS_TRIED - 1}"
    raise ContactFPGAError(f"cannot listen on {host}, {where}: {reason}; give another --host or --http-port")


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[Callable[[], bool]]:
    """Make viser's listener ask the guard first."""
    import websockets.asyncio.server as listening

    serve = listening.serve
    wrapped: list[bool] = []

    def serve_guarded(*args: Any, process_request: Any = None, **options: Any) -> Any:
        wrapped.append(True)
        return serve(*args, process_request=_checked(guard, process_request), **options)

    listening.serve = serve_guarded
    try:
        yield lambda: bool(wrapped)
    finally:
        listening.serve = serve


def _checked(guard: Guard, inner: Any) -> Any:
    def process_request(connection: Any, request: Any) -> Any:
        headers = dict(request.headers.raw_items())
        upgrade = "websocket" in request.headers.get("Upgrade", "").lower()
        port = connection.local_address[1]
        answer = guard.check(request.path, headers, port, upgrade)
        if answer is not None:
            return _response(answer)
        response = inner(connection, request)
        if response is not None:
            for name, value in guard.page_headers(headers).items():
                response.headers[name] = value
        return response

    return process_request


def _response(answer: Response) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    body = answer.text.encode()
    headers = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body)), **answer.headers}
    return Response(answer.status, HTTPStatus(answer.status).phrase, Headers(**headers), body)


def _forget_tunnel(server: viser.ViserServer) -> None:
    """Disable viser's tunnel, which a client could request."""
    from viser import _messages

    handlers = server._websock_server
    for kind in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        handlers.unregister_handler(kind)


def stop(server: viser.ViserServer) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
