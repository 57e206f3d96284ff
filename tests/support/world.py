"""A board that scans, a line, and a bridge that delays, loses and corrupts bytes: a port in simulated time.

All times are whole microseconds of the world's clock. What the board sent is kept in :attr:`World.truth`, so that
whatever a host makes of the bytes can be held against it.
"""

import dataclasses
import random

from model_board import ModelBoard

from contactfpga.errors import PortLost

HELLO_US = 500_000
BYTE_US = 10 / 3
BOOT_US = 120_000
"""From power-up, or from the loading of a bitstream, to the first scan."""


@dataclasses.dataclass(frozen=True)
class Truth:
    """A frame that the board sent."""

    begun_us: int
    """When its first row was sampled, on the world's clock."""
    time_us: int
    """The same since power-up."""
    life: int
    """Power-ups before it."""
    index: int
    """Frames sent before it since power-up."""
    zone: tuple
    pitch_mm: float


class World:
    """The port of a virtual board, as ``contactfpga.open`` takes it."""

    def __init__(self, skin, *, scan_us=1000, up_us=0, down_us=0, seed=0):
        self.rng = random.Random(seed)
        self.skin = skin
        self.scan_us = scan_us
        self.up_us = up_us  # from the host's write to the board
        self.down_us = down_us  # from the board's last byte to the host; bytes come in chunks of this time
        self.lose = 0.0  # share of packets that vanish
        self.corrupt = 0.0  # share of packets with flipped bits
        self.lose_requests = 0.0
        self.unplugged = False
        self.closed = False
        self.now_us = 0
        self.truth = []
        self.board = ModelBoard(skin)
        self.life = 0
        self.words = [[0]]
        """Of each life, what the board knew of its lines, one after the other."""
        self._report_due = False
        self._cut = b""  # has arrived and was not read yet
        self._to_board = []  # (time, bytes)
        self._to_host = []  # (time, bytes)
        self._power_up(self.now_us)

    # ---- what happens to the board

    def skip(self, us):
        """Time passes on a line that carries nothing."""
        end = self.now_us + us
        lost = round(us / self.scan_us)
        self.now_us = self._sample_us = self._free_us = end
        self._next_hello = end + HELLO_US
        self.board.sent += lost if self._on_us <= end else 0
        self._waiting, self._to_board = None, []

    def restart(self, skin=None, torn=False, mute=False):
        """Power fails, or another bitstream is loaded; ``torn``: in the middle of a packet; ``mute``: the first hello
        is lost."""
        if torn:
            data = self.board.frame()
            self._send(data[: self.rng.randrange(1, len(data) - 1)], whole=False)
        if skin is not None:
            self.skin = skin
            self.board = ModelBoard(skin)
        self.life += 1
        self.words.append([0])
        self.board.power_up()
        self._to_board = []
        self._power_up(self.now_us + BOOT_US)
        if mute:
            self._hello_due = None

    def _power_up(self, when):
        self._on_us = self._sample_us = when
        self._hello_due = when  # the time from which a hello is due
        self._next_hello = when + HELLO_US
        self._waiting = None
        self._report_due = False
        self._free_us = when
        self._heard_at_sample = 0

    def break_lines(self, word):
        """The board finds lines faulty, or whole again; it tells so."""
        if self.skin.guard and word != self.board.word:
            self.board.word = word
            self.words[-1].append(word)
            self._report_due = True

    def pause(self, us):
        """The world goes on while the host does not read; what came waits."""
        end = self.now_us + us
        while self.now_us < end:
            self._step(end)

    # ---- the port

    def read(self, seconds):
        end = self.now_us + round(seconds * 1e6)
        while True:
            self._check()
            data, self._cut = self._cut, b""
            while self._to_host and self._to_host[0][0] <= self.now_us:
                data += self._to_host.pop(0)[1]
            if data or self.now_us >= end:
                return self._piece(data)
            self._step(end)

    def _piece(self, data):
        """Bytes come cut anywhere."""
        cut = self.rng.randrange(1, len(data) + 1) if data else 0
        self._cut = data[cut:]
        return data[:cut]

    def write(self, data):
        self._check()
        if self.rng.random() >= self.lose_requests:
            self._to_board.append((self.now_us + self.up_us, data))

    def clock(self):
        return self.now_us / 1e6

    def close(self):
        self.closed = True

    def _check(self):
        assert not self.closed, "a closed port was used"
        if self.unplugged:
            raise PortLost("the world is gone; plug the board in")

    # ---- time

    def _step(self, end):
        """On to the next thing that happens, at most to ``end``."""
        times = [end, self._sample_us + self.scan_us, self._next_hello]
        times += [when for when, _ in self._to_board[:1] + self._to_host[:1]]
        if self._waiting is not None or self._hello_due is not None or self._report_due:
            times.append(self._free_us)
        self.now_us = max(self.now_us, min(when for when in times if when > self.now_us))
        self._hear()
        if self.now_us >= self._next_hello:
            self._next_hello += HELLO_US
            self._hello_due = self.now_us
        self._transmit()
        if self.now_us >= self._sample_us + self.scan_us:
            if self._waiting is not None:
                self.board.overwritten += 1
            self._waiting = (self._sample_us, self._heard_at_sample)
            self._sample_us = self.now_us
            self._heard_at_sample = self.board.heard
            self._transmit()

    def _hear(self):
        while self._to_board and self._to_board[0][0] <= self.now_us:
            data = self._to_board.pop(0)[1]
            if self.now_us < self._on_us:
                continue
            if any(hello for _, hello in self.board.hear(data)):
                self._hello_due = self.now_us

    def _transmit(self):
        while self._free_us <= self.now_us and self.now_us >= self._on_us:
            if self._hello_due is not None:
                self._hello_due = None
                self.board.time_us = self.now_us - self._on_us
                self._send(self.board.hello())
                self._report_due = self.skin.guard
            elif self._report_due:
                self._report_due = False
                self._send(self.board.report())
            elif self._waiting is not None:
                (begun, heard), self._waiting = self._waiting, None
                self._send_frame(begun, heard)
            else:
                return

    def _send_frame(self, begun, heard):
        index = self.board.sent
        number = len(self.truth)
        # The area tells lives apart: two of them may well have a frame of the same number, time and place.
        zone = (1 + self.life % 100, number % self.skin.columns, number // self.skin.columns % self.skin.rows)
        self.board.moments = [zone]
        since = begun - self._on_us
        self.truth.append(Truth(begun, since, self.life, index, zone, self.skin.pitch_x_mm))
        flags = ["fault"] if self.board.word else []
        self._send(self.board.frame(time=since, heard=heard, flags=flags))

    def _send(self, data, whole=True):
        self._free_us = max(self._free_us, self.now_us) + round(len(data) * BYTE_US)
        arrival = self._free_us + self.down_us
        if self.down_us:  # a bridge hands over what it has every so often
            arrival = -(-arrival // self.down_us) * self.down_us
        if whole and self.rng.random() < self.lose:
            return
        if whole and self.rng.random() < self.corrupt:
            error = self.rng.randrange(1, 1 << 16, 2) << self.rng.randrange(8 * len(data) - 16)
            data = (int.from_bytes(data, "little") ^ error).to_bytes(len(data), "little")
        self._to_host.append((arrival, data))


class Witness:
    """Holds the frames that a host passes on against what the board sent."""

    def __init__(self, world):
        self.world = world
        self.place = -1

    def check(self, zones, since_us=None):
        """A frame that was sent, after those before, at the right time; ``since_us``: scanned after that moment."""
        truth = self.world.truth
        for place in range(self.place + 1, len(truth)):
            sent = truth[place]
            (zone,) = zones
            same = (zone.area_cells, zone.sum_x, zone.sum_y) == sent.zone and zones.time_us == sent.time_us
            if same and zones.sequence == sent.index % 256 and zones.sheet.pitch_x_mm == sent.pitch_mm:
                self.place = place
                self._check_faults(zones, sent)
                if since_us is not None:
                    assert sent.begun_us >= since_us, f"scanned {since_us - sent.begun_us} us before it was asked for"
                return sent
        last = truth[self.place] if self.place >= 0 else None
        raise AssertionError(f"never sent, or sent before the last one, {last}: {zones}")

    def _check_faults(self, zones, sent):
        """Faults of a flagged frame are some that the board had in this life, or have no name; others have none."""
        known = [names(word) for word in self.world.words[sent.life]] + [("unnamed fault",)]
        right = zones.faults in known if "fault" in zones.flags else zones.faults == ()
        assert right, f"never reported of this board: {zones.faults}"

    def check_reported(self, faults):
        """What a board said of its lines last, on a good line."""
        wanted = names(self.world.board.word)
        assert (faults.names if faults else ()) == wanted, f"never reported, though lines are {wanted}"


def names(word):
    """Of broken rows of a sheet, not all of them."""
    return tuple(sorted(f"row {row} open" for row in range(16) if word >> row & 1))
