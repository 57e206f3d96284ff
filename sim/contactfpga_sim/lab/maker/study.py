"""The maker's sheet: diodes, pull-ups, series resistors and the schematic."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="The maker's sheet: diodes, pull-ups, series resistors and the schematic",
    page="maker.md",
    minutes=1,
    sections={
        "diodes": Section("tables:diodes_table", sample="tables:diodes_table"),
        "pulls": Section("tables:pulls_table", sample="tables:pulls_table"),
        "series": Section("tables:series_table", sample="tables:series_table"),
    },
    pictures="tables:draw",
)
