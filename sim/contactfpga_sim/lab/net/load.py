"""Links through a router, in four processes: boards with publishers, router, and two readers.

Frames are made beforehand, so that boards cost almost nothing.
"""

from __future__ import annotations

import functools
import multiprocessing
import random
import socket
import threading
import time
from contextlib import ExitStack
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

import contactfpga
from contactfpga.robot.net import session
from contactfpga.robot.net.publisher import BoardPublisher
from contactfpga.skin.derived import EPOCH_BITS, HEARD_BITS
from contactfpga.wire.hello import EPOCH_DIGITS, HEARD_DIGITS, SENT_DIGITS
from contactfpga_sim.lab.speed.driver import FRAMES, STEP_US, frame
from contactfpga_sim.lab.speed.driver import SKIN as SKIN
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.request import heard

HELLO_S = 0.5
GREETED_HZ = 20.0


@functools.cache
def frames(low: int) -> list[bytes]:
    """Frames of a board whose last request number has these lowest bits."""
    return [frame(number, low) for number in range(FRAMES)]


def said(sent: int, number: int) -> bytes:
    """Hello of a board after this many frames and this request."""
    counters = ((sent, SENT_DIGITS), (sent * STEP_US >> EPOCH_BITS, EPOCH_DIGITS), (number, HEARD_DIGITS), (0, 2))
    return hello(facts(SKIN), [value >> 7 * place & 127 for value, count in counters for place in range(count)])


class Steady:
    """A transport that sends ``rate_hz`` frames per second after :meth:`go`."""

    threaded = True

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._asked, self._taken, self._low, self._number = b"", 0, 0, 0
        self._answers = b""
        self._sent = self._first = 0
        self._hello_s = 0.0
        self._begun_s, self._rate_hz = time.monotonic(), GREETED_HZ

    def go(self, begun_s: float, rate_hz: float) -> int:
        """Send at this rate; return the first frame's number."""
        with self._lock:
            self._begun_s, self._rate_hz, self._first = begun_s, rate_hz, self._sent
            return self._sent

    def read(self, timeout_s: float) -> bytes:
        """Due frames, after waiting for the first."""
        until = time.monotonic() + timeout_s
        while True:
            with self._lock:
                data = self._answers + self._due(time.monotonic())
                self._answers = b""
                next_s = self._begun_s + (self._sent - self._first + 1) / self._rate_hz
            now_s = time.monotonic()
            if data or now_s >= until:
                return data
            time.sleep(max(0.0, min(next_s, until, now_s + 0.05) - now_s))

    def _due(self, now_s: float) -> bytes:
        count = int((now_s - self._begun_s) * self._rate_hz) - (self._sent - self._first)
        if count <= 0:
            return b""
        made = frames(self._low)
        data = b""
        if now_s > self._hello_s:
            data, self._hello_s = said(self._sent, self._number), now_s + HELLO_S
        data += b"".join(made[number % FRAMES] for number in range(self._sent, self._sent + count))
        self._sent += count
        return data

    def write(self, data: bytes) -> None:
        with self._lock:
            self._asked += data
            for one in heard([(0, self._asked)], facts(SKIN).bit_clocks).requests[self._taken :]:
                self._taken, self._low = self._taken + 1, one.number % (1 << HEARD_BITS)
                self._number = one.number
                if one.hello:
                    self._answers += said(self._sent, one.number)

    def clock(self) -> float:
        return time.monotonic()


def number_of(time_us: int) -> int:
    """Number of the frame with this time since power-up."""
    return time_us // STEP_US


SECONDS = 5.0
FULL_HZ = 10_000.0
RATE_HZ = 1000.0
BARE_BYTES = 100
LONG_S = 120.0


class NetworkRun(NamedTuple):
    """Result of a run, in s."""

    links: int
    share: float
    """Share of sent frames received by the end."""
    frames: float
    lost: int
    """Frames and messages lost."""
    messages: float
    cpu: dict[str, float]
    """Core share of publishers, router and readers."""
    latency: tuple[float, float]
    """p50 and p99 from due at the port to reader, for one link."""
    bare: tuple[float, float]
    """p50 and p99 of the bare pair, from put to callback."""


