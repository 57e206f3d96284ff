"""The simulation: what the gateware is held against, what shows that both agree, and the studies behind the pages.

``VirtualBoard`` is loaded when it is used first: the golden model needs no gateware.
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
