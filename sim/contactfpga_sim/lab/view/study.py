"""Delay and load of the view in a browser."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Delay and load of the view in a browser",
    page="view.md",
    minutes=2,
    sections={
        "view_load": Section("tables:loads_table"),
        "view_clicks": Section("tables:clicks_table"),
    },
    compute="tables:compute",
    pictures="tables:draw",
    extra="test",
    needs=("chromium",),
)
