// The page's cover under Node: node tiles.mjs KIT < JSON of [fingers, closed before] pairs; writes [forces, closed]
// pairs.

import { readFileSync } from "node:fs";
import { Tiles } from "../../docs/try/cover.js";

const tiles = new Tiles(JSON.parse(process.argv[2]));
const pairs = JSON.parse(readFileSync(0));
console.log(JSON.stringify(pairs.map(([fingers, before]) => [tiles.forces(fingers), tiles.closed(fingers, before)])));
