"""The reading thread in C and the one in Python report the same events, counters and times of the same histories,
whenever received bytes are taken."""

import random

import pytest
from byte_histories import SKINS, History, damaged
from model_board import ModelBoard
from reader_pair import Pair
from sample import sample
from wire import digits, seal

import contactfpga
from contactfpga.driver import native
from contactfpga.driver.conversation import frames_in
from contactfpga.driver.native import NewestUnknown
from contactfpga.errors import ContactFPGAError
from contactfpga.wire.command import Command
from contactfpga.zones.zone import Zones

NAMES = [*SKINS, "guard", "units"]
ALL = SKINS | {"guard": contactfpga.Skin(guard=True), "units": contactfpga.Skin(units=2)}

pytestmark = pytest.mark.skipif(bool(native.missing()), reason=native.missing())


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


def described(item):
    """A frame or event as text, with all that a user can see of it."""
    if isinstance(item, Zones):
        return repr((item.to_dict(), sorted(item.flags), item.sheet, item.frame.heard, item.suspects))
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
    """What a board says of itself, and the counters."""
    said = link.conversation
    history = said.units.history
    units = history and (history.count, history.lows, history.highs, history.last and history.last.sequence)
    with link.changed:
        silence = str(link.silence(0.0))
    return repr((said.hello, said.lines.reported, said.stats, sorted(said.numbers), link.last_s, units, silence))


class Followers:
    """Two queues of the same kind, one on each link."""

    def __init__(self, pair, rng, maxsize, all_events=False):
        self.queues = [link.queue(maxsize, all_events) for link in pair.links]
        self.rng, self.all_events = rng, all_events
        self.seen = 0

    def step(self):
        thread, fast = self.queues
        assert len(thread) == len(fast)
        assert thread.dropped == fast.dropped
        assert repr(thread.first_error()) == repr(fast.first_error())
        match self.rng.randrange(6):
            case 0 | 1:
                self.pop(self.rng.randrange(40))
            case 2 if not self.all_events:
                first, second = ([described(zones) for zones in frames_in(queue.pop_frames())] for queue in self.queues)
                assert first == second
                self.seen += len(first)
            case 3 if not self.all_events:
                assert self.kept(thread) == self.kept(fast)
            case 4:
                self.pop(1)
            case 5 if self.rng.random() < 0.05:
                thread.clear(), fast.clear()

    def kept(self, queue):
        try:
            queue.keep_last()
        except ContactFPGAError as error:
            return repr(error)
        return len(queue)

    def pop(self, count):
        for _ in range(count):
            found = [queue.pop() for queue in self.queues]
            assert described(found[0]) == described(found[1])
            if found[0] is None:
                return
            self.seen += 1


