"""A robot of several sheets."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="A robot of several sheets",
    page="body.md",
    minutes=4,
    sections={
        "outages": Section("tables:outages_table"),
        "registration": Section("tables:registration_table"),
        "folds": Section("tables:folds_table", sample="tables:folds_sample"),
    },
    pictures="tables:draw",
    extra="test",
)
