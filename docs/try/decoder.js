// What a board sent, read by c/contactfpga.h, compiled to WebAssembly.

export const NOTHING = 0, FRAME = 1, HELLO = 2, FAULTS = 3; // contactfpga_event
export const FAULT = 4; // a bit of a frame's flags

export class Decoder {
  #wasm;

  constructor(wasm) {
    this.#wasm = wasm;
    wasm.reader_init();
  }

  // Take a byte; returns what it completed.
  push(byte) {
    return this.#wasm.reader_push(byte);
  }

  // The last frame, with its zones: area in cells, sums of columns and rows, place in mm. To be read at once.
  frame() {
    const [time_us, sequence, flags, cells, count, items] = this.#numbers(this.#wasm.reader_frame(), 6);
    const zones = Array.from({ length: items }, (_, index) => {
      const [area, sum_x, sum_y, x_mm, y_mm] = this.#numbers(this.#wasm.reader_zone(index), 5);
      return { area, sum_x, sum_y, x_mm, y_mm };
    });
    return { time_us, sequence, flags, cells, count, zones };
  }

  // What the board says of itself.
  hello() {
    const wasm = this.#wasm;
    const [rows, columns, pitch_x_mm, pitch_y_mm, clock_hz, baud] = this.#numbers(wasm.reader_hello(), 6);
    const name = new Uint8Array(wasm.memory.buffer, wasm.reader_name(), 33);
    return {
      rows, columns, pitch_x_mm, pitch_y_mm, clock_hz, baud,
      name: new TextDecoder().decode(name.slice(0, name.indexOf(0))),
    };
  }

  // What the board reports of its lines, a sentence for each fault.
  faults() {
    const { rows, columns } = this.hello(), wasm = this.#wasm;
    const all = (count, found, say) => Array.from({ length: count }, (_, line) => (found(line) ? say(line) : "")).filter(Boolean);
    const name = (column) => (column < columns ? `column ${column}` : "the guard column");
    return [
      ...all(rows, wasm.reader_row_open, (row) => `row ${row} is open before its far end`),
      ...all(columns, wasm.reader_column_open, (column) => `column ${column} is open before its far end`),
      ...all(columns + 1, wasm.reader_column_stuck, (column) => `${name(column)} reads pressed while no row is driven`),
    ];
  }

  #numbers(address, count) {
    return Array.from(new Float64Array(this.#wasm.memory.buffer, address, count));
  }
}
