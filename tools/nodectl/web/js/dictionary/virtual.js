// The rows of a long table, of which only those in view are in the document.

import { el, set } from "../dom.js";

/** The height beyond the visible part that has rows, in pixels: the keyboard and a short scroll find them there. */
const MARGIN = 200;
/** The heights by kind before the first row is measured. */
const ASSUMED = { area: 32, object: 32, details: 160 };

export class VirtualRows {
  /** `box` scrolls, `body` has the rows, `onShow` is called with the items in view. An item has `kind`, `element` and `height`. */
  constructor(box, body, onShow) {
    Object.assign(this, { box, body, onShow, items: [], heights: { ...ASSUMED } });
    const room = () => el("tr", { class: "room", "aria-hidden": "true" }, el("td", { colspan: 9 }));
    [this.above, this.below] = [room(), room()];
    box.addEventListener("scroll", () => this.draw(), { passive: true });
    this.sizes = new ResizeObserver(() => this.draw());
    this.sizes.observe(box);
  }

  /** Shows other items. */
  show(items) {
    for (const { kind, element } of this.items.filter(({ kind }) => kind === "details")) this.sizes.unobserve(element.firstChild.firstChild);
    this.items = items;
    for (const { element } of items.filter(({ kind }) => kind === "details")) this.sizes.observe(element.firstChild.firstChild);
    this.draw();
  }

  draw() {
    if (this.box.clientHeight === 0) return;
    this.#place();
    if (this.#measure()) this.#place();
    this.onShow(this.#within(0));
  }

  #height({ kind, height }) {
    return height ?? this.heights[kind];
  }

  /** The items of the visible part and of a margin around it. */
  #within(margin) {
    const [from, to] = [this.box.scrollTop - margin, this.box.scrollTop + this.box.clientHeight + margin];
    let y = 0;
    return this.items.filter((item) => {
      const top = y;
      y += this.#height(item);
      return y > from && top < to;
    });
  }

  #place() {
    const shown = this.#within(MARGIN);
    const first = this.items.indexOf(shown[0]);
    const sum = (items) => items.reduce((height, item) => height + this.#height(item), 0);
    this.above.firstChild.style.height = `${sum(this.items.slice(0, Math.max(0, first)))}px`;
    this.below.firstChild.style.height = `${shown.length ? sum(this.items.slice(first + shown.length)) : 0}px`;
    shown.forEach(({ element }, at) => set(element, "aria-rowindex", first + at + 2));
    this.#arrange([this.above, ...shown.map(({ element }) => element), this.below]);
  }

  /** Rows that stay are not moved: one of them may have the focus. */
  #arrange(rows) {
    const wanted = new Set(rows);
    for (const row of [...this.body.children]) if (!wanted.has(row)) row.remove();
    rows.forEach((row, at) => {
      if (this.body.children[at] !== row) this.body.insertBefore(row, this.body.children[at] ?? null);
    });
  }

  /** Takes the heights of the rows in the document; whether one has changed. */
  #measure() {
    let isNew = false;
    for (const item of this.items) {
      if (!item.made?.isConnected) continue;
      const height = item.made.offsetHeight;
      if (height === this.#height(item)) continue;
      isNew = true;
      if (item.kind === "details") item.height = height;
      else this.heights[item.kind] = height;
    }
    return isNew;
  }
}
