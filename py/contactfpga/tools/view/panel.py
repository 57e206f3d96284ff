"""The panel beside the sheet."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import picture_style
from contactfpga.tools.view import chart, contacts, controls, picture
from contactfpga.tools.view.cameras import Cameras
from contactfpga.tools.view.fingers import Hand
from contactfpga.tools.view.playback import SPEEDS, Playback
from contactfpga.tools.view.sources import Moment, Source, paced

if TYPE_CHECKING:
    import viser

MOUSE = (
    "Click a cell to put a finger down, click the finger to lift it. Drag across the sheet to press while you hold the "
    "button. Beside the sheet the mouse turns the view, the wheel zooms."
)

_MARK = '<span style="color:{color}">{mark}</span>'

ZONES = ("orange", picture_style.VERMILLION, "◯", "a contact: its barycenter, and a circle of its area, not its shape")
WAY = ("green", picture_style.GREEN, "―", "where its contact was within the last second")
REPORTED = ("blue", picture_style.BLUE, "■", "pressed cells, as the board reports them")
POLYGONS = (*ZONES[:2], "⬠", "a contact: its barycenter, and a polygon that holds it")
LEVELS = (*REPORTED[:3], "pressed cells, as the board reports them; the harder, the bluer")
GHOSTS = ("yellow", picture_style.ORANGE, "■", "cells that other pressed ones may have made")
TRUTH = (
    "sky",
    picture_style.SKY,
    "■",
    "cells that are really pressed; the virtual board reports only zones",
)
"""Legend: name and value of a color, its mark and meaning."""

FORCE = ("purple", picture_style.PURPLE, "➜", f"the force of a contact, {picture.MM_PER_N:g} mm per newton")
TITLE = 36
STEPS: dict[str, tuple[int, int]] = {"left": (-1, 0), "right": (1, 0), "up": (0, -1), "down": (0, 1)}
"""Columns and rows by which a key moves a finger."""
MOST_N = 30.0


class Panel:
    def __init__(self, server: viser.ViserServer, source: Source, hand: Hand | None, cameras: Cameras):
        self._source = source
        self._moment: Moment | None = None
        gui = server.gui
        self._table = gui.add_html(contacts.table(()))
        self._timeline = TimelineControls(server, source) if isinstance(source, Playback) else None
        self._chart = gui.add_html("")
        controls.add(server, cameras, self._caption)
        if hand is not None:
            self._add_mouse(server, hand)
        with gui.add_folder("Board"):
            self._facts = gui.add_markdown("")
        with gui.add_folder("Colors"):
            gui.add_markdown(legend(source, hand is not None))

    def _add_mouse(self, server: viser.ViserServer, hand: Hand) -> None:
        sheet = self._source.sheet
        pitch_mm = max(sheet.pitch_x_mm, sheet.pitch_y_mm)
        with server.gui.add_folder("Fingers"):
            server.gui.add_markdown(MOUSE)
            low, high = round(0.5 * pitch_mm, 1), round(3 * pitch_mm, 1)
            radius = server.gui.add_slider("radius, mm", low, high, 0.1, round(min(max(hand.radius_mm, low), high), 1))
            force = None
            if self._source.cells is not None or hand.board.by_force:
                force = server.gui.add_slider("force, N", 0.5, MOST_N, 0.1, hand.force_n)
            lift = server.gui.add_button("Lift all (L)")
        radius.on_update(lambda _: hand.resize(radius_mm=radius.value))
        if force is not None:
            force.on_update(lambda _: hand.resize(force_n=force.value))
        lift.on_click(lambda _: hand.lift())
        server.gui.add_command("Lift all fingers", hotkey="L").on_trigger(lambda _: hand.lift())
        middle_mm = (sheet.columns // 2 * sheet.pitch_x_mm, sheet.rows // 2 * sheet.pitch_y_mm)
        finger = server.gui.add_command("Finger in the middle", hotkey="F")
        finger.on_trigger(lambda _: hand.click(*middle_mm))
        for key, (columns, rows) in STEPS.items():
            step_mm = (columns * sheet.pitch_x_mm, rows * sheet.pitch_y_mm)
            step = server.gui.add_command(f"Move the last finger: {key}", hotkey=f"arrow{key}", modifier="shift")
            step.on_trigger(lambda _, step_mm=step_mm: hand.step(*step_mm))

    def _caption(self) -> tuple[str, list[contacts.Row]]:
        title = f"contactfpga: {shortened(self._source.title)}"
        if self._moment is None:
            return title, []
        return f"{title}, {self._moment.zones.time_us / 1e6:.6f} s since power-up", contacts.rows(self._moment)

    def write(self, moment: Moment | None) -> None:
        self._moment = moment
        self._table.content = contacts.table(() if moment is None else contacts.rows(moment))
        self._facts.content = as_markdown(facts(self._source, moment))
        self._chart.content = f'<div class="chart">{chart.chart(self._source.meter.strip)}</div>'
        if self._timeline is not None:
            self._timeline.write()


class TimelineControls:
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
        if self._player.playing:
            self._place.value = self._player.position_s
        self._button.label = "Pause" if self._player.playing else "Play"


def facts(source: Source, moment: Moment | None) -> list[tuple[str, str]]:
    rows = [("source", shortened(source.title)), ("sends", paced(source.meter.frames_per_s))]
    if moment is not None:
        rows.append(("pressed", f"{moment.zones.pressed} cells"))
        flags = sorted(moment.zones.flags | set(moment.zones.faults))
        rows += [("flags", ", ".join(flags))] if flags else []
    return rows + source.facts()


def as_markdown(rows: Iterable[tuple[str, str]]) -> str:
    """Names and values, a line each, verbatim: they may come from strangers, and the page would otherwise run their
    HTML and load their pictures.
    """
    return "\n".join(f"**{_plain(name)}** {_plain(value)}  " for name, value in rows)


def _plain(text: str) -> str:
    # Markdown takes any ASCII punctuation behind a backslash for itself.
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", " ".join(text.split()))


def shortened(title: str) -> str:
    """At most a line, keeping the end of a long name."""
    return title if len(title) <= TITLE else f"… {title[-TITLE:]}"


def legend(source: Source, virtual: bool) -> str:
    cells = source.sheet.report == "cells"
    rows = [POLYGONS if cells or source.sheet.extent else ZONES, WAY]
    rows += [REPORTED if source.sheet.levels == 1 else LEVELS] if cells else []
    rows += [GHOSTS] if cells and source.sheet.ghosts else []
    rows += [FORCE] if source.cells is not None else []
    rows += [TRUTH] if virtual and not cells else []
    return "\n".join(f"{_MARK.format(color=color, mark=mark)} {what}  " for _, color, mark, what in rows)
