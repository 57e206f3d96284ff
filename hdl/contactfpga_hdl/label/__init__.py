"""Labellers: rows in, zone records out, behind one interface."""

from contactfpga_hdl.label.projection import ProjectionLabeller
from contactfpga_hdl.label.run import RunLabeller
from contactfpga_hdl.label.serial import SerialLabeller
from contactfpga_hdl.label.single import SingleLabeller

LABELLERS = {
    "run": RunLabeller,
    "serial": SerialLabeller,
    "projection": ProjectionLabeller,
    "single": SingleLabeller,
}
"""By the name that `labeller` has in a Skin."""

__all__ = ["LABELLERS", "ProjectionLabeller", "RunLabeller", "SerialLabeller", "SingleLabeller"]
