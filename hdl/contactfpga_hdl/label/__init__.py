"""Labellers with common ports: rows in, zone records out (contactfpga.choices.labellers)."""
