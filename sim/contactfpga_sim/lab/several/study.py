"""Cost of several sheets at one FPGA."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Cost of several sheets at one FPGA",
    page="several.md",
    minutes=3,
    sections={
        "several_line": Section("tables:line_table", sample="tables:line_sample"),
        "several_size": Section("tables:size_table", of_netlists=True),
    },
    extra="boards",
)
