"""Every electrical fault in the sheet."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Every electrical fault in the sheet",
    page="safety.md",
    minutes=5,
    sections={
        "coverage": Section("tables:coverage_table"),
        "faults": Section("tables:faults_table"),
        "times": Section("tables:times_table", sample="tables:times_table"),
    },
)
