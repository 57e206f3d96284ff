"""Nobody but the browser that was given the token reads or presses: by real requests to a real server."""

import http.client
import socket
import time
from types import SimpleNamespace

import numpy as np
import pytest

from contactfpga.errors import ContactFPGAError
from contactfpga.tools.view.server import Guard

pytest.importorskip("viser")
pytest.importorskip("websockets")

from view_page import Page, camera, click, cookie, socket_of
from websockets.exceptions import InvalidStatus

from contactfpga.tools.view import server as serving


@pytest.fixture(scope="module")
def served():
    server, guard = serving.serve(port=0)
    cells = server.scene.add_batched_meshes_simple(
        "/cells", np.eye(3), np.array([[0, 1, 2]]), np.array([[1.0, 0, 0, 0]]), np.zeros((1, 3))
    )
    clicks = []
    cells.on_click(lambda event: clicks.append(event))
    yield server.get_port(), guard, clicks
    serving.stop(server)


def get(port, path="/", **headers):
    """Status, headers and body; ``Host`` as a browser would send it."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in {"Host": f"127.0.0.1:{port}", **headers}.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), body


def test_the_address_with_the_token_leads_to_the_page(served):
    port, guard, _ = served
    status, headers, body = get(port, f"/?token={guard.token}")
    assert status == 200
    assert b"? '/?darkMode' : '/')" in body, "the browser says whether its user likes dark pages"
    assert guard.token.encode() not in body
    assert len(body) < 200
    given = headers["Set-Cookie"]
    assert given.startswith(cookie(port, guard) + ";")
    assert "HttpOnly" in given
    assert "SameSite=Strict" in given
    status, headers, body = get(port, Cookie=given.split(";")[0])
    assert status == 200
    assert b"<html" in body[:2000].lower()
    assert guard.token.encode() not in body
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert headers["X-Frame-Options"] == "DENY"


def test_without_the_token_there_is_no_page(served):
    port, guard, _ = served
    other = f"contactfpga-view-{port + 1}={guard.token}"
    for path, headers in (
        ("/", {}),
        ("/?token=", {}),
        (f"/?token={guard.token[:-1]}", {}),
        ("/index.html", {}),
        ("/", {"Cookie": f"contactfpga-view-{port}=x"}),
        ("/", {"Cookie": other}),
        ("/", {"Cookie": "a=b;;=;[x"}),
    ):
        status, answered, body = get(port, path, **headers)
        assert status == 403, path
        assert "Set-Cookie" not in answered
        assert b"token" in body


def test_a_name_that_was_made_to_resolve_here_is_refused(served):
    port, guard, _ = served
    for host in (f"evil.example:{port}", "evil.example", f"127.0.0.1.evil.example:{port}", f"127.0.0.1:{port + 1}"):
        assert get(port, f"/?token={guard.token}", Host=host)[0] == 403, host
        assert get(port, Host=host, Cookie=cookie(port, guard))[0] == 403, host
    assert get(port, Host=f"localhost:{port}", Cookie=cookie(port, guard))[0] == 200


def test_a_foreign_page_is_refused_though_it_has_the_cookie(served):
    port, guard, _ = served
    for origin in ("http://evil.example", f"http://127.0.0.1:{port + 1}", "null", f"https://127.0.0.1:{port}"):
        assert get(port, Cookie=cookie(port, guard), Origin=origin)[0] == 403, origin
        with pytest.raises(InvalidStatus, match="403"):
            socket_of(port, guard, origin=origin)


def test_our_page_reads_and_presses(served):
    port, guard, clicks = served
    with Page(port, guard) as page:
        page.hear(lambda message: message.get("name") == "/cells")
        page.say(camera(), click("/cells"))
        wait(lambda: clicks)
    assert clicks[0].instance_index == 0


def test_a_foreign_page_neither_reads_nor_presses(served):
    """What it sends before it is refused, or without waiting for an answer, counts as well."""
    port, guard, clicks = served
    before = len(clicks)
    for refused in (
        {"token": False},
        {"origin": ""},
        {"origin": "http://evil.example"},
        {"host": f"evil.example:{port}"},
        {"token": False, "query": f"?token={guard.token}"},
    ):
        with pytest.raises(InvalidStatus, match="403") as caught:
            socket_of(port, guard, **refused)
        assert guard.token.encode() not in caught.value.response.body
    hasty = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    hasty += (
        "Origin: http://evil.example\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
    )
    with socket.create_connection(("127.0.0.1", port), timeout=60) as raw:
        raw.sendall(hasty.encode() + b"\r\n\x82\x05abcde")
        assert raw.recv(4096)[:12] in (b"HTTP/1.1 403", b"")
    with socket_of(port, guard) as page:
        page.recv(timeout=60)
    assert len(clicks) == before


def test_nobody_can_ask_for_a_tunnel():
    """viser would let its clients open one to a server of its authors."""
    server, _ = serving.serve(port=0)
    try:
        kinds = {kind.__name__ for kind in server._websock_server._incoming_handlers}
        assert kinds
        assert not {kind for kind in kinds if "ShareUrl" in kind}
    finally:
        serving.stop(server)


def test_a_port_that_is_taken_is_named(served):
    port, _, _ = served
    with pytest.raises(ContactFPGAError, match=rf"cannot listen on 127.0.0.1, port {port}: .*--http-port"):
        serving.serve(port=port)


def test_a_host_that_is_not_here_is_named():
    with pytest.raises(ContactFPGAError, match=r"cannot listen on 192\.0\.2\.1, any port from 8080 to .*--host"):
        serving.serve("192.0.2.1")


def test_a_viser_that_lets_no_guard_in_is_refused(monkeypatch):
    """As if it listened by other means than those that we know."""
    import viser.infra._infra as infra
    import websockets.asyncio.server as listening

    kept = SimpleNamespace(serve=listening.serve, ServerConnection=listening.ServerConnection)
    other = SimpleNamespace(asyncio=SimpleNamespace(server=kept))
    other.exceptions, other.datastructures = infra.websockets.exceptions, infra.websockets.datastructures
    monkeypatch.setattr(infra, "websockets", other)
    with pytest.raises(ContactFPGAError, match="lets no guard in"):
        serving.serve(port=0)


def test_each_start_has_a_token_of_its_own():
    tokens = {Guard("127.0.0.1").token for _ in range(20)}
    assert len(tokens) == 20
    assert min(map(len, tokens)) >= 20


@pytest.mark.parametrize(
    ("host", "address"),
    [("127.0.0.1", "http://127.0.0.1:80/"), ("::1", "http://[::1]:80/"), ("0.0.0.0", "http://127.0.0.1:80/")],
)
def test_the_address_can_be_opened(host, address):
    guard = Guard(host)
    assert guard.url(80) == f"{address}?token={guard.token}"
    told = {"host": address[7:-1], "Cookie": cookie(80, guard), "ORIGIN": address[:-1]}
    assert guard.check("/", told, 80, upgrade=True) is None


def wait(found, seconds=60.0):
    until = time.monotonic() + seconds
    while not found() and time.monotonic() < until:
        time.sleep(0.01)
    assert found()
