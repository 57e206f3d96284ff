"""Labellers: rows in, zone records out, behind one interface."""

from contactfpga_hdl.label.run import RunLabeller

__all__ = ["RunLabeller"]
