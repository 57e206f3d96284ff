"""The simulation: golden model, virtual board, verification, and studies.

``VirtualBoard`` is imported on first use, because the golden model needs no gateware.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contactfpga_sim.model.board.virtual import VirtualBoard

__all__ = ["VirtualBoard"]


def __getattr__(name: str) -> Any:
    if name != "VirtualBoard":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from contactfpga_sim.model.board.virtual import VirtualBoard

    return VirtualBoard
