// Slow motion of one touch: what the board does from the closed switch to the last byte that tells it, along its clock.

import { svg } from "./svg.js";

const LEFT = 104, RIGHT = 12, TOP = 22; // px
const LANES = [
  ["driven", "row driven", 30], ["charged", "columns reset", 14], ["rows", "columns read", 22],
  ["contact", "pin contact", 18], ["records", "zones leave", 22], ["received", "bytes sent", 30],
];
const GAP = 7;
const HEIGHT = TOP + LANES.reduce((sum, [, , height]) => sum + height + GAP, 0) + 26;
const ROOM = 13; // px that a label of two digits needs

export class Timeline {
  touch = null;
  cycle = 0; // shown
  #svg;
  #kit;
  #cursor = svg("path", { class: "cursor" });

  constructor(element, kit) {
    this.#svg = element;
    this.#kit = kit;
    this.#svg.setAttribute("height", HEIGHT);
  }

  // Draw all of a touch (see Machine.press).
  show(touch) {
    this.touch = touch;
    this.blocks = { driven: driven(touch), charged: spans(touch.charged), bytes: bytes(touch, this.#kit.bit_clocks) };
    this.draw();
    this.at(touch.last);
  }

  // Draw anew, as after a change of the width.
  draw() {
    if (!this.touch) return;
    const width = this.#svg.clientWidth, end = this.touch.last + 20;
    this.#x = (cycle) => LEFT + ((cycle - this.touch.start) / (end - this.touch.start)) * (width - LEFT - RIGHT);
    this.#svg.replaceChildren(this.#axis(), ...this.#lanes(), this.#cursor);
    this.at(this.cycle);
  }

  at(cycle) {
    this.cycle = Math.min(Math.max(cycle, this.touch.start), this.touch.last);
    this.#cursor.setAttribute("d", `M${this.#x(this.cycle)} ${TOP - 6}V${HEIGHT - 26}`);
  }

  // The cycles in which something happens that is worth a stop.
  get stops() {
    const { start, contact, last, rows, records } = this.touch;
    const all = [start, contact, last, ...rows.map((row) => row.cycle), ...records.map((record) => record.cycle), ...this.blocks.bytes.map((byte) => byte.to)];
    return [...new Set(all.filter((cycle) => cycle !== null && cycle >= start && cycle <= last))].sort((a, b) => a - b);
  }

  // What happens at the cycle shown: the row that is driven, cells read so far, and sentences.
  get moment() {
    const now = this.cycle, { touch, blocks } = this;
    const block = blocks.driven.find(({ from, to }) => from <= now && now < to);
    const row = touch.rows.findLast((one) => one.cycle <= now && now < one.cycle + 12);
    const record = touch.records.findLast((one) => one.cycle <= now && now < one.cycle + 12);
    const byte = blocks.bytes.find(({ from, to }) => from < now && now <= to);
    return { row: block ? block.row : null, sampled: Boolean(row), read: this.#read(), said: this.#said(block, row, record, byte) };
  }

  #x = () => 0;

  #us(cycle) {
    return ((cycle - this.touch.start) / this.#kit.clock_hz) * 1e6;
  }

  #read() {
    const { rows, columns } = this.#kit;
    const read = new Array(rows * columns).fill(0);
    for (const { row, data, cycle } of this.touch.rows) {
      if (cycle > this.cycle) break;
      for (let column = 0; column < columns; column++) read[row * columns + column] = (data / 2 ** column) & 1;
    }
    return read;
  }

  #said(block, row, record, byte) {
    const { touch, cycle } = this, said = [];
    if (cycle === touch.start) said.push("The switches close.");
    if (row) said.push(row.data ? `Row ${row.row} is read: ${columnsOf(row.data)} closed.` : `Row ${row.row} is read: nothing closed.`);
    else if (block) said.push(block.row < this.#kit.rows ? `Row ${block.row} is driven.` : "The guard row is driven: every whole column must read closed.");
    if (touch.contact !== null && cycle >= touch.contact && cycle < touch.contact + 12) said.push("The pin contact rises: a robot can stop now.");
    if (record) said.push(record.mark ? "The frame is complete." : `A zone is complete: ${record.data % 2 ** this.#kit.area_bits} switches.`);
    if (byte) said.push(`Byte ${hex(byte.data)} is on the line${byte.telling ? `, ${byte.number} of ${byte.of} that tell the touch` : ", of a frame from before"}.`);
    if (cycle === touch.last) said.push("The last byte is out: your program knows.");
    return said.join(" ");
  }

  // ---- drawing ----

  #axis() {
    const group = svg("g", { class: "axis" }), { start, last } = this.touch;
    const step = [5, 10, 20, 50, 100, 200, 500].find((us) => (this.#us(last) / us) * 56 < this.#svg.clientWidth - LEFT) ?? 1000;
    for (let us = 0; us <= this.#us(last); us += step) {
      const x = this.#x(start + (us * this.#kit.clock_hz) / 1e6);
      group.append(svg("path", { d: `M${x} ${TOP - 6}V${HEIGHT - 26}` }), svg("text", { x, y: 11 }, us ? String(us) : "0 µs"));
      group.append(svg("text", { x, y: HEIGHT - 8 }, us ? String(Math.round((us * this.#kit.clock_hz) / 1e6)) : "0"));
    }
    group.append(svg("text", { x: 0, y: 11, class: "name" }, "time"), svg("text", { x: 0, y: HEIGHT - 8, class: "name" }, "clock"));
    return group;
  }

  #lanes() {
    let top = TOP;
    return LANES.map(([name, title, height]) => {
      const y = top;
      top += height + GAP;
      const group = svg("g", { class: `lane ${name}` }, svg("text", { x: 0, y: y + height / 2, class: "name" }, title));
      group.append(svg("rect", { x: LEFT, y, width: this.#svg.clientWidth - LEFT - RIGHT, height, class: "ground" }));
      group.append(...this.#marks(name, y, height));
      return group;
    });
  }

  #marks(name, y, height) {
    const { touch, blocks } = this;
    if (name === "driven") return blocks.driven.flatMap(({ from, to, row }) => this.#block(from, to, y, height, row < this.#kit.rows ? row : "g"));
    if (name === "charged") return blocks.charged.flatMap(({ from, to }) => this.#block(from, to, y, height));
    if (name === "rows") return touch.rows.flatMap((row) => this.#tick(row.cycle, y, height, row.data ? count(row.data) : "", row.data ? "hit" : ""));
    if (name === "records") return touch.records.flatMap(({ cycle, mark }) => this.#tick(cycle, y, height, "", mark ? "end" : "hit"));
    if (name === "received") return blocks.bytes.flatMap((byte) => this.#block(byte.from, byte.to, y, height, hex(byte.data), byte.telling ? "hit" : ""));
    const rise = touch.contact ?? touch.start, low = `M${LEFT} ${y + height}H${this.#x(rise)}V${y + 1}`;
    const line = touch.contact || touch.raised ? low : `M${LEFT} ${y + height}`;
    return [svg("path", { d: `${line}H${this.#x(touch.last)}`, class: "level" })];
  }

  #block(from, to, y, height, label = "", kind = "") {
    const x = Math.max(this.#x(from), LEFT), width = Math.max(this.#x(to) - x, 1);
    const rect = svg("rect", { x, y, width, height, class: `mark ${kind}`, rx: 1.5 });
    return width < ROOM || label === "" ? [rect] : [rect, svg("text", { x: x + width / 2, y: y + height / 2 }, String(label))];
  }

  #tick(cycle, y, height, label, kind) {
    const x = this.#x(cycle), wide = label === "" ? (kind ? 4 : 2) : ROOM;
    const rect = svg("rect", { x: x - wide / 2, y, width: wide, height, class: `mark ${kind}`, rx: 1 });
    return label === "" ? [rect] : [rect, svg("text", { x, y: y + height / 2 }, String(label))];
  }
}

export function hex(byte) {
  return byte.toString(16).padStart(2, "0");
}

function count(word) {
  return word.toString(2).replaceAll("0", "").length;
}

function columnsOf(word) {
  const columns = [...word.toString(2)].reverse().flatMap((bit, column) => (bit === "1" ? [column] : []));
  return `${columns.length > 1 ? "columns" : "column"} ${columns.join(", ")}`;
}

// From when to when something other than 0 was noted.
function spans(events) {
  return events.flatMap(({ cycle, data }, index) => (data && events[index + 1] ? [{ from: cycle, to: events[index + 1].cycle, data }] : []));
}

// Rows are told as one bit of a word.
function driven(touch) {
  return spans(touch.driven).map((span) => ({ ...span, row: Math.round(Math.log2(span.data)) }));
}

// Each byte with its time on the line; those of the last packet tell the touch.
function bytes({ received, last }, bit_clocks) {
  const upTo = received.findIndex(({ cycle }) => cycle === last);
  const first = received.slice(0, upTo).findLastIndex(({ data }) => data === 0) + 1;
  return received.slice(0, upTo + 1).map(({ cycle, data }, index) => ({
    from: cycle - 10 * bit_clocks, to: cycle, data, telling: index >= first, number: index - first + 1, of: upTo + 1 - first,
  }));
}
