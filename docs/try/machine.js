// A board that runs, and all that one can know of it from outside: what leaves it, what that says, and when.

import { Board } from "./board.js";
import { Decoder, FAULT, FAULTS, FRAME, HELLO } from "./decoder.js";
import { groups, same } from "./zones.js";

const ALWAYS = ["rows", "contact", "alive"];
const TRACED = ["records", "driven", "charged"]; // while a touch is under way, too
const PATIENCE = 12; // scans within which a frame has to tell of a touch
const PACKETS = 12; // that are kept

export class Machine {
  frame = null; // the last frame, with its bytes and the cycle after its last one
  faults = []; // sentences
  packets = []; // those that said something new, the last one first
  read; // cells as the last whole scan read them
  contact = false; // the pin
  turned = 0; // the cycle in which the pin `alive` turned last
  touch = null; // the last change of the switches that a frame told of, see press()
  contact_cycles = null; // from a touch to the pin, the last time that it rose
  #kit;
  #board;
  #decoder;
  #bytes = []; // of the packet that is on the line
  #rows = []; // of the scan under way
  #open = null; // a touch of which no frame has told yet

  constructor(boardWasm, decoderWasm, kit) {
    this.#kit = kit;
    this.#board = new Board(boardWasm, kit);
    this.#decoder = new Decoder(decoderWasm);
    this.read = new Array(kit.rows * kit.columns).fill(0);
    this.#board.capture(ALWAYS);
  }

  get cycle() {
    return this.#board.cycle;
  }

  get board() {
    return this.#board;
  }

  // Close these switches. A touch begins: the cycle, what has to be told, and all that is seen until a frame tells it.
  press(cells) {
    this.#open = {
      cells,
      start: this.cycle,
      wanted: groups(cells, this.#kit),
      raised: this.contact,
      contact: null,
      last: null, // cycles
      rows: [],
      records: [],
      driven: [],
      charged: [],
      received: [],
    };
    this.#board.capture([...ALWAYS, ...TRACED]);
    this.#board.press(cells);
  }

  run(cycles) {
    this.#board.run(cycles);
    for (const name of TRACED) this.#trace(name, this.#board.take(name));
    this.#board.take("rows").forEach((event) => this.#row(event));
    this.#board.take("contact").forEach((event) => this.#pin(event));
    this.#board.take("alive").forEach((event) => (this.turned = event.cycle));
    this.#board.take("received").forEach((event) => this.#byte(event));
    if (this.#open && this.cycle - this.#open.start > PATIENCE * this.#kit.frame_clocks) this.#close();
  }

  #trace(name, events) {
    this.#open?.[name].push(...events);
  }

  #row(event) {
    const { columns } = this.#kit;
    this.#trace("rows", [{ ...event, row: this.#rows.length }]);
    this.#rows.push(Array.from({ length: columns }, (_, column) => (event.data / 2 ** column) & 1));
    if (!event.mark) return;
    this.read = this.#rows.flat();
    this.#rows = [];
  }

  #pin({ cycle, data }) {
    this.contact = data === 1;
    if (!data || !this.#open || this.#open.contact) return;
    this.#open.contact = cycle;
    this.contact_cycles = cycle - this.#open.start;
  }

  #byte(event) {
    this.#trace("received", [event]);
    this.#bytes.push(event.data);
    const what = this.#decoder.push(event.data);
    if (what === FRAME) this.#frame(event.cycle);
    if (what === HELLO) this.#say(event.cycle, "hello", this.#decoder.hello());
    if (what === FAULTS) this.#say(event.cycle, "faults", (this.faults = this.#decoder.faults()));
    if (event.data === 0) this.#bytes = [];
  }

  #frame(cycle) {
    const before = this.frame;
    this.frame = { ...this.#decoder.frame(), cycle, bytes: this.#bytes };
    if (!before || said(before) !== said(this.frame)) this.#say(cycle, "frame", this.frame);
    if (this.#open && tells(this.frame, this.#open.wanted)) {
      this.#open.last = cycle;
      this.#close();
    }
  }

  #say(cycle, kind, content) {
    this.packets = [{ cycle, kind, bytes: this.#bytes, content }, ...this.packets].slice(0, PACKETS);
  }

  #close() {
    if (this.#open.last) this.touch = upTo(this.#open.last, this.#open);
    this.#open = null;
    this.#board.capture(ALWAYS);
  }
}

// A touch without what was seen after its end.
function upTo(last, touch) {
  const seen = ["rows", "received", ...TRACED].map((name) => [name, touch[name].filter(({ cycle }) => cycle <= last)]);
  return { ...touch, ...Object.fromEntries(seen) };
}

function said({ zones, cells, flags }) {
  return JSON.stringify([zones, cells, flags & FAULT]);
}

function tells({ zones }, wanted) {
  return zones.length === wanted.length && wanted.every((group) => zones.some((zone) => same(zone, group)));
}
