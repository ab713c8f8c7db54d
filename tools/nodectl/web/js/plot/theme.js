// The colours of the style sheet, for drawings by program.

const dark = matchMedia("(prefers-color-scheme: dark)");

/** The colour of a variable of the style sheet. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Colours of lines, which people with colour blindness can tell apart, too. After the last colour dashes begin. */
export function line(position) {
  return { colour: colour(`line-${(position % 6) + 1}`), dash: position < 6 ? [] : [6, 4] };
}

/** Calls `listener` when the user changes between dark and light. */
export function onTheme(listener) {
  dark.addEventListener("change", listener);
}
