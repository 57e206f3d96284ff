"""What ``zenoh://KEY?connect=ENDPOINT`` asks for, and which endpoints are this machine alone."""

from __future__ import annotations

import dataclasses
import ipaddress
import math
import re
from urllib.parse import unquote

from contactfpga.errors import PortNotFound

SCHEME = "zenoh://"
ENDPOINT = "tcp/127.0.0.1:7447"
"""Where a publisher listens, and where a port looks for it, unless asked otherwise."""
_FORM = "it reads zenoh://KEY, with ?connect=ENDPOINT, &config=FILE and &wait=SECONDS where wanted"


@dataclasses.dataclass(frozen=True)
class Address:
    """The options, decoded."""

    key: str
    connect: str | None = None
    config: str | None = None
    wait_s: float = 0.5
    """How long a publisher that is gone may take to come back before the port counts as lost."""


def parse(name: str) -> Address:
    """Read an address; raises :class:`PortNotFound` that says what is wrong."""
    head, _, query = name.removeprefix(SCHEME).partition("?")
    found: dict[str, str] = {}
    for part in query.split("&") if query else ():
        option, _, value = part.partition("=")
        if option not in ("connect", "config", "wait") or not value or option in found:
            raise PortNotFound(f"{name}: {part!r} is no option, or given twice; {_FORM}")
        found[option] = unquote(value)
    try:
        key = checked_key(head)
    except ValueError as error:
        raise PortNotFound(f"{name}: {error}; {_FORM}") from None
    return Address(key, found.get("connect"), found.get("config"), _seconds(name, found.get("wait", "0.5")))


def checked_key(key: str) -> str:
    """A key that names one board; raises ValueError."""
    if not re.fullmatch(r"[\w.@:+-]+(/[\w.@:+-]+)*", key) or len(key) > 200:
        raise ValueError(f"key is {key!r}; it must be names of letters, digits and . _ - + : @ with / between them")
    return key


def key_of(name: str, fingerprint: bytes) -> str:
    """The usual key of a board."""
    usual = re.sub(r"[^\w.@:+-]+", "-", name).strip("-") or fingerprint.hex()
    return f"contactfpga/{usual}"


def is_loopback(endpoint: str) -> bool:
    """Whether nobody on another machine can reach an endpoint such as ``tcp/127.0.0.1:7447``."""
    protocol, _, place = endpoint.partition("/")
    if protocol.startswith("unix"):
        return True
    host = re.sub(r":\d+$", "", re.split(r"[?#]", place)[0]).strip("[]")
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _seconds(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= 86_400:
        raise PortNotFound(f"{name}: wait is {text!r}; it must be a number of seconds from 0 to 86400")
    return value
