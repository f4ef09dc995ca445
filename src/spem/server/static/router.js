/**
 * Addresses and pages.
 *
 * A page is `async (root, parameters, state, setState) => {update?, destroy?} | void`. `state` is the query string as an
 * object; keys that stand there several times have an array. `setState(changes, {push: false})` merges changes
 * into the address, null removing a key; it does not draw. Where the reader goes back or forth within a page,
 * `update(state)` is called if the page gave one, else it is drawn again. `destroy()` is called when it is left.
 */

import { announce, element } from "./dom.js";

const routes = [];
let current = null;
let turn = 0;

/**
 * Add a page: `pattern` such as "shape/:id", `name` for the navigation, `open` loads its function; `when` tells of
 * a state whether the page is meant, where several share a path.
 */
export function route(pattern, name, open, when = () => true) {
  const source = pattern.replace(/:(\w+)/g, "(?<$1>[^/]+)");
  routes.push({ pattern: new RegExp(`^${source}/?$`), name, open, when });
}

/** The query string as an object. */
export function readState(search = location.search) {
  const state = {};
  for (const [key, value] of new URLSearchParams(search)) {
    if (key in state) state[key] = [].concat(state[key], value);
    else state[key] = value;
  }
  return state;
}

/** The query string of an object, "" or beginning with "?"; empty values are left out. */
export function writeState(state) {
  const search = new URLSearchParams();
  for (const [key, value] of Object.entries(state)) {
    for (const one of [].concat(value ?? [])) if (one !== "") search.append(key, one);
  }
  const text = search.toString();
  return text ? `?${text}` : "";
}

/** Merge changes into the address without drawing. */
export function setState(changes, { push = false } = {}) {
  const search = writeState({ ...readState(), ...changes });
  if (search === location.search) return;
  history[push ? "pushState" : "replaceState"](null, "", location.pathname + search);
}

/** Address of a page, under the server's root and for the model that is looked at. */
export function href(path, state = {}) {
  const model = new URLSearchParams(location.search).get("model");
  return new URL(path, document.baseURI).pathname + writeState(model ? { model, ...state } : state);
}

/** Go to an address of the explorer. */
export function go(address, { replace = false } = {}) {
  history[replace ? "replaceState" : "pushState"](null, "", address);
  return draw(true);
}

function matched() {
  const base = new URL(document.baseURI).pathname;
  const path = location.pathname.startsWith(base) ? location.pathname.slice(base.length) : location.pathname;
  const state = readState();
  for (const { pattern, name, open, when } of routes) {
    const match = pattern.exec(path);
    if (match && when(state)) {
      const parameters = decoded(match.groups ?? {});
      if (!parameters) break;
      return { name, open, parameters, key: `${name} ${path} ${state.model ?? ""}` };
    }
  }
  return { name: "absent", open: absent, parameters: {}, key: path };
}

/** Parts of a path as text; null where they are none. */
function decoded(groups) {
  try {
    return Object.fromEntries(Object.entries(groups).map(([key, value]) => [key, decodeURIComponent(value)]));
  } catch {
    return null;
  }
}

function absent() {
  return (root) => {
    document.title = "No such page · spem";
    root.append(element("h1", {}, "No such page"), element("p", {}, "The address leads nowhere. "));
    root.lastChild.append(element("a", { href: href("./") }, "See all shapes"));
  };
}

function mark(name) {
  for (const link of document.querySelectorAll("[data-page]")) {
    if (link.dataset.page === name) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
    link.setAttribute("href", href(link.dataset.page === "map" ? "map" : "./"));
  }
}

async function draw(moved) {
  const found = matched();
  mark(found.name);
  dispatchEvent(new CustomEvent("spem-page", { detail: found.name }));
  if (current?.page?.update && current.key === found.key) {
    current.page.update(readState());
    return;
  }
  const ticket = ++turn;
  const main = document.getElementById("main");
  current?.page?.destroy?.();
  current = { key: found.key, page: null };
  const root = document.createElement("div");
  root.className = `page page-${found.name}`;
  main.replaceChildren(root);
  try {
    const render = await found.open();
    if (ticket !== turn) return;
    const page = await render(root, found.parameters, readState(), setState);
    if (ticket === turn) current.page = page ?? null;
    else page?.destroy?.();
  } catch (error) {
    if (ticket !== turn || error.name === "AbortError") return;
    const title = error.status === 404 ? "This is not here" : "This page could not be drawn";
    document.title = `${title} · spem`;
    root.replaceChildren(element("h1", {}, title), element("p", { class: "lead" }, error.message));
  }
  if (ticket === turn && moved) arrive(root);
}

function arrive(root) {
  scrollTo(0, 0);
  const heading = root.querySelector("h1");
  if (heading) {
    heading.tabIndex = -1;
    heading.focus({ preventScroll: true });
  }
  announce(document.title);
}

/** Draw the page of the address, and every one that the reader goes to. */
export function start() {
  addEventListener("popstate", () => draw(false));
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.("a[href]");
    if (!link || event.defaultPrevented || event.button || event.metaKey || event.ctrlKey || event.shiftKey) return;
    if (link.target || link.hasAttribute("download") || link.origin !== location.origin) return;
    const url = new URL(link.href);
    const base = new URL(document.baseURI).pathname;
    const path = url.pathname.slice(base.length);
    if (!routes.some(({ pattern }) => pattern.test(path))) return;
    event.preventDefault();
    if (link.classList.contains("skip")) document.getElementById("main").focus();
    else go(url.pathname + url.search);
  });
  return draw(false);
}
