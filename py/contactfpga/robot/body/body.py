"""A robot with a sheet on each of several links, by `robot.toml`; an open body has a thread per link."""

from __future__ import annotations

import asyncio
import collections
import dataclasses
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from contactfpga.choices.choice import trusted
from contactfpga.driver import forks
from contactfpga.driver.address import MAX_LINKS
from contactfpga.driver.subscription import checked, checked_span
from contactfpga.errors import BoardClosed, ReadTimeout
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown, suggestion
from contactfpga.robot.body import plan
from contactfpga.robot.body import urdf as urdf_file
from contactfpga.robot.body.joints import Joints
from contactfpga.robot.body.kinematics import Kinematics
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import RETRY_S, LinkReader, OpenBoard, SharedClock, States, open_board
from contactfpga.robot.body.snapshot import BodyStats, Snapshot, SnapshotBatch
from contactfpga.robot.body.state import BodyError

KEYS = ("urdf", "links")


@dataclasses.dataclass(frozen=True, eq=False)
class Body:
    """The links with a sheet, and their kinematics."""

    links: dict[str, Plan]
    kinematics: Kinematics | None = None
    """Kinematics of the links; None without a URDF, which leaves no base frame."""
    urdf: Path | None = None
    """The URDF file of the kinematics."""

    @classmethod
    def load(cls, path: str | Path, trust: bool = False) -> Body:
        """Read `robot.toml`, whose paths are relative to its folder; ``trust`` as for :meth:`contactfpga.Skin.load`.
        Raises :class:`BodyError`, OSError."""
        path = Path(path)
        values = tomlfile.load(path, BodyError)
        try:
            with trusted(trust):
                return cls.of(values, path.parent)
        except BodyError as error:
            raise BodyError(f"{path}: {error}") from None

    @classmethod
    def of(cls, values: Mapping[str, Any], folder: Path) -> Body:
        """A body from the values of a `robot.toml`; paths are relative to ``folder``. Raises :class:`BodyError`,
        OSError."""
        for key in values:
            if key not in KEYS:
                raise BodyError(f"unknown key {shown(key)}; {suggestion(key, KEYS)}")
        tables = values.get("links")
        if not isinstance(tables, list) or not tables:
            raise BodyError("there is no link; give a table [[links]] with name, skin and port for each")
        if len(tables) > MAX_LINKS:
            raise BodyError(f"{len(tables)} links; the limit is {MAX_LINKS}")
        urdf = urdf_file.located(plan.text(values, "urdf"), folder) if "urdf" in values else None
        kinematics = None if urdf is None else Kinematics(urdf_file.load(urdf))
        return cls(_by_name([plan.read(one, folder) for one in tables], kinematics), kinematics, urdf)

    def open(self, joints: Joints | None = None, *, timeout: float = 1.0, period_s: float = 0.002) -> OpenBody:
        """Open every link's board, each in its own thread, and return when each was tried once; boards that do not
        answer are retried.

        Args:
         joints: a function from a time on the host's clock to the joint angles, such as a :class:`JointHistory`;
             without it there are only contacts in the links' frames.
         timeout: seconds for a board's hello.
         period_s: shortest interval of reading a link's newest frame.
        """
        if joints is not None and not callable(joints):
            raise TypeError(f"joints is {shown(joints)}; it must be a function of a time, such as a JointHistory")
        return OpenBody(self, joints, timeout=timeout, period_s=period_s)


def _by_name(plans: list[Plan], kinematics: Kinematics | None) -> dict[str, Plan]:
    found: dict[str, Plan] = {}
    ports: dict[str, str] = {}
    for one in plans:
        if one.name in found:
            raise BodyError(f"two links are named {shown(one.name)}")
        if kinematics is not None and one.frame not in kinematics.robot.links:
            raise BodyError(f"link {shown(one.name)}: frame is {shown(one.frame)}; the URDF has no such link")
        if one.port is not None and not one.port.startswith("sim:"):
            if one.port in ports:
                both = f"{shown(ports[one.port])} and {shown(one.name)}"
                raise BodyError(f"links {both} have one port, {shown(one.port)}")
            ports[one.port] = one.name
        if one.folds is not None and kinematics is not None and one.folds.joint not in kinematics.joint_names:
            raise BodyError(f"link {shown(one.name)}: its folds are of joint {shown(one.folds.joint)}; there is none")
        found[one.name] = one
    return found


