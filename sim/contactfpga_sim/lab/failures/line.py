"""Knobs of the line and its ends."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections import deque

import numpy as np

from contactfpga.driver import health
from contactfpga.driver.board import Board as Driver
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.errors import ReadTimeout
from contactfpga.skin import Skin
from contactfpga.skin.derived import HEARD_BITS
from contactfpga.wire import protocol
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.rig import REFERENCE, Rig, hello_clocks
from contactfpga_sim.lab.knobs import Knob, Outcome, RateTest
from contactfpga_sim.model.board.virtual import VirtualBoard

OVERSAMPLING = 16
"""Samples per bit, as in most UARTs; the middle one counts."""


@dataclasses.dataclass(frozen=True, eq=False)
class Line:
    skin: Skin
    edges: np.ndarray
    """(n,) float: clocks of level changes; the level begins high."""
    end: float
    frames: tuple[bytes, ...]
    """Sent packets in order, without delimiters."""

    @classmethod
    def record(cls, skin: Skin, scans: int, seed: int) -> Line:
        """Record a board under new random fingers in each scan."""
        rng = np.random.default_rng(seed)
        with Rig(skin, capture=("line",)) as rig:
            rig.board.hold(np.zeros((1, skin.rows, skin.columns), bool), hello_clocks(skin))
            cells = np.zeros((scans, skin.rows, skin.columns), bool)
            for scan, row, column in zip(range(scans), *rng.integers(0, [[skin.rows], [skin.columns]], (2, scans))):
                cells[scan, row : row + 2, column : column + 2] = True
            rig.board.hold(cells)
            *packets, cut = rig.board.receive().split(bytes([protocol.DELIMITER]))
            while cut:  # the last one is waited for
                rig.board.run(skin.derived.bit_clocks)
                cut += rig.board.receive()
                if cut.endswith(bytes([protocol.DELIMITER])):
                    packets.append(cut[:-1])
                    break
            edges = rig.board.take("line")["cycle"].astype(float)
            return cls(skin, edges, float(rig.board.cycle), tuple(packets))

    def noisy(self, rate_hz: float, seed: int) -> Line:
        """The line with ``rate_hz`` pulses per second that invert it for half a bit to two bits."""
        rng = np.random.default_rng([seed, round(rate_hz)])
        bit = self.skin.derived.bit_clocks
        count = rng.poisson(rate_hz * self.end / self.skin.clock_hz)
        starts, lengths = rng.uniform(0, self.end, count), rng.uniform(0.5 * bit, 2 * bit, count)
        return dataclasses.replace(self, edges=np.sort(np.concatenate([self.edges, starts, starts + lengths])))

    def read(self, bit_clocks: float, phase: float = 0.0) -> bytes:
        """Bytes that a UART reads at ``bit_clocks`` clocks per bit, without those that lack a stop bit. ``phase`` (0
        to 1) delays sampling by part of a sample."""
        tick = bit_clocks / OVERSAMPLING
        data, now, last = bytearray(), 0.0, self.end + 12 * self.skin.derived.bit_clocks
        offsets = tick * (OVERSAMPLING * np.arange(10) + OVERSAMPLING // 2)
        while now < last:
            index = int(np.searchsorted(self.edges, now, "right"))
            if not index & 1:  # high: on to where it falls, as the next tick sees it
                if index >= len(self.edges):
                    break
                look = tick * (math.ceil(self.edges[index] / tick - phase) + phase)
                now = max(look, float(self.edges[index]))
                if not int(np.searchsorted(self.edges, now, "right")) & 1:
                    continue
            levels = 1 - (np.searchsorted(self.edges, now + offsets, "right") & 1)
            if levels[0]:
                now += offsets[0]
                continue
            if levels[9]:
                data.append(int((levels[1:9] << np.arange(8)).sum()))
                now += offsets[9]
            else:  # a break: wait for the line to rise
                now += offsets[9]
                index = int(np.searchsorted(self.edges, now, "right"))
                if index & 1:
                    now = self.edges[index] if index < len(self.edges) else last
        return bytes(data)


@dataclasses.dataclass(frozen=True)
class HostDecoding:
    sent: int
    arrived: int
    """Frames that arrived unchanged."""
    wrong: int
    """Arrived frames that were never sent."""
    told: tuple[str, ...]


def heard(line: Line, data: bytes, greeted: bytes = b"") -> HostDecoding:
    """The host's frames and counters; ``greeted`` arrived earlier, undisturbed."""
    sent = _decoded(b"".join(packet + bytes([protocol.DELIMITER]) for packet in line.frames))[0]
    frames, conversation = _decoded(greeted + data)
    stats = conversation.stats
    right = sum(1 for frame in frames if frame in set(sent))
    counters = {"lost": stats.lost, "damaged": stats.damaged.total()}
    told = [name for name, count in counters.items() if count]
    if conversation.hello is None:
        told = ["OnlyNoise"]
    return HostDecoding(len(sent), right, len(frames) - right, tuple(told))


