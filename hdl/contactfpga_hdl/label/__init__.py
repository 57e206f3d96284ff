"""Labellers: rows in, zone records out, behind one interface (contactfpga.choices.labellers)."""
