// The rows of the trace that are kept, and the selection of the rows that are shown.

/** The number of rows that are kept. Older rows are dropped, and a text says so. */
export const KEPT = 20_000;

export const KINDS = ["nmt", "sync", "time", "emcy", "pdo", "sdo", "heartbeat", "lss", "other"];

export class Rows {
  constructor() {
    this.rows = [];
    this.lost = 0;
    this.forgotten = 0;
    this.number = 0;
    this.byId = new Map();
  }

  /** Takes an event of the trace. Rows that the server has dropped before it become a row of their own. */
  take({ lost, rows }) {
    const fresh = lost > 0 ? [{ gap: lost }, ...rows] : rows;
    for (const row of fresh) {
      row.number = this.number += 1;
      if (!row.gap) this.#count(row);
    }
    this.lost += lost;
    this.rows.push(...fresh);
    const excess = this.rows.length - KEPT;
    if (excess > KEPT / 10) {
      this.rows.splice(0, excess);
      this.forgotten += excess;
    }
    return fresh;
  }

  clear() {
    this.rows = [];
    this.byId.clear();
  }

  /** Counts the row for its CAN-ID, and gives it the time since the row before. */
  #count(row) {
    const known = this.byId.get(row.id);
    if (!known) {
      this.byId.set(row.id, { first: row.t, shortest: Infinity, longest: 0, count: 1, row });
      return;
    }
    row.delta = row.t - known.row.t;
    known.shortest = Math.min(known.shortest, row.delta);
    known.longest = Math.max(known.longest, row.delta);
    known.count += 1;
    known.row = row;
  }
}

/** Sets the filter of the rows. */
export class Filter {
  constructor() {
    this.kinds = new Set(KINDS);
    this.node = "";
    this.words = [];
  }

  setText(text) {
    this.words = text.toLowerCase().split(/\s+/).filter(Boolean);
  }

  /** A gap is shown whatever the filter, because the missing rows may have passed the filter. */
  wants(row) {
    if (row.gap) return true;
    if (!this.kinds.has(row.kind)) return false;
    if (this.node !== "" && String(row.node) !== this.node) return false;
    const text = `${row.text} ${row.id.toString(16)}h`.toLowerCase();
    return this.words.every((word) => text.includes(word));
  }
}
