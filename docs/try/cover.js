// Which switches close under fingers: tiles, that is foam cut between rigid caps that stand proud of the sheet. Each
// cap takes what presses on its tile, one pitch wide. contactfpga.design.cover.cells and layers are the same for any
// cover and body, with the reasons.

const STEPS = 384; // pressures in the table, from 1e-6 to 1e4 of the softest modulus
const SHARES = 32; // steps of a patch's pressure from its rim to its middle

// Layers in series by the pressure that they share. What couples foam sideways makes small patches stiffer.
class Layers {
  #depths = [0];
  #pressures = [0];
  #integrals = [0];
  #couplings = [0];

  constructor({ layers, springs, coupling }) {
    const softest = Math.min(...layers.map(([, modulus]) => modulus));
    for (let k = 0; k < STEPS; k++) {
      const pressure = softest * 10 ** (-6 + (10 * k) / (STEPS - 1));
      const soft = layers.map(([thickness, modulus]) => (thickness * pressure) / (modulus + pressure));
      const coupled = layers.map(([thickness, , foam], i) => (foam ? thickness ** 2 * soft[i] : 0));
      const give = springs.map(([stiffness, travel]) => Math.min(pressure / stiffness, travel));
      const depth = [...soft, ...give].reduce((sum, one) => sum + one, 0);
      const mean = (pressure + this.#pressures[k]) / 2;
      this.#integrals.push(this.#integrals[k] + (depth - this.#depths[k]) * mean);
      this.#depths.push(depth);
      this.#pressures.push(pressure);
      this.#couplings.push(coupling * coupled.reduce((sum, one) => sum + one, 0));
    }
  }

  pressure(depth) {
    return between(this.#depths, this.#pressures, depth);
  }

  // Where a round finger with this force comes that has its radius at the depth `full`; all in m and N.
  depth(force, radius, full) {
    const forces = this.#depths.map((depth, k) => {
      const more = k ? 1 + this.#couplings[k] / (((radius * radius) / full) * depth ** 2) : 1;
      return ((Math.PI * radius * radius) / full) * this.#integrals[k] * more;
    });
    return between(forces, this.#depths, force);
  }
}

// A table's value at a place within it.
function between(places, values, place) {
  let [low, high] = [0, places.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (places[middle] <= place) low = middle;
    else high = middle;
  }
  return values[low] + ((values[high] - values[low]) * (place - places[low])) / (places[high] - places[low]);
}

export class Tiles {
  #kit;
  #layers;
  #step; // of the grid on which pressure is resolved, in mm
  #edge = 1; // pitches of the grid beyond the sheet, on each side

  // `kit`: rows, columns, pitch_mm, parts (grid steps per pitch), thresholds_n (closing force of each switch, row by
  // row), hysteresis (the share of it by which the force must fall again), layers and springs of tile, finger and
  // switch, and depth_m, at which a finger has its radius.
  constructor(kit) {
    this.#kit = kit;
    this.#layers = new Layers(kit);
    this.#step = kit.pitch_mm / kit.parts;
  }

  // 0 or 1 for each switch, row by row. A finger has x_mm, y_mm, radius_mm and force_n; `before`: the last answer.
  closed(fingers, before) {
    const { thresholds_n, hysteresis } = this.#kit;
    return this.forces(fingers).map((force, cell) => {
      const threshold = thresholds_n[cell] * (before[cell] ? 1 - hysteresis : 1);
      return force >= threshold ? 1 : 0;
    });
  }

  // Force on each switch in N.
  forces(fingers) {
    const forces = new Array(this.#kit.rows * this.#kit.columns).fill(0);
    for (const finger of fingers) this.#add(finger, forces);
    return forces;
  }

  // The patch grows as the root of the depth. Its pressure is that of the depth times 1 - (r / radius)^2.
  #add({ x_mm, y_mm, radius_mm: full_mm, force_n }, forces) {
    const { rows, columns, parts, depth_m } = this.#kit;
    const depth = this.#layers.depth(force_n, full_mm * 1e-3, depth_m);
    const radius_mm = full_mm * Math.sqrt(depth / depth_m);
    const profile = Array.from({ length: SHARES + 1 }, (_, k) => this.#layers.pressure((depth * k) / SHARES));
    const across = this.#span(x_mm, radius_mm, columns);
    const down = this.#span(y_mm, radius_mm, rows);
    const shares = new Array(forces.length).fill(0);
    let total = 0;
    for (let j = down.first; j < down.end; j++) {
      const v = (this.#place(j) - y_mm) / radius_mm;
      const row = Math.floor(j / parts) - this.#edge;
      for (let i = across.first; i < across.end; i++) {
        const u = (this.#place(i) - x_mm) / radius_mm;
        const column = Math.floor(i / parts) - this.#edge;
        const at = SHARES * Math.max(0, 1 - u * u - v * v);
        const k = Math.min(SHARES - 1, Math.floor(at));
        const share = profile[k] + (profile[k + 1] - profile[k]) * (at - k);
        total += share;
        if (row >= 0 && row < rows && column >= 0 && column < columns) shares[row * columns + column] += share;
      }
    }
    // What lies on the grid is all of the finger's force, but for one that reaches beyond it.
    const mean = profile.reduce((sum, one, k) => sum + one * (k % SHARES ? 1 : 0.5), 0) / SHARES;
    if (!across.whole || !down.whole) total = (mean * Math.PI * radius_mm ** 2) / this.#step ** 2;
    shares.forEach((share, cell) => (forces[cell] += (force_n * share) / total));
  }

  #place(index) {
    return (index + 0.5) * this.#step - (this.#edge + 0.5) * this.#kit.pitch_mm;
  }

  // The steps of the grid that something of this middle and reach covers, and whether all of it lies on the grid.
  #span(middle, reach, count) {
    const steps = (count + 2 * this.#edge) * this.#kit.parts;
    const first = Math.floor((middle - reach - this.#place(0)) / this.#step);
    const end = Math.ceil((middle + reach - this.#place(0)) / this.#step) + 1;
    const whole = middle - reach >= this.#place(0) && middle + reach <= this.#place(steps - 1);
    return { first: Math.max(0, first), end: Math.min(steps, end), whole };
  }
}
