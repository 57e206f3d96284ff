"""Faults that a self-test is meant for: the compiled board is powered up with one, and the pin `contact` is watched."""

from __future__ import annotations

import functools

import numpy as np

from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.lab.safety import compute
from contactfpga_sim.lab.safety.catalogue import FAULTS
from contactfpga_sim.lab.safety.hurt import Hurt
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.sheet.shorts import Shorts

TESTED = Skin.load(examples() / "fast.toml").replace(guard=True, self_test=True, fail_safe=True, alive=True)

HOST = "self_test"
"""What :attr:`~contactfpga_sim.lab.safety.catalogue.Fault.host` says of these faults."""


def clocks(skin: Skin) -> int:
    """That the self-test takes at power-up, and the pin after it; no row is driven by the scan until then."""
    derived = skin.derived
    slot = 2 * derived.project_clocks + derived.settle_clocks + 8
    return (1 + skin.rows + skin.columns) * slot + 2


def told_us(hurt: Hurt, skin: Skin = TESTED) -> float | None:
    """When the pin says so, in us from power-up, with the switches pressed whose diodes are shorted; None: it does
    not."""
    cells = np.zeros((1, skin.rows, skin.columns), bool)
    for cell in hurt.bare:
        cells[0][cell] = True
    with CompiledBoard(skin, ("contact",)) as board:
        board.join(Shorts(rows=hurt.joined_rows, columns=hurt.joined_columns, bridged=hurt.bare))
        board.hold(cells, clocks(skin))
        rises = board.take("contact")
    return float(rises["cycle"][0]) / skin.derived.clocks_per_us if len(rises) else None


@functools.cache
def found(fault: str) -> dict[str, float | None]:
    """By place when the self-test tells this fault; of a fault that it is not meant for nothing."""
    if FAULTS[fault].host != HOST:
        return {}
    return {name: told_us(hurt) for name, hurt in compute.places(TESTED, fault)}
