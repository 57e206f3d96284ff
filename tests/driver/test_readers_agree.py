"""A process that reads a port says what a thread says: the same events, counters and times on the same histories."""

import random

import pytest
from byte_histories import SKINS, History, damaged
from model_board import ModelBoard
from reader_pair import Pair
from sample import sample
from wire import digits, seal

import contactfpga
from contactfpga.driver import reader
from contactfpga.errors import ContactFPGAError
from contactfpga.wire.command import Command
from contactfpga.zones.batch import Batch
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

NAMES = [*SKINS, "guard", "units"]
ALL = SKINS | {"guard": contactfpga.Skin(guard=True), "units": contactfpga.Skin(units=2)}

pytestmark = pytest.mark.skipif(not hasattr(__import__("os"), "memfd_create"), reason="this system has no memfd_create")


@pytest.fixture
def pairs():
    """Makes pairs, which are closed at the end."""
    made = []

    def make(*arguments):
        made.append(Pair(*arguments))
        return made[-1]

    yield make
    for pair in made:
        pair.close()


def told(item):
    """All that a user can see of what came."""
    if isinstance(item, Zones):
        return repr((item.to_dict(), sorted(item.flags), item.sheet, item.frame.heard, item.suspects))
    if isinstance(item, Run):
        return [told(zones) for zones in item]
    return repr(item)


class Side(History):
    """A board that also tells of its lines and its units."""

    def __init__(self, skin, rng):
        super().__init__(skin, rng)
        self.swept = 0

    def happening(self):
        if self.skin.guard and self.rng.random() < 0.5:
            self.board.word = self.rng.choice([0, 1, 6])
            return self.board.report()
        if self.skin.units and self.rng.random() < 0.8:
            return b"".join(self.sweep() for _ in range(self.rng.randrange(1, 5)))
        return super().happening()

    def sweep(self):
        data = b"".join(digits(self.rng.randrange(4096), 2) for _ in range(self.skin.units))
        time_us = self.board.time_us + self.rng.choice([-90, -50, 0, 40])
        data += digits(time_us % 2**24 + self.swept % 256 * 2**24, 5) + bytes([0x80])
        self.swept += self.rng.choice([1, 1, 1, 2])
        return seal(data, self.board.wire.known.fingerprint[:2]) + self.board.frame()


def facts(link):
    """What a board says of itself, and what is counted."""
    said = link.conversation
    history = said.units.history
    units = history and (history.count, history.lows, history.highs, history.last and history.last.sequence)
    with link.changed:
        silence = str(link.silence(0.0))
    return repr((said.hello, said.lines.told, said.stats, sorted(said.numbers), link.last_s, units, silence))


class Followers:
    """Two queues of the same kind, one on each link."""

    def __init__(self, pair, rng, maxsize, all_events=False):
        self.queues = [link.queue(maxsize, all_events) for link in pair.links]
        self.rng, self.all_events = rng, all_events
        self.seen = 0

    def step(self):
        thread, process = self.queues
        assert len(thread) == len(process)
        assert thread.dropped == process.dropped
        assert repr(thread.first_error()) == repr(process.first_error())
        match self.rng.randrange(6):
            case 0 | 1:
                self.pop(self.rng.randrange(40))
            case 2 if not self.all_events:
                found = [queue.pop_frames() for queue in self.queues]
                flat = [[told(z) for one in some for z in (one if isinstance(one, Run) else [one])] for some in found]
                assert flat[0] == flat[1]
                self.seen += len(flat[0])
            case 3 if not self.all_events:
                assert self.kept(thread) == self.kept(process)
            case 4:
                self.pop(1)
            case 5 if self.rng.random() < 0.05:
                thread.clear(), process.clear()

    def kept(self, queue):
        try:
            queue.keep_last()
        except ContactFPGAError as error:
            return repr(error)
        return len(queue)

    def pop(self, count):
        for _ in range(count):
            found = [queue.pop() for queue in self.queues]
            assert told(found[0]) == told(found[1])
            if found[0] is None:
                return
            self.seen += 1


