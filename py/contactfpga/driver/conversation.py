"""The protocol between host and board without input or output: bytes and the time in, events out.

Only this module, :mod:`contactfpga.driver.requests` and :mod:`contactfpga.driver.clock` decide on freshness, losses,
restarts, hellos and times.
"""

from __future__ import annotations

import functools
import math
import random
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from contactfpga.driver import native
from contactfpga.driver.clock import MOST_S, ClockFit, HostClock, Timeline, run_ends
from contactfpga.driver.events import Lines, UnitLine
from contactfpga.driver.native import FrameFormat, Steady
from contactfpga.driver.reads import Reads
from contactfpga.driver.requests import Requests
from contactfpga.driver.stats import Stats
from contactfpga.errors import SkinMismatch, VersionMismatch
from contactfpga.skin import Skin
from contactfpga.skin.derived import LONGEST_PACKET, Widths
from contactfpga.skin.sheet import Sheet
from contactfpga.wire import framing, protocol
from contactfpga.wire.command import Command
from contactfpga.wire.faults import KIND_FAULTS, Faults, SelfTestSlot, decode_slot, is_slot
from contactfpga.wire.hello import Hello, describe, difference
from contactfpga.wire.protocol import OldPacket, PacketError, frame_of
from contactfpga.wire.sheet_number import sheet_of
from contactfpga.wire.table import PacketTable
from contactfpga.wire.units import KIND_UNITS
from contactfpga.zones.run import Run
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import HostLine, HostLines, Zones

_FRAME_KINDS = set(protocol.KINDS.values())


Event = Run | Hello | Faults | SelfTestSlot | UnitSamples | SkinMismatch | VersionMismatch


def frames_in(events: Iterable[Event]) -> list[Zones]:
    return [zones for event in events if isinstance(event, Run) for zones in event]


