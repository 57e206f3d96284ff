"""The protocol between host and board without input or output: bytes and the time in, events out.

Only this module, :mod:`contactfpga.driver.requests` and :mod:`contactfpga.driver.clock` decide on freshness, losses,
restarts, hellos and times.
"""

from __future__ import annotations

import dataclasses
import math
import random
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.driver.clock import MOST_S, ClockFit, HostClock, Timeline, continues
from contactfpga.driver.events import Lines, UnitLine
from contactfpga.driver.reads import Reads
from contactfpga.driver.requests import Requests
from contactfpga.driver.stats import Stats
from contactfpga.errors import SkinMismatch, VersionMismatch
from contactfpga.skin import Skin
from contactfpga.skin.derived import LONGEST_PACKET, Widths
from contactfpga.skin.sheet import Sheet
from contactfpga.wire import framing, many, protocol
from contactfpga.wire.command import Command
from contactfpga.wire.faults import KIND_FAULTS, Faults, SelfTestSlot, decode_slot, is_slot
from contactfpga.wire.hello import Hello, describe, difference
from contactfpga.wire.numbered import sheet_of
from contactfpga.wire.protocol import Frame, OldPacket, PacketError
from contactfpga.wire.units import KIND_UNITS
from contactfpga.zones.run import Run, frame_of
from contactfpga.zones.units import UnitHistory, UnitSamples
from contactfpga.zones.zone import HostLine, Zones

_FRAME_KINDS = set(protocol.KINDS.values())


@dataclasses.dataclass(frozen=True, slots=True)
class Arrival:
    zones: Zones
    answers: int
    """Highest ticket of :meth:`Conversation.ask` that was issued before the frame was scanned."""


class Steady(NamedTuple):
    """The meaning of frames while they change only counters and clocks, because each continues the last one."""

    time_us: int
    """Time of :attr:`before` since power-up."""
    before: Frame
    came_s: float
    """Arrival of :attr:`before`, on the host's clock."""
    fit: ClockFit
    byte_s: float
    sheet: Sheet
    faults: tuple[str, ...]
    history: UnitHistory | None

    def zones(self, frame: Frame, time_us: int, before: Frame, line: HostLine) -> Zones:
        """Zones of a frame, without counting it; ``before`` is the frame just before it."""
        return Zones(frame, self.sheet, time_us, before, line, self.faults, self.history)


Event = Arrival | Hello | Faults | SelfTestSlot | UnitSamples | SkinMismatch | VersionMismatch

