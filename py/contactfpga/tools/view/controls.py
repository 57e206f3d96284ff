"""Controls of each view: sides to look from, and a picture to save."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from contactfpga.tools.view import page
from contactfpga.tools.view.cameras import Cameras
from contactfpga.tools.view.contacts import Row

if TYPE_CHECKING:
    import viser

KEYS: tuple[Any, ...] = ("1", "2", "3", "4")

Caption = Callable[[], tuple[str, Sequence[Row]]]


def add(server: viser.ViserServer, cameras: Cameras, caption: Caption) -> None:
    gui = server.gui
    named = {f"{side} ({key})": side for key, side in zip(KEYS, cameras.sides)}
    buttons = gui.add_button_group("view", tuple(named))
    buttons.on_click(lambda event: cameras.show(event.client, named[event.target.value]))
    for key, side in zip(KEYS, cameras.sides):
        turn = gui.add_command(f"View: {side}", hotkey=key)
        turn.on_trigger(lambda event, side=side: cameras.show(event.client, side))

    def keep(event: Any) -> None:
        what, rows = caption()
        page.picture(event.client, [what, *("   ".join(row.lines) for row in rows)])

    gui.add_button("Screenshot (P)").on_click(keep)
    gui.add_command("Screenshot", hotkey="P").on_trigger(keep)
