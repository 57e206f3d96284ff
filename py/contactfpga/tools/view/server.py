"""viser's server with our guard in front of it."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from contactfpga.errors import ContactFPGAError, MissingExtra, PortNotFound
from contactfpga.tools.view.guard import Answer, Guard

if TYPE_CHECKING:
    import viser

LOCAL = "127.0.0.1"
PORT = 8080
PORTS_TRIED = 20
"""Where no port was asked for, this many from :data:`PORT` on."""


def serve(host: str = LOCAL, port: int | None = None, guard: Guard | None = None) -> tuple[viser.ViserServer, Guard]:
    """Start a server that nobody gets past without the guard's leave; returns both. ``port``: 0 is any free one.

    Raises :class:`~contactfpga.PortNotFound` where it cannot listen there, :class:`~contactfpga.MissingExtra`.
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
        right = "install the right version with pip install '.[view]'"
        raise ContactFPGAError(f"viser {viser.__version__} lets no guard in; {right}")
    _forget_tunnel(server)
    return server, guard


def _free_port(host: str, port: int | None) -> int:
    """One that can be listened on: viser would try 1000 others, or wait forever for a host that is not here."""
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
    raise PortNotFound(f"cannot listen on {host}, {where}: {reason}; give another --host or --http-port")


@contextlib.contextmanager
def _guarded(guard: Guard) -> Iterator[Callable[[], bool]]:
    """While viser starts, have its listener ask the guard first. viser hands its own check to websockets and has no
    setting for another one."""
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


def _response(answer: Answer) -> Any:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    body = answer.text.encode()
    headers = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body)), **answer.headers}
    return Response(answer.status, HTTPStatus(answer.status).phrase, Headers(**headers), body)


def _forget_tunnel(server: viser.ViserServer) -> None:
    """viser can open a tunnel to a server of its authors, at a client's wish; here nobody asks it to."""
    from viser import _messages

    handlers = server._websock_server
    for kind in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        handlers.unregister_handler(kind)


def stop(server: viser.ViserServer) -> None:
    """End it; it prints a farewell of its own."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
