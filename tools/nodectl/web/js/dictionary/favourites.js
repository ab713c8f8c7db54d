// The favourites, kept by the browser.

const PLACE = "favourite objects";

export class Favourites {
  #keys = new Set(read());

  has(key) {
    return this.#keys.has(key);
  }

  toggle(key) {
    if (!this.#keys.delete(key)) this.#keys.add(key);
    try {
      localStorage.setItem(PLACE, JSON.stringify([...this.#keys]));
    } catch {
      // The browser stores nothing: the favourites last as long as the page.
    }
  }
}

function read() {
  try {
    return JSON.parse(localStorage.getItem(PLACE)) ?? [];
  } catch {
    return [];
  }
}
