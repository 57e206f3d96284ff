// What a board sent, read by c/contactfpga.h, compiled to WebAssembly with the functions of c/page.c.

export const FRAME = 1,
  HELLO = 2,
  FAULTS = 3; // what a byte can complete: contactfpga_event
export const FAULT = 4; // a bit of a frame's flags

export class Decoder {
  #wasm;

  constructor(wasm) {
    this.#wasm = wasm;
    wasm.decode_init();
  }

  // Take a byte; returns what it completed, 0 for nothing.
  push(byte) {
    return this.#wasm.decode_push(byte);
  }

  // The last frame with its zones: area in cells, place in mm. To be read before the next byte.
  frame() {
    const wasm = this.#wasm;
    const zones = Array.from({ length: wasm.frame_items() }, (_, index) => ({
      area: wasm.zone_area(index),
      x_mm: wasm.zone_x_mm(index),
      y_mm: wasm.zone_y_mm(index),
    }));
    return {
      time_us: wasm.frame_time_us(),
      flags: wasm.frame_flags(),
      cells: wasm.frame_cells(),
      count: wasm.frame_zones(),
      zones,
    };
  }

  // What the board says of itself.
  hello() {
    const wasm = this.#wasm;
    return { rows: wasm.hello_rows(), columns: wasm.hello_columns(), pitch_mm: wasm.hello_pitch_x_mm() };
  }

  // What the board reports of its lines, in words.
  faults() {
    const { rows, columns } = this.hello();
    const wasm = this.#wasm;
    const all = (count, found, say) =>
      Array.from({ length: count }, (_, line) => (found(line) ? [say(line)] : [])).flat();
    const name = (column) => (column < columns ? `column ${column}` : "the guard column");
    return [
      ...all(rows, wasm.row_open, (row) => `row ${row} is open before its far end`),
      ...all(columns, wasm.column_open, (column) => `column ${column} is open before its far end`),
      ...all(columns + 1, wasm.column_stuck, (column) => `${name(column)} reads pressed while no row is driven`),
    ];
  }
}
