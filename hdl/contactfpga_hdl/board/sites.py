"""FPGA pins of wires, from amaranth-boards."""

from __future__ import annotations

from amaranth.build import Subsignal

from contactfpga.boards.spec import BoardSpec
from contactfpga.boards.wiring import Wire
from contactfpga_hdl.board.board_top import platform_for


def connector_sites(board: BoardSpec) -> dict[str, str]:
    platform = platform_for(board)
    return {name: pin for connector in platform.connectors.values() for name, pin in connector}


def wire_sites(board: BoardSpec, wires: list[Wire]) -> list[str]:
    connected, own = connector_sites(board), own_sites(board)
    return [connected[wire.pin] if wire.pin else own[wire.port] for wire in wires]


def own_sites(board: BoardSpec) -> dict[str, str]:
    """FPGA pins that the board itself connects, by port."""
    platform = platform_for(board)
    (clock,) = platform.resources[platform.default_clk, 0].ios
    found = {"clock": clock.names[0]}
    for one in platform.resources["uart", 0].ios:
        if isinstance(one, Subsignal) and one.name in ("rx", "tx"):
            found[f"uart {one.name}"] = one.ios[0].names[0]
    names = ["held_high"] if len(board.held_high) == 1 else [f"held_high[{bit}]" for bit in range(len(board.held_high))]
    return found | dict(zip(names, board.held_high, strict=True))
