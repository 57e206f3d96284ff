"""Memory that one process writes and others read without a lock: no copy is torn, nothing is lost unseen."""

import os
import random
import time

import pytest
from fake_board import background

from contactfpga.driver import shared
from contactfpga.driver.shared import ERROR, FRAME, PAD, SIDE, Ring, Slot, WriterGone


class Between:
    """Memory of a reader in which something happens in the middle of a copy."""

    def __init__(self, memory, happen):
        self._memory, self._happen = memory, happen

    def __getitem__(self, place):
        if not isinstance(place, slice):
            return self._memory[place]
        middle = (place.start + place.stop) // 2
        first = bytes(self._memory[place.start : middle])
        self._happen()
        return first + bytes(self._memory[middle : place.stop])


def written(number):
    """Bytes that belong together, of a length of their own."""
    return bytes([number % 251]) * (40 + number % 7)


class Interrupted(Slot):
    """A slot that is written while it is read, so often as the test says."""

    def __init__(self, memory, writes):
        super().__init__(memory)
        self._writer, self._left, self._number = Slot(memory), writes, 0
        self._bytes = Between(memory, self._happen)

    def _happen(self):
        if self._left:
            self._left -= 1
            self._number += 1
            self._writer.write(written(self._number))


class Unchecked(Interrupted):
    """The planted fault: it does not look a second time."""

    def _same(self, before):
        return True


def is_whole(data):
    return any(data == written(number) for number in range(252 * 7))


@pytest.mark.parametrize("writes", [0, 1, 2, 15])
def test_a_slot_gives_what_one_write_put_there(writes):
    memory = memoryview(bytearray(256))
    Slot(memory).write(written(0))
    assert Interrupted(memory, writes).read() == written(writes)


def test_without_the_second_look_a_copy_is_torn():
    memory = memoryview(bytearray(256))
    Slot(memory).write(written(0))
    assert not is_whole(Unchecked(memory, 1).read())


def test_where_stores_change_places_a_sum_tells(monkeypatch):
    monkeypatch.setattr(shared, "ORDERED", False)
    memory = memoryview(bytearray(256))
    Slot(memory).write(written(0))
    assert Unchecked(memory, 3).read() == written(3)


def test_a_slot_whose_writer_ended_in_the_middle_is_told_of(monkeypatch):
    monkeypatch.setattr(shared, "PATIENCE_S", 0.01)
    memory = memoryview(bytearray(256))
    slot = Slot(memory)
    slot.write(b"x")
    memory.cast("Q")[0] += 1
    with pytest.raises(WriterGone):
        slot.read()


