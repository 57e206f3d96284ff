// The page: fingers close switches through the cover, the board runs, and what it says is shown.

import { Tiles } from "./cover.js";
import { at } from "./dom.js";
import { Fingers } from "./fingers.js";
import { Machine } from "./machine.js";
import { showFrame, showPackets, showPins, showReport, showZones } from "./panels.js";
import { Replay } from "./replay.js";
import { Sheet } from "./sheet.js";
import { times } from "./text.js";
import { load } from "./wasm.js";
import { numbered } from "./zones.js";

const BUSY_MS = 7; // of each picture's time, for the board
const IDLE_MS = 2; // the same, after IDLE_AFTER_MS without anything new
const IDLE_AFTER_MS = 3000;
const START = 24_000; // clocks in which the board says hello and sends its first frames
const STEP = 2503; // clocks; no multiple of a scan's, so that touches fall anywhere in one
const KEY_STEPS = 5; // of a slider, for a key

const kit = JSON.parse(at("kit").textContent);

async function embedded(id) {
  const packed = Uint8Array.from(atob(at(id).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return load(await new Response(stream).arrayBuffer());
}

const machine = new Machine(await embedded("board-wasm"), await embedded("decoder-wasm"), kit);
const tiles = new Tiles(kit);
const sheet = new Sheet(at("sheet"), kit);
const replay = new Replay(sheet, kit);
const fingers = new Fingers(at("sheet"), sheet.ground, kit, sliders, touched);
let closed = new Array(kit.rows * kit.columns).fill(0); // switches

// ---- what the user does ----

// Size and force of a new finger.
function sliders() {
  return { radius_mm: at("size").value / 2, force_n: Number(at("force").value) };
}

function touched() {
  const { selected } = fingers;
  if (selected) [at("size").value, at("force").value] = [2 * selected.radius_mm, selected.force_n];
  at("size-value").textContent = `${Number(at("size").value)} mm`;
  at("force-value").textContent = `${Number(at("force").value).toFixed(1)} N`;
  replay.leave();
  close();
}

function close() {
  const now = tiles.closed(fingers.all, closed);
  if (broken.stuck) now[broken.stuck.row * kit.columns + broken.stuck.column] = 1;
  if (now.some((on, cell) => on !== closed[cell])) machine.press((closed = now));
}

function resize() {
  if (fingers.selected) fingers.shape(Object.assign(fingers.selected, sliders()));
  else touched();
}

at("size").addEventListener("input", resize);
at("force").addEventListener("input", resize);
at("keep").addEventListener("change", () => (fingers.keep = at("keep").checked));
at("lift").addEventListener("click", () => fingers.liftAll());
at("add").addEventListener("click", () => {
  const place = (count) => (0.15 + 0.7 * Math.random()) * (count - 1) * kit.pitch_mm;
  fingers.put(place(kit.columns), place(kit.rows));
});

const KEYS = {
  "+": ["force", "stepUp"],
  "=": ["force", "stepUp"],
  "-": ["force", "stepDown"],
  "]": ["size", "stepUp"],
  "[": ["size", "stepDown"],
};

document.addEventListener("keydown", ({ key, target }) => {
  if (target.matches("input:not([type=range])")) return;
  if (key === "Escape") fingers.liftAll();
  if (!KEYS[key]) return;
  const [slider, step] = KEYS[key];
  at(slider)[step](KEY_STEPS);
  resize();
});

// ---- what the user breaks ----

const broken = { row: null, column: null, short: null, stuck: null }; // each with kind, row and column, once it is

at("faults").addEventListener("click", ({ target }) => {
  const kind = target.dataset.fault;
  if (!kind) return;
  broken[kind] = broken[kind] ? null : { kind, row: line("row"), column: line("column") };
  target.classList.toggle("broken", Boolean(broken[kind]));
  target.dataset.breaks ??= target.textContent;
  target.textContent = broken[kind] ? target.dataset.mends : target.dataset.breaks;
  const { row, column, short } = broken;
  machine.board.cut(row ? [[row.row, row.column]] : [], column ? [[column.column, column.row]] : []);
  machine.board.stick(short ? [short.column] : []);
  sheet.cut = [row, column].filter(Boolean);
  sheet.lines();
  touched();
});

function line(id) {
  return Math.min(Math.max(Math.round(Number(at(id).value)) || 0, 0), Number(at(id).max));
}

// ---- the loop ----

let zones = []; // that are shown, each with its number and color
let pace = 0; // cycles in a second of the clock on the wall, smoothed
let before = performance.now();
let drawn = ""; // what is
let news = before; // when that changed

function tick(now) {
  requestAnimationFrame(tick);
  if (replay.on) {
    replay.tick(now);
    drawn = "";
  } else {
    run(now);
    draw();
  }
  before = now;
}

// Run the board for a part of the picture's time, and never ahead of the clock on the wall.
function run(now) {
  const busy = now - news < IDLE_AFTER_MS;
  const until = performance.now() + (busy ? BUSY_MS : IDLE_MS);
  const from = machine.cycle;
  const passed_s = Math.max(now - before, 1) / 1e3;
  while (performance.now() < until && machine.cycle - from < passed_s * kit.clock_hz) machine.run(STEP);
  if (busy) pace += 0.05 * ((machine.cycle - from) / passed_s - pace);
}

function draw() {
  const { frame, faults, read, packets, touch } = machine;
  showPins(machine, kit);
  const slower = kit.clock_hz / pace;
  at("pace").textContent =
    slower < 1.2 ? "It runs in real time." : `Your browser runs it ${times(slower)} times slower.`;
  const now = JSON.stringify([frame.zones, faults, read, closed, packets[0].cycle, broken]);
  if (now === drawn) return;
  drawn = now;
  news = performance.now();
  zones = numbered(frame.zones, zones);
  sheet.show(read, closed, zones);
  showZones(zones, frame.count, kit);
  showFrame(frame, kit);
  showPackets(packets, kit);
  showReport(faults, sheet.cut, Boolean(broken.stuck));
  if (touch) replay.show(touch, zones);
}

at("log").open = matchMedia("(min-width: 75rem)").matches;
machine.run(START);
fingers.put(32, 42);
machine.run(8 * kit.frame_clocks);
draw();
performance.mark("ready");
document.documentElement.dataset.ready = "true";
requestAnimationFrame(tick);
