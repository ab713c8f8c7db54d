// The samples of one signal, in the order of their times.

/** The number of newest samples of a signal that are kept: at a thousand a second, more than four minutes. */
export const KEPT = 262_144;
/** Of each so many older samples, only the least and the greatest one are kept. */
const REDUCED = 64;
/** The number of samples that are kept of the older time: more than two hours at a thousand samples a second. */
const OLD = 262_144;
/** The older samples are reduced when this number of samples has come. */
const PART = 32_768;

export class Series {
  constructor() {
    this.clear();
  }

  clear() {
    this.t = [];
    this.v = [];
    this.meaning = null;
    /** The number of samples at the begin that are left of older ones. */
    this.old = 0;
  }

  /** Takes the samples of one message. */
  take({ t, v, meaning = null }) {
    for (let i = 0; i < t.length; i += 1) {
      this.t.push(t[i]);
      this.v.push(v[i]);
    }
    this.meaning = meaning;
    if (this.t.length >= this.old + KEPT + PART) this.#reduce();
  }

  /** Reduces the samples before the newest ones, and drops the oldest ones beyond the time that is kept. */
  #reduce() {
    const end = this.t.length - KEPT;
    const chosen = [];
    for (let at = this.old; at < end; at += REDUCED) chosen.push(...this.#extremes(at, Math.min(end, at + REDUCED)));
    const forgotten = Math.max(0, this.old + chosen.length - OLD);
    for (const array of [this.t, this.v]) {
      // In place: copies of arrays of this length would be most of the memory of the page.
      array.splice(this.old, end - this.old, ...chosen.map((at) => array[at]));
      array.splice(0, forgotten);
    }
    this.old += chosen.length - forgotten;
  }

  /** The newest value; `undefined` before the first one. */
  get newest() {
    return this.v.at(-1);
  }

  /** The position of the first sample at or after a time. */
  position(time) {
    let [low, high] = [0, this.t.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.t[middle] < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The value at a time: that of the last sample until then; `null` before the first one. */
  at(time) {
    const next = this.position(time);
    const at = this.t[next] === time ? next : next - 1;
    return at < 0 ? null : this.v[at];
  }

  /**
   * What a plot of so many columns shows from one time to another: every sample where there is room, else the first, the least, the
   * greatest and the last one of each column, so that no peak is lost. One sample on either side leads to the edge.
   */
  envelope(from, to, columns) {
    const start = Math.max(0, this.position(from) - 1);
    const end = Math.min(this.t.length, this.position(to) + 1);
    if (end - start <= 4 * columns) return this.#all(start, end);
    const points = [];
    const width = (to - from) / columns;
    for (let at = start; at < end; ) {
      const column = Math.floor((this.t[at] - from) / width);
      const next = Math.min(end, Math.max(at + 1, this.position(from + (column + 1) * width)));
      points.push(...this.#column(at, next));
      at = next;
    }
    return points;
  }

  #all(start, end) {
    const points = [];
    for (let at = start; at < end; at += 1) points.push(this.#point(at));
    return points;
  }

  /** First, least, greatest, last, and a gap where there is one, in the order of time. */
  #column(start, end) {
    const chosen = new Set([start, ...this.#extremes(start, end), end - 1]);
    return [...chosen].sort((a, b) => a - b).map((at) => this.#point(at));
  }

  /** The positions of the least and the greatest sample, and of a gap where there is one, in the order of time. */
  #extremes(start, end) {
    let [least, greatest, gap] = [start, start, null];
    for (let at = start; at < end; at += 1) {
      if (this.v[at] == null) gap = at;
      // A comparison with null would take it for 0.
      else if (this.v[least] == null || this.v[at] < this.v[least]) least = at;
      if (this.v[at] != null && (this.v[greatest] == null || this.v[at] > this.v[greatest])) greatest = at;
    }
    const chosen = new Set([least, greatest]);
    if (gap != null) chosen.add(gap);
    return [...chosen].sort((a, b) => a - b);
  }

  #point(at) {
    return { x: this.t[at], y: this.v[at] };
  }
}

/** The points of a signal. While its status says that the value is not valid, there is a gap. */
export function points(recorder, { key, status }, from, to, columns) {
  const all = recorder.of(key).envelope(from, to, columns);
  const states = status && recorder.series.get(status);
  if (!states?.t.length) return all;
  // Bit 0 of 6150h: the value is not valid (CiA 404).
  return all.map((point) => ((states.at(point.x) ?? 0) & 1 ? { x: point.x, y: null } : point));
}
