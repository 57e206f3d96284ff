"""Enters a labeller into docs/rivals.md: each cell is a zone, so those that touch are wrong."""

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