def measure(links: int, batch_s: float, full: bool = False, seconds: float = SECONDS) -> NetworkRun:
    """Run links of 1 kHz; ``full``: and one of 10 kHz."""
    context: Any = multiprocessing.get_context("spawn")
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{one.getsockname()[1]}"
    with ExitStack() as stack:
        pipes = {}
        every = range(links + full)
        for name, work, mine in (
            ("router", _route, every),
            ("publishers", _publish, every),
            ("reader", _read, every[::2]),
            ("other reader", _read, every[1::2]),
        ):
            pipes[name], theirs = context.Pipe()
            arguments = (theirs, endpoint, mine, batch_s, full, seconds)
            process = context.Process(target=work, args=arguments, daemon=True)
            process.start()
            stack.callback(process.kill)
            assert _answer(pipes[name]) == "ready"
        for pipe in pipes.values():
            pipe.send("go")
        begun_s, firsts = _answer(pipes["publishers"])
        for name in ("reader", "other reader"):
            pipes[name].send((begun_s, firsts[0]))
        found = {name: _answer(pipe) for name, pipe in pipes.items()}
    cpu = {name: value[0] / seconds for name, value in found.items()}
    frames, lost, messages = (np.array(found["reader"][1]) + found["other reader"][1]).tolist()
    sent = (RATE_HZ * links + FULL_HZ * full) * seconds
    return NetworkRun(
        links + full, frames / sent, frames / seconds, lost, messages / seconds, cpu, *found["reader"][2:]
    )


def _answer(pipe: Connection) -> Any:
    if not pipe.poll(LONG_S):
        raise TimeoutError("a process of the study does not answer")
    return pipe.recv()


def _route(pipe: Connection, endpoint: str, _links: range, _batch_s: float, _full: bool, seconds: float) -> None:
    with session.listening(endpoint):
        pipe.send("ready")
        pipe.recv()
        used_s = time.process_time()
        time.sleep(seconds)
        pipe.send((time.process_time() - used_s,))
        time.sleep(LONG_S)


def _publish(pipe: Connection, endpoint: str, links: range, batch_s: float, full: bool, seconds: float) -> None:
    for low in range(8):
        frames(low)
    boards = [Steady() for _ in links]
    with session.connected(endpoint) as network:
        stop = threading.Event()
        for number, board in enumerate(boards):
            publisher = BoardPublisher(board, network, f"load/{number}", batch_s=batch_s)
            threading.Thread(target=publisher.run, args=(stop,), daemon=True).start()
        bare = network.declare_publisher("bare/pair", express=True)
        pipe.send("ready")
        pipe.recv()
        begun_s, rng = time.monotonic() + 0.1, random.Random(1)
        rates = [RATE_HZ] * len(links)
        if full:
            rates[-1] = FULL_HZ
        pipe.send(
            (
                begun_s,
                [board.go(begun_s + rng.random() / rate, rate) for board, rate in zip(boards, rates, strict=True)],
            )
        )
        used_s = time.process_time()
        _beat(bare, begun_s + seconds)
        pipe.send((time.process_time() - used_s,))
        time.sleep(LONG_S)


def _beat(bare: Any, until_s: float) -> None:
    while (now_s := time.monotonic()) < until_s:
        bare.put(np.float64(now_s).tobytes() + bytes(BARE_BYTES - 8))
        time.sleep(1 / RATE_HZ)


def _read(pipe: Connection, endpoint: str, links: range, batch_s: float, full: bool, seconds: float) -> None:
    bare: list[float] = []
    with session.connected(endpoint) as network, ExitStack() as stack:
        network.declare_subscriber(
            "bare/pair",
            lambda sample: bare.append(time.monotonic() - np.frombuffer(sample.payload.to_bytes()[:8])[0]),
        )
        boards = []
        for number in links:
            port = f"zenoh://load/{number}?connect={endpoint}"
            boards.append(stack.enter_context(contactfpga.open(port, timeout=LONG_S)))
        pipe.send("ready")
        pipe.recv()
        begun_s, first = _answer(pipe)
        before = [_counted(board) for board in boards]
        used_s, found = time.process_time(), []
        if 0 in links:
            found = _probed(boards[0], first, begun_s, begun_s + seconds)
        time.sleep(max(0.0, begun_s + seconds - time.monotonic()))
        used_s = time.process_time() - used_s
        counts = [_counted(board) for board in boards]
        total = np.array([*counts, (0, 0, 0)]).sum(axis=0) - np.array([*before, (0, 0, 0)]).sum(axis=0)
        pipe.send((used_s, total.tolist(), _quantiles(found), _quantiles(bare)))
        time.sleep(LONG_S)


def _probed(board: contactfpga.Board, first: int, begun_s: float, until_s: float) -> list[float]:
    found = []
    with board.subscribe(maxsize=1 << 16) as frames:
        while time.monotonic() < until_s:
            number = number_of(frames.next(LONG_S).time_us) - first
            if number >= 0:
                found.append(time.monotonic() - (begun_s + (number + 1) / RATE_HZ))
    return found


def _counted(board: contactfpga.Board) -> tuple[int, int, int]:
    stats = board.stats
    assert stats.net is not None
    return stats.frames, stats.lost + stats.unexplained + stats.net.lost_messages, stats.net.messages


def _quantiles(found: list[float]) -> tuple[float, float]:
    if not found:
        return 0.0, 0.0
    middle, most = np.quantile(found, [0.5, 0.99]).tolist()
    return middle, most
