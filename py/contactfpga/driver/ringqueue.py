"""The frames that wait for one listener, in memory that another process writes."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from typing import Protocol

from contactfpga.driver.events import SideEvent
from contactfpga.driver.packed import Last, unpack_error, unpack_frame, unpack_run
from contactfpga.driver.shared import ERROR, FRAME, PAD, SIDE, SWEEP, Marks, Message, Ring
from contactfpga.errors import ContactFPGAError
from contactfpga.skin.sheet import Sheet
from contactfpga.zones.run import Run
from contactfpga.zones.units import UnitHistory
from contactfpga.zones.zone import Zones

Item = Zones | Run | SideEvent | ContactFPGAError


class Belongings(Protocol):
    """What frames belong to, by the numbers that they carry."""

    def sheets(self) -> dict[int, Sheet]:
        """Of each sheet."""

    def histories(self) -> Mapping[int, UnitHistory]:
        """Of the pressure units since each power-up."""

    def place_of(self, zones: Zones) -> int:
        """Where a frame that was asked for begins in the ring; -1: it was not."""


class Cursor:
    """A place in a ring up to which everything was taken. What is overwritten before it is taken is counted."""

    def __init__(self, ring: Ring, belongings: Belongings):
        self.ring = ring
        self.lost = 0
        """Frames that were overwritten before they were taken."""
        marks = ring.marks()
        self.place = marks.head
        self.frames, self.errors, self.sides = marks.frames, marks.errors, marks.sides
        self.taken = 0  # frames of the message at this place
        self._belongings = belongings
        self._run: Run | None = None  # at this place
        self._last: Last | None = None

    def message(self, marks: Marks) -> Message | None:
        """What comes next; None where nothing does."""
        while self.place < marks.head:
            if self.ring.tail > marks.head:  # more was overwritten than is shown
                return None
            found = self.ring.look(self.place)
            if found is None:
                self.place, self.taken, self._run = self.ring.tail, 0, None
            elif found.kind == PAD:
                self.place = found.end
            else:
                if found.frames_before > self.frames - self.taken:
                    self.lost += found.frames_before - self.frames
                    self.frames, self.taken = found.frames_before, 0
                self.errors, self.sides = found.errors_before, found.sides_before
                return found
        return None

    def skip(self, message: Message) -> None:
        """Take all of a message."""
        self.frames = message.frames_before + message.frames
        self.errors = message.errors_before + (message.kind == ERROR)
        self.sides = message.sides_before + (message.kind == SIDE)
        self.place, self.taken, self._run = message.end, 0, None

    def drop(self, message: Message, most: int) -> int:
        """Take at most ``most`` frames of a message, or all of a message without frames; returns how many it took."""
        if message.frames - self.taken <= most or not message.frames:
            left = max(1, message.frames - self.taken)
            self.skip(message)
            return left
        self.taken += most
        self.frames += most
        return most

    def jump(self, place: int, message: Message) -> None:
        """Go to the last frame of a message ahead."""
        if place != self.place:
            self._run = None
        self.place, self.taken = place, max(0, message.frames - 1)
        self.frames = message.frames_before + self.taken
        self.errors, self.sides = message.errors_before, message.sides_before

    def item(self, message: Message) -> Item | None:
        """What the message holds, not taken; None where it was overwritten meanwhile. Of a run it is all of it."""
        if self._run is not None:
            return self._run
        body = self.ring.body(self.place)
        if body is None:
            return None
        sheets, histories = self._belongings.sheets(), self._belongings.histories()
        if message.kind == FRAME:
            zones, self._last = unpack_frame(body, sheets, histories, self._last)
            return zones
        if message.kind == ERROR:
            return unpack_error(body)[0]
        if message.kind == SIDE:
            side: SideEvent = pickle.loads(body)
            return side
        self._run = unpack_run(body, sheets, histories)
        return self._run


class RingQueue:
    """What :class:`contactfpga.driver.framequeue.FrameQueue` does, with frames that stay in the ring until they are
    taken. At most ``maxsize`` wait, and no more than the ring holds; ``all_events``: also what is told between frames.
    """

    def __init__(self, ring: Ring, belongings: Belongings, maxsize: int, all_events: bool):
        self.maxsize = maxsize
        self.all_events = all_events
        self._left_out = (SWEEP,) if all_events else (SWEEP, SIDE)
        self._ring = ring
        self._belongings = belongings
        self._cursor = Cursor(ring, belongings)
        self._front: list[Zones | SideEvent] = []
        self._dropped = 0

    def __len__(self) -> int:
        marks = self._ring.marks()
        self._cursor.message(marks)  # past what is overwritten
        return min(self._length(marks), self.maxsize)

    def _length(self, marks: Marks) -> int:
        cursor = self._cursor
        waiting = marks.frames - cursor.frames + marks.errors - cursor.errors
        return len(self._front) + waiting + (marks.sides - cursor.sides if self.all_events else 0)

    @property
    def dropped(self) -> int:
        """Frames that were not taken in time."""
        self._fit(self._ring.marks())
        return self._dropped + self._cursor.lost

    def _next(self, marks: Marks) -> Message | None:
        """What comes next of what this queue takes."""
        while (found := self._cursor.message(marks)) is not None and found.kind in self._left_out:
            self._cursor.skip(found)
        return found

    def _fit(self, marks: Marks) -> None:
        """Drop what is more than may wait."""
        while self._length(marks) > self.maxsize:
            if self._front:
                self._dropped += isinstance(self._front.pop(0), Zones)
                continue
            found = self._next(marks)  # past what is overwritten
            if found is None:
                return
            if (more := self._length(marks) - self.maxsize) > 0:
                self._dropped += bool(found.frames) * self._cursor.drop(found, more)

    def put_back(self, zones: Zones | SideEvent) -> None:
        """Have this come next."""
        self._front.insert(0, zones)

    def pop(self) -> Zones | SideEvent | ContactFPGAError | None:
        """What comes next; None where nothing waits."""
        marks = self._ring.marks()
        self._fit(marks)
        if self._front:
            return self._front.pop(0)
        while (found := self._next(marks)) is not None:
            if (item := self._item(found)) is None:
                continue
            if isinstance(item, Run):
                item = item[self._cursor.taken]
            self._cursor.drop(found, 1)
            return item
        return None

    def _item(self, message: Message) -> Item | None:
        try:
            return self._cursor.item(message)
        except KeyError:  # of a sheet before many others
            self._dropped += self._cursor.drop(message, message.frames)
            return None

    def pop_frames(self) -> list[Zones | Run]:
        """All frames that wait, up to the first error."""
        marks = self._ring.marks()
        self._fit(marks)
        found: list[Zones | Run] = []
        while self._front and isinstance(first := self._front[0], Zones):
            found.append(first)
            self._front.pop(0)
        if self._front:
            return found
        while (message := self._next(marks)) is not None and message.frames:
            item, taken = self._item(message), self._cursor.taken
            if item is None:
                continue
            assert isinstance(item, (Zones, Run))
            found.append(item.after(taken) if isinstance(item, Run) and taken else item)
            self._cursor.skip(message)
        return found

    def first_error(self) -> ContactFPGAError | None:
        """The error that comes next, if one does; it stays."""
        if self._front:
            return None
        found = self._next(self._ring.marks())
        item = self._item(found) if found is not None and found.kind == ERROR else None
        return item if isinstance(item, ContactFPGAError) else None

    def skip_to(self, zones: Zones) -> None:
        """Drop this frame, which was asked for, and all that came before it."""
        marks, place = self._ring.marks(), self._belongings.place_of(zones)
        if place < self._cursor.place:
            return
        self._front.clear()
        while (found := self._cursor.message(marks)) is not None and self._cursor.place <= place:
            self._cursor.skip(found)

    def keep_last(self) -> None:
        """Drop all but what came last, or up to the first error, which is raised."""
        marks = self._ring.marks()
        if marks.errors == self._cursor.errors and not self.all_events:
            self._keep_newest(marks)
            return
        self._fit(marks)
        while (more := self._length(marks) - 1) > 0:
            if self._front:
                self._front.pop(0)
                continue
            found = self._next(marks)
            if found is None:
                return
            error = self._item(found) if found.kind == ERROR else None
            self._cursor.drop(found, more)
            if isinstance(error, ContactFPGAError):
                raise error

    def _keep_newest(self, marks: Marks) -> None:
        """The same where nothing but frames waits: as soon for many as for a few."""
        self._cursor.message(marks)  # past what is overwritten
        self._dropped += max(0, self._length(marks) - self.maxsize)
        if marks.frames == self._cursor.frames:
            del self._front[:-1]
            return
        self._front.clear()
        while (newest := self._ring.look(marks.last)) is None:
            marks = self._ring.marks()
        self._cursor.jump(marks.last, newest)

    def drop_older(self, moment: float) -> None:
        """Drop a frame that waits alone and came before that moment."""
        marks = self._ring.marks()
        if self._length(marks) != 1:
            return
        if self._front:
            item: Item | None = self._front[0]
        else:
            found = self._next(marks)
            item = self._item(found) if found is not None else None
        if isinstance(item, Run):
            item = item[self._cursor.taken]
        if isinstance(item, Zones) and item.arrived_s is not None and item.arrived_s < moment:
            self.pop()

    def clear(self) -> None:
        """Drop everything."""
        self._front.clear()
        marks = self._ring.marks()
        while (found := self._cursor.message(marks)) is not None:
            self._cursor.skip(found)
