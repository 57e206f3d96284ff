"""The gateware of one Skin: connections of its stages."""

from typing import Any, ClassVar, TypeVar

from amaranth.hdl import Module, Mux, ResetInserter, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.choices import debounces
from contactfpga.skin import Skin
from contactfpga.skin.derived import SAMPLE_AT, SELF_TEST, Derived
from contactfpga.wire.sheet_number import SheetPlace
from contactfpga_hdl.link.link import Link, offset_bits
from contactfpga_hdl.link.pack import Packer
from contactfpga_hdl.link.request import RequestReader
from contactfpga_hdl.link.uart import LINE_BITS, Receiver, Transmitter
from contactfpga_hdl.report.audit import Audit
from contactfpga_hdl.report.backlog import Backlog
from contactfpga_hdl.scan.pins import column_pins, connect_pins, moves_sample, row_pins

_Stage = TypeVar("_Stage", bound=wiring.Component)

_SHARED_LINE = {"bits": In(LINE_BITS), "bytes": Out(stream.Signature(8)), "grant": In(1), "holds": Out(1)}


class Top(wiring.Component):
    """A Skin's gateware between the pins of the sheet and those of the host.

    rows (out), columns (in): one pin per row and column, or those of shift registers, see
        :func:`~contactfpga_hdl.scan.pins.row_pins` and :func:`~contactfpga_hdl.scan.pins.column_pins`.
    tx (out), rx (in): the UART.
    contact (out): high while something touches the sheet. With units a clock later, and while a threshold is reached;
        with ``fail_safe`` a clock later, and while a fault is known or units have no threshold.
    spi_clock, spi_select_n, spi_mosi (out), spi_miso (in): with units, pins at their converter.
    alive (out): with ``alive``, see :class:`~contactfpga_hdl.link.alive.Alive`.

    ``probes`` adds the outputs of :func:`~contactfpga_hdl.probes.probe_ports`.

    If scan or link find that a register flipped by itself, everything except the transmitter restarts within two
    clocks: a hello follows the byte on the line, with its counters at 0. With ``fail_safe`` the pin ``contact`` is high
    until a later frame is packed.

    A Skin with ``dual`` has two copies (:class:`~contactfpga_hdl.dual.Dual`); a ``copy`` has ``contact`` with
    ``fail_safe`` without a register. With a ``place`` among several sheets
    (:class:`~contactfpga_hdl.several.SeveralTop`), ``bits`` (in), ``bytes`` (out), ``grant`` (in) and ``holds`` (out)
    of the link replace the UART.
    """

    LINE: ClassVar = {"tx": Out(1, init=1), "rx": In(1, init=1)}

    def __init__(self, skin: Skin, probes: bool = False, copy: bool = False, place: SheetPlace | None = None):
        self.skin = skin
        self.place = place
        self.probes = probes
        self.copy = copy
        self._restarts = Signal(name="restarts")
        self.derived = derived = skin.derived
        ports = {
            **row_pins(skin),
            **column_pins(skin),
            **_unit_pins(skin),
            **(self.LINE if place is None else _SHARED_LINE),
            "contact": Out(1),
            **({"alive": Out(1)} if skin.alive else {}),
        }
        if probes:
            from contactfpga_hdl.probes import probe_ports

            ports |= probe_ports(derived)
        super().__init__(ports)

    def elaborate(self, platform):
        if self.skin.dual and not self.copy:
            return self._compared()
        m = Module()
        # Pipeline, from the sheet to the line
        scan = self._put(m, "scan", self.derived.scan.load_gateware()(self.skin))
        rows = self._debounced(m, scan)
        items, summary = self._zones(m, rows) if self.derived.report.zones else self._bitmap(m, rows)
        packer = self._put(m, "packer", Packer(self.skin, offset_bits(self.skin, self.place)))
        link = self._put(m, "link", Link(self.skin, self.place))
        number = None if self.place is None else self.place.number
        request = RequestReader(bool(self.derived.commands), number)
        self._connect_line(m, request, link)
        m.d.sync += self._restarts.eq(scan.upset | link.upset)
        wiring.connect(m, items, packer.items)
        wiring.connect(m, packer.frames, link.frames)
        # Pins and faults
        self._connect_sheet(m, scan)
        units = self._units(m, request, link) if self.skin.units else None
        self._watch_faults(m, scan, packer, units)
        if "faults" in link.signature.members:
            m.d.comb += link.faults.eq(scan.faults)
        if self.skin.self_test:
            wiring.connect(m, scan.slots, link.slots)
            m.d.comb += scan.command.eq(request.command & (request.what == SELF_TEST))
        # Requests and tags
        m.d.comb += [
            scan.request.eq(request.received),
            scan.heard.eq(request.heard),
            packer.tag.eq(scan.tag),
            packer.summary.eq(summary),
            link.tag.eq(scan.tag),
            link.summary.eq(summary),
            link.epoch.eq(scan.epoch),
            link.asked.eq(request.received & request.hello),
            link.number.eq(request.number),
        ]
        # Optional parts of the scan
        if moves_sample(self.derived):
            m.d.comb += [scan.moves.eq(request.command & (request.what == SAMPLE_AT)), scan.clocks.eq(request.value)]
        if self.derived.scan.waits:
            m.d.comb += [
                scan.packed.eq(_packed(packer)),
                scan.due.eq(link.due),
                link.time.eq(scan.time),
            ]
        self._probe(m, "row", rows, cells=rows.payload.cells, last=rows.payload.last)
        self._probe(m, "byte", link.bytes, data=link.bytes.payload)
        return m

    def _connect_sheet(self, m: Module, scan: Any) -> None:
        if not self.skin.row_order and not self.skin.column_order:
            connect_pins(m, scan.pins, self)
            return
        from contactfpga_hdl.scan.lines import connect_lines

        connect_lines(m, self.skin, scan.pins, self)

    def _connect_line(self, m: Module, request: RequestReader, link: Link) -> None:
        if self.place is None:
            m.submodules.transmitter = transmitter = Transmitter(self.derived.bit_clocks)
            receiver = self._put(m, "receiver", receiver_of(self.derived))
            self._put(m, "request", request)
            wiring.connect(m, link.bytes, transmitter.bytes)
            wiring.connect(m, receiver.bits, request.bits)
            m.d.comb += [self.tx.eq(transmitter.pin), receiver.pin.eq(self.rx)]
            return
        self._put(m, "request", request)
        wiring.connect(m, link.bytes, wiring.flipped(self.bytes))
        wiring.connect(m, wiring.flipped(self.bits), request.bits)
        m.d.comb += [link.grant.eq(self.grant), self.holds.eq(link.holds)]

    def _put(self, m: Module, name: str, stage: _Stage) -> _Stage:
        """Add a stage that restarts when a register is found wrong. The transmitter is not reset, to complete the byte
        on the line."""
        m.submodules[name] = stage if self.skin.dual else ResetInserter(self._restarts)(stage)
        return stage

    def _units(self, m: Module, request: RequestReader, link: Link) -> wiring.Component:
        from contactfpga_hdl.units.units import Units

        units = self._put(m, "units", Units(self.skin))
        connect_pins(m, units.pins, self)
        wiring.connect(m, units.packet, link.units)
        m.d.comb += [units.command.eq(request.command), units.what.eq(request.what), units.value.eq(request.value)]
        return units

    def _watch_faults(self, m: Module, scan: Any, packer: Packer, units: wiring.Component | None) -> None:
        fault = Signal()
        over, unwatched = (0, 0) if units is None else (units.over, ~units.armed)
        stuck = scan.stuck if self.derived.scan.waits else 0  # before a frame begins and counts it
        reported = scan.faults.as_value().any() if hasattr(scan, "faults") else 0
        m.d.comb += fault.eq(scan.tag.fault | stuck | reported)
        # Where one may fall as another rises, a register keeps that from the pin.
        if self.skin.fail_safe:
            level = scan.contact | over | fault | unwatched | self._blind(m, packer)
            m.d["comb" if self.copy else "sync"] += self.contact.eq(level)
        elif units is not None:
            m.d.sync += self.contact.eq(scan.contact | over)
        else:
            m.d.comb += self.contact.eq(scan.contact)
        if self.skin.alive:
            from contactfpga_hdl.link.alive import Alive

            m.submodules.alive = alive = Alive(self.derived.clocks_per_us)
            watched = scan.watched if self.derived.scan.waits else 0
            m.d.comb += [alive.well.eq(_packed(packer) | watched), alive.fault.eq(fault), self.alive.eq(alive.pin)]

    def _blind(self, m: Module, packer: Packer) -> Value:
        """High from a restart until a whole scan after it."""
        blind = Signal()
        m.d.sync += blind.eq(self._restarts | blind & ~_packed(packer))
        return blind

    def _compared(self) -> Module:
        from contactfpga_hdl.dual import Dual

        m = Module()
        first, second = Top(self.skin, self.probes, copy=True), Top(self.skin, copy=True)
        m.submodules.dual = dual = Dual(self.skin, first, second)
        connect_pins(m, dual, self)
        return m

    def _debounced(self, m: Module, scan: Any) -> stream.Interface:
        if not self.derived.debounced:
            return scan.rows
        waits = self.derived.scan.waits
        chosen = debounces.find(self.skin.debounce)
        make = chosen.load_timed_gateware() if waits else chosen.load_gateware()
        debounce = self._put(m, "debounce", make(self.skin))
        wiring.connect(m, scan.rows, debounce.raw)
        if waits:
            m.d.comb += [debounce.alone.eq(scan.alone), debounce.now.eq(scan.sampled), scan.busy.eq(debounce.busy)]
        return debounce.rows

    def _hand_over(self, m: Module, rows: stream.Interface, taken: stream.Interface, free: Value) -> None:
        """Pass rows on; if the scan waits, a row also waits until it can be counted."""
        if not self.derived.scan.waits:
            wiring.connect(m, rows, taken)
            return
        m.d.comb += [
            taken.payload.eq(rows.payload),
            taken.valid.eq(rows.valid & free),
            rows.ready.eq(taken.ready & free),
        ]

    def _zones(self, m: Module, rows: stream.Interface) -> tuple[stream.Interface, data.View]:
        label = self._put(m, "label", self.derived.labeller.load_gateware()(self.skin))
        audit = self._put(m, "audit", Audit(self.skin))
        backlog = self._put(m, "backlog", Backlog(self.skin))
        self._hand_over(m, rows, label.rows, audit.free)
        wiring.connect(m, label.records, audit.records)
        wiring.connect(m, audit.items, backlog.passed)
        m.d.comb += [audit.taken.eq(rows.valid & rows.ready), audit.row.eq(rows.payload)]
        record = label.records.payload
        self._probe(m, "record", label.records, data=Mux(record.end, 0, record.zone.as_value()), end=record.end)
        items = self._divided(m, backlog) if self.skin.report == "barycenter" else backlog.waiting
        return items, audit.summary

    def _divided(self, m: Module, backlog: Backlog) -> stream.Interface:
        from contactfpga_hdl.report.divide import Divider

        divide = self._put(m, "divide", Divider(self.skin))
        wiring.connect(m, backlog.waiting, divide.records)
        item = divide.items.payload
        self._probe(m, "item", divide.items, data=Mux(item.end, 0, item.data), end=item.end)
        return divide.items

    def _bitmap(self, m: Module, rows: stream.Interface) -> tuple[stream.Interface, data.View]:
        from contactfpga_hdl.report.bitmap import Bitmap

        bitmap = self._put(m, "bitmap", Bitmap(self.skin))
        backlog = self._put(m, "backlog", Backlog(self.skin))
        self._hand_over(m, rows, bitmap.rows, bitmap.free)
        wiring.connect(m, bitmap.items, backlog.passed)
        item = bitmap.items.payload
        self._probe(m, "record", bitmap.items, data=item.data, end=item.end)
        return backlog.waiting, bitmap.summary

    def _probe(self, m: Module, name: str, boundary: stream.Interface, **fields: Value) -> None:
        if self.probes:
            from contactfpga_hdl.probes import connect_probe

            connect_probe(m, self, name, boundary, **fields)


def receiver_of(derived: Derived) -> wiring.Component:
    if not derived.pulsed:
        return Receiver(derived.bit_clocks)
    from contactfpga_hdl.link.pulses import PulseReceiver

    return PulseReceiver(derived.bit_clocks)


def _unit_pins(skin: Skin) -> dict[str, wiring.Member]:
    if not skin.units:
        return {}
    from contactfpga_hdl.units.ports import unit_pins

    return unit_pins(skin)


def _packed(packer: Packer) -> Value:
    frames = packer.frames
    return frames.commit | frames.decide & ~frames.verdict.send
