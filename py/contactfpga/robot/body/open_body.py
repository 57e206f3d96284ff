"""An open body: a thread per link, and snapshots of all."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING

from contactfpga.driver import forks
from contactfpga.driver.subscription import checked, checked_span
from contactfpga.errors import BoardClosed, ReadTimeout
from contactfpga.robot.body.joints import Joints
from contactfpga.robot.body.known import States
from contactfpga.robot.body.opening import open_board
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.queue import SnapshotQueue
from contactfpga.robot.body.reader import RETRY_S, LinkReader, OpenBoard
from contactfpga.robot.body.snapshot import Snapshot
from contactfpga.robot.body.together import Together
from contactfpga.robot.body.totals import BodyStats, SnapshotBatch

if TYPE_CHECKING:
    from contactfpga.robot.body.body import Body


class OpenBody:
    """Every link's board, read until it is closed: a context manager that iterates snapshots.

    Made by :meth:`Body.open`. No link's failure raises: its state says so, the others go on, and it is opened again as
    soon as it can be.
    """

    def __init__(
        self,
        body: Body,
        joints: Joints | None = None,
        *,
        timeout: float = 1.0,
        period_s: float = 0.002,
        opened: Callable[[Plan], OpenBoard] | None = None,
    ):
        self.body = body
        self._joints = joints
        self._timeout, self._period_s = checked(timeout), period_s
        self._changed = threading.Condition()
        self._changes = self._given = 0
        self._closing = threading.Event()  # beside the condition: no change of a link wakes the other links' threads
        self._queues: list[SnapshotQueue] = []
        self._inherited = False
        forks.watch(self)
        opener, together = opened or self._open_board, Together(self.clock)
        self._readers = {name: LinkReader(plan, opener, self.clock, together) for name, plan in body.links.items()}
        self._threads = [
            threading.Thread(target=self._read, args=(reader,), name=f"reader of link {name}", daemon=True)
            for name, reader in self._readers.items()
        ]
        for thread in self._threads:
            thread.start()
        with self._changed:
            self._changed.wait_for(lambda: all(reader.tried for reader in self._readers.values()))

    def _open_board(self, plan: Plan) -> OpenBoard:
        return open_board(plan, self._timeout)

    @staticmethod
    def clock() -> float:
        """Seconds on the body's clock, ``time.monotonic``; virtual boards' frames are put on it, too."""
        return time.monotonic()

    def _read(self, reader: LinkReader) -> None:
        before = None
        while not self._closing.is_set():
            pause_s = max(reader.step(), self._period_s)
            state = reader.state()
            now = (state.status, state.frame_s)
            if now != before or not reader.tried:
                before = now
                self._tell()
            self._closing.wait(min(pause_s, RETRY_S))

    def _tell(self) -> None:
        with self._changed:
            self._changes += 1
            snapshot = self._snapshot() if self._queues else None
            for queue in self._queues:
                assert snapshot is not None
                queue.put(snapshot)
            self._changed.notify_all()

    def _snapshot(self) -> Snapshot:
        seen = {name: reader.seen() for name, reader in self._readers.items()}
        now = self.clock()
        return Snapshot(self.body, now, States(self.body.links, seen, now), self._joints)

    # ---- snapshots

    def latest(self, timeout: float = 1.0) -> Snapshot:
        """All links as they are now; waits for nothing."""
        checked(timeout)
        self._check_open()
        return self._snapshot()

    def read(self, timeout: float = 1.0) -> Snapshot:
        """All links, each with a frame that was scanned after this call; those of which none came within ``timeout``
        seconds as they are then, which their state and age say."""
        timeout = checked(timeout)
        self._check_open()
        asked = {name: reader.ask() for name, reader in self._readers.items()}

        def settled() -> bool:
            return self._closing.is_set() or all(
                self._readers[name].answered >= number or self._readers[name].state().status in ("lost", "mismatch")
                for name, number in asked.items()
            )

        with self._changed:
            self._changed.wait_for(settled, timeout)
        return self.latest()

    def next(self, timeout: float = 1.0) -> Snapshot:
        """The newest snapshot in which a link has a newer frame or another state than in the last one that this method
        returned. Raises :class:`ReadTimeout` where nothing changes for ``timeout`` seconds, as when every link is
        lost."""
        timeout = checked(timeout)
        with self._changed:
            if not self._changed.wait_for(lambda: self._closing.is_set() or self._changes > self._given, timeout):
                raise ReadTimeout(f"no link has changed within {timeout:g} s: {self._snapshot()}")
            self._given = self._changes
        return self.latest()

    def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> SnapshotBatch:
        """All snapshots of the next ``max_s`` seconds, with their frames as arrays; the first one is waited for, for
        ``timeout`` seconds."""
        max_s = checked_span(max_s)
        with self.subscribe() as queue:
            found = [queue.next(timeout)]
            end_s = self.clock() + max_s
            while (left_s := end_s - self.clock()) > 0:
                try:
                    found.append(queue.next(left_s))
                except ReadTimeout:
                    break
        return SnapshotBatch(found)

    def subscribe(self, maxsize: int = 1024) -> SnapshotQueue:
        """A queue of its own for the snapshot at each change from now on."""
        self._check_open()
        queue = SnapshotQueue(self, maxsize)
        with self._changed:
            self._queues.append(queue)
        return queue

    def __iter__(self) -> Iterator[Snapshot]:
        """The newest snapshot again and again, forever, at every change or once per second."""
        while True:
            yield self._newest()

    async def __aiter__(self) -> AsyncIterator[Snapshot]:
        """The same in ``async for``."""
        while True:
            yield await asyncio.to_thread(self._newest)

    def _newest(self) -> Snapshot:
        try:
            return self.next()
        except ReadTimeout:
            return self.latest()

    @property
    def stats(self) -> BodyStats:
        """Counters since the body was opened."""
        return BodyStats.of({name: reader.stats for name, reader in self._readers.items()})

    def forked(self) -> None:
        """In a child process all ports are closed; its parent goes on."""
        self._changed, self._closing = threading.Condition(), threading.Event()
        self._closing.set()
        self._threads, self._readers, self._inherited = [], {}, True

    def _check_open(self) -> None:
        if self._inherited:
            raise BoardClosed(f"this body {forks.ELSEWHERE}")
        if self._closing.is_set():
            raise BoardClosed("this body was closed; open it again")

    # ---- its end

    def __enter__(self) -> OpenBody:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give all ports back; may be called twice."""
        with self._changed:
            self._closing.set()
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()
        for reader in self._readers.values():
            reader.close()
