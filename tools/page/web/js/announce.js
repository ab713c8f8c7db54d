// What happened, for those who do not look at it: a screen reader reads the live region.

/** Says one sentence politely. */
export function announce(sentence) {
  const region = document.getElementById("announcer");
  region.textContent = "";
  // A region reads what is put in after it was empty, the same sentence too.
  requestAnimationFrame(() => (region.textContent = sentence));
}
