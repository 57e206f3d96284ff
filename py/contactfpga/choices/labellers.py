"""Labellers: how pressed cells become zones."""

from __future__ import annotations

import dataclasses
from typing import Literal

from contactfpga.choices.choice import Bound, Choice
from contactfpga.choices.choice import find as find_choice


@dataclasses.dataclass(frozen=True, kw_only=True)
class Labeller(Choice):
    """A labeller of rows that gives zone records.

    ``gateware``: a component with the ports of :func:`contactfpga_hdl.payloads.labeller_ports`; ``golden``: a
    :class:`contactfpga_sim.model.golden.zones.LabellerRule`.
    """

    exact: bool
    """Whether zones are the connected components of cells. Inexact labellers ignore the connectivity."""
    end_clocks: Bound
    """The most clocks from a frame's last row to its end mark, which follows the last record."""
    row_clocks: Bound
    """The most clocks from a row until the labeller takes the next."""
    empty_row_clocks: Bound = lambda derived: 1
    """The most clocks from an empty row below an empty row until the labeller takes the next."""
    closed: bool = False
    """Whether zones are joined over the seam of a sheet whose ends meet."""
    extent: bool = False
    """Whether zones have their smallest and largest row and column."""


LabellerName = Literal["run", "serial", "projection", "single"]

LABELLERS: dict[str, Labeller] = {
    labeller.name: labeller
    for labeller in (
        Labeller(
            name="run",
            title="run",
            gateware="contactfpga_hdl.label.run:RunLabeller",
            golden="contactfpga_sim.model.golden.label:RUN",
            exact=True,
            end_clocks=lambda derived: derived.open_zones + derived.skin.closed + 4,
            row_clocks=lambda derived: derived.open_zones + derived.skin.closed + 2,
            closed=True,
            extent=True,
        ),
        Labeller(
            name="serial",
            title="serial",
            gateware="contactfpga_hdl.label.serial:SerialLabeller",
            golden="contactfpga_sim.model.golden.label:SERIAL",
            exact=True,
            end_clocks=lambda derived: derived.skin.columns + derived.open_zones + 2 + 2 * derived.skin.closed,
            row_clocks=lambda derived: derived.skin.columns + derived.open_zones + 2 + 2 * derived.skin.closed,
            closed=True,
            extent=True,
            empty_row_clocks=lambda derived: derived.skin.columns + 2,
        ),
        Labeller(
            name="projection",
            title="projection",
            gateware="contactfpga_hdl.label.projection:ProjectionLabeller",
            golden="contactfpga_sim.model.golden.label:PROJECTION",
            exact=False,
            end_clocks=lambda derived: derived.skin.columns + 3,
            row_clocks=lambda derived: derived.skin.columns + 1,
        ),
        Labeller(
            name="single",
            title="single",
            gateware="contactfpga_hdl.label.single:SingleLabeller",
            golden="contactfpga_sim.model.golden.label:SINGLE",
            exact=False,
            end_clocks=lambda derived: derived.skin.columns + 4,
            row_clocks=lambda derived: derived.skin.columns + 2,
        ),
    )
}
"""Built-in labellers by name; a new one needs an entry, gateware and a golden rule (docs/extend.md)."""


def find(value: object) -> Labeller:
    return find_choice(Labeller, LABELLERS, value)
