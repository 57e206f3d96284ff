// Slow motion: plays a touch on the timeline and on the sheet.

import { at } from "./dom.js";
import { times, us } from "./text.js";
import { Timeline } from "./timeline.js";

const PLAY_S = 14; // for a touch

export class Replay {
  #timeline;
  #sheet;
  #kit;
  #zones = []; // that the touch was told as
  #since = null; // when it began to play, in ms
  #still = matchMedia("(prefers-reduced-motion: reduce)");

  constructor(sheet, kit) {
    this.#sheet = sheet;
    this.#kit = kit;
    this.#timeline = new Timeline(at("timeline"), kit);
    at("play").addEventListener("click", () => (this.#since === null ? this.#play() : this.#pause()));
    at("next").addEventListener("click", () => this.#step((stops, now) => stops.find((cycle) => cycle > now)));
    at("back").addEventListener("click", () => this.#step((stops, now) => stops.findLast((cycle) => cycle < now)));
    at("cursor").addEventListener("input", () => {
      this.#pause();
      this.#look(this.#timeline.touch.start + Number(at("cursor").value));
    });
    at("live").addEventListener("click", () => this.leave());
    new ResizeObserver(() => this.#timeline.draw()).observe(at("timeline"));
  }

  // Whether what was is shown, and not what is.
  get on() {
    return !at("live").hidden;
  }

  // Have this touch ready, with the zones that it was told as.
  show(touch, zones) {
    this.#zones = zones;
    if (touch === this.#timeline.touch) return;
    this.#timeline.show(touch);
    at("cursor").max = touch.last - touch.start;
    at("cursor").value = at("cursor").max;
    this.#tell();
  }

  leave() {
    if (!this.on) return;
    at("live").hidden = true;
    this.#pause();
    this.#sheet.lines();
    this.#tell();
  }

  // Once for each picture, `now` in ms.
  tick(now) {
    if (this.#since === null) return;
    const { start, last } = this.#timeline.touch;
    const played_s = Math.max(now - this.#since, 0) / 1e3; // a picture's time may lie before the click that began it
    const cycle = start + (played_s / PLAY_S) * (last - start);
    // From event to event for who wants no motion.
    this.#look(this.#still.matches ? this.#timeline.stops.findLast((stop) => stop <= cycle) : cycle);
    if (cycle >= last) this.#pause();
  }

  #play() {
    const { touch, cycle } = this.#timeline;
    const played = cycle < touch.last ? (cycle - touch.start) / (touch.last - touch.start) : 0;
    this.#since = performance.now() - played * PLAY_S * 1e3;
    at("play").textContent = "Pause";
    this.#look(touch.start + played * (touch.last - touch.start));
  }

  #pause() {
    this.#since = null;
    at("play").textContent = "Play";
  }

  #step(find) {
    this.#pause();
    this.#look(find(this.#timeline.stops, this.#timeline.cycle) ?? this.#timeline.cycle);
  }

  #look(cycle) {
    this.#timeline.at(cycle);
    const { row, sampled, read, said } = this.#timeline.moment;
    const { start, last, cells } = this.#timeline.touch;
    const since = this.#timeline.cycle - start;
    this.#sheet.lines(row, sampled);
    this.#sheet.show(read, cells, this.#timeline.cycle === last ? this.#zones : []);
    at("cursor").value = since;
    at("moment").textContent = `${us(since, this.#kit)}: ${said}`;
    at("live").hidden = false;
    const scroll = at("timeline").parentElement;
    scroll.scrollLeft = (since / (last - start)) * (scroll.scrollWidth - scroll.clientWidth);
  }

  #tell() {
    const cycles = this.#timeline.touch.last - this.#timeline.touch.start;
    const slower = times((PLAY_S * this.#kit.clock_hz) / cycles);
    at("moment").textContent =
      `From the switches to the last byte in ${us(cycles, this.#kit)}. Play shows it ${slower} times slower.`;
  }
}