@pytest.mark.parametrize(
    ("name", "seed"),
    sample(
        [(name, seed) for name in NAMES for seed in range(12)],
        quick=[(name, 0) for name in ("moments", "guard", "units")],
        slow=[(name, 1) for name in NAMES],
    ),
)
def test_both_say_the_same_of_any_history(name, seed, pairs):
    rng = random.Random(f"{name} {seed}")
    skin = ALL[name]
    history, pair = Side(skin, rng), pairs(rng.choice([None, skin]))
    followers = [
        Followers(pair, rng, maxsize, every)
        for maxsize, every in ((1, False), (10, False), (5000, False), (5000, True), (30, True))
    ]
    stream, waiting, commanded, answered = b"", [], None, 0
    for _ in range(40):
        until = pair.now + rng.choice([0.05, 1.0])
        if rng.random() < 0.4:
            waiting.append(ask(pair, until))
        if commanded is None and rng.random() < 0.2 and pair.thread.conversation.hello is not None:
            commanded = command(pair, until)
        stream += history.more(rng.choice([1, 2, 20, 60]), pair.sent())
        if rng.random() < 0.1:
            stream = damaged(stream, rng)
        cut = rng.choice([1, len(stream) // 2, len(stream), len(stream)])
        pair.take(stream[:cut])
        stream = stream[cut:]
        assert facts(pair.thread) == facts(pair.remote)
        for follower in rng.sample(followers, 3):
            follower.step()
        for one in list(waiting):
            found = [look() for look in one]
            assert told(found[0]) == told(found[1])
            if found[0] is not None:
                waiting.remove(one)
                answered += 1
        if commanded is not None and rng.random() < 0.5:
            found = [look() for look in commanded]
            assert told(found[0]) == told(found[1])
            end_command(pair)
            commanded = None
        pair.now += rng.choice([0.001, 0.1, 0.1, 0.1, 0.1, 9.0])
    for follower in followers:
        follower.pop(10_000)
    assert sum(follower.seen for follower in followers) > 40
    assert answered > 2


def ask(pair, until):
    """Both are asked; looks for the answers."""
    with pair.thread.changed:
        ticket = pair.thread.conversation.ask(pair.now, until)
    pair.thread._send()
    return enlist(pair, ticket), pair.remote._asked("ask", until).look


def command(pair, until):
    with pair.thread.changed:
        ticket = pair.thread.conversation.command(Command(2, 7), pair.now, until)
    pair.thread._send()
    return enlist(pair, ticket), pair.remote._asked("command", until, 2, 7).look


def end_command(pair):
    pair.thread.conversation.end_command()
    pair.process.send("end command")


def enlist(pair, ticket):
    from contactfpga.driver.link import _Waiter

    waiter = _Waiter(ticket)
    pair.thread._waiters.append(waiter)
    return waiter.look


def test_a_frame_that_was_asked_for_is_skipped_in_both(pairs):
    pair = pairs()
    board = ModelBoard(SKINS["moments"])
    queues = [link.queue(100, False) for link in pair.links]
    pair.take(board.hello() + board.frame() + board.frame())
    looks = ask(pair, 10.0)
    for _ in range(6):
        for _, hello in board.hear(pair.sent()):
            pair.take(board.hello() if hello else b"")
        pair.take(board.frame())
    found = [look() for look in looks]
    assert told(found[0]) == told(found[1]) != "None"
    for queue, zones in zip(queues, found, strict=True):
        queue.skip_to(zones)
    rest = [[told(item) for item in iter(queue.pop, None)] for queue in queues]
    assert rest[0] == rest[1]
    assert 0 < len(rest[0]) < 8


def test_what_the_ring_overwrites_is_counted(pairs, monkeypatch):
    """A queue that may hold more than the ring loses what the ring does, and no more."""
    monkeypatch.setattr(reader, "MEMORY_BYTES", reader._RING_AT + reader.Ring.HEAD + (1 << 16))
    pair, board = pairs(), ModelBoard(SKINS["moments"])
    queue = pair.remote.queue(1_000_000, False)
    pair.take(board.hello())
    count = 0
    for _ in range(300):
        size = random.choice([1, 1, 5, 40])
        pair.take(b"".join(board.frame() for _ in range(size)))
        count += size
    left = list(iter(queue.pop, None))
    assert queue.dropped > 1000
    assert len(left) + queue.dropped == count == pair.remote.conversation.stats.frames
    assert [zones.sequence for zones in left] == [n % 256 for n in range(count - len(left), count)]


def test_a_batch_is_the_same(pairs):
    pair, board = pairs(), ModelBoard(SKINS["moments"])
    queues = [link.queue(1000, False) for link in pair.links]
    pair.take(board.hello() + b"".join(board.frame() for _ in range(50)))
    pair.take(board.frame())
    batches = [Batch.of(queue.pop_frames()) for queue in queues]
    for name in ("frames", "zones"):
        assert repr(getattr(batches[0], name)) == repr(getattr(batches[1], name))
    assert len(batches[0]) == 51
