"""Who may read and press: a browser that was given the token, on a page that this server sent."""

from __future__ import annotations

import dataclasses
import hmac
import ipaddress
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

TOKEN_BYTES = 16


@dataclasses.dataclass(frozen=True)
class Answer:
    """What is answered in place of the page."""

    status: int
    text: str
    headers: Mapping[str, str] = dataclasses.field(default_factory=dict)


class Guard:
    """Decides for each request whether it is served.

    A page of another site can make this browser send requests, also to 127.0.0.1. It cannot choose the Host and Origin
    that the browser sends with them, and it does not know the token: so all three are checked. The token comes once in
    the address, and from then on in a cookie, which the browser does not send for other sites.
    """

    def __init__(self, host: str, token: str | None = None):
        self.host = host
        """The address that is listened on."""
        self.token = token or secrets.token_urlsafe(TOKEN_BYTES)

    def check(self, path: str, headers: Mapping[str, str], port: int, upgrade: bool) -> Answer | None:
        """What to answer instead; None: the request may pass. ``headers``: by name, the case does not matter;
        ``upgrade``: it asks for a WebSocket, over which all is read and pressed."""
        host = _one(headers, "Host")
        if not self._is_ours(host, port):
            return Answer(403, f"Host {host!r} is not this server's name; use the address that it printed.\n")
        origin = _one(headers, "Origin")
        if (upgrade or origin) and origin != f"http://{host}":
            return Answer(403, f"Origin {origin!r} is another page; open the address that the server printed.\n")
        address = urlsplit(path)
        given = parse_qs(address.query).get("token", [""])[0]
        if given and not upgrade:
            return self._welcome(port) if self._is_token(given) else _NO_TOKEN
        return None if self._is_token(_cookie(headers, self.cookie(port))) else _NO_TOKEN

    def page_headers(self, headers: Mapping[str, str]) -> dict[str, str]:
        """What goes with a page: no other page may frame it, and it loads nothing from elsewhere."""
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
        """Its name: browsers keep one jar for all ports of a host."""
        return f"contactfpga-view-{port}"

    def _is_ours(self, host: str, port: int) -> bool:
        """Whether the browser was led here by a name that nobody can point elsewhere: a site that lets its own name
        resolve to 127.0.0.1 would otherwise count as this server's page."""
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

    def _welcome(self, port: int) -> Answer:
        """Lead the browser to the same page without the token, so that it stays out of the address line. The page does
        it by itself: after a redirect a browser that came by a link of another site would keep its cookie back."""
        cookie = f"{self.cookie(port)}={self.token}; HttpOnly; SameSite=Strict; Path=/"
        page = f"<!doctype html><title>contactfpga</title><script>location.replace({_PAGE!r})</script>\n"
        return Answer(200, page, {**_HEADERS, "Content-Type": "text/html; charset=utf-8", "Set-Cookie": cookie})


_PAGE = "/"
_HEADERS = {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Frame-Options": "DENY"}
_NO_TOKEN = Answer(403, "The token is missing or is another one; open the whole address that the server printed.\n")


def _one(headers: Mapping[str, str], name: str) -> str:
    """A header's value; "" where it is absent."""
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
