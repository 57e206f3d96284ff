// Fingers on the sheet, which mouse, touch, pen and keys put down, move and lift.

import { svg } from "./dom.js";

const STEP_MM = 1; // of an arrow key; with Shift a pitch
const TAP_MM = 1.5; // a finger that moves less between press and release was tapped, and is lifted
const MOST = 10; // fingers

const PUT = ["Enter", " "];
const LIFT = ["Delete", "Backspace"];
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Fingers {
  all = []; // each with x_mm, y_mm, radius_mm, force_n and its element
  selected = null;
  keep = true; // fingers stay when they are let go
  #svg;
  #ground;
  #kit;
  #make;
  #changed;
  #held = new Map(); // pointer to finger, offset and start

  // On the SVG element of a sheet, drawn in its group `ground`. `make` gives size and force of a new finger; `changed`
  // is called when something about fingers is.
  constructor(element, ground, kit, make, changed) {
    this.#svg = element;
    this.#ground = ground;
    this.#kit = kit;
    this.#make = make;
    this.#changed = changed;
    this.#listen();
  }

  put(x_mm, y_mm) {
    if (this.all.length === MOST) this.lift(this.all[0]);
    const circles = ["skin", "tip"].map((name) => svg("circle", { class: name }));
    const element = svg("g", { tabindex: 0, role: "img" }, ...circles);
    const finger = { ...this.#make(), x_mm, y_mm, element };
    element.addEventListener("focus", () => this.select(finger));
    this.all.push(finger);
    this.#ground.append(element);
    this.select(finger);
    this.move(finger, x_mm, y_mm);
    return finger;
  }

  select(finger) {
    this.selected = finger;
    for (const one of this.all) one.element.classList.toggle("selected", one === finger);
    this.#changed();
  }

  move(finger, x_mm, y_mm) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const within = (value, count) => Math.min(Math.max(value, -pitch / 2), (count - 0.5) * pitch);
    Object.assign(finger, { x_mm: within(x_mm, columns), y_mm: within(y_mm, rows) });
    this.shape(finger);
  }

  // Draw a finger whose place, size or force has changed.
  shape(finger) {
    const { x_mm, y_mm, radius_mm, force_n, element } = finger;
    element.setAttribute("transform", `translate(${x_mm} ${y_mm})`);
    element.firstChild.setAttribute("r", radius_mm);
    element.lastChild.setAttribute("r", radius_mm * Math.min(1, 0.25 + force_n / 14));
    const [x, y, force] = [x_mm, y_mm, force_n].map((value) => value.toFixed(1));
    element.setAttribute("aria-label", `Finger at x ${x} mm, y ${y} mm, ${force} N`);
    this.#changed();
  }

  lift(finger) {
    const focused = finger.element === document.activeElement;
    finger.element.remove();
    this.all = this.all.filter((one) => one !== finger);
    if (this.selected === finger) this.select(this.all.at(-1) ?? null);
    if (focused) (this.selected?.element ?? this.#svg).focus();
    this.#changed();
  }

  liftAll() {
    this.#held.clear();
    for (const finger of [...this.all]) this.lift(finger);
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
    const there = this.all.findLast((finger) => Math.hypot(finger.x_mm - x, finger.y_mm - y) <= finger.radius_mm);
    const finger = there ?? this.put(x, y);
    finger.element.focus({ preventScroll: true });
    this.#held.set(event.pointerId, {
      finger,
      fresh: !there,
      from: [x, y],
      offset: [finger.x_mm - x, finger.y_mm - y],
      moved: false,
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
    const finger = this.selected;
    const step = event.shiftKey ? pitch : STEP_MM;
    if (PUT.includes(event.key)) this.put(((columns - 1) * pitch) / 2, ((rows - 1) * pitch) / 2).element.focus();
    else if (finger && LIFT.includes(event.key)) this.lift(finger);
    else if (finger && ARROWS[event.key]) {
      const [right, down] = ARROWS[event.key];
      this.move(finger, finger.x_mm + right * step, finger.y_mm + down * step);
    } else return;
    event.preventDefault();
  }
}
