"""Knobs of the line and of both its ends: baud rates that differ, noise, another clock, a host that is slow."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections import deque

import numpy as np

from contactfpga.driver import health
from contactfpga.driver.board import Board as Driver
from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.errors import ReadTimeout
from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.knob import Knob, Outcome
from contactfpga_sim.lab.failures.rig import REFERENCE, Rig, hello_clocks
from contactfpga_sim.model.board.virtual import VirtualBoard

OVERSAMPLING = 16
"""Samples per bit, as most UARTs take; the middle one of a bit counts."""


@dataclasses.dataclass(frozen=True, eq=False)
class Line:
    """What a board put on its line."""

    skin: Skin
    edges: np.ndarray
    """(n,) float: clocks at which the level changes; it begins high."""
    end: float
    """Clocks that were recorded."""
    frames: tuple[bytes, ...]
    """Every packet that was sent, without its delimiter, in order."""

    @classmethod
    def record(cls, skin: Skin, scans: int, seed: int) -> Line:
        """A board whose sheet shows random fingers, others in each scan."""
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
        """With this many pulses per second that invert the level for half a bit to two bits."""
        rng = np.random.default_rng([seed, round(rate_hz)])
        bit = self.skin.derived.bit_clocks
        count = rng.poisson(rate_hz * self.end / self.skin.clock_hz)
        starts, lengths = rng.uniform(0, self.end, count), rng.uniform(0.5 * bit, 2 * bit, count)
        return dataclasses.replace(self, edges=np.sort(np.concatenate([self.edges, starts, starts + lengths])))

    def read(self, bit_clocks: float) -> bytes:
        """What a UART takes for bytes whose bits last this many of the board's clocks; without the bytes that have no
        stop bit."""
        tick = bit_clocks / OVERSAMPLING
        data, now, last = bytearray(), 0.0, self.end + 12 * self.skin.derived.bit_clocks
        offsets = tick * (OVERSAMPLING * np.arange(10) + OVERSAMPLING // 2)
        while now < last:
            index = int(np.searchsorted(self.edges, now, "right"))
            if not index & 1:  # high: on to where it falls, as the next tick sees it
                if index >= len(self.edges):
                    break
                now = max(tick * math.ceil(self.edges[index] / tick), float(self.edges[index]))
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
    """What the host makes of a line."""

    sent: int
    """Frames that were sent."""
    arrived: int
    """Frames that arrived as they were sent."""
    wrong: int
    """Frames that arrived and were never sent."""
    told: tuple[str, ...]
    """Counters that are not 0, and errors."""


def heard(line: Line, data: bytes, greeted: bytes = b"") -> HostDecoding:
    """The host's frames and counters; ``greeted`` came before, as it was sent."""
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
    arrived = [event.zones for event in events if isinstance(event, Arrival)]
    return [str(_sent(zones)) for zones in arrived], conversation


def _sent(zones: Zones) -> dict[str, object]:
    """What the board said, without what the host adds from the frames before: flags, and the time on its own clock."""
    own = {name: value for name, value in zones.to_dict().items() if not name.startswith("host_")}
    return own | {"flags": sorted(zones.frame.flags)}


FRAMES = 60
SKIN = REFERENCE


@functools.cache
def recorded(scans: int = FRAMES) -> Line:
    """A line to be heard in several ways."""
    return Line.record(SKIN, scans, seed=3)


def _of_line(found: HostDecoding, extra: str = "") -> Outcome:
    """Right if every frame arrives; a frame that was never sent is worse than one that is lost, and silent."""
    missing = found.sent - found.arrived
    what = f"{missing} of {found.sent} frames do not arrive" + extra
    if found.wrong:
        return Outcome(False, (), f"{found.wrong} frames that were never sent", missing / found.sent)
    return Outcome(not missing and not found.told, found.told, what, missing / found.sent)


def _baud(sign: int, per_cent: float) -> Outcome:
    bits = SKIN.derived.bit_clocks / (1 + sign * per_cent / 100)
    return _of_line(heard(recorded(), recorded().read(bits)))


ASKED = 0x15_2A_D0
"""Of a request whose other digits mix zeros and ones; its lowest bits are left for a number."""


def _send(rig: Rig, byte: int, bit: float) -> None:
    """A byte whose bits last this many of the board's clocks, at its receive pin."""
    bits = [0, *(byte >> index & 1 for index in range(8)), 1]
    ends = [round(bit * (index + 1)) for index in range(10)]
    for start, end, level in zip([0, *ends], ends, bits):
        if not level:
            rig.board.pull_low(end - start)
        rig.board.run(end - start)


def _asked(sign: int, per_cent: float) -> Outcome:
    """The host's requests, at the host's rate, at the board's receive pin: does a frame answer?"""
    bit = SKIN.derived.bit_clocks / (1 + sign * per_cent / 100)
    answered = 0
    lows = (1, 2, 3, 4)
    with Rig(SKIN) as rig:
        rig.board.run(hello_clocks(SKIN))
        for low in lows:
            rig.frames()
            for byte in protocol.encode_request(ASKED + low):
                _send(rig, byte, bit)
            rig.board.run(6 * rig.scan)
            answered += any(zones.frame.heard == low for zones in rig.frames())
    right = answered == len(lows)
    what = f"{len(lows) - answered} of {len(lows)} requests unanswered"
    return Outcome(right, () if right else ("ReadTimeout",), what, 1 - answered / len(lows))


BAUD = Knob(
    name="baud",
    title="Baud rates that differ",
    axis="difference, %",
    amount="share lost",
    values=tuple(np.arange(0, 12.01, 0.25).round(2).tolist()),
    runs={
        "host faster, frames": functools.partial(_baud, 1),
        "host slower, frames": functools.partial(_baud, -1),
        "host faster, requests": functools.partial(_asked, 1),
        "host slower, requests": functools.partial(_asked, -1),
    },
    helps="a Skin is refused beyond 1.5 %; `contactfpga doctor` counts what is damaged",
)


