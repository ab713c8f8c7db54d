// The line below a control that shows the result of a request.

import { announce } from "./announce.js";
import { el, set, text } from "./dom.js";

export function outcome() {
  const line = el("p", { class: "outcome" });
  const say = (kind, sentence) => {
    set(line, "data-kind", kind);
    text(line, sentence);
    if (kind === "good" || kind === "bad") announce(sentence);
  };
  return {
    line,
    clear: () => say("none", ""),
    busy: (sentence) => say("busy", sentence),
    good: (sentence) => say("good", sentence),
    bad: (error) => say("bad", error.message ?? String(error)),
    /** Runs a request and shows its result; `undefined` where it has failed. */
    async of(doing, promise, done) {
      say("busy", doing);
      try {
        const ok = await promise;
        say("good", typeof done === "function" ? done(ok) : done);
        return ok;
      } catch (error) {
        say("bad", error.message);
        return undefined;
      }
    },
  };
}
