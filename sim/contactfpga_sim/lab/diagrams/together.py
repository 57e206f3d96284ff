"""Parts of the starter kit, with times since the switch closed."""

from __future__ import annotations

from pathlib import Path

from contactfpga import picture_style as style
from contactfpga.design import predictions
from contactfpga.design.kits import Kit
from contactfpga_sim.lab.diagrams.canvas import Canvas
from contactfpga_sim.lab.finger.stages import ASSUMED_HOST_US

SKIN, BOARD, HOST = (16, 184), (272, 146), (560, 144)
"""Left end and width, px."""
CELLS = 9


def draw(kit: Kit, path: Path) -> Path:
    canvas = Canvas(346)
    _skin(canvas, kit)
    _boxes(canvas, kit)
    _times(canvas, kit)
    canvas.small(16, 318, f"Times since the switch closed: median, in parentheses the worst. {kit.title}; simulated.")
    canvas.small(16, 335, "Before that, a touch sinks into the foam for some milliseconds.")
    return canvas.save(path)


def _skin(canvas: Canvas, kit: Kit) -> None:
    left, width = SKIN
    step = width / CELLS
    canvas.text(left, 22, "robot with a skin", fontweight="bold")
    finger = left + width / 2
    points = [(finger - 18, 40), (finger - 18, 78), (finger - 11, 90), (finger + 11, 90), (finger + 18, 78)]
    canvas.area([*points, (finger + 18, 40)], "#e8c4a8")
    canvas.small(finger + 26, 58, "finger")
    pressed = [abs(left + (cell + 0.5) * step - finger) < 1.2 * step for cell in range(CELLS)]
    for cell, down in enumerate(pressed):
        x = left + cell * step
        canvas.box(x + 0.8, 88 + 3 * down, step - 1.6, 22, style.ORANGE, lw=0.6)
        canvas.box(x + 3, 113 + 2 * down, step - 6, 6 - 2 * down, style.BLUE, fc=style.BLUE if down else None)
    canvas.box(left, 119, width, 7, style.GREEN, fc=style.GREEN)
    canvas.box(left, 130, width, 58, style.GRAY, ec=style.SOFT)
    canvas.text(left + width / 2, 159, "link of the robot", ha="center")
    skin = kit.skin
    canvas.small(left, 204, f"foam on {skin.rows} x {skin.columns} switches,")
    canvas.small(left, 220, f"{skin.pitch_x_mm:g} mm apart")


def _boxes(canvas: Canvas, kit: Kit) -> None:
    for (left, width), title in ((BOARD, "FPGA board"), (HOST, "computer")):
        canvas.text(left, 22, title, fontweight="bold")
        canvas.box(left, 40, width, 148, style.BLUE if title == "FPGA board" else style.PURPLE)
    steps = ("scans the rows", "finds the zones", "sends them as bytes")
    for place, words in enumerate(steps):
        canvas.text(BOARD[0] + BOARD[1] / 2, 66 + 48 * place, words, ha="center")
    for y in (78, 126):
        canvas.arrow((BOARD[0] + BOARD[1] / 2, y), (BOARD[0] + BOARD[1] / 2, y + 24))
    for place, words in enumerate(("USB controller", "driver", "your program")):
        canvas.text(HOST[0] + HOST[1] / 2, 66 + 48 * place, words, ha="center")
    for y in (78, 126):
        canvas.arrow((HOST[0] + HOST[1] / 2, y), (HOST[0] + HOST[1] / 2, y + 24))
    canvas.box(BOARD[0], 250, BOARD[1], 40, style.VERMILLION)
    canvas.text(BOARD[0] + BOARD[1] / 2, 270, "drives of the robot", ha="center")


def _times(canvas: Canvas, kit: Kit) -> None:
    skin, said = kit.skin, predictions.load(kit)
    times = skin.derived

    def us(name: str, more: float = 0.0) -> str:
        median, worst = (said[f"{name}_{which}_us"].value + more for which in ("median", "worst"))
        return f"{median:.0f} µs ({worst:.0f})"

    row_us = 1e6 * (times.settle_clocks + times.release_clocks) / skin.clock_hz
    canvas.arrow((SKIN[0] + SKIN[1] + 4, 122), (BOARD[0] - 4, 122), both=True)
    between = (SKIN[0] + SKIN[1] + BOARD[0]) / 2
    canvas.small(between, 106, "ribbon", ha="center")
    canvas.small(between, 138, "a row in", ha="center")
    canvas.small(between, 154, f"{row_us:.1f} µs", ha="center", color=style.INK)
    start, end = BOARD[0] + BOARD[1], HOST[0]
    canvas.arrow((start + 4, 114), (end - 4, 114))
    middle = (start + end) / 2
    canvas.small(middle, 58, "last byte sent", ha="center")
    canvas.text(middle, 74, us("last_byte"), ha="center", fontweight="bold")
    canvas.small(middle, 98, "USB", ha="center")
    canvas.small(middle, 134, "at the controller", ha="center")
    canvas.text(middle, 150, us("host"), ha="center", fontweight="bold")
    pin = BOARD[0] + BOARD[1] / 2
    canvas.arrow((pin, 190), (pin, 248), color=style.VERMILLION)
    canvas.small(pin + 10, 210, "pin contact: stop, without a computer")
    canvas.text(pin + 10, 228, us("contact"), fontweight="bold", color=style.VERMILLION)
    canvas.arrow((BOARD[0] - 4, 270), (SKIN[0] + 95, 270), (SKIN[0] + 95, 232))
    program = HOST[0] + HOST[1] / 2
    canvas.arrow((program, 190), (program, 270), (start + 4, 270))
    canvas.small(start + 12, 288, f"decision of your program, {ASSUMED_HOST_US:.0f} µs assumed for it")
    canvas.text(start + 12, 256, us("host", ASSUMED_HOST_US), fontweight="bold")
