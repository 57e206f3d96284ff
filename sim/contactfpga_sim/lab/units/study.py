"""Sweep times of pressure units."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Sweep times of pressure units",
    page="units.md",
    minutes=1,
    sections={
        "units": Section("tables:units_table", sample="tables:units_table"),
    },
)
