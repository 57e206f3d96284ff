"""The host's end of the line: a UART with a clock of its own, and noise before it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.rig import Rig, hello_clocks

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
        """With this many pulses per second that turn the level around for half a bit to two bits."""
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
class Heard:
    """What the host makes of a line."""

    sent: int
    """Frames that were sent."""
    arrived: int
    """Frames that arrived as they were sent."""
    wrong: int
    """Frames that arrived and were never sent."""
    told: tuple[str, ...]
    """Counters that are not 0, and errors."""


def heard(line: Line, data: bytes, greeted: bytes = b"") -> Heard:
    """The host's frames and counters; ``greeted`` came before, as it was sent."""
    sent = _decoded(b"".join(packet + bytes([protocol.DELIMITER]) for packet in line.frames))[0]
    frames, conversation = _decoded(greeted + data)
    stats = conversation.stats
    right = sum(1 for frame in frames if frame in set(sent))
    counters = {"lost": stats.lost, "damaged": stats.damaged.total()}
    told = [name for name, count in counters.items() if count]
    if conversation.hello is None:
        told = ["OnlyNoise"]
    return Heard(len(sent), right, len(frames) - right, tuple(told))


def _decoded(data: bytes) -> tuple[list[str], Conversation]:
    conversation = Conversation("the line")
    events = conversation.receive(data, 0.0)
    arrived = [event.zones for event in events if isinstance(event, Arrival)]
    return [str(_sent(zones)) for zones in arrived], conversation


def _sent(zones: Zones) -> dict[str, object]:
    """What the board said, without what the host adds from the frames before: flags, and the time on its own clock."""
    own = {name: value for name, value in zones.to_dict().items() if not name.startswith("host_")}
    return own | {"flags": sorted(zones.frame.flags)}
