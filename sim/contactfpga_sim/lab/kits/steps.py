"""Pictures of the starter kit's assembly, one a step: cuts through two switches and a corner, to scale."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from contactfpga import picture_style
from contactfpga.design import kits
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.sheet import caps as printed
from contactfpga.design.sheet.caps import Caps
from contactfpga.design.sheet.drawing import BOARDS
from contactfpga.inputs.files import write_text

KIT = kits.kit("starter")
PX = 14.0
"""Pixels of a millimeter."""
SPACER_MM, SOFT_SPACER_MM, HEADER_MM, PLUG_MM = 5.0, 20.0, 9.0, 15.0
"""Length of a spacer, and of the soft kit's, and height of a header without and with its plug."""
CELLS = 2
LEFT_MM, WORDS_MM, WIDE_MM = 4.0, 28.0, 52.0
"""Left end of the cut and begin of the words, from the first switch's middle, and width of a picture."""
LAST = 6
SOFT = "#fbecc8"


class Piece(NamedTuple):
    """Rectangles (left, low, right, high) in mm; the board's top is 0 high, the first switch is in the middle of x."""

    step: int
    words: str
    color: str
    boxes: list[tuple[float, float, float, float]]


def pieces(caps: Caps, cover: Cover) -> list[Piece]:
    """What each step adds, from the back to the front."""
    assert cover.bed is not None
    pitch, half, switch = KIT.skin.pitch_x_mm, caps.side_mm / 2, caps.switch
    middles = [number * pitch for number in range(CELLS)]
    board, thick = BOARDS["plane"][0], 1e3 * cover.thickness_m
    top = switch.height_mm
    stem, hole = printed.STEM_MM / 2, printed.STEM_MM / 2 + printed.PLAY_MM
    tube, low = hole + printed.WALL_MM, top + caps.foot_mm
    plate = top + caps.under_mm
    foam = plate + printed.PLATE_MM
    edge, post, web = middles[-1] + pitch / 2, printed.WALL_MM / 2, printed.WEB_MM[1]
    pad, bed = cover.bed.pad_mm, 1e3 * cover.bed.thickness_m
    corner, foot = edge + printed.RIM_MM + 4.0, -board - SPACER_MM
    end = foot - printed.FOOT_MM - bed
    ends = [(middle - half, middle + half) for middle in middles]
    tubes = [(x + side * hole, x + side * tube) for x in middles for side in (-1, 1)]
    return [
        Piece(1, f"circuit board, {board:g} mm", "#d0ece3", [(-LEFT_MM, -board, corner + 4, 0)]),
        Piece(1, "a diode for each switch", picture_style.INK, [(x - 1, -board - 1, x + 1, -board) for x in middles]),
        Piece(1, "a header", "#8c8c8c", [(1.7, -board - HEADER_MM, 4.7, -board)]),
        Piece(
            2,
            f"metal domes of {switch.part.width:g} mm, {switch.force_n:g} N",
            "#8c8c8c",
            [(x - switch.part.width / 2, 0, x + switch.part.width / 2, top) for x in middles],
        ),
        Piece(
            3,
            f"frame, {printed.RIM_MM:g} mm beyond the switches",
            picture_style.SKY,
            [
                *((left, low, right, low + printed.GUIDE_MM) for left, right in map(sorted, tubes)),
                *((x + tube, low, x + pitch - tube, low + printed.RIB_MM) for x in middles[:-1]),
                *((x + pitch / 2 - post, 0, x + pitch / 2 + post, low) for x in middles[:-1]),
                (middles[-1] + tube, low, edge + printed.RIM_MM, low + printed.RIB_MM),
                (edge, 0, edge + printed.RIM_MM, low),
            ],
        ),
        Piece(
            4,
            f"caps of {caps.side_mm:g} mm, {caps.gap_mm:g} mm apart",
            picture_style.BLUE,
            [
                *((left, plate, right, foam) for left, right in ends),
                *((x - stem, low, x + stem, plate) for x in middles),
                *((x - switch.closed_by / 2, top, x + switch.closed_by / 2, low) for x in middles),
            ],
        ),
        Piece(
            4,
            "webs between them",
            picture_style.VERMILLION,
            [(right, foam - web, right + caps.gap_mm, foam) for _, right in ends[:-1]],
        ),
        Piece(
            5,
            f"foam of {thick:g} mm, cut with the webs",
            SOFT,
            [(left, foam, right, foam + thick) for left, right in ends],
        ),
        Piece(LAST, "plug of a flat cable", picture_style.SOFT, [(1.5, -board - PLUG_MM, 4.9, -board - HEADER_MM + 3)]),
        Piece(
            LAST, f"spacer, {SPACER_MM:g} mm, at each corner", "#8c8c8c", [(corner - 2.5, foot, corner + 2.5, -board)]
        ),
        Piece(
            LAST,
            f"foot, {printed.FOOT_MM:g} mm",
            picture_style.SKY,
            [(corner - pad / 2, foot - printed.FOOT_MM, corner + pad / 2, foot)],
        ),
        Piece(
            LAST,
            f"pad of foam, {bed:g} x {pad:g} x {pad:g} mm",
            SOFT,
            [(corner - pad / 2, end, corner + pad / 2, foot - printed.FOOT_MM)],
        ),
        Piece(LAST, "link of the robot", picture_style.SHEET, [(-LEFT_MM, end - 2, corner + pad / 2, end)]),
    ]


