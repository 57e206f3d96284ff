"""An open port with a board at its other end."""

from __future__ import annotations

import contextlib
import math
import threading
import weakref
from collections.abc import AsyncIterator, Callable, Iterator
from types import TracebackType

from contactfpga.batch import Batch
from contactfpga.conversation import Arrival, Conversation, Event
from contactfpga.errors import (
    BoardClosed,
    BoardSilent,
    ContactFPGAError,
    OnlyNoise,
    ReadTimeout,
    ReplayEnded,
)
from contactfpga.protocol import Hello
from contactfpga.sheet import Sheet
from contactfpga.skin import Skin
from contactfpga.stats import Stats
from contactfpga.subscription import Subscription, checked, frame_of
from contactfpga.transport import Transport
from contactfpga.zone import Zones

QUEUE = 16_384
"""Frames that wait for :meth:`Board.next` at most."""

TURN_S = 0.05
"""The reader looks this often whether the board was closed."""

SIMULATED_TURN_S = 0.002
"""The most simulated time that passes in one turn, during which :meth:`Board.close` has to wait."""

Found = Zones | ContactFPGAError | Hello | bool
"""What is waited for."""


class _Waiter:
    """A call of :meth:`Board.read` that waits for its frame."""

    def __init__(self, ticket: int):
        self.ticket = ticket
        self.found: Zones | ContactFPGAError | None = None

    def look(self) -> Zones | ContactFPGAError | None:
        """What has been found by now."""
        return self.found


