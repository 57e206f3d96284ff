"""Probes: transfers at stage boundaries as outputs of a Skin's gateware, for co-simulation."""

from amaranth.hdl import Module, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import Out

from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import zone_layout


def probe_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Ports of the probes; each ``transfer`` is high in clocks in which the others hold a payload.

    row_transfer, row_cells, row_last (out): rows at the labeller.
    record_transfer, record_data, record_end (out): zone records, or with ``report = "cells"`` bitmap rows.
    item_transfer, item_data, item_end (out): with ``report = "barycenter"``, the divided records.
    byte_transfer, byte_data (out): bytes.
    """
    divides = derived.skin.report == "barycenter"
    item = Out(8 * derived.item_bytes)
    return {
        "row_transfer": Out(1),
        "row_cells": Out(derived.skin.columns * derived.level_bits),
        "row_last": Out(1),
        "record_transfer": Out(1),
        "record_data": Out(zone_layout(derived).size) if divides else item,
        "record_end": Out(1),
        "byte_transfer": Out(1),
        "byte_data": Out(8),
        **({"item_transfer": Out(1), "item_data": item, "item_end": Out(1)} if divides else {}),
    }


def connect_probe(
    m: Module, probes: wiring.PureInterface, name: str, boundary: stream.Interface, **fields: Value
) -> None:
    """Connect the probe ``name`` to a boundary's transfers, and its other ports by field."""
    m.d.comb += getattr(probes, f"{name}_transfer").eq(boundary.valid & boundary.ready)
    for field, value in fields.items():
        m.d.comb += getattr(probes, f"{name}_{field}").eq(value)
