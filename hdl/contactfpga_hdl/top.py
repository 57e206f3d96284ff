"""The whole chain for one Skin; wiring only."""

from amaranth.hdl import Module, Mux
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.debounce.even import Debounce
from contactfpga_hdl.debounce.timed import TimedDebounce
from contactfpga_hdl.label import LABELLERS
from contactfpga_hdl.link.link import Link
from contactfpga_hdl.link.request import RequestReader
from contactfpga_hdl.link.uart import Receiver, Transmitter
from contactfpga_hdl.payloads import moments_layout
from contactfpga_hdl.report.audit import Audit, Bitmap
from contactfpga_hdl.report.divide import Divide
from contactfpga_hdl.scan.adaptive import AdaptiveScanner
from contactfpga_hdl.scan.pins import column_pins, connect_pins, row_pins
from contactfpga_hdl.scan.raster import Scanner


class Top(wiring.Component):
    """Row and column pins, UART and ``contact`` pin.

    The pins at the sheet are ``rows`` and ``columns``, or those of the shift registers in their place, one data pin a
    chain: ``row_data``, ``row_clock``, ``row_latch``, ``row_enable_n``; ``column_load_n``, ``column_clock``,
    ``column_data``.

    With ``probes`` the transfers at the stage boundaries are outputs too, for co-simulation: rows handed to the
    labeller, zone records (or with ``report = "cells"`` bitmap rows), with ``report = "barycenter"`` what becomes of
    the records, and bytes.
    """

    def __init__(self, skin: Skin, probes: bool = False):
        self.skin = skin
        self.probes = probes
        derived = Derived(skin)
        ports = {
            **row_pins(skin),
            **column_pins(skin),
            "tx": Out(1, init=1),
            "rx": In(1, init=1),
            "contact": Out(1),
        }
        if probes:
            ports |= {
                "row_transfer": Out(1),
                "row_cells": Out(skin.columns),
                "row_last": Out(1),
                "record_transfer": Out(1),
                "record_data": Out(8 * derived.item_bytes),
                "record_end": Out(1),
                "byte_transfer": Out(1),
                "byte_data": Out(8),
            }
            if skin.report == "barycenter":
                ports["record_data"] = Out(moments_layout(derived).size)
                ports |= {"item_transfer": Out(1), "item_data": Out(8 * derived.item_bytes), "item_end": Out(1)}
        super().__init__(ports)

    def elaborate(self, platform):
        m = Module()
        bit_clocks = Derived(self.skin).bit_clocks
        m.submodules.scan = scan = Scanner(self.skin) if self.skin.scan == "raster" else AdaptiveScanner(self.skin)
        m.submodules.link = link = Link(self.skin)
        m.submodules.transmitter = transmitter = Transmitter(bit_clocks)
        m.submodules.receiver = receiver = Receiver(bit_clocks)
        m.submodules.request = request = RequestReader()
        wiring.connect(m, receiver.bits, request.bits)
        rows = self._debounced(m, scan)
        if self.skin.report == "cells":
            self._cells(m, rows, scan, link)
        else:
            self._zones(m, rows, scan, link)
        wiring.connect(m, link.bytes, transmitter.bytes)
        connect_pins(m, scan.pins, self)
        m.d.comb += [
            self.contact.eq(scan.contact),
            self.tx.eq(transmitter.pin),
            receiver.pin.eq(self.rx),
            scan.request.eq(request.received),
            scan.heard.eq(request.heard),
            link.tag.eq(scan.tag),
            link.epoch.eq(scan.epoch),
            link.asked.eq(request.received & request.hello),
            link.number.eq(request.number),
        ]
        if self.probes:
            self._probe(m, "row", rows, cells=rows.payload.cells, last=rows.payload.last)
            self._probe(m, "byte", link.bytes, data=link.bytes.payload)
        return m

    def _debounced(self, m, scan):
        if self.skin.debounce == "none":
            return scan.rows
        adaptive = self.skin.scan == "adaptive"
        m.submodules.debounce = debounce = TimedDebounce(self.skin) if adaptive else Debounce(self.skin)
        wiring.connect(m, scan.rows, debounce.raw)
        if adaptive:
            m.d.comb += [debounce.alone.eq(scan.alone), debounce.now.eq(scan.sampled), scan.busy.eq(debounce.busy)]
        return debounce.rows

    def _zones(self, m, rows, scan, link):
        m.submodules.label = label = LABELLERS[self.skin.labeller](self.skin)
        m.submodules.audit = audit = Audit(self.skin)
        wiring.connect(m, rows, label.rows)
        wiring.connect(m, label.records, audit.records)
        if self.skin.report == "barycenter":
            self._divided(m, audit, link)
        else:
            wiring.connect(m, audit.items, link.items)
        m.d.comb += [
            audit.taken.eq(rows.valid & rows.ready),
            audit.row.eq(rows.payload),
            link.summary.eq(audit.summary),
        ]
        if self.probes:
            record = label.records.payload
            self._probe(m, "record", label.records, data=record.zone.as_value(), end=record.end)

    def _divided(self, m, audit, link):
        m.submodules.divide = divide = Divide(self.skin)
        wiring.connect(m, audit.items, divide.records)
        wiring.connect(m, divide.items, link.items)
        if self.probes:
            item = divide.items.payload
            self._probe(m, "item", divide.items, data=Mux(item.end, 0, item.data), end=item.end)

    def _cells(self, m, rows, scan, link):
        m.submodules.bitmap = bitmap = Bitmap(self.skin)
        wiring.connect(m, rows, bitmap.rows)
        wiring.connect(m, bitmap.items, link.items)
        m.d.comb += link.summary.eq(bitmap.summary)
        if self.probes:
            item = bitmap.items.payload
            self._probe(m, "record", bitmap.items, data=item.data, end=item.end)

    def _probe(self, m, name, boundary, **fields):
        m.d.comb += getattr(self, f"{name}_transfer").eq(boundary.valid & boundary.ready)
        for field, value in fields.items():
            m.d.comb += getattr(self, f"{name}_{field}").eq(value)
