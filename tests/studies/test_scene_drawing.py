"""The picture of the scenes page."""

import xml.etree.ElementTree as ElementTree

from contactfpga_sim.lab.scenes import pictures

SVG = "{http://www.w3.org/2000/svg}"


def test_a_panel_shows_every_closed_switch_part_and_contact():
    for panel in pictures.panels():
        root = ElementTree.fromstring(pictures.svg([panel]))
        cells = panel.scene.pressed(0.0, panel.skin, panel.cover)
        squares, *crosses = root.findall(f".//{SVG}path")
        assert squares.get("d").count("M") == cells.sum() > 0
        assert len(crosses) == panel.scene.on_cover(panel.skin, panel.cover).truth(0.0, panel.skin).count
        parts = sum(len(load.parts) for load in panel.scene.loads(0.0))
        outlines = [one for one in root.iter() if one.get("stroke-width") == "1.2"]
        assert len(outlines) == parts