def layer() -> Caps:
    """The kit's caps."""
    return printed.caps(KIT.skin, KIT.layout.switch, 1e3 * _cover().cap.side_m)  # type: ignore[union-attr]


def _cover() -> Cover:
    cover = load_cover(KIT.skin_path)
    assert cover is not None
    return cover


def draw(folder: Path) -> list[Path]:
    every = pieces(layer(), _cover())
    found = []
    for step in range(1, LAST + 1):
        shown = [one for one in every if one.step <= step and not (step > 4 and one.words.startswith("webs"))]
        path = folder / f"step-{step}.svg"
        named = [one for one in shown if one.step == step or step == LAST]
        _write(path, f"Step {step} of {LAST}", shown, named)
        found.append(path)
    every = soft_pieces()
    _write(folder / "soft.svg", "The soft kit", every, every)
    return [*found, folder / "soft.svg"]


def soft_pieces() -> list[Piece]:
    """A cut through the soft kit's sheet, all of it."""
    kit = kits.kit("soft")
    cover = load_cover(kit.skin_path)
    assert cover is not None
    assert cover.cap is not None
    pitch, half, thick = kit.skin.pitch_x_mm, 5e2 * cover.cap.side_m, 1e3 * cover.thickness_m
    middles, board, film = [number * pitch for number in range(CELLS)], BOARDS["plane"][0], 0.3
    edge, foot = middles[-1] + pitch / 2, -board - SOFT_SPACER_MM
    cut = [(x - pitch / 2 + 0.1, x + pitch / 2 - 0.1) for x in middles]
    teeth = [x - half + 0.5 * number for x in middles for number in range(round(4 * half))]
    corner, low, high = edge + 6.0, 0.15, 0.15 + film
    diodes = [(x - 1, -board - 1, x + 1, -board) for x in middles]
    spacer = f"spacer, {SOFT_SPACER_MM:g} mm, at each corner"
    found: list[tuple[str, str, list[tuple[float, float, float, float]]]] = [
        (f"foam of {thick:g} mm, cut with the film", SOFT, [(a, high, b, high + thick) for a, b in cut]),
        ("resistive film (0.1 mm, drawn thicker)", picture_style.INK, [(a, low, b, high) for a, b in cut]),
        ("two combs of copper for each cell", picture_style.VERMILLION, [(x, 0, x + 0.25, low) for x in teeth]),
        (f"circuit board, {board:g} mm", "#d0ece3", [(-LEFT_MM, -board, corner + 4, 0)]),
        ("a diode for each cell", "#8c8c8c", diodes),
        ("header with the plug of a flat cable", picture_style.SOFT, [(1.5, -board - PLUG_MM, 4.9, -board)]),
        (spacer, "#8c8c8c", [(corner - 2.5, foot, corner + 2.5, -board)]),
        ("link of the robot", picture_style.SHEET, [(-LEFT_MM, foot - 2, corner + 5, foot)]),
    ]
    return [Piece(1, *one) for one in found]


def _write(path: Path, title: str, shown: list[Piece], named: list[Piece]) -> None:
    write_text(path, picture_style.for_dark_pages("\n".join([*_lines(title, shown, named), ""])))


def _lines(title: str, shown: list[Piece], named: list[Piece]) -> Iterator[str]:
    """What is named has an outline and words; what was there before is pale."""
    boxes = [box for one in shown for box in one.boxes]
    high, low = max(box[3] for box in boxes) + 1, min(box[1] for box in boxes) - 1
    high = max(high, low + 1.3 * len(named) + 1)
    width, height = WIDE_MM * PX, (high - low) * PX
    yield f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}">'
    yield f"<title>{title}: {', '.join(one.words for one in named)}</title>"
    yield f'<rect width="{width:.0f}" height="{height:.0f}" rx="8" fill="{picture_style.CARD}"/>'
    for one in shown:
        new = f'stroke="{picture_style.INK}" stroke-width="1.2"' if one in named else 'opacity="0.45"'
        for left, bottom, right, top in one.boxes:
            place = f'x="{(left + LEFT_MM + 1) * PX:.1f}" y="{(high - top) * PX:.1f}"'
            size = f'width="{(right - left) * PX:.1f}" height="{(top - bottom) * PX:.1f}"'
            yield f'<rect {place} {size} fill="{one.color}" {new}/>'
    above = sorted(named, key=lambda one: -_anchor(one)[1])
    places = [(high - _anchor(one)[1]) * PX for one in above]
    for number in range(1, len(places)):
        places[number] = max(places[number], places[number - 1] + 1.25 * PX)
    over = max(0.0, places[-1] - height + PX)
    for one, y in zip(above, places, strict=True):
        x, at = _anchor(one)
        words_x = (WORDS_MM + LEFT_MM + 1) * PX
        from_x, from_y = (x + LEFT_MM + 1) * PX, (high - at) * PX
        yield (
            f'<path d="M{from_x:.1f} {from_y:.1f}L{words_x - 6:.1f} {y - over:.1f}" stroke="{picture_style.SOFT}" '
            f'stroke-width="0.8" fill="none"/>'
        )
        yield (
            f'<text x="{words_x:.1f}" y="{y - over + 4:.1f}" font-family="sans-serif" font-size="13" '
            f'fill="{picture_style.INK}">{one.words}</text>'
        )
    yield "</svg>"


def _anchor(one: Piece) -> tuple[float, float]:
    """Where the words' line begins: the middle of the right edge of the piece that is farthest to the right."""
    _, low, right, high = max(one.boxes, key=lambda box: box[2])
    return right, (low + high) / 2
