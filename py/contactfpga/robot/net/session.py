"""Zenoh sessions, by default unreachable from other machines."""

from __future__ import annotations

import contextlib
import ipaddress
import json
import os
import re
import socket
import stat
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contactfpga.errors import ContactFPGAError, MissingExtra

if TYPE_CHECKING:
    import zenoh

LOOPBACK = "tcp/127.0.0.1:7447"
"""An endpoint for every user of this machine."""
_MOST_PATH = 100
"""Most bytes of a socket's path; operating systems allow 103 or 107."""


def key_of(name: str, fingerprint: bytes) -> str:
    """The default key of a board."""
    usual = re.sub(r"[^\w.@:+-]+", "-", name).strip("-") or fingerprint.hex()
    return f"contactfpga/{usual}"


def own_endpoint() -> str:
    """The default endpoint of publishers and ports: a Unix socket in a folder for this user alone, on Windows
    :data:`LOOPBACK`.

    The folder is in ``XDG_RUNTIME_DIR`` or that for temporary files. Raises :class:`~contactfpga.ContactFPGAError` if
    another user could open or replace it.
    """
    if sys.platform == "win32":
        return LOOPBACK
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(runtime, "contactfpga") if runtime else Path(tempfile.gettempdir(), f"contactfpga-{os.getuid()}")
    path = folder.absolute() / "zenoh.sock"
    step = f"name an endpoint, for instance {LOOPBACK}, to publisher and readers"
    if (size := len(os.fsencode(path))) > _MOST_PATH or re.search(r"[?#;]", str(path)):
        limits = f"a socket's path has at most {_MOST_PATH} bytes, and no question mark, # or semicolon"
        raise ContactFPGAError(f"{path} has {size} bytes; {limits}; {step}")
    try:
        with contextlib.suppress(FileExistsError):
            folder.mkdir(0o700)
        found, above = folder.lstat(), folder.parent.stat()
    except OSError as error:
        raise ContactFPGAError(f"{folder} cannot be made for the socket: {error.strerror}; {step}") from None
    alone = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077
    replaceable = above.st_uid not in (0, os.getuid()) or (above.st_mode & 0o022 and not above.st_mode & stat.S_ISVTX)
    if not alone or replaceable:
        raise ContactFPGAError(f"{folder} is not a folder that only you can open or replace; remove it, or {step}")
    return f"unixsock-stream/{path}"


def is_loopback(endpoint: str) -> bool:
    """Whether an endpoint such as ``tcp/127.0.0.1:7447`` is unreachable from other machines."""
    protocol, _, place = endpoint.partition("/")
    if protocol.startswith("unix"):
        return True
    host = re.sub(r":\d+$", "", re.split(r"[?#]", place)[0]).strip("[]")
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


LEASE_MS = 1000
"""Silence after which a peer counts as gone."""
MOST_RECEIVED = 1 << 20
"""Approximate largest message that a session accepts, more than any of ours."""
CONNECT_MS = 2000


FILES = (
    *(f"transport/link/tls/{name}" for name in ("root_ca_certificate", "listen_private_key", "listen_certificate")),
    *(f"transport/link/tls/{name}" for name in ("connect_private_key", "connect_certificate")),
    "transport/auth/usrpwd/dictionary_file",
)
"""Settings with file names."""


def listening(endpoint: str | None = None, config: str | None = None) -> zenoh.Session:
    """A router: a session that others connect to, and that forwards between them."""
    return _open({"mode": "router"}, endpoint, config, "listen")


def connected(endpoint: str | None = None, config: str | None = None) -> zenoh.Session:
    """A session that connects to a router, without listening."""
    return _open({"mode": "client", "connect/timeout_ms": CONNECT_MS}, endpoint, config, "connect")


def _open(settings: dict[str, Any], endpoint: str | None, config: str | None, what: str) -> zenoh.Session:
    try:
        import zenoh
    except ModuleNotFoundError as error:
        raise MissingExtra(f"zenoh:// ({error})", "net") from None
    settings = settings | {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
        "transport/shared_memory/enabled": False,
        "transport/link/rx/max_message_size": MOST_RECEIVED,
    }
    place = f"{what}/endpoints"
    found, given = zenoh.Config(), {}
    if config is not None:
        if not Path(config).is_file():
            raise ContactFPGAError(f"config is {config!r}; there is no such file")
        try:
            found = zenoh.Config.from_file(config)
        except zenoh.ZError as error:
            raise ContactFPGAError(f"config {config!r}: {_reason(error)}") from None
        _check_files(found, config)
        given = {name: found.get_json(name) for name in (*settings, place)} | {"mode": "null"}
    usual = zenoh.Config()

    def as_usual(name: str) -> bool:
        return given.get(name, "null") in ("null", "[]", usual.get_json(name))

    for name, value in settings.items():
        if as_usual(name):
            _insert(found, name, value)
    if endpoint is not None or as_usual(place):
        _insert(found, place, [endpoint or own_endpoint()])
    places = json.loads(found.get_json(place))
    try:
        return zenoh.open(found)
    except zenoh.ZError as error:
        reason = f"no connection within {CONNECT_MS / 1000:g} s" if what == "connect" else _reason(error)
        step = _step(what, reason, places)
        raise ContactFPGAError(f"{_where(places)}: cannot {what} there: {reason}; {step}") from None


def _check_files(found: zenoh.Config, config: str) -> None:
    for name in FILES:
        path = json.loads(found.get_json(name))
        if path is not None and not Path(path).is_file():
            raise ContactFPGAError(f"config {config!r}: {name} is {path!r}; there is no such file")


def _insert(found: zenoh.Config, name: str, value: Any) -> None:
    import zenoh

    try:
        found.insert_json5(name, json.dumps(value))
    except zenoh.ZError as error:  # of what a user names: an endpoint
        reason = re.sub(r'^.*msg: "', "", _reason(error))
        raise ContactFPGAError(f"endpoint {value[0]!r}: {reason}; for instance {LOOPBACK}") from None


def _where(places: Any) -> str:
    return ", ".join(map(str, places)) if isinstance(places, list) else str(places)


def _step(what: str, reason: str, places: Any) -> str:
    if what == "listen":
        taken = "in use" in reason or "acquire lock" in reason
        if taken:
            return f"connect to the publisher that listens there: --connect {_where(places)}"
        return f"give an endpoint of this computer, for instance {LOOPBACK}"
    if isinstance(places, list) and any(map(_answers, places)):
        return "something listens there; are certificates, user and password those that it asks for?"
    return "is `contactfpga publish` running there?"


def _answers(place: str) -> bool:
    found = re.fullmatch(r"(?:tcp|tls)/\[?(.+?)\]?:(\d+)(?:[?#].*)?", place)
    if found is None:
        return False
    try:
        socket.create_connection((found[1], int(found[2])), timeout=1.0).close()
    except (OSError, OverflowError):
        return False
    return True


def _reason(error: Exception) -> str:
    return str(error).split(" at /")[0].strip("[] ") or type(error).__name__
