// The views, one of which is shown. The address of the page has the view's name, so that a reload and a bookmark lead back.

import { el, set } from "./dom.js";

export class Navigation {
  /** `views`: `{name, title, content, show?, hide?, search?}` each. */
  constructor(views) {
    this.views = views;
    this.current = null;
    const main = document.getElementById("main");
    for (const view of views) {
      view.link = el("a", { href: `#${view.name}` }, view.title);
      view.heading = el("h2", { tabindex: -1 }, view.title);
      view.section = el("section", { id: `view-${view.name}`, class: "view", hidden: true }, view.heading, view.content);
      set(view.section, "aria-label", view.title);
      main.append(view.section);
    }
    document.getElementById("views").append(...views.map((view) => view.link));
    addEventListener("hashchange", () => this.#follow(true));
    this.#follow(false);
  }

  /** Adds or removes a view: the stimuli are for a simulator only. */
  offer(name, isThere) {
    const view = this.views.find((view) => view.name === name);
    set(view.link, "hidden", !isThere);
    if (!isThere && this.current === view) location.hash = this.views[0].name;
  }

  showAt(position) {
    const view = this.#offered()[position];
    if (view) location.hash = view.name;
  }

  /** Puts the cursor into the search field of the view. */
  search() {
    this.current.search?.focus();
  }

  #offered() {
    return this.views.filter((view) => !view.link.hidden);
  }

  #follow(isMove) {
    const name = location.hash.slice(1);
    const view = this.views.find((view) => view.name === name) ?? this.views[0];
    if (view === this.current) return;
    this.current?.hide?.();
    for (const other of this.views) {
      set(other.section, "hidden", other !== view);
      set(other.link, "aria-current", other === view ? "page" : null);
    }
    this.current = view;
    view.link.scrollIntoView({ block: "nearest", inline: "center" });
    view.show?.();
    document.title = `${view.title} - CANopen bus`;
    if (isMove) view.heading.focus({ preventScroll: true });
  }
}
