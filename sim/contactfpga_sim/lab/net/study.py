"""Links over a network."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Links over a network",
    page="net.md",
    minutes=2,
    sections={
        "batch": Section("tables:batch_table"),
        "links": Section("tables:links_table"),
        "thousand": Section("tables:thousand_table"),
    },
    pictures="tables:draw",
    extra="test",
)