def _decoded(data: bytes) -> tuple[list[str], Conversation]:
    conversation = Conversation("the line")
    events = conversation.receive(data, 0.0)
    return [str(_sent(zones)) for zones in frames_in(events)], conversation


def _sent(zones: Zones) -> dict[str, object]:
    own = {name: value for name, value in zones.to_dict().items() if not name.startswith("host_")}
    return own | {"flags": sorted(zones.frame.flags)}


SKIN = REFERENCE
SCAN_MS = 1000 * SKIN.derived.frame_clocks / SKIN.clock_hz
ZONE_BYTES = 13 + 4
"""Bytes of a frame with one zone; further zones need 4 each."""
FEW_FRAMES = 20
RECORDED = 200
"""Recorded lines of :data:`FEW_FRAMES` to draw from."""


@functools.cache
def recorded(scans: int, seed: int) -> Line:
    return Line.record(SKIN, scans, seed)


def _of_line(found: HostDecoding) -> Outcome:
    """Right if every frame arrives. A frame that was never sent is worse than a lost one, and silent."""
    missing = found.sent - found.arrived
    what = f"{missing} of {found.sent} frames do not arrive"
    if found.wrong:
        return Outcome(False, (), f"{found.wrong} frames that were never sent")
    return Outcome(not missing and not found.told, found.told, what)