class OpenBody:
    """Every link's board, read until it is closed: a context manager that iterates snapshots.

    A link's failure does not raise: it is in the link's state, and the link is reopened as soon as possible.
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
        self._changes = _Changes()
        self._given = 0  # the last change that next() has returned
        self._batched: collections.Counter[str] = collections.Counter()  # frames of each link in batches
        forks.watch(self)
        opener, shared_clock = opened or self._open_board, SharedClock(self.clock)
        self._readers = {name: LinkReader(plan, opener, self.clock, shared_clock) for name, plan in body.links.items()}
        self._threads = [
            threading.Thread(target=self._read, args=(reader,), name=f"reader of link {name}", daemon=True)
            for name, reader in self._readers.items()
        ]
        for thread in self._threads:
            thread.start()
        self._changes.wait_for(lambda: all(reader.tried for reader in self._readers.values()))

    def _open_board(self, plan: Plan) -> OpenBoard:
        return open_board(plan, self._timeout)

    @staticmethod
    def clock() -> float:
        """Seconds on the body's clock, ``time.monotonic``, also for virtual boards' frames."""
        return time.monotonic()

    def _read(self, reader: LinkReader) -> None:
        before = None
        while not self._changes.closed.is_set():
            pause_s = max(reader.step(), self._period_s)
            state = reader.state()
            now = (state.status, state.frame_s)
            if now != before or not reader.tried:
                before = now
                self._changes.announce(self._snapshot)
            self._changes.closed.wait(min(pause_s, RETRY_S))

    def _snapshot(self) -> Snapshot:
        observed = {name: reader.observe() for name, reader in self._readers.items()}
        now = self.clock()
        return Snapshot(self.body, now, States(self.body.links, observed, now), self._joints)

    # ---- snapshots

    def latest(self, timeout: float = 1.0) -> Snapshot:
        """All links as they are now, without waiting."""
        checked(timeout)
        self._changes.check_open()
        return self._snapshot()

    def read(self, timeout: float = 1.0) -> Snapshot:
        """All links, each with a frame scanned after this call, or in its state after ``timeout`` seconds."""
        timeout = checked(timeout)
        self._changes.check_open()
        asked = {name: reader.ask() for name, reader in self._readers.items()}

        def settled() -> bool:
            return all(
                self._readers[name].answered >= number or self._readers[name].state().status in ("lost", "mismatch")
                for name, number in asked.items()
            )

        self._changes.wait_for(settled, timeout)
        return self.latest()

    def next(self, timeout: float = 1.0) -> Snapshot:
        """The newest snapshot in which a link has a newer frame or another state than in the last one returned. Raises
        :class:`ReadTimeout` if nothing changes for ``timeout`` seconds."""
        timeout = checked(timeout)
        with self._changes.condition:
            if not self._changes.wait_for(lambda: self._changes.count > self._given, timeout):
                raise ReadTimeout(f"no link has changed within {timeout:g} s: {self._snapshot()}")
            self._given = self._changes.count
        return self.latest()

    def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> SnapshotBatch:
        """All snapshots of the next ``max_s`` seconds, after waiting up to ``timeout`` seconds for the first."""
        max_s = checked_span(max_s)
        with self.subscribe() as queue:
            found = [queue.next(timeout)]
            end_s = self.clock() + max_s
            while (left_s := end_s - self.clock()) > 0:
                try:
                    found.append(queue.next(left_s))
                except ReadTimeout:
                    break
        batch = SnapshotBatch(found)
        with self._changes.condition:
            batch.continue_from(self._batched)
        return batch

    def subscribe(self, maxsize: int = 1024) -> SnapshotQueue:
        """A separate queue for the snapshot at each change from now on."""
        return self._changes.subscribe(maxsize)

    def __iter__(self) -> Iterator[Snapshot]:
        """The newest snapshot, forever, at every change or once per second."""
        while True:
            yield self._newest()

    async def __aiter__(self) -> AsyncIterator[Snapshot]:
        """The newest snapshot in ``async for``, as in :meth:`__iter__`."""
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
        """Close all ports in a child process; the parent goes on."""
        self._changes.forked()
        self._threads, self._readers = [], {}

    # ---- its end

    def __enter__(self) -> OpenBody:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release all ports; may be called twice."""
        self._changes.close()
        for thread in self._threads:
            thread.join()
        for reader in self._readers.values():
            reader.close()