FEW, FEW_IN_RUN = 16, 8
"""Least number of packets, and of frames, whose joint processing is faster."""


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
        self.frame_format: tuple[Widths, bytes] | None = None
        """Widths of frames, and first bytes of their check; None if frames have to be decoded singly."""
        self._widths: Widths | None = None
        self._rest = b""
        self._noticed = math.inf
        self._doubted = -math.inf
        self.unused = 0
        """Bytes that came to nothing: damaged, before the first hello, or of frames whose times are unknown."""
        self._begun = False  # the first piece is cut off by when we began to listen; it is no damage
        self._damage = False

    def ask(self, now: float, until: float) -> int:
        """Request a frame scanned after ``now``; returns the ticket that :attr:`Arrival.answers` reaches.

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
        packets = self._split(data, now)
        events = [event for packet in packets if (event := self._packet(packet, now)) is not None]
        self._end(now)
        return events

    def receive_runs(self, data: bytes, now: float, decoded: many.PacketTable | None = None) -> list[Event | Run]:
        """Events as of :meth:`receive`, but successive frames that answer no further request come as runs. ``decoded``:
        all packets that ``data`` completes, by the last hello.
        """
        packets = self._split(data, now)
        if decoded is not None and len(decoded.packets) != len(packets):
            decoded = None
        same = self.frame_format
        events: list[Event | Run] = []
        at = 0
        while at < len(packets):
            known = decoded if decoded is not None and self.frame_format == same else None
            at += self._take_some(packets[at:], now, events, known and known.part(at, len(packets)))
        self._end(now)
        return events

    def receive_reads(self, reads: Reads) -> Iterator[tuple[float, list[Event | Run]]]:
        """Events of successive reads, each with its arrival in s. Reads of frames that continue one another give one
        run.
        """
        table = reads.decoded
        ends = None if table is None or len(table.packets) < FEW_IN_RUN else _ends(continues(table.packets))
        at = 0
        while at < len(reads):
            end = at if ends is None else self._steady(reads, at, ends)
            if end > at:
                yield reads.at_s[end - 1], [self._take_reads(reads, at, end)]
                at = end
                continue
            now = reads.at_s[at]
            if reads.paused(at):
                self.doubt(now)
            self._noticed = now
            decoded = reads.decoded_at(at) if self.frame_format == reads.frame_format else None
            yield now, self.receive_runs(reads.data_of(at), now, decoded)
            at += 1

    def skip(self, missing: int, rest: bytes) -> None:
        """Count ``missing`` overwritten bytes; ``rest`` begins the next packet."""
        self._rest = rest
        self.stats.bytes += missing

    def steady(self) -> Steady | None:
        """The current steady state; None if a continuing frame might change more."""
        last, fit = self._timeline.last, self._clock.fit
        if last is None or fit is None or not fit.begun or self.lines.fading or self.frame_format is None:
            return None
        assert self._widths is not None
        names = self.lines.names(flagged=True)
        return Steady(*last, fit, self._clock.byte_s, self._widths.sheet, names, self.units.history)

    def pass_time(self, now: float, paused: bool) -> None:
        """Note that nothing came until now. ``paused``: the reader was away too long, see :meth:`doubt`."""
        if paused:
            self.doubt(now)
        self._noticed = now
        self._requests.poll(now, hello=not self._timeline.known)

    def _split(self, data: bytes, now: float) -> list[bytes]:
        self.stats.bytes += len(data)
        self._notice(now)
        *packets, self._rest = (self._rest + data).split(b"\0")
        if packets:
            self._clock.begin(now)
        return [packet for packet in packets if packet]

    def _steady(self, reads: Reads, at: int, ends: list[int]) -> int:
        """The read up to which frames continue one another; ``at`` unless they are many enough, with one in the last
        read.
        """
        first = reads.packets_before(at)
        end = reads.last_within(at, ends[first + 1] if first + 1 < len(ends) else first)
        if end == at or reads.packets_before(end) - first < FEW_IN_RUN or self.frame_format != reads.frame_format:
            return at
        if not self._requests.idle or self.lines.fading or not self._clock.begun:
            return at
        assert reads.decoded is not None
        valid, time_us, sequence, heard, *_ = reads.decoded.packets[first].item()
        return end if valid and self._timeline.expects(heard, time_us, sequence, reads.at_s[at]) else at

    def _take_reads(self, reads: Reads, at: int, end: int) -> Run:
        assert self._widths is not None
        assert reads.decoded is not None
        data, now = reads.data_of(at, end), reads.at_s[end - 1]
        self.stats.bytes += len(data)
        self._noticed = now
        self._rest = data[data.rindex(0) + 1 :]
        widths, before = self._widths, self._timeline.before
        decoded = reads.decoded.part(reads.packets_before(at), reads.packets_before(end))
        last = frame_of(
            decoded.packets[-1].item(), decoded.records[decoded.starts[-2] : decoded.starts[-1]], widths.sheet
        )
        times_us = self._timeline.take_run(decoded.packets, widths, last, now)
        self._requests.take_frame(last.heard, now)
        lines = self._clock.take_reads(*reads.last_frames(at, end, times_us))
        self._passed()
        faults = self.lines.names(flagged=True)
        return Run(
            widths.sheet,
            decoded.packets,
            decoded.starts,
            decoded.records,
            times_us,
            lines,
            before,
            faults,
            self.units.history,
        )

    def _end(self, now: float) -> None:
        self._clock.end(now)
        if len(self._rest) > LONGEST_PACKET:
            self._refuse("noise", len(self._rest))
            self._rest = b""
        self._requests.poll(now, hello=not self._timeline.known)

    def _take_some(
        self, packets: list[bytes], now: float, events: list[Event | Run], decoded: many.PacketTable | None
    ) -> int:
        """Take at least one packet, up to a change of the sheet; returns their number.

        A frame that may not continue the one before is decoded alone, because it decides how to read the next ones.
        """
        before, widths = self._before(), self._widths
        table, ends, follows = None, [0], False
        if len(packets) >= FEW and widths is not None and self.frame_format is not None:
            table = many.decode(packets, widths, before) if decoded is None else decoded
            ends, follows = self._stretches(table.packets, now)
        at = 0
        while at < len(packets) and self._widths is widths and self._before() == before:
            in_run = follows and not self.lines.fading
            if in_run and table is not None and ends[at] - at >= FEW_IN_RUN:
                events.append(self._take_run(table, at, ends[at], len(packets[ends[at] - 1]), now))
                at, follows = ends[at], False
                continue
            if decoded is not None and decoded.packets[at]["valid"]:
                event = self._decoded(decoded, at, len(packets[at]), now)
            else:
                event = self._packet(packets[at], now)
            at, follows = at + 1, isinstance(event, Arrival)
            if event is not None:
                events.append(event)
        return at

    def _stretches(self, packets: np.ndarray, now: float) -> tuple[list[int], bool]:
        """For each place, and the one after the last, the end of the frames that continue one another; and whether the
        first is expected.
        """
        found = continues(packets)
        valid, time_us, sequence, heard, *_ = packets[0].item()
        expected = valid and self._timeline.expects(heard, time_us, sequence, now)
        found[0] = expected
        return _ends(found), expected

    def _take_run(self, table: many.PacketTable, start: int, end: int, last_bytes: int, now: float) -> Run:
        assert self._widths is not None
        widths = self._widths
        packets, starts = table.packets[start:end], table.starts[start : end + 1]
        last = frame_of(packets[-1].item(), table.records[starts[-2] : starts[-1]], widths.sheet)
        before = self._timeline.before
        times_us = self._timeline.take_run(packets, widths, last, now)
        line = self._heard(last.heard, int(times_us[-1]), last_bytes, now)  # all of them carry the same
        self._passed()
        faults = self.lines.names(flagged=True)
        return Run(widths.sheet, packets, starts, table.records, times_us, line, before, faults, self.units.history)

    def _heard(self, heard: int, time_us: int, packet_bytes: int, now: float) -> HostLine | None:
        answered = self._requests.answered
        self._requests.take_frame(heard, now)
        asked_s = self._requests.answered_sent_s if self._requests.answered > answered else None
        return self._clock.take(time_us, packet_bytes + 1, now, asked_s)

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

    def _decoded(self, decoded: many.PacketTable, index: int, packet_bytes: int, now: float) -> Event | None:
        assert self._widths is not None
        start, end = decoded.starts[index], decoded.starts[index + 1]
        frame = frame_of(decoded.packets[index].item(), decoded.records[start:end], self._widths.sheet)
        event = self._take_frame(frame, self._widths, packet_bytes, now)
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
        self.hello = self.sheet = self._widths = self.frame_format = None
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
            told = self._reader.take(plain)
            if told is None:
                return None
            event = self._take_hello(told, now)
            widths = self._widths
            many_at_once = widths is not None and widths.report.zones and not widths.sheet.ghosts
            self.frame_format = (widths, self._before()) if widths is not None and many_at_once else None
            return event
        hello = self.hello
        if kind == KIND_FAULTS and hello is not None and (hello.guard or hello.self_test):
            return self._take_lines(plain, hello)
        if kind == KIND_UNITS and hello is not None and hello.units is not None:
            samples = self.units.take(plain, self._timeline)
            return samples if self._widths is not None else None
        if kind not in _FRAME_KINDS:
            self.stats.unknown_kinds += 1
            return None
        if self._widths is None:
            self.stats.foreign_skin += 1
            return None
        return self._take_frame(protocol.decode_frame(plain, self._widths), self._widths, len(packet), now)

    def _take_lines(self, plain: bytes, hello: Hello) -> Faults | SelfTestSlot | None:
        if is_slot(plain):
            slot = decode_slot(plain, hello.sheet.rows, hello.sheet.columns)
            return slot if self._widths is not None else None
        found = self.lines.take_report(plain, hello)
        self.stats.fault_reports += 1
        return found if self._widths is not None else None

    def _before(self) -> bytes:
        return protocol.check_prefix(self.hello) if self.hello else b""

    def _take_frame(self, frame: Frame, widths: Widths, packet_bytes: int, now: float) -> Arrival | None:
        before = self._timeline.before
        time_us = self._timeline.take_frame(frame, widths, now)
        if time_us is None:
            self.unused += packet_bytes + 1
            return None
        line = self._heard(frame.heard, time_us, packet_bytes, now)
        faults = self.lines.names("fault" in frame.flags)
        zones = Zones(frame, widths.sheet, time_us, before, line, faults, self.units.history)
        return Arrival(zones, self._requests.answered)

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
            self.sheet = self._widths = None
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
        if self.sheet != hello.sheet:
            self.sheet = hello.sheet
            self._widths = Widths(hello.sheet)
        if not changed or before is None:
            return hello
        return SkinMismatch(
            f"{self.port} now has {describe(hello)}, before it was {describe(before)}: another bitstream was "
            "loaded; frames from here on are of the new Skin"
        )


def _ends(found: np.ndarray) -> list[int]:
    """For each place, and the one after the last, the next place that was not found."""
    places = np.where(np.append(found, False), len(found), np.arange(len(found) + 1))
    ends: list[int] = np.minimum.accumulate(places[::-1])[::-1].tolist()
    return ends
