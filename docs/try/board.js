// The gateware of a kit with its sheet of switches and a UART at its line, stepped by the clock. It is the virtual
// board of sim/contactfpga_sim/model/board/drivers/board.cpp, which says what its functions do.

const EVENTS = ["rows", "records", "items", "bytes", "line", "contact", "alive", "driven", "charged", "received"];
const EVENT_BYTES = 24; // cycle, data, mark: 64 bits each

export class Board {
  #wasm;
  #board;
  #kit;
  #room; // in the module's memory, for arguments

  // `kit` has rows and columns, each without its guard line.
  constructor(wasm, kit) {
    this.#wasm = wasm;
    this.#kit = kit;
    this.#board = wasm.board_new();
    this.#room = wasm.malloc(1024);
  }

  // The clock cycle that runs next; cycle 0 is the first one after power-up.
  get cycle() {
    return Number(this.#wasm.board_cycle(this.#board));
  }

  run(cycles) {
    this.#wasm.board_run(this.#board, BigInt(cycles));
  }

  // From the next cycle on these switches are closed: 0 or 1 for each, row by row.
  press(cells) {
    const { rows, columns } = this.#kit;
    const words = new BigUint64Array(this.#wasm.memory.buffer, this.#room, rows);
    for (let row = 0; row < rows; row++) {
      words[row] = BigInt(cells.slice(row * columns, (row + 1) * columns).reduceRight((word, on) => 2 * word + on, 0));
    }
    this.#wasm.board_hold(this.#board, this.#room, 1, 0n);
  }

  // What is noted besides received bytes: names of EVENTS.
  capture(names) {
    this.#wasm.board_capture(
      this.#board,
      names.reduce((bits, name) => bits | (1 << EVENTS.indexOf(name)), 0),
    );
  }

  // What was noted of this name since it was asked for last: cycle, data and mark as the driver says.
  take(name) {
    const index = EVENTS.indexOf(name);
    const count = this.#wasm.board_count(this.#board, index);
    const at = this.#wasm.board_events(this.#board, index);
    const view = new DataView(this.#wasm.memory.buffer);
    const found = Array.from({ length: count }, (_, each) => {
      const [cycle, data, mark] = [0, 8, 16].map((offset) => view.getBigUint64(at + EVENT_BYTES * each + offset, true));
      return { cycle: Number(cycle), data: Number(data), mark: Number(mark) };
    });
    this.#wasm.board_forget(this.#board, index);
    return found;
  }

  // From the next cycle on these columns, by number, read pressed whatever row is driven.
  stick(columns) {
    const lines = this.#lines(this.#kit.columns + 1, 0);
    for (const column of columns) lines[column] = 1;
    this.#wasm.board_stick(this.#board, lines.byteOffset);
  }

  // From the next cycle on these lines are cut, and all others whole. `rows`: pairs of a row and the column from which
  // on its switches no longer reach the pin; `columns`: pairs of a column and such a row.
  cut(rows, columns) {
    const rowEnds = this.#lines(this.#kit.rows + 1, this.#kit.columns + 1);
    const columnEnds = this.#lines(this.#kit.columns + 1, this.#kit.rows + 1, 128);
    for (const [row, end] of rows) rowEnds[row] = end;
    for (const [column, end] of columns) columnEnds[column] = end;
    this.#wasm.board_cut(this.#board, rowEnds.byteOffset, columnEnds.byteOffset);
  }

  #lines(count, value, offset = 0) {
    return new Uint8Array(this.#wasm.memory.buffer, this.#room + offset, count).fill(value);
  }
}
