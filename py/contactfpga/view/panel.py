"""The panel beside the sheet: counters, chart, what the mouse presses with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import picture_style
from contactfpga.view.fingers import Hand
from contactfpga.view.sources import Moment, Source

if TYPE_CHECKING:
    import viser

MOUSE = (
    "Click a cell to put a finger down, click the finger to lift it. Drag across the sheet to press while you hold the "
    "mouse; drag a finger to move it. Beside the sheet the mouse turns the view."
)


class Panel:
    """Writes what a source says besides its zones."""

    def __init__(self, server: viser.ViserServer, source: Source, hand: Hand | None):
        self._source = source
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        gui.set_panel_label("contactfpga")
        self._facts = gui.add_markdown("")
        self._legend = gui.add_markdown("")
        self._chart = self._add_chart(server)
        if hand is not None:
            self._add_mouse(server, hand)

    def _add_chart(self, server: viser.ViserServer) -> Any:
        none = np.array([-1.0, 0.0])
        return server.gui.add_uplot(
            (none, none * 0, none * 0),
            (
                {"label": "s"},
                {"label": "zones", "stroke": picture_style.VERMILLION, "width": 2, "scale": "y"},
                {"label": "cm2", "stroke": picture_style.BLUE, "width": 2, "scale": "cm2"},
            ),
            scales={"x": {"time": False}, "y": {}, "cm2": {}},
            axes=(
                {"label": "s"},
                {"scale": "y", "label": "zones", "stroke": picture_style.VERMILLION},
                {"scale": "cm2", "label": "cm2", "side": 1, "stroke": picture_style.BLUE},
            ),
            aspect=1.6,
        )

    def _add_mouse(self, server: viser.ViserServer, hand: Hand) -> None:
        sheet = self._source.sheet
        pitch_mm = max(sheet.pitch_x_mm, sheet.pitch_y_mm)
        with server.gui.add_folder("Mouse"):
            server.gui.add_markdown(MOUSE)
            low, high = round(0.75 * pitch_mm, 1), round(4 * pitch_mm, 1)
            radius = server.gui.add_slider("finger mm", low, high, 0.1, min(max(hand.radius_mm, low), high))
            lift = server.gui.add_button("Lift all")

        @radius.on_update
        def _(_: Any) -> None:
            hand.resize(radius_mm=radius.value)

        @lift.on_click
        def _(_: Any) -> None:
            hand.lift()

    def write(self, moment: Moment | None) -> None:
        """What is known now."""
        source, stats = self._source, self._source.meter.stats
        rows = [("source", source.title), ("frames", f"{source.meter.frames_per_s:,.0f} per second")]
        if moment is not None:
            zones = moment.zones
            rows.append(("zones", f"{zones.total_zones}, {zones.pressed} cells pressed"))
            rows.append(("flags", ", ".join(sorted(zones.flags)) or "none"))
        rows.append(("lost", f"{stats.lost} frames, {sum(stats.damaged.values())} packets damaged"))
        rows += source.told()
        self._facts.content = "\n".join(f"**{name}** {value}  " for name, value in rows)
        strip = source.meter.strip
        if len(strip.seconds) > 1:
            self._chart.data = (strip.seconds, strip.zones, strip.area_mm2 / 100)
