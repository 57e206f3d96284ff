// Touches of the page's machine under Node: node touches.mjs BOARD DECODER KIT < JSON of [gap, cells, hold] triples;
// writes for each the cycles of the touch, of the pin and of the last byte.

import { readFileSync } from "node:fs";
import { Machine } from "../../docs/try/machine.js";
import { load } from "../../docs/try/wasm.js";

const [board, decoder, kit] = process.argv.slice(2);
const machine = new Machine(await load(readFileSync(board)), await load(readFileSync(decoder)), JSON.parse(kit));
const seen = JSON.parse(readFileSync(0)).map(([gap, cells, hold]) => {
  machine.run(gap);
  machine.press(cells);
  machine.run(hold);
  const { start, contact, last } = machine.touch;
  machine.press(cells.map(() => 0));
  machine.run(hold);
  return [start, contact, last];
});
console.log(JSON.stringify(seen));
