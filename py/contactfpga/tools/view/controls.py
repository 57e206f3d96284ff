"""Sides to look from and a picture to keep: buttons and keys that each view has."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import picture_style
from contactfpga.tools.view.cameras import Cameras
from contactfpga.tools.view.contacts import Row

if TYPE_CHECKING:
    import viser

CAPTURE_S = 20.0
CAPTURE_PX = 1600
"""Width of a picture."""
MARGIN_PX, LETTERS_PX = 28, 26

Caption = Callable[[], tuple[str, Sequence[Row]]]
"""What is shown and when, and the contacts then."""


def add(server: viser.ViserServer, cameras: Cameras, caption: Caption) -> None:
    """To the panel."""
    gui = server.gui
    names = tuple(cameras.sides)
    sides = gui.add_button_group("view", tuple(f"{name} ({key})" for key, name in enumerate(names, 1)))
    keyed = dict(zip(sides.options, names))
    sides.on_click(lambda event: cameras.show(event.client, keyed[event.target.value]))
    for key, name in enumerate(names, 1):
        command = gui.add_command(f"View: {name}", hotkey=str(key))  # type: ignore[arg-type]
        command.on_trigger(lambda event, name=name: cameras.show(event.client, name))
    picture = gui.add_button("Screenshot (P)")
    picture.on_click(lambda event: _send(event.client, caption))
    gui.add_command("Screenshot", hotkey="P").on_trigger(lambda event: _send(event.client, caption))


def _send(client: Any, caption: Caption) -> None:
    height = round(CAPTURE_PX / client.camera.aspect)
    what, rows = caption()
    image = client.get_render(height, CAPTURE_PX, transport_format="png", timeout=CAPTURE_S)
    client.send_file_download("contactfpga.png", stamped(image, what, rows), save_immediately=True)


def stamped(image: np.ndarray, what: str, rows: Sequence[Row]) -> bytes:
    """A PNG of an (h, w, 4) image with a line of what it shows below it, and a line for each contact."""
    from PIL import Image, ImageDraw, ImageFont

    lines = [what, *(row.caption.replace("\n", "   ") for row in rows)]
    step = round(1.5 * LETTERS_PX)
    height, width = image.shape[:2]
    sheet = Image.new("RGB", (width, height + 2 * MARGIN_PX + step * len(lines)), picture_style.CARD)
    drawn = Image.fromarray(image)
    sheet.paste(drawn, (0, 0), drawn if image.shape[2] == 4 else None)
    pen, letters = ImageDraw.Draw(sheet), ImageFont.load_default(LETTERS_PX)
    for number, line in enumerate(lines):
        color = picture_style.INK if number == 0 else picture_style.SOFT
        pen.text((MARGIN_PX, height + MARGIN_PX + step * number), line, fill=color, font=letters)
    file = io.BytesIO()
    sheet.save(file, "PNG")
    return file.getvalue()
