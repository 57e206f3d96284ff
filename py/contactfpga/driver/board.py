"""An open port with a board at its other end."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Callable, Iterator
from types import TracebackType
from typing import Protocol, TypeVar, runtime_checkable

from contactfpga.driver.events import SideEvent
from contactfpga.driver.facts import BoardFacts
from contactfpga.driver.link import Link, frame_of
from contactfpga.driver.subscription import Subscription, checked
from contactfpga.driver.transport import Transport
from contactfpga.errors import ContactFPGAError, NoSuchCommand, ReadTimeout, ReplayEnded
from contactfpga.inputs.values import shown, whole
from contactfpga.instruments.self_test import SelfTest
from contactfpga.skin import Skin
from contactfpga.skin.derived import LEVEL_STEP, MAX_RULER, SAMPLE_AT, SELF_TEST
from contactfpga.wire.command import Command
from contactfpga.wire.faults import SelfTestSlot
from contactfpga.wire.units import UnitFacts, sum_threshold_value, threshold_value, zero_value
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

QUEUE = 16_384
"""Most frames that wait for :meth:`Board.next`."""


class Board(BoardFacts):
    """An open port with a board at its other end: a context manager that iterates over every frame.

    >>> with contactfpga.open("sim://?scene=two_fingers") as board:
    ...     for zones in board:
    ...         if len(zones) == 2:
    ...             break

    Made by :func:`open`. Thread-safe. :meth:`read`, :meth:`next` and :meth:`latest` share one queue; a thread that
    wants every frame for itself calls :meth:`subscribe`. A board can be neither copied nor sent to another process; a
    child of ``fork`` sees it closed. After :meth:`close` every method raises :class:`BoardClosed`, even a waiting one.
    In ``async with`` it is an :class:`AsyncBoard`.
    """

    def __init__(
        self,
        port: Transport | Link,
        skin: Skin | None = None,
        opened: Callable[[Board], object] | None = None,
    ):
        link = port if isinstance(port, Link) else Link(port, skin)
        super().__init__(link, Subscription(link, QUEUE), skin)
        if opened is not None:
            opened(self)
        self._link.start()

    def __del__(self) -> None:
        if hasattr(self, "_link"):
            self._link.abandon()

    # ---- frames

    def read(self, timeout: float = 1.0) -> Zones:
        """Request a frame and return the first complete one scanned after this call; :meth:`next` continues after it.

        ``timeout`` in seconds. A recording gives its next frame. Raises :class:`ReadTimeout`, :class:`PortLost`,
        :class:`SkinMismatch`, :class:`VersionMismatch`.
        """
        timeout = checked(timeout)
        if not self.live:
            return self.next(timeout)
        zones, number = self._link.read(timeout)
        self._frames.skip_to(number)
        return zones

    def next(self, timeout: float = 1.0) -> Zones:
        """The next frame, in order. With ``timeout=0`` only a waiting one. Raises the errors of :meth:`read`, and
        :class:`ReplayEnded`.

        At most 16,384 frames wait; beyond that, the oldest are dropped and counted in ``stats.dropped``.
        """
        return self._frames.next(timeout)

    def latest(self, timeout: float = 1.0, *, max_age_s: float | None = None) -> Zones:
        """The newest waiting frame, or the next one if none waits; older ones are dropped.

        With ``max_age_s``, in seconds, it returns no frame that arrived earlier, or that was scanned earlier and
        delayed, as far as the clocks show, and raises :class:`NoData` as soon as none can come. A recording gives its
        next frame. ``timeout`` and other errors as for :meth:`next`.
        """
        if max_age_s is not None:
            max_age_s = self._checked("max_age_s", max_age_s)
        if self.live:
            if (zones := self._frames.shown(timeout, max_age_s)) is not None:
                return zones
            self._link.take_what_came()
            self._frames.keep_last()
        return self._frames.next(timeout) if max_age_s is None else self._frames.newest(max_age_s, checked(timeout))

    def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> Batch:
        """All frames that wait after at most ``max_s`` seconds, as numpy arrays (:class:`Batch`).

        It waits at most ``timeout`` seconds for the first frame. Errors as for :meth:`next`.
        """
        return self._frames.batch(max_s, timeout)

    # ---- commands

    def command(self, what: int, value: int = 0, timeout: float = 1.0) -> Zones:
        """Send a command: 1, test the lines; 2, see :meth:`sample_at`. Returns the first complete frame scanned after
        the board took it. The board may take it twice if answers are lost.

        ``value`` is its argument, ``timeout`` is in seconds. Raises :class:`NoSuchCommand` if the board does not take
        it, ValueError for numbers out of range, and the errors of :meth:`read`.
        """
        return frame_of(self._link.command(Command(what, value), checked(timeout)))

    def sample_at(self, clocks: int = 0, timeout: float = 1.0, *, level: int = 1) -> Zones:
        """From the next frame on, sample the columns this many clocks of the board after a row is selected. This
        measures the settle time that the sheet needs (``contactfpga wire --settle``). Returns the first frame sampled
        in this way. Until the value is 0 again, or the board restarts, slower cells do not read pressed.

        A board with a ruler takes ``clocks`` as sixteenths of the ruler's time (docs/cell.md). With several levels of
        force it moves the sample of one ``level``, from 1, the lightest, on; ValueError for a level that it lacks, or
        more than 255 sixteenths.

        0, larger values than the settle time, and values too early for the board (less than 2 clocks, or than shift
        registers take) mean the settle time. Raises the errors of :meth:`command`; boards with ``report = "cells"``
        take it.
        """
        levels = self.sheet.levels
        if whole(level) not in range(1, levels + 1) or (levels > 1 and not 0 <= clocks <= MAX_RULER):
            raise ValueError(f"level {shown(level)} at {shown(clocks)}; it has {levels} levels, at 0 to {MAX_RULER}")
        return self.command(SAMPLE_AT, clocks + LEVEL_STEP * (level - 1), timeout)

    def self_test(self, timeout: float = 2.0) -> SelfTest:
        """Have the board drive each of its lines alone, between scans, and return the result (:class:`SelfTest`).

        Bridged diodes show only while their switch is pressed: repeat the test, and combine the results with
        :func:`contactfpga.instruments.self_test.merged`. ``timeout`` in seconds. Raises :class:`NoSuchCommand` if the
        board has no self-test, and the errors of :meth:`read`. If the Skin is unknown, so is its mask, and lines that
        do not rise cannot be distinguished from absent ones.
        """
        slots = _run_self_test(self._link, checked(timeout))
        try:
            mask = frozenset(self.skin.mask)
        except ContactFPGAError:
            mask = None
        sheet = self.sheet
        return SelfTest(slots, sheet.rows, sheet.columns, self.hello.guard, mask)

    def set_zero(self, unit: int, reading: int, timeout: float = 1.0) -> Zones:
        """Set the reading of an unloaded pressure unit, in steps of its converter; as :meth:`command`."""
        return self.command(*zero_value(self._unit_facts(), unit, reading), timeout=timeout)

    def set_threshold(self, unit: int, deviation: int, timeout: float = 1.0) -> Zones:
        """Make a unit raise ``contact`` at this deviation from its zero, either way; 0: never. As :meth:`command`."""
        return self.command(*threshold_value(self._unit_facts(), unit, deviation), timeout=timeout)

    def set_sum_threshold(self, index: int, deviation: int, timeout: float = 1.0) -> Zones:
        """:meth:`set_threshold` for a weighted sum of deviations, by its place in the Skin's ``unit_sums``."""
        return self.command(*sum_threshold_value(self._unit_facts(), index, deviation), timeout=timeout)

    def _unit_facts(self) -> UnitFacts:
        if (facts := self.hello.units) is None:
            raise NoSuchCommand(f"{self.port}: this board has no pressure units; build its Skin with units")
        return facts

    def __iter__(self) -> Iterator[Zones]:
        """Every frame, until a recording ends."""
        yield from self._frames

    async def __aiter__(self) -> AsyncIterator[Zones]:
        """Every frame in ``async for``."""
        async for zones in self._frames:
            yield zones

    # ---- its end

    def __enter__(self) -> Board:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    async def __aenter__(self) -> AsyncBoard:
        return AsyncBoard(self, self._link, self._frames, self._expected)

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def greet(self, timeout: float) -> None:
        """Wait for the hello; the frame that answers the request stays for :meth:`next`."""
        if self.live:
            _, number = self._link.read(timeout)
            self._frames.skip_to(number - 1)
            return
        try:
            self._link.wait_for(lambda: self._link.conversation.hello, math.inf, timeout)
        except ReplayEnded:
            raise ContactFPGAError(f"{self.port} holds no hello; its frames cannot be read") from None
        self._frames.raise_first()


