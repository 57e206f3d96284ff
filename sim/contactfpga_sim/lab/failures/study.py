"""One knob after another until something breaks."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="One knob after another until something breaks",
    page="failures.md",
    minutes=10,
    sections={
        "failures": Section("tables:table"),
        "unnoticed": Section("tables:unnoticed"),
        "pictures": Section("tables:pictures", sample="tables:pictures"),
    },
    compute="tables:compute",
    pictures="tables:draw_for_page",
)
