"""Times that a sheet's circuit needs."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Times that a sheet's circuit needs",
    page="settle.md",
    minutes=2,
    sections={
        "needs": Section("tables:needs_table"),
        "breaks": Section("tables:breaks_table"),
        "shorted": Section("tables:shorted_table", sample="tables:shorted_table"),
        "summary": Section("tables:summary_table", needs=("ngspice",)),
        "agreement": Section("tables:agreement_table", needs=("ngspice",)),
    },
    pictures="pictures:draw",
)
