"""The page that runs the starter kit's board in a browser, as one file: python docs/try/assemble.py build/try.html

It is made of the files beside this one and of two WebAssembly files that the package carries, so it takes no compiler.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
import sys
from pathlib import Path

from contactfpga.design import kits
from contactfpga.design.cover import BODIES, cells_of, load_cover
from contactfpga.design.cover.layers import COUPLING, Layer
from contactfpga_sim.model.board import webassembly

FOLDER = Path(__file__).resolve().parent
MODULES = (
    *("wasm", "board", "decoder", "zones", "machine", "cover"),
    *("dom", "text", "sheet", "fingers", "timeline", "replay", "panels", "main"),
)
"""Each after those that it imports."""

KIT = "starter"
BOARD, DECODER = webassembly.path_of(KIT), webassembly.path_of("decoder")
MOST_N = 10.0
"""The force of a pen pressed as hard as it can tell."""


def facts(name: str = KIT) -> dict:
    """What the scripts need to know of a kit whose cover is tiles: sheet, clock, and when each switch closes."""
    kit = kits.kit(name)
    skin, cover = kit.skin, load_cover(kit.skin_path)
    if cover is None or cover.cap is None or not (cover.cut and cover.cap.proud) or skin.pitch_x_mm != skin.pitch_y_mm:
        raise ValueError(f"the kit {name!r} has no square tiles; cover.js knows nothing else")
    pitch_m = skin.pitch_x_mm * 1e-3
    cells, body = cells_of(cover, skin.rows, skin.columns, pitch_m, pitch_m), BODIES["finger"]
    layers = cover.layers(body, pitch_m, pitch_m)
    return {
        "name": skin.name,
        "rows": skin.rows,
        "columns": skin.columns,
        "pitch_mm": skin.pitch_x_mm,
        "cap_mm": cover.cap.side_m * 1e3,
        "parts": cells.parts,
        "thresholds_n": cells.thresholds_n.ravel().tolist(),
        "hysteresis": cover.switch.hysteresis,
        "layers": [
            [layer.thickness_m, layer.modulus_pa, layer.coupled] for layer in layers if isinstance(layer, Layer)
        ],
        "springs": [[layer.stiffness_pa_m, layer.travel_m] for layer in layers if not isinstance(layer, Layer)],
        "coupling": COUPLING,
        "depth_m": body.depth_m,
        "most_n": MOST_N,
        "clock_hz": skin.clock_hz,
        "baud": skin.baud,
        "frame_clocks": skin.derived.frame_clocks,
        "bit_clocks": skin.derived.bit_clocks,
        "area_bits": skin.derived.area_bits,
        "record_bytes": skin.derived.item_bytes,
    }


def page() -> str:
    """The page's text."""
    kit = facts()
    style, script = read("page.css"), "".join(map(plain, MODULES))
    values = {
        "policy": f"default-src 'none'; script-src {digest(script)} 'wasm-unsafe-eval'; style-src {digest(style)}",
        "style": style,
        "script": script,
        "kit": json.dumps(kit, separators=(",", ":")),
        "board": packed(BOARD),
        "decoder": packed(DECODER),
        "cells": kit["rows"] * kit["columns"],
        "scans": f"{kit['clock_hz'] / kit['frame_clocks']:,.0f}",
        "last_row": kit["rows"] - 1,
        "last_column": kit["columns"] - 1,
        "pitch": kit["pitch_mm"],
        "clock": f"{kit['clock_hz'] / 1e6:g}",
        **kit,
        "baud": f"{kit['baud'] / 1e6:g}",
    }
    return re.sub("@([a-z_]+)@", lambda found: str(values[found[1]]), read("page.html"))


def plain(name: str) -> str:
    """A module as a part of one script."""
    return re.sub(r"^import [^;]*;\n|^export ", "", read(f"{name}.js"), flags=re.MULTILINE)


def read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


def digest(text: str) -> str:
    """The hash by which the page's policy allows an inline script or style."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def packed(file: Path) -> str:
    return base64.b64encode(gzip.compress(file.read_bytes(), 9, mtime=0)).decode()


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(page(), encoding="utf-8")
    print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")