def _lines(bit_clocks: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    lines = [recorded(FEW_FRAMES, int(seed)) for seed in rng.integers(0, RECORDED, count)]
    found = [(line, line.read(bit_clocks, float(phase))) for line, phase in zip(lines, rng.random(count))]
    return [_of_line(heard(line, data)) for line, data in found]


def _baud(sign: int, per_cent: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    return _lines(SKIN.derived.bit_clocks / (1 + sign * per_cent / 100), rng, count)


def _send(rig: Rig, byte: int, bit: float) -> None:
    bits = [0, *(byte >> index & 1 for index in range(8)), 1]
    ends = [round(bit * (index + 1)) for index in range(10)]
    for start, end, level in zip([0, *ends], ends, bits):
        if not level:
            rig.board.pull_low(end - start)
        rig.board.run(end - start)


def _number(rng: np.random.Generator) -> int:
    while not protocol.may_number(number := int(rng.integers(1 << protocol.DIGIT_BITS * protocol.HEARD_DIGITS))):
        pass
    return number


def _asked(sign: int, per_cent: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    bit = SKIN.derived.bit_clocks / (1 + sign * per_cent / 100)
    found = []
    with Rig(SKIN) as rig:
        rig.board.run(hello_clocks(SKIN))
        for _ in range(count):
            number = _number(rng)
            rig.frames()
            rig.board.run(int(rng.integers(rig.scan)))
            for byte in protocol.encode_request(number):
                _send(rig, byte, bit)
            rig.board.run(6 * rig.scan)
            right = any(zones.frame.heard == number % (1 << HEARD_BITS) for zones in rig.frames())
            found.append(Outcome(right, () if right else ("ReadTimeout",), "a request is not answered"))
    return found


BAUD = Knob(
    name="baud",
    title="Baud rates that differ",
    axis="difference, %",
    values=tuple(np.arange(0, 8.01, 0.25).round(2).tolist()),
    runs={
        f"host {speed}, {what}": RateTest(functools.partial(draws, sign), most=480)
        for what, draws in (("frames", _baud), ("requests", _asked))
        for speed, sign in (("faster", 1), ("slower", -1))
    },
    helps="a Skin is refused beyond 1.5 %; `contactfpga doctor` counts what is damaged",
    # The middle of the stop bit, 9.5 bits after the start, slips by half a bit; a look takes 1/16 of a bit.
    closed={f"host {speed}, frames": round(100 * 0.5 / 9.5, 2) for speed in ("faster", "slower")},
)


def _noise(rate_hz: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    """The port was opened before the noise."""
    line = recorded(count + 10, int(rng.integers(RECORDED)))
    data = line.noisy(rate_hz, int(rng.integers(1 << 32))).read(SKIN.derived.bit_clocks)
    found = heard(line, data, greeted=protocol.encode_hello(SKIN))
    if found.wrong:
        return [Outcome(False, (), f"{found.wrong} frames that were never sent")] * count
    lost = Outcome(False, found.told, "a frame does not arrive")
    return ([lost] * (found.sent - found.arrived) + [Outcome(True, found.told)] * found.arrived)[:count]


NOISE = Knob(
    name="noise",
    title="Pulses on the line",
    axis="pulses per second",
    values=(0, 100, 300, 500, 600, 700, 800, 900, 1_000, 2_000, 5_000, 10_000, 30_000, 100_000, 300_000),
    runs={"half a bit to two bits long": RateTest(_noise)},
    helps="a shorter cable, a slower `baud`",
    # Pulses come at random, and each spoils a frame: the one that it meets, or the next one, to which the byte that it
    # makes is added; a frame comes every 96 us.
    closed={"half a bit to two bits long": float(round(-math.log(0.95) * 1000 / SCAN_MS))},
)


def _clock(per_cent: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    faster = 1 + per_cent / 100
    told = ("doctor",) if [*health.clock(DOCTOR_S * faster, DOCTOR_S)] else ()
    times = Outcome(per_cent <= CLOCK_PER_CENT, told, f"times {per_cent:g} % off")
    return [times if one.right else one for one in _lines(SKIN.derived.bit_clocks * faster, rng, count)]


DOCTOR_S = 10.0
"""Duration of `contactfpga doctor --seconds 10`."""

CLOCK_PER_CENT = 0.1
"""Largest time error that counts as right."""

CLOCK = Knob(
    name="clock",
    title="A board whose clock is fast",
    axis="its error, %",
    values=(0.01, 0.03, 0.1, 0.3, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0, 30.0, 100.0),
    runs={"board with `clock_hz` off": RateTest(_clock, most=480)},
    helps="a crystal: 0.01 % at worst; on-chip oscillators cannot be chosen",
    unnoticed="over USB the host knows a frame's instant to a millisecond only, so a small difference shows late",
)


# ---- a host that is slow


TTY_BYTES = 4095
"""Linux's buffer of an unread serial port; further bytes are dropped."""


class SlowHost:
    """A virtual board with an operating system's buffer, whose time passes while the host works."""

    live, threaded = True, False
    name = "the slow host"

    def __init__(self) -> None:
        self._board = VirtualBoard(SKIN, "two_fingers")
        self._waiting: deque[int] = deque()

    def work(self, seconds: float) -> None:
        end = self._board.clock() + seconds
        while (left := end - self._board.clock()) > 1e-6:
            self._keep(self._board.read(min(left, 1e-4)))

    def _keep(self, data: bytes) -> None:
        self._waiting.extend(data[: TTY_BYTES - len(self._waiting)])

    def read(self, timeout_s: float) -> bytes:
        if not self._waiting:
            self._keep(self._board.read(max(timeout_s, 1e-6)))
        data = bytes(self._waiting)
        self._waiting.clear()
        return data

    def write(self, data: bytes) -> None:
        self._board.write(data)

    def clock(self) -> float:
        return self._board.clock()

    def close(self) -> None:
        self._board.close()


def _slow_host(milliseconds: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    transport = SlowHost()
    scan_us = SKIN.derived.frame_clocks / SKIN.derived.clocks_per_us
    found = []
    with Driver(transport) as board:
        board.greet(1.0)
        last_us = board.next().time_us
        for _ in range(count):
            lost, overwritten, unexplained = board.stats.lost, board.stats.overwritten, board.stats.unexplained
            transport.work((milliseconds + rng.random() * scan_us / 1000) / 1000)
            until, times = transport.clock() + 0.002, []
            while transport.clock() < until:
                times.append(board.next().time_us)
            stats = board.stats
            missing = round((times[-1] - last_us) / scan_us) - len(times) - (stats.overwritten - overwritten)
            lost, unexplained, last_us = stats.lost - lost, stats.unexplained - unexplained, times[-1]
            told = tuple(name for name, number in (("lost", lost), ("unexplained", unexplained)) if number)
            what = f"{missing} frames missing, `lost` says {lost}"
            found.append(Outcome(missing <= 0 and not stats.damaged, told, what, missing))
    return found


class DyingBoard(SlowHost):
    name = "the board that stops"
    runs = True

    def _keep(self, data: bytes) -> None:
        if self.runs:
            super()._keep(data)


MAX_AGE_S = 0.005
"""Largest age of data on which a robot may act."""


@functools.cache
def _silence(max_age_s: float | None, phase: float) -> tuple[str, float]:
    transport = DyingBoard()
    with Driver(transport) as board:
        board.greet(1.0)
        board.latest()
        transport.work(phase * SKIN.derived.frame_clocks / SKIN.clock_hz)
        board.latest()
        transport.runs = False
        begun = transport.clock()
        try:
            while True:
                board.latest(max_age_s=max_age_s)
        except ReadTimeout as error:
            return type(error).__name__, transport.clock() - begun


def _told_late(max_age_s: float | None, milliseconds: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    found = []
    for phase in rng.integers(0, PHASES, count) / PHASES:
        error, after_s = _silence(max_age_s, float(phase))
        told = (error,) if milliseconds >= 1000 * after_s else ()
        found.append(Outcome(milliseconds <= 1000 * MAX_AGE_S, told, f"no frame for {milliseconds:g} ms"))
    return found


PHASES = 32

SILENCE = Knob(
    name="silence",
    title="A board without supply, clock or configuration, or a broken cable",
    axis="ms since its last byte",
    values=(1, 2, 4, 6, 10, 20, 50, 100, 200, 500, 1000, 2000),
    runs={
        "`latest()`": RateTest(functools.partial(_told_late, None)),
        "`latest(max_age_s=0.005)`": RateTest(functools.partial(_told_late, MAX_AGE_S)),
    },
    helps="`max_age_s`, or `deadline_s` of `subscribe` and `events`; a watchdog at the pin `alive`",
    unnoticed="a read waits for a frame until its timeout; how old one may be, only your program knows",
)

HOST = Knob(
    name="host",
    title="A host that reads every now and then",
    axis="ms between reads",
    values=(1, 2, 5, 8, 10, 12, 14, 16, 20, 25, 30, 40, 50, 70, 100),
    runs={"every frame of `contactfpga.open()`": RateTest(_slow_host, most=120)},
    helps='`Board.latest()` where only the newest frame counts; `send = "on_change"`',
    # The system's buffer of 4,095 bytes is full of packets of 21 bytes, one per scan.
    closed={"every frame of `contactfpga.open()`": round(TTY_BYTES / (ZONE_BYTES + 4) * SCAN_MS, 1)},
)
