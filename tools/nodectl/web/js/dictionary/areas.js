// The areas of the object dictionary (CiA 301, table 37), as headings between the objects.

import { button, el, set, text } from "../dom.js";
import { address } from "../format.js";

/** Name, title, first and last index. */
export const AREAS = [
  ["types", "Data types", 0x0000, 0x0fff],
  ["communication", "Communication", 0x1000, 0x13ff],
  ["pdo", "PDO parameters", 0x1400, 0x1bff],
  ["network", "Network and program", 0x1c00, 0x1fff],
  ["manufacturer", "Manufacturer", 0x2000, 0x5fff],
  ["profile", "Device profile", 0x6000, 0xffff],
];

export class Area {
  kind = "area";

  constructor([name, title, first, last], onToggle) {
    Object.assign(this, { name, first, last, isOpen: true });
    this.opener = button("", () => {
      this.isOpen = !this.isOpen;
      onToggle();
    }, { class: "plain", "aria-expanded": "true" });
    this.title = title;
    this.made = this.element = el("tr", { class: "area", data: { area: name } }, el("th", { scope: "rowgroup", colspan: 9 }, this.opener));
  }

  has({ index }) {
    return index >= this.first && index <= this.last;
  }

  show(number) {
    set(this.opener, "aria-expanded", String(this.isOpen));
    text(this.opener, `${this.isOpen ? "▾" : "▸"} ${this.title} ${address(this.first)} to ${address(this.last)} (${number})`);
  }
}
