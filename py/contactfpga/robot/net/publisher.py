"""Publishes a board's bytes, and passes requests to it."""

from __future__ import annotations

import contextlib
import random
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from contactfpga.driver.stats import NetCounters
from contactfpga.errors import ContactFPGAError
from contactfpga.robot.net.message import BEAT_S, MOST_ASKED, MOST_BYTES, Message, Stream, token
from contactfpga.robot.net.session import LEASE_MS
from contactfpga.wire.command import RequestKind, request_kind

if TYPE_CHECKING:
    import zenoh

SLICE_S = 0.01
"""Longest interval of reading a port while bytes are collected, lest it overflow."""


class BoardPort(Protocol):
    """A port whose bytes come by themselves: a :class:`~contactfpga.driver.transport.Transport` that is threaded."""

    def read(self, timeout_s: float) -> bytes: ...

    def write(self, data: bytes) -> None: ...


class BoardPublisher:
    """One board under one key: ``KEY/bytes`` from it, ``KEY/ask`` to it, ``KEY/alive/...`` while this runs.

    Bytes are collected for ``batch_s``. On a slow network the publisher waits and lets the port overflow with
    ``block``, else Zenoh drops messages. ``commands`` passes commands as well as requests. Raises
    :class:`~contactfpga.ContactFPGAError` if the key is taken.
    """

    def __init__(
        self,
        source: BoardPort,
        session: zenoh.Session,
        key: str,
        *,
        batch_s: float = 0.002,
        block: bool = True,
        commands: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ):
        import zenoh

        self.denied = self.passed = self.sent = 0
        """Messages to the board refused and passed; messages from it."""
        self._source, self._batch_s, self._commands, self._clock = source, batch_s, commands, clock
        self._number = random.SystemRandom().getrandbits(64)
        self._offset = 0
        _check_alone(session, key)
        control = zenoh.CongestionControl.BLOCK if block else zenoh.CongestionControl.DROP
        self._out = session.declare_publisher(f"{key}/bytes", congestion_control=control, express=True)
        self._in = session.declare_subscriber(f"{key}/ask", self._take)
        self._token = session.liveliness().declare_token(f"{key}/alive/{token(self._number)}")

    def run(self, stop: threading.Event) -> None:
        """Publish until stopped. Raises :class:`~contactfpga.PortLost` if the board is gone."""
        try:
            while not stop.is_set():
                self.step()
        finally:
            self._token.undeclare()
            self._in.undeclare()
            self._out.undeclare()

    def step(self) -> None:
        data = self._source.read(BEAT_S)
        read_us = round(self._clock() * 1e6)
        if data and self._batch_s:
            until_s = time.monotonic() + self._batch_s
            while (left_s := until_s - time.monotonic()) > 0:
                time.sleep(min(left_s, SLICE_S))
                data += self._source.read(0.0)
        for start in range(0, max(1, len(data)), MOST_BYTES):
            self._send(data[start : start + MOST_BYTES], read_us)

    def _send(self, data: bytes, read_us: int) -> None:
        message = Message(self._number, self.sent, self._offset, read_us, self.denied & 0xFFFFFFFF, data)
        self.sent += 1
        self._offset += len(data)
        self._out.put(message.encode())

    def _take(self, sample: zenoh.Sample) -> None:
        data = sample.payload.to_bytes()
        asked = request_kind(data) if len(data) <= MOST_ASKED else RequestKind.OTHER
        if asked is RequestKind.OTHER or (asked is RequestKind.COMMAND and not self._commands):
            self.denied += 1
            return
        self.passed += 1
        with contextlib.suppress(ContactFPGAError):  # the next read says so, or who asks asks again
            self._source.write(data)


def _check_alone(session: zenoh.Session, key: str) -> None:
    """Raise if another publisher sends under the key; tokens can be stale or forged."""
    if not list(session.liveliness().get(f"{key}/alive/*", timeout=LEASE_MS / 1000)):
        return
    counters, heard = NetCounters(), threading.Event()
    stream = Stream(counters)

    def take(sample: zenoh.Sample) -> None:
        if stream.take(sample.payload.to_bytes(), time.monotonic()):
            heard.set()

    subscriber = session.declare_subscriber(f"{key}/bytes", take)
    try:
        if heard.wait(2 * LEASE_MS / 1000):
            raise ContactFPGAError(
                f"key is {key!r}; it is published already; end that publisher, or give this one --key"
            )
    finally:
        subscriber.undeclare()
