// Announcements for users of a screen reader, which reads the live region.

/** Says one sentence politely. */
export function announce(sentence) {
  const region = document.getElementById("announcer");
  region.textContent = "";
  // A region reads a text that replaces an empty one, also when the same text comes again.
  requestAnimationFrame(() => (region.textContent = sentence));
}
