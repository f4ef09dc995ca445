/** The gallery: every shape of the collection, searched, filtered and sorted. */

import { info, json } from "./api.js";
import { announce, counted, debounced, element, icon, notice } from "./dom.js";
import { arrowKeys, card, skeletons } from "./cards.js";
import { href } from "./router.js";

const PAGE = 48;
const SORTS = { name: "Name", added: "Newest", volume: "Size" };

/** Draw the gallery. */
export function renderGallery(root, _parameters, state, setState) {
  document.title = "Shapes · spem";
  const gallery = new Gallery(root, setState);
  gallery.draw(state);
  return { update: (changed) => gallery.update(changed), destroy: () => gallery.stop() };
}

class Gallery {
  constructor(root, setState) {
    this.root = root;
    this.setState = setState;
    this.request = null;
    this.shapes = [];
  }

  draw(state) {
    this.count = element("p", { class: "count", role: "status", "aria-live": "polite" });
    this.grid = element("ul", { class: "grid", role: "list", "aria-label": "Shapes" });
    this.more = element("div", { class: "more" });
    arrowKeys(this.grid);
    const lead = element("p", { class: "lead" }, "Drop a file anywhere, or paste one, to find the shapes nearest to it.");
    const heading = element("div", { class: "heading" }, element("h1", {}, "Shapes"), this.count, lead);
    this.root.append(heading, this.toolbar(state), this.grid, this.more);
    this.fillLabels(state);
    this.load(state, 0);
  }

  toolbar(state) {
    const change = (changes) => {
      if (!this.root.isConnected) return;
      this.setState(changes);
      this.load({ ...this.state, ...changes }, 0);
    };
    const typed = debounced((value) => change({ q: value.trim() || null }), 200);
    this.q = element("input", {
      type: "search", id: "q", name: "q", value: state.q ?? "", placeholder: "Search by name", autocomplete: "off",
      spellcheck: "false", "aria-keyshortcuts": "/", "aria-label": "Search shapes by name",
      oninput: (event) => typed(event.target.value),
      onkeydown: (event) => {
        if (event.key === "ArrowDown") this.grid.querySelector("a")?.focus();
        if (event.key === "Escape" && this.q.value) {
          this.q.value = "";
          typed("");
        }
      },
    });
    const choice = (key, words, options) => {
      const listed = options.map(([value, text]) => element("option", { value }, text));
      const select = element("select", { onchange: (event) => change({ [key]: event.target.value || null }) }, listed);
      select.value = state[key] ?? "";
      this[key] = select;
      return element("label", { class: "field" }, element("span", {}, words), select);
    };
    const sorts = Object.entries(SORTS).map(([value, text]) => [value === "name" ? "" : value, text]);
    const dimensions = [["", "All"], ...[1, 2, 3, 4].map((d) => [String(d), `${d}-D`])];
    const glass = icon("M9 3.500a5.500 5.500 0 1 1 0 11 5.500 5.500 0 0 1 0-11z", "M13 13l4 4");
    return element(
      "form",
      { class: "toolbar", role: "search", "aria-label": "Shapes", onsubmit: (event) => event.preventDefault() },
      element("div", { class: "searchbox" }, glass, this.q, element("kbd", { "aria-hidden": "true" }, "/")),
      choice("label", "Label", [["", "All"]]),
      choice("ndim", "Dimension", dimensions),
      choice("sort", "Sort by", sorts),
    );
  }

  async fillLabels(state) {
    try {
      const { labels, models } = await info();
      for (const { label, n } of labels) {
        if (label) this.label.append(element("option", { value: label }, `${label} (${n.toLocaleString("en")})`));
      }
      this.label.value = state.label ?? "";
      this.label.closest("label").hidden = this.label.options.length < 2;
      this.ndim.closest("label").hidden = models.length > 0 && models.every(({ ndim }) => ndim) && !state.ndim;
    } catch {
      this.label.closest("label").hidden = true; // The list below says what is wrong.
    }
  }

  update(state) {
    this.q.value = state.q ?? "";
    for (const key of ["label", "ndim", "sort"]) this[key].value = state[key] ?? "";
    this.load(state, 0);
  }

  stop() {
    this.request?.abort();
  }

  async load(state, offset) {
    this.stop();
    this.state = state;
    this.request = new AbortController();
    const { signal } = this.request;
    if (offset === 0) this.wait(signal);
    const { q, label, ndim, sort } = state;
    try {
      const found = await json("api/shapes", { q, label, ndim, sort, offset, limit: PAGE }, signal);
      this.show(found, offset);
    } catch (error) {
      if (error.name !== "AbortError") this.fail(error, offset);
    } finally {
      if (!signal.aborted) this.grid.removeAttribute("aria-busy");
    }
  }

  wait(signal) {
    this.grid.setAttribute("aria-busy", "true");
    // What is shown stays while an answer is quick, so that typing does not flicker.
    setTimeout(() => {
      if (this.grid.hasAttribute("aria-busy") && !signal.aborted) this.grid.replaceChildren(...skeletons(12));
    }, this.grid.childElementCount ? 400 : 0);
  }

  show({ total, shapes }, offset) {
    const cards = shapes.map((shape) => element("li", {}, card(shape, href(`shape/${shape.id}`))));
    if (offset === 0) this.grid.replaceChildren(...cards);
    else this.grid.append(...cards);
    const shown = offset + shapes.length;
    const filtered = ["q", "label", "ndim"].some((key) => this.state[key]);
    this.count.textContent = `${counted(total, "shape")}${filtered ? " found" : ""}`;
    this.more.replaceChildren();
    if (offset) cards[0]?.querySelector("a").focus({ preventScroll: true });
    if (offset) announce(`${shown.toLocaleString("en")} of ${counted(total, "shape")} shown`);
    if (!total) this.more.append(this.empty(filtered));
    else if (shown < total) this.more.append(...this.showMore(shown, total));
  }

  showMore(shown, total) {
    const next = () => this.load(this.state, shown);
    const button = element("button", { type: "button", class: "button", onclick: next });
    button.textContent = `Show ${Math.min(PAGE, total - shown)} more`;
    return [element("p", {}, `${shown.toLocaleString("en")} of ${total.toLocaleString("en")} shown`), button];
  }

  empty(filtered) {
    if (!filtered) return notice("Nothing here yet", "Add shapes with: spem index add DB SHAPES");
    const clear = () => {
      this.setState({ q: null, label: null, ndim: null });
      this.update({ ...this.state, q: null, label: null, ndim: null });
      this.q.focus();
    };
    const button = element("button", { type: "button", class: "button", onclick: clear }, "Show all shapes");
    return notice("No shape matches", "Try fewer letters of its name, or other filters.", button);
  }

  fail(error, offset) {
    if (offset === 0) this.grid.replaceChildren();
    this.count.textContent = "";
    const again = () => this.load(this.state, offset);
    const button = element("button", { type: "button", class: "button", onclick: again }, "Try again");
    this.more.replaceChildren(notice("The shapes could not be loaded", error.message, button));
    announce(error.message);
  }
}
