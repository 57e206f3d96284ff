"""Places and forces by pressure units."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Places and forces by pressure units",
    page="haptics.md",
    minutes=5,
    sections={
        "layouts": Section("tables:layouts_table", sample="tables:layouts_table"),
        "places": Section("tables:places_table"),
        "wrong": Section("tables:wrong_table"),
        "felt": Section("felt_tables:felt_table"),
        "pairs": Section("felt_tables:pairs_table"),
        "limits": Section("felt_tables:limits_table"),
        "breaks": Section("felt_tables:breaks_table"),
        "breakpictures": Section("felt_tables:breaks_pictures", sample="felt_tables:breaks_pictures"),
    },
    pictures="tables:draw",
    extra="test",
)
