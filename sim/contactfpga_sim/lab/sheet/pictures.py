"""Picture of docs/sheet.md."""

from __future__ import annotations

from pathlib import Path

from contactfpga.design.circuit import load_checked
from contactfpga.design.sheet import picture
from contactfpga.design.sheet.layout import lay_out
from contactfpga.inputs.files import write_text
from contactfpga.shipped import examples
from contactfpga.skin import Skin


def draw(folder: Path) -> Path:
    """Draw ``examples/tiles.toml``, as its command does."""
    file, path = examples() / "tiles.toml", folder / "sheet.svg"
    skin = Skin.load(file)
    write_text(path, picture.svg(lay_out(skin, load_checked(file, skin)).drawing, f"contactfpga sheet {file.name}"))
    return path