def test_what_is_too_long_is_refused():
    slot = Slot(memoryview(bytearray(64)))
    with pytest.raises(ValueError, match="49 bytes are too many for a slot of 48"):
        slot.write(bytes(49))
    ring = Ring(memoryview(bytearray(Ring.HEAD + 1024)))
    ring.begin()
    with pytest.raises(ValueError, match="too long for a ring of 1024"):
        ring.put(FRAME, bytes(300), 1)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_another_process_that_writes_all_the_time_tears_nothing():
    import mmap

    memory = memoryview(mmap.mmap(-1, 1 << 18))
    slot, stop = Slot(memory[: 1 << 17]), memory[1 << 17 :]
    slot.write(bytes(8))
    child = os.fork()
    if not child:
        number = 0
        while not stop[0]:
            number += 1
            slot.write(number.to_bytes(8, "little") * (1 + number % 4096))
        os._exit(0)
    try:
        seen, until = set(), time.monotonic() + 0.7
        while time.monotonic() < until:
            data = slot.read()
            number = data[:8]
            assert data == number * (len(data) // 8)
            assert not seen or int.from_bytes(number, "little") >= max(seen)
            seen.add(int.from_bytes(number, "little"))
    finally:
        stop[0] = 1
        os.waitpid(child, 0)
    assert len(seen) > 3


class Model:
    """The messages of a ring as a list, with where each begins and ends."""

    def __init__(self, size):
        self.memory = memoryview(bytearray(Ring.HEAD + size))
        self.ring = Ring(self.memory)
        self.ring.begin()
        self.messages = []

    def put(self, rng):
        kind = rng.choice([FRAME, FRAME, FRAME, ERROR, SIDE])
        body = bytes([len(self.messages) % 256]) * rng.randrange(192)
        frames = rng.choice([1, 1, 30]) if kind == FRAME else 0
        self.ring.put(kind, body, frames, len(self.messages))
        self.messages.append((kind, body, frames))


def messages_from(ring, place, head):
    """(place, message, body) of all from there on, and how often something was overwritten."""
    found, gaps = [], 0
    while place < head:
        message = ring.look(place)
        body = None if message is None else ring.body(place) if message.kind != PAD else b""
        if message is None or body is None:
            gaps += 1
            place = ring.tail
            continue
        if message.kind != PAD:
            found.append((message, body))
        place = message.end
    return found, gaps


@pytest.mark.parametrize("size", [1024, 4096])
def test_a_ring_keeps_the_newest_messages_in_order(size, rng):
    model = Model(size)
    for _ in range(120):
        for _ in range(rng.randrange(4)):
            model.put(rng)
        model.ring.publish(7, 12, 11, 1.5)
        marks = model.ring.marks()
        assert (marks.facts, marks.bytes, marks.last_bytes, marks.last_s) == (7, 12, 11, 1.5)
        assert marks.frames == sum(frames for _, _, frames in model.messages)
        assert marks.errors == sum(kind == ERROR for kind, _, _ in model.messages)
        assert marks.sides == sum(kind == SIDE for kind, _, _ in model.messages)
        found, gaps = messages_from(model.ring, model.ring.tail, marks.head)
        assert not gaps
        assert [(m.kind, body, m.frames) for m, body in found] == model.messages[len(model.messages) - len(found) :]
        for number, (message, _) in enumerate(found, len(model.messages) - len(found)):
            before = model.messages[:number]
            assert message.frames_before == sum(frames for _, _, frames in before)
            assert message.errors_before == sum(kind == ERROR for kind, _, _ in before)
        kept = sum(64 + len(body) for _, body in found)
        assert len(found) == len(model.messages) or kept > size // 2
    assert len(model.messages) > len(found)


class Unkept(Ring):
    """The planted fault: it does not look whether a message was overwritten while it was copied."""

    def _kept(self, place):
        return True


@pytest.mark.parametrize("kind", [Ring, Unkept])
def test_a_message_that_is_overwritten_during_the_copy_is_not_taken(kind):
    model = Model(1024)
    rng = random.Random(1)
    ring = kind(model.memory)
    torn = taken = 0
    for _ in range(300):
        model.put(rng)
        model.ring.publish(0, 0, 0, 0.0)
        place = model.ring.tail
        message = model.ring.look(place)
        if message.kind == PAD:
            continue
        known = next(body for m, body in [(message, model.ring.body(place))])
        ring._bytes = BetweenBytes(model.memory[Ring.HEAD :], lambda: [model.put(rng) for _ in range(6)])
        body = ring.body(place)
        taken += 1
        torn += body is not None and body != known
    assert taken > 100
    assert (torn == 0) == (kind is Ring)


class BetweenBytes(Between):
    def __len__(self):
        return len(self._memory)


def test_readers_of_a_ring_that_is_written_meanwhile_see_the_newest(rng):
    """In a thread, which the interpreter switches to at any moment."""
    model = Model(4096)
    model.put(rng)
    model.ring.publish(0, 0, 0, 0.0)
    done = []

    def write():
        while not done:
            model.put(rng)
            model.ring.publish(0, 0, 0, 0.0)

    with background(write):
        newest, until = 0, time.monotonic() + 0.3
        while time.monotonic() < until:
            marks = model.ring.marks()
            message = model.ring.look(marks.last) if marks.last >= 0 else None
            assert marks.frames >= newest
            newest = marks.frames
            assert message is None or message.frames_before < marks.frames
        done.append(True)
    assert newest > 10