class AsyncBoard(BoardFacts):
    """A board in ``async with``, whose waiting methods are coroutines.

    >>> import asyncio
    >>> async def main():
    ...     async with contactfpga.open("sim://?scene=two_fingers") as board:
    ...         return len(await board.next())
    >>> asyncio.run(main())
    2

    :func:`open` itself blocks until the board's hello, at most for its ``timeout``; where no task may block that long,
    use ``await asyncio.to_thread(contactfpga.open, port)``. Commands are methods of :attr:`board`.
    """

    def __init__(self, board: Board, link: Link, frames: Subscription, expected: Skin | None):
        super().__init__(link, frames, expected)
        self.board = board
        """The wrapped board, whose methods block."""

    async def read(self, timeout: float = 1.0) -> Zones:
        """Await the first frame scanned after the call; errors as for :meth:`Board.read`."""
        return await _in_thread(self.board.read, timeout)

    async def next(self, timeout: float = 1.0) -> Zones:
        """Await the next frame; errors as for :meth:`Board.next`. A canceled task takes no frame."""
        return await self._frames.awaited(timeout)

    async def latest(self, timeout: float = 1.0, *, max_age_s: float | None = None) -> Zones:
        """Await the newest frame; errors as for :meth:`Board.latest`."""
        return await _in_thread(lambda timeout: self.board.latest(timeout, max_age_s=max_age_s), timeout)

    async def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> Batch:
        """Await all frames that have come, as arrays; errors as for :meth:`Board.batch`."""
        return await _in_thread(lambda timeout: self.board.batch(max_s, timeout), timeout)

    async def __aiter__(self) -> AsyncIterator[Zones]:
        async for zones in self._frames:
            yield zones


