// The sheet of switches, drawn in mm, and the fingers on it, which mouse, touch, pen and keys move. Column 0 and row 0 meet
// at (0, 0), as in everything that the board says.

import { svg } from "./svg.js";
import { groups, outline, same } from "./zones.js";

export const COLORS = 6; // of zones, in the style sheet
const STEP_MM = 1; // of an arrow key; with Shift a pitch
const TAP_MM = 1.5; // a finger that moves less between press and release was tapped, and is lifted
const MOST = 10; // fingers

export class Sheet {
  fingers = []; // x_mm, y_mm, radius_mm, force_n, element
  selected = null;
  keep = true; // fingers stay when they are let go
  cut = []; // lines: kind, row, column
  #kit;
  #svg;
  #caps;
  #layers;
  #held = new Map(); // pointer to finger, offset and start
  #changed;

  // `make` gives size and force of a new finger; `changed` is called when fingers are.
  constructor(element, kit, make, changed) {
    this.#svg = element;
    this.#kit = kit;
    this.#changed = changed;
    this.make = make;
    this.#draw();
    this.#listen();
  }

  // ---- what is drawn ----

  #draw() {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const width = columns * pitch, height = rows * pitch, edge = pitch / 2;
    this.#svg.setAttribute("viewBox", `${-edge - 8} ${-edge - 8} ${width + 16} ${height + 16}`);
    const names = ["foam", "caps", "wires", "labels", "fingers", "outlines", "marks"];
    this.#layers = Object.fromEntries(names.map((name) => [name, svg("g", { class: name })]));
    this.#svg.append(...Object.values(this.#layers));
    this.#layers.foam.append(svg("rect", { x: -edge - 1, y: -edge - 1, width: width + 2, height: height + 2, rx: 2 }));
    this.#drawCaps();
    this.#drawLabels(width, height, edge);
  }

  #drawCaps() {
    const { rows, columns, pitch_mm: pitch, cap_mm: side } = this.#kit;
    this.#caps = Array.from({ length: rows * columns }, (_, cell) => {
      const x = (cell % columns) * pitch - side / 2, y = Math.floor(cell / columns) * pitch - side / 2;
      return svg("rect", { x, y, width: side, height: side, rx: 0.8 });
    });
    this.#layers.caps.append(...this.#caps);
  }

  #drawLabels(width, height, edge) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const text = (x, y, what, name) => svg("text", { x, y, class: name }, String(what));
    for (let row = 0; row < rows; row++) this.#layers.labels.append(text(-edge - 3.2, row * pitch, row, "line"));
    for (let column = 0; column < columns; column++) this.#layers.labels.append(text(column * pitch, -edge - 3.2, column, "line"));
    this.#layers.labels.append(text(-edge - 3.2, -edge - 3.2, "row\u00a0col", "corner"));
    for (let mm = 0; mm <= width - edge; mm += 20) {
      this.#layers.labels.append(
        svg("path", { d: `M${mm} ${height - edge + 1.6}v1.4M${width - edge + 1.6} ${mm}h1.4` }),
        text(mm, height - edge + 5, mm || "0 mm", "mm"), text(width - edge + 5.4, mm, mm, "mm"),
      );
    }
  }

  // `read`: cells as the board read them; `zones` as it reports them, each with its color; `closed`: the switches.
  show(read, closed, zones) {
    this.#caps.forEach((cap, cell) => {
      const name = [closed[cell] ? "closed" : "", read[cell] ? "read" : ""].join(" ").trim();
      if (cap.getAttribute("class") !== name) cap.setAttribute("class", name);
    });
    this.#outline(read, zones);
    this.#layers.marks.replaceChildren(...zones.map(mark));
  }

  // A board sends no shapes. Those drawn are the cells that it read whose area and place are those of a zone.
  #outline(read, zones) {
    const { columns, pitch_mm: pitch } = this.#kit;
    const paths = groups(read, this.#kit).flatMap((group) => {
      const zone = zones.find((one) => same(one, group));
      return zone ? [svg("path", { d: outline(group, columns), class: `zone-${zone.color}`, transform: `scale(${pitch})` })] : [];
    });
    this.#layers.outlines.replaceChildren(...paths);
  }

  // Lines that are cut, and in slow motion the row that is driven, whose columns may be sampled just now.
  lines(row = null, sampled = false) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const wires = [];
    if (row !== null && row < rows) {
      wires.push(svg("rect", {
        x: -pitch / 2, y: (row - 0.5) * pitch, width: columns * pitch, height: pitch, class: sampled ? "row sampled" : "row",
      }));
    }
    for (const line of this.cut) wires.push(...cutLine(line, this.#kit));
    this.#layers.wires.replaceChildren(...wires);
    this.#layers.labels.querySelectorAll(".line").forEach((label, index) => label.classList.toggle("driven", index === row));
  }

  // ---- fingers ----

  put(x_mm, y_mm) {
    if (this.fingers.length === MOST) this.lift(this.fingers[0]);
    const element = svg("g", { tabindex: 0, role: "img" }, svg("circle", { class: "skin" }), svg("circle", { class: "tip" }));
    const finger = { ...this.make(), x_mm, y_mm, element };
    element.addEventListener("focus", () => this.select(finger));
    this.fingers.push(finger);
    this.#layers.fingers.append(element);
    this.select(finger);
    this.move(finger, x_mm, y_mm);
    return finger;
  }

  select(finger) {
    this.selected = finger;
    for (const one of this.fingers) one.element.classList.toggle("selected", one === finger);
    this.#changed();
  }

  move(finger, x_mm, y_mm) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const within = (value, count) => Math.min(Math.max(value, -pitch / 2), (count - 0.5) * pitch);
    Object.assign(finger, { x_mm: within(x_mm, columns), y_mm: within(y_mm, rows) });
    this.shape(finger);
  }

  // Draw a finger anew whose place, size or force has changed.
  shape(finger) {
    const { x_mm, y_mm, radius_mm, force_n, element } = finger;
    element.setAttribute("transform", `translate(${x_mm} ${y_mm})`);
    element.firstChild.setAttribute("r", radius_mm);
    element.lastChild.setAttribute("r", radius_mm * Math.min(1, 0.25 + force_n / 14));
    element.setAttribute("aria-label", `Finger at x ${x_mm.toFixed(1)} mm, y ${y_mm.toFixed(1)} mm, ${force_n.toFixed(1)} N`);
    this.#changed();
  }

  lift(finger) {
    const focused = finger.element === document.activeElement;
    finger.element.remove();
    this.fingers = this.fingers.filter((one) => one !== finger);
    if (this.selected === finger) this.select(this.fingers.at(-1) ?? null);
    if (focused) (this.selected?.element ?? this.#svg).focus();
    this.#changed();
  }

  liftAll() {
    this.#held.clear();
    for (const finger of [...this.fingers]) this.lift(finger);
  }

  // ---- mouse, touch and pen ----

  #listen() {
    const on = (name, handle) => this.#svg.addEventListener(name, handle);
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#drag(event));
    on("pointerup", (event) => this.#up(event));
    on("pointercancel", (event) => this.#up(event));
    on("keydown", (event) => this.#key(event));
  }

  // Place of a pointer in mm.
  #place({ clientX, clientY }) {
    const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(this.#svg.getScreenCTM().inverse());
    return [x, y];
  }

  #down(event) {
    if (event.button) return;
    event.preventDefault();
    this.#svg.setPointerCapture(event.pointerId);
    const [x, y] = this.#place(event);
    const there = this.fingers.findLast((finger) => Math.hypot(finger.x_mm - x, finger.y_mm - y) <= finger.radius_mm);
    const finger = there ?? this.put(x, y);
    finger.element.focus({ preventScroll: true });
    this.#held.set(event.pointerId, {
      finger, fresh: !there, from: [x, y], offset: [finger.x_mm - x, finger.y_mm - y], moved: false,
    });
    this.#press(finger, event);
  }

  #drag(event) {
    const held = this.#held.get(event.pointerId);
    if (!held) return;
    const [x, y] = this.#place(event);
    held.moved ||= Math.hypot(x - held.from[0], y - held.from[1]) > TAP_MM;
    if (held.moved) this.move(held.finger, x + held.offset[0], y + held.offset[1]);
    this.#press(held.finger, event);
  }

  // A pen says how hard it presses, from 0 to 1.
  #press(finger, { pointerType, pressure }) {
    if (pointerType !== "pen" || !pressure) return;
    finger.force_n = pressure * this.#kit.most_n;
    this.shape(finger);
  }

  #up(event) {
    const held = this.#held.get(event.pointerId);
    this.#held.delete(event.pointerId);
    if (held && (!this.keep || (!held.fresh && !held.moved))) this.lift(held.finger);
  }

  // ---- keys ----

  #key(event) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const finger = this.selected, step = event.shiftKey ? pitch : STEP_MM;
    const steps = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
    if (event.key === "Enter" || event.key === " ") this.put(((columns - 1) * pitch) / 2, ((rows - 1) * pitch) / 2).element.focus();
    else if (finger && (event.key === "Delete" || event.key === "Backspace")) this.lift(finger);
    else if (finger && steps) this.move(finger, finger.x_mm + steps[0], finger.y_mm + steps[1]);
    else return;
    event.preventDefault();
  }
}

function mark({ x_mm, y_mm, color, number }) {
  const label = svg("text", { x: x_mm, y: y_mm }, String(number));
  return svg("g", { class: `zone-${color}` }, svg("circle", { cx: x_mm, cy: y_mm, r: 2.3 }), label);
}

// A line up to where it is cut, and what is cut off, which the board no longer reaches.
function cutLine({ row, column, kind }, { rows, columns, pitch_mm: pitch }) {
  const edge = pitch / 2;
  if (kind === "row") {
    const y = row * pitch, x = column * pitch - edge, end = columns * pitch - edge;
    return [svg("path", { d: `M${-edge} ${y}H${x - 1}`, class: "whole" }), svg("path", { d: `M${x + 1} ${y}H${end}`, class: "cut" })];
  }
  const x = column * pitch, y = row * pitch - edge, end = rows * pitch - edge;
  return [svg("path", { d: `M${x} ${-edge}V${y - 1}`, class: "whole" }), svg("path", { d: `M${x} ${y + 1}V${end}`, class: "cut" })];
}
