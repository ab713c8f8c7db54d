// The part of time that the plots show. All plots share it.

const SHORTEST = 0.01;
const LONGEST = 3600;

export class TimeWindow extends EventTarget {
  constructor(length) {
    super();
    this.length = length;
    /** The right end; `null` while the plots follow the bus. */
    this.end = null;
    this.now = 0;
    /** The position of the pointer as a share of the width; `null` without one. */
    this.pointer = null;
  }

  /** The time under the pointer; `null` without one. */
  get cursor() {
    return this.pointer == null ? null : this.from + this.pointer * this.length;
  }

  point(share) {
    this.pointer = share;
    this.dispatchEvent(new CustomEvent("change"));
  }

  get follows() {
    return this.end == null;
  }

  get to() {
    return this.end ?? this.now;
  }

  get from() {
    return this.to - this.length;
  }

  /** The newest time of the bus. */
  advance(now) {
    this.now = now;
  }

  follow() {
    this.#set(this.length, null);
  }

  pause() {
    this.#set(this.length, this.to);
  }

  toggle() {
    if (this.follows) this.pause();
    else this.follow();
  }

  /** Makes the time longer or shorter; `anchor` stays where it is, 0 at the left and 1 at the right. */
  zoom(factor, anchor = 1) {
    const length = Math.min(LONGEST, Math.max(SHORTEST, this.length * factor));
    const fixed = this.from + anchor * this.length;
    this.#set(length, this.follows && anchor === 1 ? null : fixed + (1 - anchor) * length);
  }

  /** Moves by a share of the length. */
  move(share) {
    this.#set(this.length, this.to + share * this.length);
  }

  show(from, to) {
    this.#set(Math.max(SHORTEST, to - from), to);
  }

  setLength(length) {
    this.#set(length, this.end);
  }

  #set(length, end) {
    this.length = length;
    // A move beyond the newest sample makes the plots follow the bus again.
    this.end = end != null && end > this.now ? null : end;
    this.dispatchEvent(new CustomEvent("change"));
  }
}
