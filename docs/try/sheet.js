// The sheet of switches, drawn in mm. Column 0 and row 0 meet at (0, 0), as in everything that the board says.

import { svg } from "./dom.js";
import { groups, outline, same } from "./zones.js";

export class Sheet {
  cut = []; // lines: kind, row, column
  #kit;
  #svg;
  #caps;
  #layers;

  constructor(element, kit) {
    this.#svg = element;
    this.#kit = kit;
    this.#draw();
  }

  // Where fingers are drawn.
  get ground() {
    return this.#layers.fingers;
  }

  #draw() {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const width = columns * pitch;
    const height = rows * pitch;
    const edge = pitch / 2;
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
      const x = (cell % columns) * pitch - side / 2;
      const y = Math.floor(cell / columns) * pitch - side / 2;
      return svg("rect", { x, y, width: side, height: side, rx: 0.8 });
    });
    this.#layers.caps.append(...this.#caps);
  }

  #drawLabels(width, height, edge) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    const text = (x, y, what, name) => svg("text", { x, y, class: name }, String(what));
    const add = (...elements) => this.#layers.labels.append(...elements);
    for (let row = 0; row < rows; row++) add(text(-edge - 3.2, row * pitch, row, "row"));
    for (let column = 0; column < columns; column++) add(text(column * pitch, -edge - 3.2, column, "column"));
    add(text(-edge - 3.2, -edge - 3.2, "row\u00a0col", "corner"));
    for (let mm = 0; mm <= width - edge; mm += 20) {
      add(
        svg("path", { d: `M${mm} ${height - edge + 1.6}v1.4M${width - edge + 1.6} ${mm}h1.4` }),
        text(mm, height - edge + 5, mm || "0 mm", "mm"),
        text(width - edge + 5.4, mm, mm, "mm"),
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
      return zone
        ? [svg("path", { d: outline(group, columns), class: `zone-${zone.color}`, transform: `scale(${pitch})` })]
        : [];
    });
    this.#layers.outlines.replaceChildren(...paths);
  }

  // Lines that are cut, and in slow motion the row that is driven, whose columns may be sampled just now.
  lines(row = null, sampled = false) {
    const cuts = this.cut.flatMap((line) => cutLine(line, this.#kit));
    this.#layers.wires.replaceChildren(...this.#band(row, sampled), ...cuts);
    const labels = this.#layers.labels.querySelectorAll(".row");
    labels.forEach((label, index) => label.classList.toggle("driven", index === row));
  }

  #band(row, sampled) {
    const { rows, columns, pitch_mm: pitch } = this.#kit;
    if (row === null || row >= rows) return [];
    const place = { x: -pitch / 2, y: (row - 0.5) * pitch, width: columns * pitch, height: pitch };
    return [svg("rect", { ...place, class: sampled ? "row sampled" : "row" })];
  }
}

function mark({ x_mm, y_mm, color, number }) {
  const label = svg("text", { x: x_mm, y: y_mm }, String(number));
  return svg("g", { class: `zone-${color}` }, svg("circle", { cx: x_mm, cy: y_mm, r: 2.3 }), label);
}

// A line up to where it is cut, and what is cut off, which the board no longer reaches.
function cutLine({ row, column, kind }, { rows, columns, pitch_mm: pitch }) {
  const edge = pitch / 2;
  const [along, line, cut, end] = kind === "row" ? ["H", row, column, columns] : ["V", column, row, rows];
  const place = (mm) => (kind === "row" ? `M${mm} ${line * pitch}` : `M${line * pitch} ${mm}`);
  const to = cut * pitch - edge;
  return [
    svg("path", { d: `${place(-edge)}${along}${to - 1}`, class: "whole" }),
    svg("path", { d: `${place(to + 1)}${along}${end * pitch - edge}`, class: "cut" }),
  ];
}
