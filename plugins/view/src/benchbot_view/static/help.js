// The dialog of keys, and what all pages do with keys.

export const root = document.body.dataset.root;
export const isStatic = "static" in document.body.dataset;

/** Return the document in a block of data of this page, null without one. */
export function block(id) {
  const found = document.getElementById(id);
  return found ? JSON.parse(found.textContent) : null;
}

/** Return the state that the address holds, after its #. */
export function stateOf(address = location.hash) {
  return Object.fromEntries(new URLSearchParams(address.slice(1)));
}

/** Put a state into the address; what is empty is left out. */
export function keepState(state) {
  const known = Object.entries(state).filter(([, value]) => value !== "" && value !== null && value !== undefined);
  const text = new URLSearchParams(known).toString();
  if (text !== location.hash.slice(1)) history.replaceState(null, "", `#${text}`);
}

/** Call what a key stands for, unless somebody writes. `keys` are functions by the name of the key. */
export function onKeys(keys) {
  const help = document.getElementById("help");
  document.getElementById("keys")?.addEventListener("click", () => help.showModal());
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || help.open) return;
    const writes = event.target.matches("input:not([type=range]), select, textarea");
    const handle = event.key === "?" && !writes ? () => help.showModal() : keys[event.key];
    if (!handle || (writes && event.key !== "Escape")) return;
    if (handle(event) !== false) event.preventDefault();
  });
}

/** Make an element with properties and children; strings become text. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "class") element.className = value;
    else if (name.includes("-") || name === "role" || name === "scope") element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children);
  return element;
}
