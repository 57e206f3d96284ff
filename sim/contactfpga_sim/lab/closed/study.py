"""Cost of labelling over the seam of a closed sheet."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Cost of labelling over the seam of a closed sheet",
    page="labelling.md",
    minutes=5,
    sections={
        "closed": Section("tables:clocks_table", sample="tables:clocks_sample"),
        "closed_size": Section("tables:size_table", of_netlists=True),
    },
    extra="boards",
)
