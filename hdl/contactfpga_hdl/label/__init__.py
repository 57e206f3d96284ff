"""Labellers: rows in, zone records out, behind one interface."""

from contactfpga_hdl.label.run import RunLabeller
from contactfpga_hdl.label.serial import SerialLabeller

LABELLERS = {"run": RunLabeller, "serial": SerialLabeller}
"""By the name that `labeller` has in a Skin."""

__all__ = ["LABELLERS", "RunLabeller", "SerialLabeller"]
