"""Size of recordings, and loss by a killed program."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Size of recordings, and loss by a killed program",
    page="recordings.md",
    minutes=2,
    sections={
        "sizes": Section("tables:sizes_table"),
        "reading": Section("tables:reading_table"),
        "loss": Section("tables:loss_table"),
    },
    extra="test",
)
