"""The panel beside the sheet: counters, chart, what the mouse presses with, a recording's timeline."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import picture_style
from contactfpga.tools.view import picture
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.playback import SPEEDS, Playback
from contactfpga.tools.view.sources import Moment, Source

if TYPE_CHECKING:
    import viser

MOUSE = (
    "Click a cell to put a finger down; click the finger to lift it. Drag across the sheet to press while you hold the "
    "button; drag a finger to move it. Beside the sheet the mouse turns the view."
)

_MARK = '<span style="color:{color}">{mark}</span>'

ZONES = ("orange", picture_style.VERMILLION, "◯", "a zone: its barycenter, and a circle of its area, not its shape")
WAY = ("green", picture_style.GREEN, "―", "where its contact was within the last second")
REPORTED = ("blue", picture_style.BLUE, "■", "pressed cells, as the board reports them")
GHOSTS = ("yellow", picture_style.ORANGE, "■", "cells that other pressed ones may have made")
TRUTH = (
    "sky",
    picture_style.SKY,
    "■",
    "what is pressed on the virtual board: its truth, as it sends zones only",
)
"""Of the legend: name and value of a color, its mark, what it means."""

FORCE = ("purple", picture_style.PURPLE, "➜", f"the force of a contact, {picture.MM_PER_N:g} mm per newton")
TITLE = 36
MOST_N = 30.0
"""Of the mouse's finger."""
CAPTURE_S = 20.0
WHOLE = (1, 2, 5, 10, 20, 50, 100, 200, 500)
"""Steps of an axis that counts."""


class Panel:
    """Writes what a source says besides its zones."""

    def __init__(self, server: viser.ViserServer, source: Source, hand: Hand | None):
        self._source = source
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        gui.set_panel_label("contactfpga")
        self._facts = gui.add_markdown("")
        self._timeline = TimelineControls(server, source) if isinstance(source, Playback) else None
        self._chart = self._add_chart(server)
        if hand is not None:
            self._add_mouse(server, hand)
        gui.add_markdown(legend(source, hand is not None))
        self._add_capture(server)

    def _add_chart(self, server: viser.ViserServer) -> Any:
        none = np.array([-1.0, 0.0])
        return server.gui.add_uplot(
            (none, none * 0, none * 0),
            (
                {"label": "s"},
                {"label": "zones", "stroke": picture_style.VERMILLION, "width": 2, "scale": "y"},
                {"label": "cm2", "stroke": picture_style.BLUE, "width": 2, "scale": "cm2"},
            ),
            scales=scales(none * 0, none * 0),
            axes=(
                {"label": "s"},
                {"scale": "y", "label": "zones", "stroke": picture_style.VERMILLION, "incrs": WHOLE},
                {"scale": "cm2", "label": "cm2", "side": 1, "stroke": picture_style.BLUE},
            ),
            aspect=1.8,
            padding=(12, 0, 0, 0),  # the highest number is not cut
        )

    def _add_mouse(self, server: viser.ViserServer, hand: Hand) -> None:
        sheet = self._source.sheet
        pitch_mm = max(sheet.pitch_x_mm, sheet.pitch_y_mm)
        with server.gui.add_folder("Mouse"):
            server.gui.add_markdown(MOUSE)
            low, high = round(0.75 * pitch_mm, 1), round(4 * pitch_mm, 1)
            radius = server.gui.add_slider("finger mm", low, high, 0.1, min(max(hand.radius_mm, low), high))
            force = None
            if self._source.cells is not None or hand.board.by_force:
                force = server.gui.add_slider("force N", 0.5, MOST_N, 0.1, hand.force_n)
            lift = server.gui.add_button("Lift all")
        radius.on_update(lambda _: hand.resize(radius_mm=radius.value))
        if force is not None:
            force.on_update(lambda _: hand.resize(force_n=force.value))
        lift.on_click(lambda _: hand.lift())

    def _add_capture(self, server: viser.ViserServer) -> None:
        button = server.gui.add_button("Screenshot")

        @button.on_click
        def _(event: Any) -> None:
            camera = event.client.camera
            size = (camera.image_height, camera.image_width)
            image = event.client.get_render(*size, transport_format="png", timeout=CAPTURE_S)
            event.client.send_file_download("contactfpga.png", png(image), save_immediately=True)

    def write(self, moment: Moment | None) -> None:
        """What is known now."""
        self._facts.content = as_markdown(facts(self._source, moment))
        strip = self._source.meter.strip
        if len(strip.seconds) > 1:
            self._chart.data = (strip.seconds, strip.zones, strip.area_mm2 / 100)
            if (wanted := scales(strip.zones, strip.area_mm2 / 100)) != self._chart.scales:
                self._chart.scales = wanted
        if self._timeline is not None:
            self._timeline.write()


