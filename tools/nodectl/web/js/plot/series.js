// The samples of one signal, in the order of their times.

/** The number of samples of a signal that are kept: at a thousand a second, more than four minutes. */
export const KEPT = 262_144;

export class Series {
  constructor() {
    this.clear();
  }

  clear() {
    this.t = [];
    this.v = [];
    this.meaning = null;
  }

  /** Takes the samples of one message. */
  take({ t, v, meaning = null }) {
    for (let i = 0; i < t.length; i += 1) {
      this.t.push(t[i]);
      this.v.push(v[i]);
    }
    this.meaning = meaning;
    if (this.t.length > 2 * KEPT) {
      this.t.splice(0, this.t.length - KEPT);
      this.v.splice(0, this.v.length - KEPT);
    }
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
    let [least, greatest, gap] = [start, start, null];
    for (let at = start; at < end; at += 1) {
      if (this.v[at] == null) gap = at;
      if (this.v[at] < this.v[least]) least = at;
      if (this.v[at] > this.v[greatest]) greatest = at;
    }
    const chosen = new Set([start, least, greatest, end - 1]);
    if (gap != null) chosen.add(gap);
    return [...chosen].sort((a, b) => a - b).map((at) => this.#point(at));
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