class Board:
    """An open port with a board at its other end: a context manager that iterates every frame.

    Made by :func:`open`. Safe for several threads; :meth:`read`, :meth:`next` and :meth:`latest` share one queue, so a
    thread that wants every frame for itself takes a :meth:`subscribe`. Every method raises :class:`BoardClosed` after
    :meth:`close`, also where it was waiting.
    """

    def __init__(self, transport: Transport, skin: Skin | None = None):
        self._transport = transport
        self._expected = skin
        self._conversation = Conversation(transport.name, skin, transport.live)
        self._changed = threading.Condition()
        self._sending = threading.Lock()
        self._subscriptions: weakref.WeakSet[Subscription] = weakref.WeakSet()
        self._waiters: list[_Waiter] = []
        self._failure: BaseException | None = None
        self._closing = False
        self._turning: int | None = None  # the thread that reads
        self._frames = Subscription(self, QUEUE)
        self._subscriptions.add(self._frames)
        if transport.threaded:
            threading.Thread(
                target=_read_all, args=(weakref.ref(self), transport), name=f"reader of {transport.name}", daemon=True
            ).start()

    # ---- what is known of the board

    @property
    def port(self) -> str:
        """Name of the port."""
        return self._transport.name

    @property
    def hello(self) -> Hello:
        """What the board said of itself last; it does so twice a second."""
        self._check_open()
        if self._conversation.hello is None:
            raise ContactFPGAError(f"{self.port}: no hello has come yet")
        return self._conversation.hello

    @property
    def sheet(self) -> Sheet:
        """Lines, lengths and report of the board's sheet, as its hello tells them."""
        return self.hello.sheet

    @property
    def name(self) -> str:
        """The name that the board's Skin gave it; "" where it has none."""
        return self.hello.name

    @property
    def fingerprint(self) -> bytes:
        """Fingerprint of the Skin the board was built from."""
        return self.hello.fingerprint

    @property
    def clock_hz(self) -> int:
        """Clock of the board's gateware in Hz."""
        return self.hello.clock_hz

    @property
    def baud(self) -> int:
        """The board's baud rate."""
        return self.hello.baud

    @property
    def skin(self) -> Skin:
        """The board's whole Skin: the one given to :func:`open`, or the reference Skin where the board has its
        fingerprint.

        Raises :class:`ContactFPGAError` for any other board: its hello tells the :attr:`sheet` and no more.
        """
        hello = self.hello
        for skin in (self._expected, Skin()):
            if skin is not None and skin.fingerprint == hello.fingerprint:
                return skin
        raise ContactFPGAError(
            f"{self.port}: of this board's Skin only `board.sheet` is known (fingerprint {hello.fingerprint.hex()}); "
            "give its file: open(port, skin='my.toml')"
        )

    @property
    def stats(self) -> Stats:
        """Counters since the port was opened."""
        stats = self._conversation.stats
        stats.dropped = self._frames.dropped
        return stats

    def clock(self) -> float:
        """Seconds on the clock that timeouts run on: ``time.monotonic``; of ``sim://`` the simulated one."""
        self._check_open()
        return self._transport.clock()

    # ---- frames

    def read(self, timeout: float = 1.0) -> Zones:
        """Ask the board and return the first complete frame scanned after this call; :meth:`next` goes on after it.

        ``timeout`` in seconds. Of a recording, the next frame. Raises :class:`ReadTimeout`, :class:`PortLost`,
        :class:`SkinMismatch`, :class:`VersionMismatch`.
        """
        timeout = checked(timeout)
        if not self._transport.live:
            return self.next(timeout)
        deadline = self.clock() + timeout
        with self._changed:
            self._check_open()
            waiter = _Waiter(self._conversation.ask(self._transport.clock(), deadline))
            self._waiters.append(waiter)
        try:
            self._send()
            found = self._wait_for(waiter.look, deadline, timeout)
        finally:
            with self._changed:
                self._waiters.remove(waiter)
        zones = frame_of(found)
        self._frames.skip_to(zones)
        return zones

    def next(self, timeout: float = 1.0) -> Zones:
        """The next frame, in order. Raises as :meth:`read` does, and :class:`ReplayEnded`.

        At most 16,384 frames wait to be taken; beyond, the oldest ones are dropped and counted in ``stats.dropped``.
        """
        return self._frames.next(timeout)

    def latest(self, timeout: float = 1.0) -> Zones:
        """The newest frame: the last of all that wait, or the next one when none does. Older ones are dropped.

        Of a recording, the next frame. ``timeout`` and errors as for :meth:`next`.
        """
        if self._transport.live:
            if not self._transport.threaded:
                self._take_what_came()
            self._frames.keep_last()
        return self._frames.next(timeout)

    def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> Batch:
        """All frames that wait after at most ``max_s`` seconds, as numpy arrays (:class:`Batch`).

        The first one is waited for, for ``timeout`` seconds at most. Errors as for :meth:`next`.
        """
        return self._frames.batch(max_s, timeout)

    def subscribe(self, maxsize: int = 1024) -> Subscription:
        """A queue of its own for every frame from now on; see :class:`Subscription`."""
        self._check_open()
        subscription = Subscription(self, maxsize)
        with self._changed:
            self._subscriptions.add(subscription)
        return subscription

    def __iter__(self) -> Iterator[Zones]:
        """Every frame, for ever; a recording ends."""
        return iter(self._frames)

    def __aiter__(self) -> AsyncIterator[Zones]:
        """The same in ``async for``."""
        return aiter(self._frames)

    # ---- its end

    def __enter__(self) -> Board:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give the port back; may be called twice. Calls that wait in other threads raise :class:`BoardClosed`."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
            if self._turning != threading.get_ident():  # else a scene's callback closes, and its turn does the rest
                while self._turning is not None:
                    self._changed.wait(1.0)
                with self._sending:
                    self._transport.close()

    def greet(self, timeout: float) -> None:
        """Wait for the hello without which no frame can be read; keep the frame that answers for :meth:`next`."""
        if self._transport.live:
            self._frames.put_back(self.read(timeout))
            return
        try:
            self._wait_for(lambda: self._conversation.hello, math.inf, timeout)
        except ReplayEnded:
            raise ContactFPGAError(f"{self.port} holds no hello; its frames cannot be read") from None
        self._frames.raise_first()

    # ---- the reader

    def _check_open(self) -> None:
        if self._closing:
            raise BoardClosed(f"{self.port} was closed; open it again")

    def _wait_for(self, found: Callable[[], Found | None], deadline: float, timeout: float) -> Found:
        """What ``found`` returns as soon as it is not None; raises :class:`ReadTimeout` at the deadline.

        A port's bytes are read by a thread of its own. Where time passes only while it is read (``sim://``) or all is
        there (``replay://``), one of the threads that wait reads for all.
        """
        start = self.stats.bytes
        with self._changed:
            while True:
                self._check_open()
                if (result := found()) is not None:
                    return result
                if self._failure is not None:
                    raise self._failure.with_traceback(None)
                left = deadline - self._transport.clock()
                if left <= 0:
                    raise self._timed_out(timeout, start)
                if self._transport.threaded or self._turning is not None:
                    self._changed.wait(min(left, 1.0) if self._transport.threaded else TURN_S)
                else:
                    self._turn(min(left, SIMULATED_TURN_S))

    def _turn(self, seconds: float) -> int:
        """Read once, with the lock held, which is released meanwhile; returns the number of bytes."""
        self._turning = threading.get_ident()
        self._changed.release()
        try:
            data = self._transport.read(seconds)
        finally:
            self._changed.acquire()
            self._turning = None
            self._changed.notify_all()
            if self._closing:
                self._transport.close()
        self._check_open()
        self._take(data)
        return len(data)

    def _take(self, data: bytes) -> None:
        for event in self._conversation.receive(data, self._transport.clock()):
            self._pass_on(event)
        self._changed.notify_all()
        if not self._transport.threaded:
            self._send()

    def _take_what_came(self) -> None:
        with self._changed:
            self._check_open()
            while self._turning is None and self._turn(0.0):
                pass

    def _pass_on(self, event: Event) -> None:
        if isinstance(event, Hello):
            return
        item = event.zones if isinstance(event, Arrival) else event
        for subscription in self._subscriptions:
            subscription.put(item)
        for waiter in self._waiters:
            if waiter.found is not None:
                continue
            if isinstance(event, Arrival):
                waiter.found = event.zones if event.answers >= waiter.ticket else None
            elif self._conversation.sheet is None:  # another Skin that can be read is no trouble for a new frame
                waiter.found = event

    def _send(self) -> None:
        with self._changed:
            data = self._conversation.data_to_send()
        if data:
            with self._sending:
                self._check_open()
                self._transport.write(data)

    def _timed_out(self, timeout: float, start: int) -> ReadTimeout:
        stats = self._conversation.stats
        head = f"{self.port}: no frame within {timeout:g} s"
        if stats.bytes == start:
            return BoardSilent(
                f"{head}, not one byte came; is the board powered and its bitstream loaded, is this its port? "
                f"`contactfpga doctor {self.port}` checks"
            )
        seen = f"{stats.bytes - start} bytes came"
        if not stats.frames and not stats.hellos:
            damaged = ", ".join(f"{count} {reason}" for reason, count in stats.damaged.items()) or "none whole"
            return OnlyNoise(
                f"{head}; {seen}, but no valid packet ({damaged}); is the baud rate the Skin's, "
                "and is this a contactfpga board?"
            )
        return ReadTimeout(
            f"{head}; {seen}, {stats.hellos} hellos and {stats.frames} frames since the port was opened; "
            "give it a longer timeout, or send less to the board"
        )


def _read_all(board: weakref.ref[Board], transport: Transport) -> None:
    """What the reader thread of a port does, until the board is closed or nobody holds it any more."""
    while True:
        held = board()
        if held is None:
            transport.close()
            return
        with held._changed:
            if held._closing:
                return
            try:
                held._turn(TURN_S)
            except BoardClosed:
                return
            except BaseException as error:  # whoever calls next gets it
                held._failure = error
                held._changed.notify_all()
                return
        with contextlib.suppress(ContactFPGAError):  # the next read says so
            held._send()
        del held