def scales(zones: np.ndarray, area_cm2: np.ndarray) -> dict[str, Any]:
    """Of the chart's axes: from 0 to a round number, so that they change seldom."""
    return {"x": {"time": False}, "y": {"range": (0, _top(zones, 2))}, "cm2": {"range": (0, _top(area_cm2, 10))}}


def _top(values: np.ndarray, least: int) -> int:
    """1, 2 or 5 times a power of ten."""
    wanted = max(least, math.ceil(values.max()))
    power = int(10 ** (len(str(wanted)) - 1))
    return next(times * power for times in (1, 2, 5, 10) if times * power >= wanted)


class TimelineControls:
    """Where a recording is, and how fast it goes on."""

    def __init__(self, server: viser.ViserServer, player: Playback[Any]):
        self._player = player
        gui = server.gui
        end_s = max(player.duration_s, 1e-3)
        step_s = 10.0 ** np.floor(np.log10(end_s / 1000))
        self._place = gui.add_slider("s", 0.0, float(np.ceil(end_s / step_s) * step_s), float(step_s), 0.0)
        self._button = gui.add_button("Pause")
        speed = gui.add_dropdown("speed", tuple(SPEEDS), initial_value="1")
        # What the server itself sets has no client.
        self._place.on_update(lambda event: player.seek(self._place.value) if event.client is not None else None)
        self._button.on_click(lambda _: player.pause() if player.playing else player.play())

        @speed.on_update
        def _(_: Any) -> None:
            player.speed = SPEEDS[speed.value]

    def write(self) -> None:
        """Where it is now."""
        if self._player.playing:
            self._place.value = self._player.position_s
        self._button.label = "Pause" if self._player.playing else "Play"


def facts(source: Source, moment: Moment | None) -> list[tuple[str, str]]:
    """Names and values, as the panel shows them."""
    meter = source.meter
    rows = [("source", shortened(source.title)), ("frames", f"{meter.frames_per_s:,.0f} per second")]
    if moment is not None:
        zones = moment.zones
        rows.append(("zones", f"{zones.total_zones}, {zones.pressed} cells pressed"))
        if moment.felt is not None and moment.felt[0]:
            rows.append(
                (
                    "forces",
                    ", ".join("?" if one.normal_n is None else f"{one.normal_n:.2f} N" for one in moment.felt[0]),
                )
            )
        flags = sorted(zones.flags | set(zones.faults))
        rows += [("flags", ", ".join(flags))] if flags else []
    return rows + source.told()


def as_markdown(rows: Iterable[tuple[str, str]]) -> str:
    """Names and values, a line each. Both are shown as they are written: names of links, files and Skins come from
    strangers, and the page would otherwise run the HTML in them and load the pictures that they name."""
    return "\n".join(f"**{_plain(name)}** {_plain(value)}  " for name, value in rows)


def _plain(text: str) -> str:
    # Markdown takes any ASCII punctuation behind a backslash for itself.
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", " ".join(text.split()))


def shortened(title: str) -> str:
    """At most a line; the end of a long name says most."""
    return title if len(title) <= TITLE else f"… {title[-TITLE:]}"


def legend(source: Source, virtual: bool) -> str:
    """What each color means, in HTML and Markdown."""
    rows = [ZONES, WAY]
    cells = source.sheet.report == "cells"
    rows += [REPORTED] if cells else []
    rows += [GHOSTS] if cells and source.sheet.ghosts else []
    rows += [FORCE] if source.cells is not None else []
    rows += [TRUTH] if virtual and not cells else []
    return "\n".join(f"{_MARK.format(color=color, mark=mark)} {what}  " for _, color, mark, what in rows)


def png(image: np.ndarray) -> bytes:
    """The bytes of a file."""
    import imageio.v3

    written: bytes = imageio.v3.imwrite("<bytes>", image, extension=".png")
    return written