class Conversation:
    """The host's side of the protocol on one port.

    ``port``: its name, for messages. ``expected``: the Skin from which the board must be built; None: any. ``live``: a
    board is at the other end, not a recording, which has no arrival times. ``fit`` makes the fit of its clocks.
    """

    def __init__(
        self,
        port: str,
        expected: Skin | None = None,
        live: bool = True,
        rng: random.Random | None = None,
        fit: Callable[[], ClockFit] = ClockFit,
    ) -> None:
        self.port = port
        self.stats = Stats()
        self.hello: Hello | None = None
        self.sheet: Sheet | None = None
        """Sheet by which frames are read; None before a hello of the expected Skin."""
        self.numbers: set[int] = set()
        """Sheet numbers in packets before the first hello."""
        self.lines = Lines(expected.mask if expected is not None else ())
        self.units = UnitLine(self.stats)
        self._expected = expected
        self._live = live
        self._requests = Requests(rng)
        self._timeline = Timeline(self.stats, live)
        self._clock = HostClock(fit() if live else None)
        self._reader = protocol.HelloReader()
        self.frame_format: FrameFormat | None = None
        """None before a hello of the expected Skin."""
        self.decode = native.decode
        """Reads packets of a frame format, like :func:`contactfpga.wire.table.decode`."""
        self._rest = b""
        self._noticed = math.inf
        self._doubted = -math.inf
        self.unused = 0
        """Bytes that came to nothing: damaged, before the first hello, or of frames whose times are unknown."""
        self._begun = False  # the first piece is cut off by when we began to listen; it is no damage
        self._damage = False

    def ask(self, now: float, until: float) -> int:
        """Request a frame scanned after ``now``; returns the ticket that :attr:`Run.answers` reaches.

        Until ``until`` a request that seems lost is sent again.
        """
        self._notice(now)
        return self._requests.ask(now, until, hello=not self._timeline.known)

    def command(self, command: Command, now: float, until: float) -> int:
        """Send a command, one at a time; returns a ticket for a frame scanned after the board took it."""
        self._notice(now)
        return self._requests.command(command, now, until)

    def end_command(self) -> None:
        self._requests.end_command()

    def doubt(self, now: float) -> None:
        """Note a reading pause: bytes received from now on may have waited, or may be much later."""
        self._timeline.doubt(now)
        self._doubted = now

    def data_to_send(self) -> bytes:
        """Bytes to send to the board now; call it after other methods."""
        return self._requests.data_to_send()

    def receive(self, data: bytes, now: float) -> list[Event]:
        """The events that ``data`` completes, in order. ``now`` is the arrival in seconds. Call it regularly even
        without data, because a request may have to be sent again.
        """
        self._notice(now)
        return self._receive(data, now, None)

    def take(self, reads: Reads) -> Iterator[tuple[float, list[Event]]]:
        """Events of successive reads of a port, each with its arrival in s. Reads of frames that continue one another
        give one run.
        """
        at = 0
        while at < len(reads):
            end = self._steady_end(reads, at)
            if end == at:
                end, now = at + 1, reads.at_s[at]
                if reads.paused(at):
                    self.doubt(now)
                self._noticed = now
                table = reads.table_of(at) if self.frame_format == reads.frame_format else None
                yield now, self._receive(reads.data_of(at), now, table)
            elif (run := self._take_steady(reads, at, end)) is not None:
                yield reads.at_s[end - 1], [run]
            at = end

    def skip(self, missing: int, rest: bytes) -> None:
        """Count ``missing`` overwritten bytes; ``rest`` begins the next packet."""
        self._rest = rest
        self.stats.bytes += missing

    def steady(self) -> Steady | None:
        """The current steady state; None if a continuing frame might change more."""
        last, fit = self._timeline.last, self._clock.fit
        if last is None or fit is None or not fit.begun or self.lines.fading or self.frame_format is None:
            return None
        names = self.lines.names(flagged=True)
        return Steady(*last, fit, self._clock.byte_s, self.frame_format[0].sheet, names, self.units.history)

    def pass_time(self, now: float, paused: bool) -> None:
        """Note that nothing came until now. ``paused``: the reader was away too long, see :meth:`doubt`."""
        if paused:
            self.doubt(now)
        self._noticed = now
        self._requests.poll(now, hello=not self._timeline.known)

    def _receive(self, data: bytes, now: float, table: PacketTable | None) -> list[Event]:
        """``table``: all packets that ``data`` completes, by :attr:`frame_format`; None if they are to be decoded."""
        self.stats.bytes += len(data)
        *packets, self._rest = (self._rest + data).split(b"\0")
        packets = [packet for packet in packets if packet]
        if packets:
            self._clock.begin(now)
        events = list(self._take_packets(packets, now, table))
        self._clock.end(now)
        if len(self._rest) > LONGEST_PACKET:
            self._refuse("noise", len(self._rest))
            self._rest = b""
        self._requests.poll(now, hello=not self._timeline.known)
        return events

    def _take_packets(self, packets: list[bytes], now: float, table: PacketTable | None) -> Iterator[Event]:
        """Take packets, each one by the last hello before it."""
        if table is not None and len(table.packets) != len(packets):
            table = None
        at = start = 0
        ends: list[int] = []
        known: FrameFormat | None = None
        while at < len(packets):
            if self.frame_format != known:  # the first packet, or a hello came
                known, start = self.frame_format, at
                if table is None or at:
                    table = known and self.decode(packets[at:], *known)
                ends = [] if table is None else run_ends(table.packets)
            index = at - start
            if table is None or ends[index] == index:
                end, event = at + 1, self._packet(packets[at], now)
            else:
                end = at + 1 if self._stands_alone(table.packets[index]) else start + ends[index]
                sizes = [len(packet) + 1 for packet in packets[at:end]]
                event = self._take_together(table.part(index, end - start), sizes, now)
            at = end
            if event is not None:
                yield event

    def _stands_alone(self, packet: np.void) -> bool:
        """Whether what comes with a frame may end with it: an answered request, or the names of faults."""
        before = self._timeline.before
        return before is None or before.heard != packet["heard"] or self.lines.fading

    def _steady_end(self, reads: Reads, at: int) -> int:
        """The read up to which frames continue one another, at least two reads later; otherwise ``at``."""
        first = reads.packets_before(at)
        if reads.table is None or self.frame_format != reads.frame_format or first == len(reads.table.packets):
            return at
        end = reads.last_within(at, reads.run_ends[first])
        if end <= at + 1 or not self._requests.idle:
            return at
        return at if self._stands_alone(reads.table.packets[first]) else end

    def _take_steady(self, reads: Reads, at: int, end: int) -> Run | None:
        assert reads.table is not None
        data, now = reads.data_of(at, end), reads.at_s[end - 1]
        self.stats.bytes += len(data)
        self._noticed = now
        self._rest = data[data.rindex(0) + 1 :]
        first, last = reads.packets_before(at), reads.packets_before(end)

        def take(times_us: np.ndarray, asked_s: float | None) -> HostLines | None:
            return self._clock.take_reads(*reads.last_frames(at, end, times_us))

        return self._take_frames(
            reads.table.part(first, last), reads.sizes[first:last] + 1, (reads.at_s[at], now), take
        )

    def _take_together(self, table: PacketTable, sizes: list[int], now: float) -> Run | None:
        return self._take_frames(table, sizes, (now, now), functools.partial(self._clock.take, sizes, now))

    def _take_frames(
        self,
        table: PacketTable,
        sizes: Sequence[int] | np.ndarray,
        came_s: tuple[float, float],
        clock: Callable[[np.ndarray, float | None], HostLine | HostLines | None],
    ) -> Run | None:
        """Take at least one frame, all of which continue the first one; None if their times are unknown.

        ``came_s``: arrival of the first and the last one. ``clock``: takes their times, and when the request was sent
        that they answer.
        """
        assert self.frame_format is not None
        widths, packets, starts = self.frame_format[0], table.packets, table.starts
        before, answered = self._timeline.before, self._requests.answered
        last = frame_of(packets[-1].item(), table.records[starts[-2] : starts[-1]], widths.sheet)
        times_us = self._timeline.take(packets, widths, last, came_s)
        self._passed()
        if times_us is None:
            self.unused += int(sum(sizes))
            return None
        self._requests.take_frame(last.heard, came_s[1])
        line = clock(times_us, self._requests.answered_sent_s if self._requests.answered > answered else None)
        return Run(
            widths.sheet,
            packets,
            starts,
            table.records,
            times_us,
            line,
            before,
            self.lines.names("fault" in last.flags or not self.lines.fading),
            self.units.history,
            self._requests.answered,
        )

    def _notice(self, now: float) -> None:
        if self._live and now - self._noticed > MOST_S:
            self.doubt(now)
        self._noticed = now

    def _packet(self, packet: bytes, now: float) -> Event | None:
        try:
            event = self._decode(packet, now)
        except OldPacket as old:
            return self._foreign(old)
        except PacketError as error:
            self._refuse(error.reason, len(packet) + 1)
            return None
        self._passed()
        return event

    def _passed(self) -> None:
        self._begun = True
        if self._damage:
            self._damage = False
            self.stats.resynchronized += 1

    def _refuse(self, reason: str, size: int) -> None:
        self.unused += size
        if self._begun:
            self.stats.damaged[reason] += 1
            self._damage = True
        self._begun = True

    def _foreign(self, old: OldPacket) -> VersionMismatch | None:
        self.stats.foreign_version += 1
        if not old.hello:
            return None
        self.hello = self.sheet = self.frame_format = None
        self._timeline = Timeline(self.stats, self._live)
        self._clock.forget()
        return VersionMismatch(
            f"{self.port} speaks protocol version 1, this host version {framing.VERSION}; "
            "load a bitstream and install a contactfpga of the same release"
        )

    def _decode(self, packet: bytes, now: float) -> Event | None:
        if self.hello is None and framing.unreadable(packet):
            self.stats.before_hello += 1
            self.unused += len(packet) + 1
            if (sheet := sheet_of(packet)) is not None:
                self.numbers.add(sheet)
            return None
        plain = framing.unseal(packet, self._before())
        kind = framing.kind_of(plain)
        if kind == framing.KIND_HELLO:
            taken = self._reader.take(plain)
            return None if taken is None else self._take_hello(taken, now)
        hello = self.hello
        if kind == KIND_FAULTS and hello is not None and (hello.guard or hello.self_test):
            return self._take_lines(plain, hello)
        if kind == KIND_UNITS and hello is not None and hello.units is not None:
            samples = self.units.take(plain, self._timeline)
            return samples if self.frame_format is not None else None
        if kind not in _FRAME_KINDS:
            self.stats.unknown_kinds += 1
            return None
        if self.frame_format is None:
            self.stats.foreign_skin += 1
            return None
        widths = self.frame_format[0]
        table = PacketTable.of([protocol.decode(plain, widths)], widths)
        return self._take_together(table, [len(packet) + 1], now)

    def _take_lines(self, plain: bytes, hello: Hello) -> Faults | SelfTestSlot | None:
        if is_slot(plain):
            slot = decode_slot(plain, hello.sheet.rows, hello.sheet.columns)
            return slot if self.frame_format is not None else None
        found = self.lines.take_report(plain, hello)
        self.stats.fault_reports += 1
        return found if self.frame_format is not None else None

    def _before(self) -> bytes:
        return protocol.check_prefix(self.hello) if self.hello else b""

    def _take_hello(self, hello: Hello, now: float) -> Hello | SkinMismatch:
        self.stats.hellos += 1
        before, self.hello = self.hello, hello
        changed = before is not None and (before.fingerprint, before.sheet) != (hello.fingerprint, hello.sheet)
        if changed:
            self.stats.skin_changes += 1
            self.lines.forget()
            self.units.forget()
            self._timeline = Timeline(self.stats, self._live)
            self._clock.forget()
        expected = self._expected
        if expected is not None and hello.fingerprint != expected.fingerprint:
            self.sheet = self.frame_format = None
            return SkinMismatch(f"{self.port} was built from {difference(hello, expected)}")
        restarts = self.stats.restarts
        self._timeline.take_hello(hello, now, self._requests.sent_since(hello.heard, self._doubted))
        if self.stats.restarts > restarts:
            self.lines.forget()
            self.units.forget()
            self._clock.forget()
        self.lines.take_hello(hello)
        self.units.take_hello(hello)
        self._requests.take_hello(hello.heard, hello.pulsed, now)
        longest = Widths(hello.sheet).max_frame_bytes
        self._clock.byte_s = 10 / hello.baud
        self._requests.retry_s = 0.25 + 4 * (longest + 100) * 10 / hello.baud
        if self.sheet != hello.sheet or self.frame_format is None or changed:
            self.sheet = hello.sheet
            self.frame_format = Widths(hello.sheet), self._before()
        if not changed or before is None:
            return hello
        return SkinMismatch(
            f"{self.port} now has {describe(hello)}, before it was {describe(before)}: another bitstream was "
            "loaded; frames from here on are of the new Skin"
        )
