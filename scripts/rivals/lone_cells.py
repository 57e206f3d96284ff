"""Enters a labeller into docs/rivals.md: each cell is a zone, so those that touch are wrong.

Ports of ``top`` on an N x N sheet. A cell arrives in every clock, no record can wait, and all records of a frame leave
before the next frame's first row is complete.

- ``clk``, ``rst``: ``rst`` is 1 for more than two rows before the first frame.
- ``pressed``: the cell of this clock, row by row from the top, each from column 0; the blank cells and rows that the
  labeller needs follow each row and frame.
- ``x``, ``y``: coordinates of the cell, enough bits for N - 1; meaningless for blank cells.
- ``found``: a record is there in this clock.
- ``zone``: area in the lowest bits, then sum x, then sum y, as wide as in our records.
"""

from pathlib import Path

from rivals.rival import Rival, Sheet

VERILOG = """
module top(input clk, rst, pressed, input [{place}-1:0] x, y, output reg found, output reg [{bits}-1:0] zone);
  always @(posedge clk) begin
    {{found, zone}} <= {{pressed & ~rst, {bits}'d1 | x << {area} | y << {area_x}}};
  end
endmodule"""


def convert(clone: Path, sheet: Sheet, scrambled: bool) -> str:
    area, wide = sheet.moment_bits[0], sum(sheet.moment_bits[:2])
    return VERILOG.format(place=sheet.place_bits, bits=sum(sheet.moment_bits), area=area, area_x=wide)


RIVAL = Rival("lone cells", blank_columns=1, blank_rows=1, convert=convert)
