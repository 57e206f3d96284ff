"""A robot arm that meets a person."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="A robot arm that meets a person",
    page="arm.md",
    minutes=3,
    sections={
        "set": Section("tables:set_table"),
        "sheet": Section("tables:sheet_table"),
        "speeds": Section("tables:speed_table"),
        "defense": Section("tables:defense_table"),
        "pushes": Section("tables:push_table", sample="tables:push_table"),
        "failures": Section("tables:failure_table"),
        "steps": Section("tables:step_table"),
    },
    compute="tables:compute",
    pictures="tables:draw",
)
