// Slow motion of one touch: what the board does from the closed switch to the last byte that tells it, along its clock.

import { svg } from "./dom.js";
import { hex } from "./text.js";

const LEFT = 104; // px, as all that follows
const RIGHT = 12;
const TOP = 22;
const LANES = [
  ["driven", "row driven", 30],
  ["charged", "columns reset", 14],
  ["rows", "columns read", 22],
  ["contact", "pin contact", 18],
  ["records", "zones leave", 22],
  ["received", "bytes sent", 30],
];
const GAP = 7;
const HEIGHT = TOP + LANES.reduce((sum, [, , height]) => sum + height + GAP, 0) + 26;
const ROOM = 13; // for a label of two digits
const JUST = 12; // clocks after which something is still shown as what happens now

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

  // As after a change of the width.
  draw() {
    if (!this.touch) return;
    const width = this.#svg.clientWidth;
    const end = this.touch.last + 20;
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
    const all = [
      start,
      contact,
      last,
      ...rows.map((row) => row.cycle),
      ...records.map((record) => record.cycle),
      ...this.blocks.bytes.map((byte) => byte.to),
    ];
    return [...new Set(all.filter((cycle) => cycle !== null && cycle >= start && cycle <= last))].sort((a, b) => a - b);
  }

  // What happens at the cycle shown: the row that is driven, cells read so far, and sentences.
  get moment() {
    const now = this.cycle;
    const { touch, blocks } = this;
    const block = blocks.driven.find(({ from, to }) => from <= now && now < to);
    const row = touch.rows.findLast((one) => one.cycle <= now && now < one.cycle + JUST);
    const record = touch.records.findLast((one) => one.cycle <= now && now < one.cycle + JUST);
    const byte = blocks.bytes.find(({ from, to }) => from < now && now <= to);
    return {
      row: block ? block.row : null,
      sampled: Boolean(row),
      read: this.#read(),
      said: this.#said(block, row, record, byte),
    };
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
    const { start, contact, last } = this.touch;
    const now = this.cycle;
    const sentences = [
      now === start && "The switches close.",
      row && `Row ${row.row} is read: ${row.data ? columnsOf(row.data) : "nothing"} closed.`,
      !row && block && this.#drives(block.row),
      contact !== null && contact <= now && now < contact + JUST && "The pin contact rises: a robot can stop now.",
      record && (record.mark ? "The frame is complete." : `A zone is complete: ${this.#area(record)} switches.`),
      byte && `Byte ${hex(byte.data)} is on the line, ${this.#place(byte)}.`,
      now === last && "The last byte is out: your program knows.",
    ];
    return sentences.filter(Boolean).join(" ");
  }

  #drives(row) {
    return row < this.#kit.rows ? `Row ${row} is driven.` : "The guard row is driven: every whole column reads closed.";
  }

  // The lowest field of a record.
  #area(record) {
    return record.data % 2 ** this.#kit.area_bits;
  }

  #place({ telling, number, of }) {
    return telling ? `${number} of ${of} that tell the touch` : "of a frame from before";
  }

  // ---- drawing ----

  #axis() {
    const group = svg("g", { class: "axis" });
    const { start, last } = this.touch;
    const step =
      [5, 10, 20, 50, 100, 200, 500].find((us) => (this.#us(last) / us) * 56 < this.#svg.clientWidth - LEFT) ?? 1000;
    for (let us = 0; us <= this.#us(last); us += step) {
      const x = this.#x(start + (us * this.#kit.clock_hz) / 1e6);
      group.append(
        svg("path", { d: `M${x} ${TOP - 6}V${HEIGHT - 26}` }),
        svg("text", { x, y: 11 }, us ? String(us) : "0 µs"),
      );
      group.append(svg("text", { x, y: HEIGHT - 8 }, us ? String(Math.round((us * this.#kit.clock_hz) / 1e6)) : "0"));
    }
    group.append(
      svg("text", { x: 0, y: 11, class: "name" }, "time"),
      svg("text", { x: 0, y: HEIGHT - 8, class: "name" }, "clock"),
    );
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
    const block = (from, to, label, kind) => this.#block(from, to, y, height, label, kind);
    const tick = (cycle, label, kind) => this.#tick(cycle, y, height, label, kind);
    const marks = {
      driven: () => blocks.driven.map(({ from, to, row }) => block(from, to, row < this.#kit.rows ? row : "g")),
      charged: () => blocks.charged.map(({ from, to }) => block(from, to)),
      rows: () => touch.rows.map(({ cycle, data }) => (data ? tick(cycle, count(data), "hit") : tick(cycle))),
      contact: () => this.#level(y, height),
      records: () => touch.records.map(({ cycle, mark }) => tick(cycle, "", mark ? "end" : "hit")),
      received: () => blocks.bytes.map((byte) => block(byte.from, byte.to, hex(byte.data), byte.telling ? "hit" : "")),
    };
    return marks[name]().flat();
  }

  // The pin: low until it rises, which may have been before.
  #level(y, height) {
    const { start, contact, last, raised } = this.touch;
    const rise = contact || raised ? `H${this.#x(contact ?? start)}V${y + 1}` : "";
    return [svg("path", { d: `M${LEFT} ${y + height}${rise}H${this.#x(last)}`, class: "level" })];
  }

  #block(from, to, y, height, label = "", kind = "") {
    const x = Math.max(this.#x(from), LEFT);
    const width = Math.max(this.#x(to) - x, 1);
    const rect = svg("rect", { x, y, width, height, class: `mark ${kind}`, rx: 1.5 });
    return width < ROOM || label === ""
      ? [rect]
      : [rect, svg("text", { x: x + width / 2, y: y + height / 2 }, String(label))];
  }

  #tick(cycle, y, height, label = "", kind = "") {
    const x = this.#x(cycle);
    const wide = label === "" ? (kind ? 4 : 2) : ROOM;
    const rect = svg("rect", { x: x - wide / 2, y, width: wide, height, class: `mark ${kind}`, rx: 1 });
    return label === "" ? [rect] : [rect, svg("text", { x, y: y + height / 2 }, String(label))];
  }
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
  return events.flatMap(({ cycle, data }, index) =>
    data && events[index + 1] ? [{ from: cycle, to: events[index + 1].cycle, data }] : [],
  );
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
    from: cycle - 10 * bit_clocks,
    to: cycle,
    data,
    telling: index >= first,
    number: index - first + 1,
    of: upTo + 1 - first,
  }));
}
