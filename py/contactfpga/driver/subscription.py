"""A queue of frames, or of all events, for one listener."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Generic, TypeVar, cast

from contactfpga.driver.events import SideEvent, Silence
from contactfpga.driver.link import Link, checked_item, frame_of
from contactfpga.errors import BoardClosed, ContactFPGAError, NoData, ReadTimeout, ReplayEnded
from contactfpga.inputs.values import is_finite
from contactfpga.wire.faults import Faults, SelfTestSlot
from contactfpga.zones.batch import Batch
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones

Item = TypeVar("Item")

POLL_S = 1e-9
"""Wait for a timeout of 0: simulated time and recordings advance only during a wait."""


class Listening(Generic[Item]):
    """Common base of :class:`Subscription` and :class:`Events`."""

    all_events = False

    def __init__(self, link: Link, maxsize: int, board: object = None, deadline_s: float | None = None):
        if isinstance(maxsize, bool) or not isinstance(maxsize, int) or maxsize < 1:
            raise ValueError(f"maxsize is {maxsize!r}; it must be a whole number of frames, 1 or more")
        self._link = link
        self._board = board  # stays open as long as someone may take frames here
        self._closed = False
        self._deadline_s = deadline_s if link.transport.live else None
        self._since = self._noticed = link.transport.clock()
        self._frames = link.queue(maxsize, self.all_events)

    @property
    def maxsize(self) -> int:
        return self._frames.maxsize

    @property
    def dropped(self) -> int:
        """Frames that were not taken in time."""
        self._link.catch_up()
        return self._frames.dropped

    def next(self, timeout: float = 1.0) -> Item:
        """The next item, in order. Errors as for :meth:`Board.next`; silence as the class describes."""
        polled = is_finite(timeout) and timeout == 0
        timeout = POLL_S if polled else checked(timeout)
        now = self._link.clock()
        silent_at = self._silent_at()
        try:
            found = self._link.wait_for(self._pop, min(now + timeout, silent_at), timeout)
        except ReadTimeout:
            if now + timeout < silent_at:
                if polled:
                    raise ReadTimeout(f"{self._link.transport.name}: no frame waits") from None
                raise
            self._noticed = self._link.clock()
            return self._silent(self._silence())
        return cast(Item, checked_item(found))

    def close(self) -> None:
        with self._link.changed:
            self._closed = True
            self._link.leave(self._frames)
            self._frames.clear()
            self._link.changed.notify_all()

    def settle(self, all_taken: Callable[[int], bool], timeout: float = 1.0) -> int:
        """Read until ``all_taken`` is true of the number of bytes whose frames are here or taken; returns the number of
        waiting items. Raises :class:`ReadTimeout`.
        """
        waiting = 0

        def settled() -> bool | None:
            nonlocal waiting
            waiting = len(self._frames)
            return True if all_taken(self._link.conversation.stats.bytes) else None

        self._link.wait_for(settled, self._link.clock() + timeout, timeout)
        return waiting

    def __enter__(self):  # type: ignore[no-untyped-def]
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Item]:
        while True:
            try:
                yield self.next()
            except ReplayEnded:
                return

    async def __aiter__(self) -> AsyncIterator[Item]:
        while True:
            try:
                yield await self.awaited()
            except ReplayEnded:
                return

    async def awaited(self, timeout: float = 1.0) -> Item:
        import asyncio  # a quarter of what contactfpga.open would load

        if self._frames or timeout == 0:
            await asyncio.sleep(0)  # others go on
        else:
            await asyncio.to_thread(self._wait, timeout)
        return self.next(timeout)  # which waits for nothing now, and takes no frame if we were canceled above

    def _wait(self, timeout: float) -> None:
        timeout = checked(timeout)
        until, silent_at = self._link.clock() + timeout, self._silent_at()
        try:
            self._link.wait_for(lambda: True if self._frames else None, min(until, silent_at), timeout)
        except ReadTimeout:
            if until < silent_at:
                raise

    def _silent_at(self) -> float:
        if self._deadline_s is None:
            return float("inf")
        return max(self._noticed, self._link.last_s) + self._deadline_s

    def _silence(self) -> Silence:
        with self._link.changed:
            return self._link.silence(self._since)

    def _silent(self, silence: Silence) -> Item:
        raise NoData(f"{silence} (allowed are {self._deadline_s:g} s)", silence)

    def _pop(self) -> Zones | SideEvent | ContactFPGAError | None:
        if self._closed:
            raise BoardClosed(f"{self._link.transport.name}: this subscription was closed; subscribe again")
        return self._frames.pop()


class Events(Listening[Zones | Faults | SelfTestSlot | UnitSamples | Silence]):
    """Everything that comes from a board from a moment on, in order, in ``for``, in ``async for``, or one by one.

    >>> with contactfpga.open("sim://") as board, board.events() as events:
    ...     type(events.next()).__name__
    'Zones'

    It gives each :class:`Zones`; :class:`Faults`, first the present ones and then each change, even without a frame;
    the slots of a self-test; each sweep of pressure units as :class:`UnitSamples`; and :class:`Silence`, each time that
    a deadline passes without a frame.

    At most ``maxsize`` items wait; beyond that, the oldest are dropped, and frames among them counted in
    :attr:`dropped`.
    """

    all_events = True

    def _silent(self, silence: Silence) -> Silence:
        return silence


class Subscription(Listening[Zones]):
    """Every frame of a board from a moment on: in ``for``, in ``async for``, or one by one.

    >>> with contactfpga.open("sim://?scene=two_fingers") as board, board.subscribe() as frames:
    ...     len(frames.next())
    2

    At most ``maxsize`` frames wait; beyond that, the oldest are dropped and counted in :attr:`dropped`. With a
    deadline, :class:`NoData` is raised each time that it passes without a frame.
    """

    _batched = 0  # frames in batches so far

    def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> Batch:
        """All frames that wait after at most ``max_s`` seconds; see :meth:`Board.batch`."""
        max_s = checked_span(max_s)
        link, until = self._link, self._link.clock() + max_s
        self._wait(timeout)
        if link.transport.live:  # of a recording, what was read at once
            link.linger(until, max_s)
        with link.changed:
            frames = self._frames.pop_frames()
        batch = Batch.of(frames or [self.next(timeout)])
        with link.changed:
            first, self._batched = self._batched, self._batched + len(batch)
        return dataclasses.replace(batch, first=first)

    # ---- for the board

    def shown(self, timeout: float, max_age_s: float | None) -> Zones | None:
        """The newest frame, if it is known before the others are taken; see :meth:`Link.newest`."""
        if max_age_s is not None or timeout == 0:
            return None
        return self._link.newest(self._frames, checked(timeout))

    def newest(self, max_age_s: float, timeout: float) -> Zones:
        """The next frame that arrived and was scanned at most ``max_age_s`` ago; raises :class:`NoData` if there can be
        none.
        """
        if not self._link.transport.live:
            return self.next(timeout)
        with self._link.changed:
            self._frames.drop_older(self._link.transport.clock() - max_age_s)
        now, silent_at = self._link.clock(), self._link.last_s + max_age_s
        try:
            zones = frame_of(self._link.wait_for(self._pop, min(now + timeout, silent_at), timeout))
        except ReadTimeout:
            if now + timeout < silent_at:
                raise
        else:
            if (age_s := self._link.clock() - latest_scan_s(zones)) <= max_age_s:
                return zones
            self._link.ask()  # the answer shows it if it is the clock that was wrong
            late = f"{self._link.transport.name}: frame {zones.sequence} waited on its way, {age_s:.3g} s or more"
            raise NoData(f"{late} (allowed are {max_age_s:g} s)", self._silence())
        silence = self._silence()
        raise NoData(f"{silence} (allowed are {max_age_s:g} s)", silence)

    def skip_to(self, number: int) -> None:
        """Drop all frames up to this number; see :meth:`Link.read`."""
        self._frames.show(number)

    def keep_last(self) -> None:
        """Drop all frames but the last; raises a pending error."""
        with self._link.changed:
            self._frames.keep_last()

    def raise_first(self) -> None:
        """Raise a pending error before the first frame."""
        with self._link.changed:
            if (error := self._frames.first_error()) is not None:
                raise error


def latest_scan_s(zones: Zones) -> float:
    """Latest possible scan time of a frame, on the port's clock."""
    at_s, sigma_s = zones.host_time_s, zones.host_sigma_s
    return math.inf if at_s is None or sigma_s is None else at_s + 2 * sigma_s


def checked(timeout: float) -> float:
    """A timeout in seconds; raises ValueError unless positive and finite."""
    if not is_finite(timeout) or timeout <= 0:
        raise ValueError(f"timeout is {timeout!r}; it must be a positive number of seconds")
    return float(timeout)


def checked_span(max_s: float) -> float:
    """The seconds of a batch; raises ValueError unless finite and not below 0."""
    if not is_finite(max_s) or max_s < 0:
        raise ValueError(f"max_s is {max_s!r}; it must be a number of seconds, 0 or more")
    return float(max_s)
