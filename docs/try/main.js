// The page: fingers close switches through the cover, the board runs, and what it says is shown.

import { Machine } from "./machine.js";
import { COLORS, Sheet } from "./sheet.js";
import { Tiles } from "./cover.js";
import { Timeline, hex } from "./timeline.js";
import { load } from "./wasm.js";

const BUSY_MS = 7, IDLE_MS = 2; // of each picture's time, for the board
const IDLE_AFTER_MS = 3000; // without anything new
const START = 24_000; // clocks in which the board says hello and sends its first frames
const STEP = 2503; // clocks; no multiple of a scan's, so that touches fall anywhere in one
const SAME_MM = 15; // a zone that was no farther away in the picture before is the same one
const PLAY_S = 14; // for a touch in slow motion

const at = (id) => document.getElementById(id);
const kit = JSON.parse(at("kit").textContent);

async function embedded(id) {
  const packed = Uint8Array.from(atob(at(id).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return load(await new Response(stream).arrayBuffer());
}

const machine = new Machine(await embedded("board-wasm"), await embedded("decoder-wasm"), kit);
const tiles = new Tiles(kit);
const timeline = new Timeline(at("timeline"), kit);
let closed = new Array(kit.rows * kit.columns).fill(0);
let shown = []; // zones, each with its number and color
const jammed = new Set();

// ---- fingers ----

const sheet = new Sheet(at("sheet"), kit, () => ({ radius_mm: at("size").value / 2, force_n: Number(at("force").value) }), touched);

function touched() {
  const { selected } = sheet;
  if (selected) [at("size").value, at("force").value] = [2 * selected.radius_mm, selected.force_n];
  at("size-value").textContent = `${Number(at("size").value)} mm`;
  at("force-value").textContent = `${Number(at("force").value).toFixed(1)} N`;
  live();
  const now = tiles.closed(sheet.fingers, closed).map((on, cell) => (on || jammed.has(cell) ? 1 : 0));
  if (now.some((on, cell) => on !== closed[cell])) machine.press((closed = now));
}

function resize() {
  const { selected } = sheet, radius_mm = at("size").value / 2, force_n = Number(at("force").value);
  if (selected) sheet.shape(Object.assign(selected, { radius_mm, force_n }));
  else touched();
}

at("size").addEventListener("input", resize);
at("force").addEventListener("input", resize);
at("keep").addEventListener("change", () => (sheet.keep = at("keep").checked));
at("lift").addEventListener("click", () => sheet.liftAll());
at("add").addEventListener("click", () => {
  const place = (count) => (0.15 + 0.7 * Math.random()) * (count - 1) * kit.pitch_mm;
  sheet.put(place(kit.columns), place(kit.rows));
});

document.addEventListener("keydown", (event) => {
  if (event.target.matches("input:not([type=range])")) return;
  const change = { "+": ["force", 1], "=": ["force", 1], "-": ["force", -1], "]": ["size", 1], "[": ["size", -1] }[event.key];
  if (event.key === "Escape") sheet.liftAll();
  if (!change) return;
  for (let step = 0; step < 5; step++) at(change[0])[change[1] > 0 ? "stepUp" : "stepDown"]();
  resize();
});

// ---- faults ----

const broken = { row: null, column: null, short: null, stuck: null };

function breakLines() {
  const cuts = [broken.row, broken.column].filter(Boolean);
  const of = (kind, line, end) => new Map(cuts.filter((cut) => cut.kind === kind).map((cut) => [cut[line], cut[end]]));
  machine.board.cut(of("row", "row", "column"), of("column", "column", "row"));
  machine.board.stick(broken.short ? [broken.short.column] : []);
  jammed.clear();
  if (broken.stuck) jammed.add(broken.stuck.row * kit.columns + broken.stuck.column);
  sheet.cut = cuts;
  sheet.lines();
  touched();
}

at("faults").addEventListener("click", ({ target }) => {
  const kind = target.dataset.fault;
  if (!kind) return;
  broken[kind] = broken[kind] ? null : { kind, row: line("row"), column: line("column") };
  target.setAttribute("aria-pressed", String(Boolean(broken[kind])));
  breakLines();
});

function line(id) {
  return Math.min(Math.max(Math.round(Number(at(id).value)) || 0, 0), Number(at(id).max));
}

// ---- what is said ----

const us = (cycles) => `${((cycles / kit.clock_hz) * 1e6).toFixed(1)} µs`;
const cell = (text) => Object.assign(document.createElement("td"), { textContent: text });

// Zones of a frame, numbered: one that is near to where it was keeps its number.
function numbered(zones) {
  const before = [...shown];
  const found = zones.map((zone) => {
    const away = (one) => Math.hypot(one.x_mm - zone.x_mm, one.y_mm - zone.y_mm);
    const nearest = before.sort((one, other) => away(one) - away(other))[0];
    return nearest && away(nearest) < SAME_MM ? { ...zone, number: before.shift().number } : { ...zone };
  });
  for (const zone of found) zone.number ??= Math.min(...free(found));
  return found.map((zone) => ({ ...zone, color: (zone.number - 1) % COLORS })).sort((one, other) => one.number - other.number);
}

function free(zones) {
  return zones.map((_, index) => index + 1).filter((number) => zones.every((zone) => zone.number !== number));
}

function showZones() {
  const { frame, read } = machine, area = kit.pitch_mm ** 2;
  shown = numbered(frame.zones);
  sheet.show(read, closed, shown);
  at("headline").textContent = ["Nothing touches it", "One contact"][frame.count] ?? `${frame.count} contacts`;
  at("zones").tBodies[0].replaceChildren(...shown.map((zone) => {
    const row = document.createElement("tr"), name = cell(`#${zone.number}`);
    name.className = `zone-${zone.color}`;
    row.append(name, cell((zone.area * area).toFixed(0)), cell(zone.x_mm.toFixed(1)), cell(zone.y_mm.toFixed(1)), cell(zone.area));
    return row;
  }));
}

function showPins() {
  const alive = machine.cycle - machine.turned < kit.clock_hz / 500;
  pin("contact", machine.contact, machine.contact ? (machine.faults.length && !machine.frame?.cells ? "high: fail-safe" : "high") : "low");
  pin("alive", alive, alive ? "turns each ms" : "stopped");
  if (machine.contact_cycles !== null) at("to-pin").textContent = us(machine.contact_cycles);
  if (machine.touch) at("to-byte").textContent = us(machine.touch.last - machine.touch.start);
}

function pin(id, on, says) {
  at(id).classList.toggle("on", on);
  at(id).lastElementChild.textContent = says;
}

// A frame: a byte of framing, a record for each zone, time and counts, three check bytes and the zero byte at its end.
function showFrame({ bytes, zones }) {
  const parts = bytes.map((byte, index) => {
    const kind = index === 0 || byte === 0 ? "stuffing" : index <= zones.length * kit.record_bytes ? "zone"
      : index >= bytes.length - 4 ? "check" : "trailer";
    return Object.assign(document.createElement("span"), { className: kind, textContent: hex(byte) });
  });
  at("frame").replaceChildren(...parts);
}

function showPackets() {
  at("packets").replaceChildren(...machine.packets.map(({ cycle, kind, bytes, content }) => {
    const item = document.createElement("li");
    const text = kind === "hello" ? `${content.rows}×${content.columns} switches, ${content.pitch_mm} mm apart`
      : kind === "faults" ? content.join("; ") || "all lines are whole" : `zones: ${content.count}, switches: ${content.cells}`;
    const raw = Object.assign(document.createElement("code"), { textContent: bytes.map(hex).join(" ") });
    item.append(`${((cycle / kit.clock_hz) * 1e3).toFixed(3)} ms, ${kind}: ${text} `, raw);
    return item;
  }));
}

function showReport() {
  const named = machine.faults.map((fault) => `The board reports: ${fault}.`);
  if (broken.stuck) named.push("The jammed switch reads as a touch: the board cannot tell it from a finger. Over time, `doctor --watch` can.");
  at("report").textContent = named.join(" ") || "The board reports: all lines are whole.";
  at("report").classList.toggle("bad", named.length > 0);
  at("cuts").textContent = [broken.row, broken.column].filter(Boolean).map(cutOff).join(" ");
}

function cutOff({ kind, row, column }) {
  return kind === "row"
    ? `Row ${row} is cut before column ${column}: what is pressed beyond no longer reaches the board.`
    : `Column ${column} is cut before row ${row}: what is pressed below no longer reaches the board.`;
}

// ---- slow motion ----

const still = matchMedia("(prefers-reduced-motion: reduce)");
let playing = null; // when it began, in ms

function look(cycle) {
  timeline.at(cycle);
  const { row, sampled, read, said } = timeline.moment;
  const { touch } = timeline;
  sheet.lines(row, sampled);
  sheet.show(read, touch.cells, cycle >= touch.last ? shown : []);
  at("cursor").value = timeline.cycle - touch.start;
  at("moment").textContent = `${us(timeline.cycle - touch.start)}: ${said}`;
  at("live").hidden = false;
  const scroll = at("timeline").parentElement;
  scroll.scrollLeft = ((timeline.cycle - touch.start) / (touch.last - touch.start)) * (scroll.scrollWidth - scroll.clientWidth);
}

// Show what is, not what was.
function live() {
  if (at("live").hidden) return;
  at("live").hidden = true;
  stop();
  sheet.lines();
  tellTouch();
}

function stop() {
  playing = null;
  at("play").textContent = "Play";
}

function play(now) {
  const { start, last } = timeline.touch;
  const cycle = start + ((now - playing) / 1e3 / PLAY_S) * (last - start);
  look(still.matches ? timeline.stops.findLast((stop) => stop <= cycle) : cycle); // from event to event for who wants no motion
  if (cycle >= last) stop();
}

at("play").addEventListener("click", () => {
  if (playing !== null) return stop();
  if (!timeline.touch) return;
  const { start, last } = timeline.touch, from = timeline.cycle < last ? timeline.cycle : start;
  playing = performance.now() - ((from - start) / (last - start)) * PLAY_S * 1e3;
  at("play").textContent = "Pause";
});
at("next").addEventListener("click", () => step((stops) => stops.find((cycle) => cycle > timeline.cycle)));
at("back").addEventListener("click", () => step((stops) => stops.findLast((cycle) => cycle < timeline.cycle)));
at("cursor").addEventListener("input", () => {
  stop();
  if (timeline.touch) look(timeline.touch.start + Number(at("cursor").value));
});
at("live").addEventListener("click", live);
new ResizeObserver(() => timeline.draw()).observe(at("timeline"));

function step(find) {
  stop();
  const cycle = timeline.touch && find(timeline.stops);
  if (cycle !== undefined && cycle !== null) look(cycle);
}

function tellTouch() {
  const { start, last } = timeline.touch, slower = (PLAY_S * kit.clock_hz) / (last - start);
  at("moment").textContent = `From the switches to the last byte in ${us(last - start)}. Play shows it ${slower.toLocaleString("en", { maximumSignificantDigits: 2 })} times slower.`;
}

function showTouch() {
  if (!machine.touch || machine.touch === timeline.touch) return;
  timeline.show(machine.touch);
  tellTouch();
  at("cursor").max = machine.touch.last - machine.touch.start;
  at("cursor").value = at("cursor").max;
}

// ---- the loop ----

let pace = 0; // cycles per second of the clock on the wall, smoothed
let before = performance.now();
let drawn = "";
let news = before; // when something new was drawn

function tick(now) {
  requestAnimationFrame(tick);
  if (!at("live").hidden) {
    if (playing !== null) play(now);
    before = now;
    return;
  }
  const busy = now - news < IDLE_AFTER_MS, until = performance.now() + (busy ? BUSY_MS : IDLE_MS);
  const from = machine.cycle, passed_s = Math.max(now - before, 1) / 1e3;
  while (performance.now() < until && machine.cycle - from < passed_s * kit.clock_hz) machine.run(STEP);
  if (busy) pace += 0.05 * ((machine.cycle - from) / passed_s - pace);
  before = now;
  draw();
}

function draw() {
  showPins();
  const slower = kit.clock_hz / pace;
  at("pace").textContent = slower < 1.2 ? "It runs in real time." : `Your browser runs it ${slower < 10 ? slower.toFixed(1) : Math.round(slower)} times slower.`;
  const now = JSON.stringify([machine.frame.zones, machine.faults, machine.read, closed, machine.packets[0].cycle, broken]);
  if (now === drawn) return;
  drawn = now;
  news = performance.now();
  showZones();
  showFrame(machine.frame);
  showPackets();
  showReport();
  showTouch();
}

at("log").open = matchMedia("(min-width: 75rem)").matches;
machine.run(START);
sheet.put(32, 42);
machine.run(8 * kit.frame_clocks);
draw();
performance.mark("ready");
document.documentElement.dataset.ready = "true";
requestAnimationFrame(tick);
