// What the board says, written into the page.

import { at, html } from "./dom.js";
import { hex, us } from "./text.js";

// Zones with their numbers and colors; `count`: as many as the board counted.
export function showZones(zones, count, { pitch_mm }) {
  at("headline").textContent = ["Nothing touches it", "One contact"][count] ?? `${count} contacts`;
  const rows = zones.map(({ number, color, area, x_mm, y_mm }) => {
    const numbers = [(area * pitch_mm ** 2).toFixed(0), x_mm.toFixed(1), y_mm.toFixed(1), area];
    const name = html("td", { className: `zone-${color}` }, `#${number}`);
    return html("tr", {}, name, ...numbers.map((text) => html("td", {}, text)));
  });
  at("zones").tBodies[0].replaceChildren(...rows);
}

export function showPins(machine, kit) {
  const alive = machine.cycle - machine.turned < kit.clock_hz / 500;
  const safe = machine.faults.length && !machine.frame.cells;
  pin("contact", machine.contact, machine.contact ? (safe ? "high: fail-safe" : "high") : "low");
  pin("alive", alive, alive ? "turns each ms" : "stopped");
  if (machine.contact_cycles !== null) at("to-pin").textContent = us(machine.contact_cycles, kit);
  if (machine.touch) at("to-byte").textContent = us(machine.touch.last - machine.touch.start, kit);
}

function pin(id, on, says) {
  at(id).classList.toggle("on", on);
  at(id).lastElementChild.textContent = says;
}

// The bytes of a frame, each underlined by what it is.
export function showFrame({ bytes, zones }, { record_bytes }) {
  const records = zones.length * record_bytes;
  at("frame").replaceChildren(
    ...bytes.map((byte, index) => html("span", { className: part(index, bytes.length, records) }, hex(byte))),
  );
}

// A frame is a byte of framing, the zones' records, time and counts, three check bytes and a zero byte.
function part(index, length, records) {
  if (index === 0 || index === length - 1) return "stuffing";
  if (index <= records) return "zone";
  return index >= length - 4 ? "check" : "trailer";
}

export function showPackets(packets, { clock_hz }) {
  const items = packets.map(({ cycle, kind, bytes, content }) => {
    const when = `${((cycle / clock_hz) * 1e3).toFixed(3)} ms`;
    return html("li", {}, `${when}, ${kind}: ${SAYS[kind](content)} `, html("code", {}, bytes.map(hex).join(" ")));
  });
  at("packets").replaceChildren(...items);
}

const SAYS = {
  hello: ({ rows, columns, pitch_mm }) => `${rows}×${columns} switches, ${pitch_mm} mm apart`,
  faults: (faults) => faults.join("; ") || "all lines are whole",
  frame: ({ count, cells }) => `zones: ${count}, switches: ${cells}`,
};

// What the board reports of its lines, and what was broken: cuts, and whether a switch is jammed.
export function showReport(faults, cuts, jammed) {
  const said = faults.length ? [`The board reports: ${faults.join("; ")}.`] : [];
  if (jammed) said.push("The jammed switch reads as a touch: the board cannot tell it from a finger.");
  at("report").textContent = said.join(" ") || "The board reports: all lines are whole.";
  at("report").classList.toggle("bad", said.length > 0);
  at("cuts").textContent = cuts.map(cutOff).join(" ");
}

function cutOff({ kind, row, column }) {
  return kind === "row"
    ? `Row ${row} is cut before column ${column}: what is pressed beyond no longer reaches the board.`
    : `Column ${column} is cut before row ${row}: what is pressed below no longer reaches the board.`;
}
