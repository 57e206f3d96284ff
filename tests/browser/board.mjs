// The page's board under Node: node board.mjs BOARD DECODER KIT < JSON lines; a JSON line comes back for each of them.
//   {"frames": [[0, 1, ...], ...], "cycles": n}   press each for so long: {"bytes": hex, "cycle": n}
//   {"cut": [rows, columns], "stick": columns}    lines as Board.cut and Board.stick take them: {}
// At the end a line of all that the page's decoder read in these bytes.

import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { Board } from "../../docs/try/board.js";
import { Decoder, FAULTS, FRAME } from "../../docs/try/decoder.js";
import { load } from "../../docs/try/wasm.js";

const [board, decoder, kit] = process.argv.slice(2);
const runs = new Board(await load(readFileSync(board)), JSON.parse(kit));
const reads = new Decoder(await load(readFileSync(decoder)));
const frames = [];
const faults = [];

function run({ frames: pressed, cycles }) {
  for (const cells of pressed) {
    runs.press(cells);
    runs.run(cycles);
  }
  const bytes = runs.take("received").map(({ data }) => data);
  for (const byte of bytes) {
    const what = reads.push(byte);
    if (what === FRAME) frames.push(reads.frame());
    if (what === FAULTS) faults.push(reads.faults());
  }
  return { bytes: Buffer.from(bytes).toString("hex"), cycle: runs.cycle };
}

for await (const line of createInterface({ input: process.stdin })) {
  const asked = JSON.parse(line);
  if (asked.cut) runs.cut(...asked.cut);
  if (asked.stick) runs.stick(asked.stick);
  console.log(JSON.stringify(asked.frames ? run(asked) : {}));
}
console.log(JSON.stringify({ frames, faults }));
