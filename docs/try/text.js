// How numbers are written.

export function hex(byte) {
  return byte.toString(16).padStart(2, "0");
}

export function us(cycles, { clock_hz }) {
  return `${((cycles / clock_hz) * 1e6).toFixed(1)} µs`;
}

// How many times slower, in two digits.
export function times(slower) {
  return slower.toLocaleString("en", { maximumSignificantDigits: 2 });
}
