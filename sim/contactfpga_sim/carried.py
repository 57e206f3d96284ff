"""The package's WebAssembly files: boards, and the C header for a page in a browser.

``python -m contactfpga_sim.carried`` builds the outdated files. It needs a clone and, unless only the gateware's text
changed, the extra ``release``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from contactfpga import terminal
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga.tools.view import opening
from contactfpga_sim import demo
from contactfpga_sim.model.board import compiled, webassembly

DECODER = "decoder"
_DECODER_C = Path(__file__).parents[2] / "c" / "page.c"


def skins() -> dict[str, Skin]:
    kits = {file.parent.name: Skin.load(file) for file in sorted((examples() / "kits").glob("*/skin.toml"))}
    shown = {"reference": Skin(), "view": opening.own_skin(), "view-flat": opening.own_skin(flat=True)}
    return shown | {"force": demo.with_force(), "forearm": demo.forearm()} | kits


def keys() -> dict[str, str]:
    """Required key of each file, by name."""
    boards = {name: compiled.carried_key(skin) for name, skin in skins().items()}
    return boards | {DECODER: webassembly.c_key(_DECODER_C)}


def stale() -> list[str]:
    """Names of missing, damaged and outdated files."""
    return [name for name, key in keys().items() if webassembly.file(key) is None]


def check() -> None:
    """End the program if a file is stale."""
    if names := stale():
        sys.exit(f"{', '.join(names)}: not built from these sources; run python -m contactfpga_sim.carried")


def build(name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        if name == DECODER:
            return webassembly.build_c(_DECODER_C, Path(folder))
        return webassembly.build_board(compiled.model_of(skins()[name]), Path(folder))


def main() -> int:
    files, late = dict(webassembly.listed()["files"]), stale()
    for name, key in keys().items():
        if name in late:
            files[name] = {"key": key, "design": _renewed(name, files.get(name, {}))}
    webassembly.write_list({name: files[name] for name in keys()})
    terminal.say(f"{webassembly.FOLDER} is built from these sources.")
    return 0


def _renewed(name: str, before: dict[str, str]) -> str:
    """Key of a file's design; a file of another design is rebuilt."""
    design = webassembly.c_key(_DECODER_C) if name == DECODER else compiled.design_key(skins()[name])
    path = webassembly.path_of(name)
    whole = path.is_file() and webassembly.sum_of(path.read_bytes()) == before.get("sha256")
    if not whole or design != before.get("design"):
        path.write_bytes(data := build(name))
        terminal.say(f"{name}: built, {len(data) / 1e3:.1f} kB")
    return design


if __name__ == "__main__":
    sys.exit(main())
