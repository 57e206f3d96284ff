"""Messages to nodes of ROS 2."""

from contactfpga_sim.lab.registry import Section, Study

STUDY = Study(
    __package__,
    title="Messages to nodes of ROS 2",
    page="ros.md",
    minutes=10,
    sections={
        "costs": Section("scripts/measure_ros.py:costs_table"),
        "shown": Section("scripts/measure_ros.py:shown_table"),
    },
    extra="test",
)