Found = TypeVar("Found")


async def _in_thread(call: Callable[[float], Found], timeout: float) -> Found:
    import asyncio  # a quarter of what contactfpga.open would load

    return await asyncio.to_thread(call, timeout)


@runtime_checkable
class Opening(Protocol):
    """A tap that learns which board sends its bytes."""

    def opened(self, board: Board) -> None:
        """Called before the first byte."""


ATTEMPT_S = 0.5
"""Least time in s after which a self-test with lost slots is repeated."""
SLOT_BITS = 5000
"""Most bits on the wire per slot: the slot, a frame, and sometimes a hello."""


class _SlotListener:
    def __init__(self, link: Link, count: int, attempt_s: float):
        self.whole: tuple[SelfTestSlot, ...] | None = None
        self.attempt_s = attempt_s
        self._count = count
        self._so_far: list[SelfTestSlot] = []
        self._queue = link.queue(QUEUE, all_events=True)

    def look(self) -> bool | None:
        while (item := self._queue.pop()) is not None:
            self._take(item)
        return True if self.whole is not None else None

    def _take(self, item: Zones | SideEvent | ContactFPGAError) -> None:
        if not isinstance(item, SelfTestSlot):
            return
        if item.number == 0 or item.number != len(self._so_far):
            self._so_far = []
        if item.number == len(self._so_far):
            self._so_far.append(item)
        if len(self._so_far) == self._count:
            self.whole = tuple(self._so_far)


def _run_self_test(link: Link, timeout: float) -> tuple[SelfTestSlot, ...]:
    deadline = link.clock() + timeout
    while True:
        slots = _listen_for_slots(link)
        try:
            link.command(Command(SELF_TEST), max(1e-3, deadline - link.clock()))
            link.wait_for(slots.look, min(deadline, link.clock() + slots.attempt_s), timeout)
        except ReadTimeout as error:
            if link.clock() >= deadline:
                raise ReadTimeout(f"{error}; the self-test was not heard as a whole") from None
        if slots.whole is not None:
            return slots.whole


def _listen_for_slots(link: Link) -> _SlotListener:
    hello = link.conversation.hello
    if hello is None:
        raise ContactFPGAError(f"{link.transport.name}: no hello has come yet")
    count = 1 + hello.sheet.rows + hello.sheet.columns
    return _SlotListener(link, count, max(ATTEMPT_S, count * SLOT_BITS / hello.baud))
