"""The queue of frames that wait for one listener of a board."""

from __future__ import annotations

import collections
import threading

from contactfpga.driver.events import SideEvent
from contactfpga.errors import ContactFPGAError
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones


class FrameQueue:
    """A queue of at most ``maxsize`` frames, errors and events between frames, which drops the oldest when full. The
    caller holds the board's lock.
    """

    def __init__(self, maxsize: int, all_events: bool = False, came: int = 0):
        self.maxsize = maxsize
        self.all_events = all_events
        self.dropped = 0
        self.shown = 0
        """Number of the last frame given by :meth:`show`; frames up to it are dropped."""
        self.others = 0
        """Number of waiting items that are no frames."""
        self._items: collections.deque[Run | SideEvent | ContactFPGAError] = collections.deque()
        self._giving = threading.Lock()  # lest one frame be shown and popped
        self._taken = 0  # frames of the run in front
        self._came = self._gone = came  # frames, which have numbers from 1; those that wait no more

    def __len__(self) -> int:
        return max(0, self._came - self.seen) + self.others

    @property
    def seen(self) -> int:
        """Number of the last frame that the listener got, or that was dropped."""
        return max(self._gone, self.shown)

    def show(self, number: int) -> bool:
        """Mark a frame as given to the listener outside of the queue; False if it already had it. The caller need not
        hold the board's lock.
        """
        with self._giving:
            if number <= self.seen:
                return False
            self.shown = number
            return True

    def put(self, item: Run | SideEvent | ContactFPGAError) -> None:
        self._items.append(item)
        if isinstance(item, Run):
            self._came += len(item)
        else:
            self.others += 1
        self._drop_shown()
        while self._held > self.maxsize:
            self.dropped += self._drop(self._held - self.maxsize)

    def pop(self) -> Zones | SideEvent | ContactFPGAError | None:
        """The next item; None if nothing waits."""
        with self._giving:
            return self._popped()

    def _popped(self) -> Zones | SideEvent | ContactFPGAError | None:
        self._drop_shown()
        if not self._items:
            return None
        item = self._items[0]
        zones = item[self._taken] if isinstance(item, Run) else item
        self._drop(1)
        return zones

    def pop_frames(self) -> list[Run]:
        """All waiting frames up to the first error."""
        found: list[Run] = []
        with self._giving:
            self._drop_shown()
            self._unwrap()
            while self._items and isinstance(item := self._items[0], Run):
                found.append(item)
                self._drop(len(item))
        return found

    def first_error(self) -> ContactFPGAError | None:
        """The next item if it is an error, which stays in the queue."""
        return self._items[0] if self._items and isinstance(self._items[0], ContactFPGAError) else None

    def keep_last(self) -> None:
        """Drop all but the last item, or raise the first error."""
        self._drop_shown()
        while self._held > 1:
            error = self.first_error()
            self._drop(self._held - 1)
            if error is not None:
                raise error
        self._unwrap()  # so that the others do not become Python's numbers with it

    def drop_older(self, moment: float) -> None:
        """Drop a single waiting frame that arrived before ``moment``."""
        self._drop_shown()
        item = self._items[0] if self._held == 1 else None
        if isinstance(item, Run) and (arrived_s := item[self._taken].arrived_s) is not None and arrived_s < moment:
            self.clear()

    def clear(self) -> None:
        self._items.clear()
        self._gone = self._came
        self._taken = self.others = 0

    @property
    def _held(self) -> int:
        """Number of waiting frames, with shown ones, which another thread may change."""
        return self._came - self._gone + self.others

    def _drop(self, most: int) -> int:
        item = self._items[0]
        if not isinstance(item, Run):
            self._items.popleft()
            self.others -= 1
            return 0
        count = min(most, len(item) - self._taken)
        self._gone += count
        self._taken += count
        if self._taken == len(item):
            self._items.popleft()
            self._taken = 0
        return count

    def _drop_shown(self) -> None:
        while self._items and self._gone < self.shown:
            self._drop(self.shown - self._gone)

    def _unwrap(self) -> None:
        if self._taken:
            run = self._items[0]
            assert isinstance(run, Run)
            self._items[0] = run.after(self._taken)
            self._taken = 0
