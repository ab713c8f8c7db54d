// Elements made in one call.

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes and children. `on` has listeners, `prop` has properties, `data` the data attributes. */
export function el(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** An element of a drawing (SVG) with attributes and children. */
export function svg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(element, attributes, children) {
  const { on = {}, prop = {}, data = {}, ...rest } = attributes;
  for (const [name, value] of Object.entries(rest)) set(element, name, value);
  for (const [name, listener] of Object.entries(on)) element.addEventListener(name, listener);
  Object.assign(element, prop);
  Object.assign(element.dataset, data);
  element.append(...children.flat().filter((child) => child != null && child !== false));
  return element;
}

/** Sets an attribute; `null`, `undefined` and `false` remove it. An unchanged attribute is not touched. */
export function set(element, name, value) {
  if (value == null || value === false) element.removeAttribute(name);
  else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value === true ? "" : value);
}

/** Sets the text of an element, if the text has changed. */
export function text(element, value) {
  if (element.textContent !== value) element.textContent = value;
}

let lastId = 0;

/** A unique id. */
export function newId(prefix = "e") {
  lastId += 1;
  return `${prefix}-${lastId}`;
}

/** A control with its label before it. */
export function field(label, control, hint = "") {
  control.id ||= newId("field");
  const help = hint && el("small", { id: `${control.id}-hint` }, hint);
  if (help) set(control, "aria-describedby", help.id);
  return el("div", { class: "field" }, el("label", { for: control.id }, label), control, help || null);
}

/** A button for an action. It is disabled while the promise of the action is open. */
export function button(label, action, attributes = {}) {
  const press = async () => {
    if (element.getAttribute("aria-busy") === "true") return;
    set(element, "aria-busy", "true");
    try {
      await action(element);
    } finally {
      set(element, "aria-busy", null);
    }
  };
  const element = el("button", { type: "button", on: { click: press }, ...attributes }, label);
  return element;
}

/** A list to choose from: `[value, label]` for each choice. */
export function select(choices, value, onChange, attributes = {}) {
  const element = el("select", { on: { change: () => onChange(element.value) }, ...attributes });
  setChoices(element, choices, value);
  return element;
}

/** Replaces the choices of a list, and keeps the chosen one if it is still there. */
export function setChoices(element, choices, value = element.value) {
  const key = JSON.stringify(choices);
  if (element.dataset.choices !== key) {
    element.dataset.choices = key;
    element.replaceChildren(...choices.map(([value, label]) => el("option", { value }, label)));
  }
  if (choices.some(([choice]) => String(choice) === String(value))) element.value = value;
}
