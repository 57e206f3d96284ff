"""The built-in scenes."""

from contactfpga_sim.lab.registry import Study

STUDY = Study(
    __package__,
    title="The built-in scenes",
    page="scenes.md",
    minutes=1,
    pictures="pictures:draw",
)
