"""Labellers: rows in, zone records out, behind one interface."""

from contactfpga_hdl.label.projection import ProjectionLabeller
from contactfpga_hdl.label.run import RunLabeller
from contactfpga_hdl.label.single import SingleLabeller

__all__ = ["ProjectionLabeller", "RunLabeller", "SingleLabeller"]