class SnapshotQueue:
    """Snapshots from a moment on; at most ``maxsize`` wait, then the oldest are dropped and counted."""

    def __init__(self, changes: _Changes, maxsize: int):
        if isinstance(maxsize, bool) or not isinstance(maxsize, int) or maxsize < 1:
            raise ValueError(f"maxsize is {maxsize!r}; it must be a whole number of snapshots, 1 or more")
        self._changes = changes
        self._waiting: collections.deque[Snapshot] = collections.deque(maxlen=maxsize)
        self.dropped = 0
        """Snapshots that were not read in time."""

    def put(self, snapshot: Snapshot) -> None:
        """Add a snapshot; the caller holds the condition of the body's changes."""
        self.dropped += len(self._waiting) == self._waiting.maxlen
        self._waiting.append(snapshot)

    def next(self, timeout: float = 1.0) -> Snapshot:
        """The next snapshot, in order. Raises :class:`ReadTimeout`, :class:`BoardClosed`."""
        with self._changes.condition:
            self._wait(checked(timeout))
            return self._waiting.popleft()

    def _wait(self, timeout: float) -> None:
        with self._changes.condition:
            self._changes.wait_for(lambda: self._waiting, timeout)
            self._changes.check_open()
            if not self._waiting:
                raise ReadTimeout(f"no link has changed within {timeout:g} s")

    def close(self) -> None:
        """Accept no more snapshots."""
        self._changes.unsubscribe(self)

    def __enter__(self) -> SnapshotQueue:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Snapshot]:
        while True:
            yield self.next()

    async def __aiter__(self) -> AsyncIterator[Snapshot]:
        while True:
            await asyncio.to_thread(self._wait, 1.0)
            yield self.next()  # which waits for nothing now, and takes none if we were canceled above


class _Changes:
    def __init__(self) -> None:
        self.condition = threading.Condition()
        self.closed = threading.Event()  # beside the condition: no change of a link wakes the other links' threads
        self.count = 0
        self._queues: list[SnapshotQueue] = []
        self._inherited = False

    def announce(self, snapshot: Callable[[], Snapshot]) -> None:
        """Count a change; the snapshot is made only for a queue."""
        with self.condition:
            self.count += 1
            taken = snapshot() if self._queues else None
            for queue in self._queues:
                assert taken is not None
                queue.put(taken)
            self.condition.notify_all()

    def wait_for(self, happened: Callable[[], object], timeout: float | None = None) -> bool:
        with self.condition:
            return bool(self.condition.wait_for(lambda: self.closed.is_set() or happened(), timeout))

    def check_open(self) -> None:
        if self._inherited:
            raise BoardClosed(f"this body {forks.ELSEWHERE}")
        if self.closed.is_set():
            raise BoardClosed("this body was closed; open it again")

    def subscribe(self, maxsize: int) -> SnapshotQueue:
        self.check_open()
        queue = SnapshotQueue(self, maxsize)
        with self.condition:
            self._queues.append(queue)
        return queue

    def unsubscribe(self, queue: SnapshotQueue) -> None:
        with self.condition:
            if queue in self._queues:
                self._queues.remove(queue)

    def close(self) -> None:
        with self.condition:
            self.closed.set()
            self.condition.notify_all()

    def forked(self) -> None:
        self.condition, self.closed = threading.Condition(), threading.Event()
        self.closed.set()
        self._inherited = True
