"""Throughput and delay of the driver on this machine: `python -m contactfpga_sim.lab.speed.driver`.

Another process plays a board with a moving fingertip on a pseudo-terminal. Rates are per CPU second of this process,
independent of other load; no test holds them.
"""

from __future__ import annotations

import multiprocessing
import os
import select
import statistics
import sys
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import contactfpga
from contactfpga.driver.conversation import Conversation
from contactfpga.skin import Skin
from contactfpga.zones.batch import Batch
from contactfpga.zones.run import Run
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.frame import join
from contactfpga_sim.model.golden.hello import hello
from contactfpga_sim.model.golden.packet import Packet
from contactfpga_sim.model.golden.request import heard

SKIN = Skin(clock_hz=24_000_000, baud=12_000_000, settle_us=2.5)
FRAMES = 1 << 14
STEP_US = (1 << 24) // FRAMES
"""Frame period, so that time and sequence wrap where frames repeat."""
CHUNK = 4096
PACED, PACE_S = 18, 250e-6
"""Frames per write and its interval: 12 Mbaud's capacity."""
ROUNDS = 20


def frame(number: int, low: int, fingers: int = 1, step_us: int = STEP_US) -> bytes:
    """A frame of fingertips of 3x3 cells, 4 rows apart, that move along rows."""
    known = facts(SKIN)
    x, y = 1 + number // 40 % (SKIN.columns - 2), SKIN.rows // 2
    counted = 24 + 8 + 3 + known.area_bits + known.zones_bits
    room = -(-(counted + 4) // 8) * 8 - counted
    records = b""
    for finger in range(fingers):
        sums = ((9, known.area_bits), (9 * x, known.sum_x_bits), (9 * (y + 4 * finger), known.sum_y_bits))
        records += join(sums)[0].to_bytes(known.item_bytes, "little")
    trailer, width = join(
        (
            (number * step_us % 2**24, 24),
            (number % 256, 8),
            (low, 3),
            (9 * fingers, known.area_bits),
            (fingers, known.zones_bits),
            (0, room + 4),
            (5, 4),
        )
    )
    packet = Packet()
    packet.push(records + trailer.to_bytes(width // 8, "little"))
    return packet.wire(before=known.fingerprint[:2])


def greeting(number: int = 0) -> bytes:
    """Hello of a new board that received this request."""
    digits = [0] * 11 + [number >> 7 * place & 127 for place in range(3)] + [0, 0]
    return hello(facts(SKIN), digits)


class Feeder:
    """A board that answers requests until started, then writes all frames ``rounds`` times: ``paced`` of them every
    PACE_S, or, if 0, as fast as read. ``touched``: frames with the fingertip."""

    def __init__(self, rounds: int, paced: int, touched: Callable[[int], bool]):
        self._rounds, self._paced, self._touched = rounds, paced, touched
        context: Any = multiprocessing.get_context("fork")
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self.go = context.Event()
        self.written_s = context.RawArray("d", rounds * FRAMES)
        """``time.monotonic`` before each frame's last byte."""
        self.process = context.Process(target=self._run, daemon=True)

    def _run(self) -> None:
        low, sent = self._answer()
        frames = [frame(number, low, int(self._touched(number))) for number in range(FRAMES)]
        self._write(frame(sent, low))  # the reader waits until the frames are made
        place = sent + 1
        size = self._paced or CHUNK // len(frames[0])
        due_s = time.monotonic()
        while place < len(self.written_s):
            chosen = range(place, min(place + size, len(self.written_s)))
            data = b"".join(frames[number % FRAMES] for number in chosen)
            now_s = time.monotonic()
            for number in chosen:  # before the reader can have them
                self.written_s[number] = now_s
            self._write(data)
            place += size
            if self._paced:
                due_s = max(due_s + PACE_S, now_s)  # what came too late is not made up for
                time.sleep(max(0.0, due_s - time.monotonic()))
        time.sleep(60.0)  # a port that is closed would take what was not read with it

    def _answer(self) -> tuple[int, int]:
        asked, taken, low, sent = b"", 0, 0, 0
        while not self.go.is_set():
            if not select.select([self._master], [], [], 0.01)[0]:
                continue
            asked += os.read(self._master, 4096)
            for one in heard([(0, asked)], facts(SKIN).bit_clocks).requests[taken:]:
                taken, low = taken + 1, one.number % 8
                self._write((greeting(one.number) if one.hello else b"") + frame(sent, low))
                sent += 1
        return low, sent

    def _write(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._master, data) :]


@contextmanager
def stream(
    rounds: int, paced: int = 0, touched: Callable[[int], bool] = lambda number: True
) -> Iterator[tuple[contactfpga.Board, contactfpga.Subscription, Feeder]]:
    """An open board, and a queue of its frames but the first."""
    feeder = Feeder(rounds, paced, touched)
    feeder.process.start()
    try:
        with contactfpga.open(feeder.port, SKIN, timeout=10.0) as board:
            with board.subscribe(maxsize=rounds * FRAMES) as queue:
                feeder.go.set()
                queue.next(10.0)
                yield board, queue, feeder
            assert not board.stats.lost
    finally:
        feeder.process.kill()


def decoded(size: int) -> float:
    """Frames per second from chunks of ``size`` bytes to a batch per megabyte."""
    data = b"".join(frame(number, 1) for number in range(FRAMES))
    best = 0.0
    for _ in range(5):
        host = Conversation("bytes")
        host.receive(greeting(), 0.0)
        started = time.process_time()
        chunks = (data[start : start + size] for start in range(0, len(data), size))
        batch = Batch.of([event for chunk in chunks for event in host.receive(chunk, 0.0) if isinstance(event, Run)])
        best = max(best, len(batch.frames) / (time.process_time() - started))
        assert len(batch.frames) == FRAMES
    return best


def over_a_port(take: Callable[[contactfpga.Subscription], int]) -> float:
    """Frames per second over a pseudo-terminal."""
    with stream(ROUNDS) as (_, queue, _):
        count, wanted, started = 0, (ROUNDS - 1) * FRAMES, time.process_time()
        while count < wanted:
            count += take(queue)
        return count / (time.process_time() - started)


def latencies_us() -> list[float]:
    """Delays from the last byte's write to ``latest``, after the first tenth."""
    found, rounds = [], 6
    with stream(rounds, PACED) as (board, queue, feeder):
        queue.close()
        number = 0
        while number < rounds * FRAMES - 1:
            number = board.latest(10.0).time_us // STEP_US
            if number >= rounds * FRAMES // 10:
                found.append((time.monotonic() - feeder.written_s[number]) * 1e6)
    return found


def main() -> int:
    old, new = decoded(len(frame(0, 1))), decoded(CHUNK)
    print("| one zone per frame | frames per second of one core |")
    print("|---|---|")
    print(f"| chunks of one frame to arrays | {old:,.0f} |")
    print(f"| chunks of {CHUNK} bytes to arrays | {new:,.0f}, {new / old:.1f} times as many |")
    print(f"| `next()` on a pseudo-terminal | {over_a_port(lambda queue: queue.next(10.0) is not None):,.0f} |")
    print(
        f"| `batch()` on a pseudo-terminal | {over_a_port(lambda queue: len(queue.batch(timeout=10.0).frames)):,.0f} |"
    )
    found = sorted(latencies_us())
    p99 = found[len(found) * 99 // 100]
    print(f"\nLast byte written to `latest()`, {PACED / PACE_S:,.0f} frames per second: median ", end="")
    print(f"{statistics.median(found):.0f} us, 99 % {p99:.0f} us, worst {found[-1]:.0f} us, of {len(found):,} calls")
    return 0


if __name__ == "__main__":
    sys.exit(main())