class Newest:
    """The newest frame on each link, which the native one may know before it takes what came."""

    def __init__(self, pair):
        self.links = pair.links
        self.queues = [link.queue(1000, False) for link in pair.links]
        self.seen = self.shown = 0

    def step(self):
        found = [self.taken(self.queues[0]), self.newest(self.links[1], self.queues[1])]
        assert described(found[0]) == described(found[1])
        self.seen += found[0] is not None

    def newest(self, link, queue):
        try:
            found = link._newest(queue)
        except NewestUnknown:
            found = None
        if isinstance(found, Zones):
            self.shown += 1
            return found
        if isinstance(found, int):
            return None
        link.catch_up()
        return self.taken(queue)

    def taken(self, queue):
        """Take received frames as :meth:`contactfpga.Board.latest` does."""
        try:
            queue.keep_last()
        except ContactFPGAError as error:
            return str(error)
        return queue.pop()


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
    newest = Newest(pair)
    stream, waiting, commanded, answered = b"", [], None, 0
    for _ in range(40):
        until = pair.now + rng.choice([0.05, 1.0])
        pair.pass_time()
        if rng.random() < 0.4:
            waiting.append(ask(pair, until))
        if commanded is None and rng.random() < 0.2 and pair.thread.conversation.hello is not None:
            commanded = command(pair, until)
        stream += history.more(rng.choice([1, 2, 20, 60]), pair.sent())
        if rng.random() < 0.1:
            stream = damaged(stream, rng)
        for _ in range(rng.choice([1, 1, 2, 5])):
            cut = rng.choice([1, len(stream) // 5, len(stream) // 2, len(stream)])
            pair.take(stream[:cut])
            stream = stream[cut:]
            pair.now += rng.choice([0.0, 0.0005])
        if rng.random() < 0.5:
            newest.step()
        assert facts(pair.thread) == facts(pair.native)
        for follower in rng.sample(followers, 3):
            follower.step()
        for one in list(waiting):
            found = [look() for look in one]
            assert described(found[0]) == described(found[1])
            if found[0] is not None:
                waiting.remove(one)
                answered += 1
        if commanded is not None and rng.random() < 0.5:
            found = [look() for look in commanded]
            assert described(found[0]) == described(found[1])
            end_command(pair)
            commanded = None
        pair.now += rng.choice([0.001, 0.1, 0.1, 0.1, 0.1, 9.0])
    for follower in followers:
        follower.pop(10_000)
    assert sum(follower.seen for follower in followers) > 40
    assert answered > 2


@pytest.mark.parametrize(
    ("report", "seed"),
    sample(
        [(report, seed) for report in ("moments", "barycenter") for seed in range(30)],
        quick=[("moments", 0)],
        slow=[("barycenter", 1), ("moments", 2)],
    ),
)
def test_times_and_newest_frames_are_the_same_of_a_board_at_its_pace(report, seed, pairs):
    """Boards in real time, with clocks as far apart as crystals, late reads, hellos and requests."""
    rng = random.Random(f"{report} {seed}")
    pair, board = pairs(), ModelBoard(contactfpga.Skin(report=report))
    followers, newest = Followers(pair, rng, 100_000), Newest(pair)
    step_us, rate = rng.choice([100, 1000]), 1 + rng.uniform(-1e-4, 1e-4)
    pair.take(board.hello() + board.frame())
    looks, sent, late_s = [], b"", 0.0
    for number in range(4000):
        board.time_us += step_us - 96
        due_s = board.time_us * 1e-6 * rate
        if rng.random() < 0.001:
            looks.append(ask(pair, pair.now + 1.0))
        data = b""
        if not number % 500 or rng.random() < 0.01:
            for _, hello in board.hear(pair.sent()):
                data += board.hello() if hello else b""
        if not number % 700:
            data += board.hello()
        sent += data + b"".join(board.frame() for _ in range(rng.choice([1, 1, 1, 3])))
        late_s = max(late_s, rng.expovariate(1e4)) if rng.random() < 0.9 else 0.0
        pair.now = max(pair.now, due_s + late_s)
        if rng.random() < 0.8:
            pair.take(sent)
            sent = b""
        if rng.random() < 0.3:
            newest.step()
        if rng.random() < 0.01:
            assert facts(pair.thread) == facts(pair.native)
            followers.step()
    pair.pass_time()
    followers.pop(100_000)
    assert facts(pair.thread) == facts(pair.native)
    assert [described(first()) for first, _ in looks] == [described(second()) for _, second in looks]
    assert newest.seen > 300
    assert newest.shown > newest.seen // 2
    assert pair.thread.conversation.stats.frames > 3000


def ask(pair, until):
    """Request a frame on both links; returns what looks for the answers."""
    return [enlist(link, lambda said: said.ask(pair.now, until)) for link in pair.links]


def command(pair, until):
    return [enlist(link, lambda said: said.command(Command(2, 7), pair.now, until)) for link in pair.links]


def end_command(pair):
    for link in pair.links:
        link.conversation.end_command()


def enlist(link, ask):
    from contactfpga.driver.link import _Waiter

    with link.changed:
        waiter = _Waiter(ask(link.conversation))
        link._waiters.append(waiter)
    link._send()

    def look():
        link.catch_up()
        return waiter.look()

    return look


def test_neither_shows_a_frame_after_a_restart_as_the_one_after_a_wrap(pairs):
    """The board heard no request, and the hello after its restart is lost."""
    pair, board = pairs(), ModelBoard(contactfpga.Skin())
    newest = Newest(pair)
    board.sent, board.time_us = 100, 2**24 - 30 * 96
    pair.take(board.hello() + board.frame())
    newest.step()
    pair.take(b"".join(board.frame() for _ in range(20)))
    newest.step()
    assert newest.shown == 1
    board.power_up()
    pair.take(b"".join(board.frame() for _ in range(20)))
    newest.step()
    assert newest.seen == 2
    assert facts(pair.thread) == facts(pair.native)


@pytest.mark.parametrize("asked", [False, True])
def test_reads_of_many_seconds_that_are_taken_together_say_the_same(pairs, asked):
    """Many seconds of reads are taken at once, with a request that the board does not receive and that is sent again
    and again."""
    pair, board = pairs(), ModelBoard(contactfpga.Skin())
    pair.take(board.hello() + board.frame())
    pair.pass_time()
    looks = ask(pair, 100.0) if asked else []
    for _ in range(12):
        pair.now += 1.0
        board.time_us += 1_000_000
        pair.take(board.frame())
    assert len(pair.sent()) > 30 or not asked
    assert facts(pair.thread) == facts(pair.native)
    assert pair.native.conversation.stats.frames == 13
    assert not any(look() for look in looks)


def test_frames_that_come_as_the_decoder_learns_of_their_sheet_are_not_lost(pairs, monkeypatch):
    """Packets that C receives while it learns of their sheet, and does not decode yet, still become frames."""
    pair, board = pairs(), ModelBoard(contactfpga.Skin())
    core, take = pair.native._core, pair.native._core.take

    def take_as_more_comes():
        found = take()
        core.feed(board.frame(), 0.0)
        return found

    pair.take(board.hello() + board.frame())
    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(core, "take", take_as_more_comes)
        pair.native.catch_up()
    assert pair.native.conversation.stats.frames == 2


def test_what_the_ring_overwrites_counts_as_lost(pairs):
    """Frames that the full ring overwrites are counted as if the line had lost them; the newest frame is always
    there."""
    pair, board = pairs(), ModelBoard(SKINS["moments"])
    queue = pair.native.queue(1_000_000, False)
    pair.take(board.hello() + board.frame())
    pair.native.catch_up()
    for _ in range(700):
        pair.now += 1e-3
        pair.take(b"".join(board.frame() for _ in range(60)))
    pair.take(board.hello() + board.frame())
    stats = pair.native.conversation.stats
    assert stats.lost > 10_000
    assert stats.frames + stats.lost == 42_002
    assert stats.bytes == pair.thread.conversation.stats.bytes
    assert not stats.damaged
    assert not stats.unexplained
    left = list(iter(queue.pop, None))
    assert len(left) == stats.frames
    assert [zones.time_us for zones in left[-5000:]] == list(range(board.time_us - 5000 * 96, board.time_us, 96))