def _noise(rate_hz: float) -> Outcome:
    """The port was opened before the noise began."""
    line = recorded(200)
    noisy = line.noisy(rate_hz, seed=1).read(SKIN.derived.bit_clocks)
    return _of_line(heard(line, noisy, greeted=protocol.encode_hello(SKIN)))


NOISE = Knob(
    name="noise",
    title="Pulses on the line",
    axis="pulses per second",
    amount="share of frames lost",
    values=(0, 10, 30, 100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000),
    runs={"half a bit to two bits long": _noise},
    helps="a shorter cable, a slower `baud`",
)


def _clock(per_cent: float) -> Outcome:
    """The board's crystal is fast: bits are short, and so are its microseconds."""
    faster = 1 + per_cent / 100
    found = heard(recorded(), recorded().read(SKIN.derived.bit_clocks * faster))
    if found.arrived < found.sent or found.wrong:
        return _of_line(found)
    told = ("doctor",) if [*health.clock(DOCTOR_S * faster, DOCTOR_S)] else ()
    return Outcome(per_cent <= CLOCK_PER_CENT, told, f"times {per_cent:g} % off", per_cent / 100)


DOCTOR_S = 10.0
"""How long `contactfpga doctor --seconds 10` looks."""

CLOCK_PER_CENT = 0.1
"""Times count as right that are off by no more."""

CLOCK = Knob(
    name="clock",
    title="A board whose clock is fast",
    axis="%",
    amount="share of frames lost, else error of times",
    values=(0.01, 0.03, 0.1, 0.3, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0, 30.0, 100.0),
    runs={"board with `clock_hz` off": _clock},
    helps="a crystal: 0.01 % at worst; on-chip oscillators cannot be chosen",
    unnoticed="over USB the host knows a frame's instant to a millisecond only, so a small difference shows late",
)


# ---- a host that is slow

TTY_BYTES = 4095
"""What Linux keeps of a serial port that nobody reads; what comes then is dropped."""


class SlowHost:
    """A virtual board behind a buffer as the system has it; time passes while the host is busy elsewhere."""

    live, threaded = True, False
    name = "the slow host"

    def __init__(self) -> None:
        self._board = VirtualBoard(SKIN, "two_fingers")
        self._waiting: deque[int] = deque()

    def work(self, seconds: float) -> None:
        """The host does something else."""
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


TURNS = 3


def _slow_host(milliseconds: float) -> Outcome:
    """The driver reads all there is, then the host works for a while, and so on."""
    transport = SlowHost()
    with Driver(transport) as board:
        board.greet(1.0)
        times = []
        for _ in range(TURNS):
            transport.work(milliseconds / 1000)
            until = transport.clock() + 0.002
            while transport.clock() < until:
                times.append(board.next().time_us)
        stats = board.stats
    scan_us = SKIN.derived.frame_clocks / SKIN.derived.clocks_per_us
    missing = round((times[-1] - times[0]) / scan_us) + 1 - len(times) - stats.overwritten
    told = tuple(name for name in ("lost", "unexplained") if getattr(stats, name))
    what = f"{missing} frames missing, `lost` says {stats.lost}"
    what += f", {stats.unexplained} whose time was not known" if stats.unexplained else ""
    return Outcome(missing <= 0 and not stats.damaged, told, what, missing)


class DyingBoard(SlowHost):
    """A board that stops."""

    name = "the board that stops"
    runs = True

    def _keep(self, data: bytes) -> None:
        if self.runs:
            super()._keep(data)


MAX_AGE_S = 0.005
"""What a robot may act on."""


@functools.cache
def _silence(max_age_s: float | None) -> tuple[str, float]:
    """A program reads the newest frame again and again, and the board stops: the error that it gets, and seconds until
    then."""
    transport = DyingBoard()
    with Driver(transport) as board:
        board.greet(1.0)
        board.latest()
        transport.runs = False
        begun = transport.clock()
        try:
            while True:
                board.latest(max_age_s=max_age_s)
        except ReadTimeout as error:
            return type(error).__name__, transport.clock() - begun


def _told_late(max_age_s: float | None, milliseconds: float) -> Outcome:
    error, after_s = _silence(max_age_s)
    told = (error,) if milliseconds >= 1000 * after_s else ()
    return Outcome(milliseconds <= 1000 * MAX_AGE_S, told, f"no frame for {milliseconds:g} ms", milliseconds)


SILENCE = Knob(
    name="silence",
    title="A board without supply, clock or configuration, or a broken cable",
    axis="ms since its last byte",
    amount="ms without a frame",
    values=(1, 2, 4, 6, 10, 20, 50, 100, 200, 500, 1000, 2000),
    runs={
        "`latest()`": functools.partial(_told_late, None),
        "`latest(max_age_s=0.005)`": functools.partial(_told_late, MAX_AGE_S),
    },
    helps="`max_age_s`, or `deadline_s` of `subscribe` and `events`; a watchdog at the pin `alive`",
    unnoticed="a read waits for a frame until its timeout; how old one may be, only your program knows",
)

HOST = Knob(
    name="host",
    title="A host that reads every now and then",
    axis="ms between reads",
    amount="frames missing",
    values=(1, 2, 5, 8, 10, 12, 14, 16, 20, 25, 30, 40, 50, 70, 100),
    runs={"every frame of `contactfpga.open()`": _slow_host},
    helps='`Board.latest()` where only the newest frame counts; `send = "on_change"`',
)
