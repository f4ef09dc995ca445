/** The shapes nearest to one: to a shape of the collection (?like=ID) or to a file that was sent (?job=ID). */

import { info, json } from "./api.js";
import { arrowKeys, card, picture, skeletons } from "./cards.js";
import { compareButton, showComparison } from "./comparison.js";
import { announce, counted, download, element, notice } from "./dom.js";
import { follow, progressOf } from "./jobs.js";
import { href } from "./router.js";
import { toCsv } from "./table.js";

const NUMBERS = [12, 24, 48, 96];

/** Draw the answers. */
export async function renderSearch(root, _parameters, state, setState) {
  const page = new Answers(root, setState);
  await page.begin(state);
  return { update: (changed) => page.update(changed), destroy: () => page.stop() };
}

function lasting(seconds) {
  if (seconds < 0.001) return "less than 1 ms";
  return seconds < 0.1 ? `${Math.round(seconds * 1000)} ms` : `${seconds.toFixed(1)} s`;
}

class Answers {
  constructor(root, setState) {
    this.root = root;
    this.setState = setState;
    this.control = new AbortController();
  }

  stop() {
    this.control.abort();
    this.closeComparison?.();
  }

  async begin(state) {
    this.state = state;
    this.asked = state.job ? `job ${state.job}` : `like ${state.like}`;
    this.closeComparison?.();
    this.id = this.found = this.closeComparison = null;
    document.title = "Nearest shapes · spem";
    this.head = element("div", { class: "query" });
    this.controls = element("div", { class: "toolbar" });
    this.grid = element("ol", { class: "grid", "aria-label": "Nearest shapes", role: "list" });
    arrowKeys(this.grid);
    this.below = element("div", { class: "more" });
    this.root.replaceChildren(this.head, this.controls, this.grid, this.below);
    this.head.append(element("div", {}, element("h1", {}, "Nearest shapes")));
    // The page stands before the answers do: the reader sees progress, and can leave.
    (state.job ? this.wait(state.job) : this.ask()).catch((error) => this.fail(error));
  }

  update(state) {
    const asked = state.job ? `job ${state.job}` : `like ${state.like}`;
    if (asked !== this.asked) {
      this.renew();
      this.begin(state);
      return;
    }
    const changed = ["k", "label"].some((key) => (this.state[key] ?? "") !== (state[key] ?? ""));
    this.state = state;
    if (!changed) this.compare();
    else if (this.id) {
      this.renew();
      this.ask().catch((error) => this.fail(error));
    }
  }

  /** Give up what was asked before, so that no late answer takes the place of a new one. */
  renew() {
    this.control.abort();
    this.control = new AbortController();
  }

  async wait(job) {
    const progress = progressOf(job);
    this.head.firstChild.append(progress.box);
    const done = await follow(job, progress.show, this.control.signal);
    progress.box.remove();
    if (done.state === "cancelled") {
      this.below.append(notice("The search was cancelled", "Drop the file again to search for it.", this.back()));
      return;
    }
    if (done.state !== "done") throw new Error(done.error || "The search failed.");
    this.id = done.result.query.id;
    if (this.state.k || this.state.label) await this.ask();
    else await this.show(done.result);
  }

  /** Ask for the neighbours of what is searched for; a file that was sent has an id while it is kept. */
  async ask() {
    this.id ??= this.state.like;
    this.grid.setAttribute("aria-busy", "true");
    if (!this.grid.childElementCount) this.grid.append(...skeletons(6));
    const { k = "24", label } = this.state;
    const path = `api/shapes/${encodeURIComponent(this.id)}/neighbours`;
    // One more, for a shape of the collection is the nearest to itself.
    const found = await json(path, { k: Number(k) + 1, label }, this.control.signal);
    const others = found.answers.filter(({ shape }) => shape.id !== this.id).slice(0, Number(k));
    await this.show({ ...found, answers: others.map((answer, at) => ({ ...answer, rank: at + 1 })) });
  }

  async show(found) {
    this.found = found;
    const { query, answers, method, seconds } = found;
    document.title = `Nearest to ${query.name} · spem`;
    this.below.replaceChildren();
    this.head.replaceChildren(picture(query, { eager: true }), this.title(query, answers, method, seconds));
    if (!this.controls.childElementCount) await this.fillControls();
    this.grid.replaceChildren(...answers.map((answer) => this.answer(answer)));
    this.grid.removeAttribute("aria-busy");
    if (!answers.length) this.below.append(notice("Nothing near it", "No shape of the collection passes this filter."));
    announce(`${counted(answers.length, "shape")} nearest to ${query.name}`);
    this.compare();
  }

  title(query, answers, method, seconds) {
    const took = seconds === undefined ? "" : ` in ${lasting(seconds)}`;
    const facts = [query.label, `${query.ndim}-D`, counted(query.n_nodes ?? 0, "node")].filter(Boolean).join(" · ");
    const sent = String(query.id).startsWith("upload-");
    return element(
      "div",
      { class: "query-words" },
      element("p", { class: "eyebrow" }, sent ? "Nearest to your file" : "Nearest shapes"),
      element("h1", {}, query.name),
      element("p", { class: "facts" }, facts),
      element("p", { class: "facts" }, `${counted(answers.length, "answer")}, ${method} search${took}`),
      element("div", { class: "row" },
        element("a", { class: "button small", href: href(`shape/${query.id}`) }, "Look at this shape"),
        element("button", { type: "button", class: "button small", onclick: () => this.save() }, "Download CSV")),
    );
  }

  async fillControls() {
    const { labels } = await info();
    const change = (key) => (event) => {
      this.setState({ [key]: event.target.value || null });
      this.update({ ...this.state, [key]: event.target.value || undefined });
    };
    const options = (pairs, chosen) =>
      pairs.map(([value, text]) => element("option", { value, selected: value === chosen }, text));
    const named = labels.filter(({ label }) => label).map(({ label, n }) => [label, `${label} (${n})`]);
    const field = (words, key, pairs, chosen) =>
      element("label", { class: "field" }, element("span", {}, words),
        element("select", { onchange: change(key) }, ...options(pairs, chosen)));
    if (named.length > 1) this.controls.append(field("Label", "label", [["", "All"], ...named], this.state.label));
    const numbers = NUMBERS.map((n) => [String(n), String(n)]);
    this.controls.append(field("Answers", "k", numbers, this.state.k ?? (this.state.job ? "48" : "24")));
  }

  answer({ rank, distance, shape }) {
    const words = `rank ${rank}, distance ${distance.toFixed(3)}`;
    const near = element("span", { class: "distance", role: "img", "aria-label": words },
      element("span", { class: "rank" }, `${rank}`), distance.toFixed(3));
    const item = element("li", { class: "answer" }, card(shape, href(`shape/${shape.id}`), near));
    item.append(compareButton(shape, () => this.setState({ compare: shape.id }, { push: true }) ?? this.openComparison(shape.id)));
    return item;
  }

  openComparison(id) {
    this.state = { ...this.state, compare: id };
    this.compare();
  }

  compare() {
    this.closeComparison?.();
    this.closeComparison = null;
    const { compare } = this.state;
    if (!compare || !this.found) return;
    const answer = this.found.answers.find(({ shape }) => shape.id === compare);
    const names = [this.found.query.name, answer?.shape.name ?? compare];
    this.closeComparison = showComparison(this.id, compare, names, () => {
      this.setState({ compare: null });
      this.state = { ...this.state, compare: undefined };
      this.closeComparison = null;
    });
  }

  save() {
    const { query, answers } = this.found;
    const rows = answers.map(({ rank, distance, shape }) => ({ rank, distance, ...shape }));
    const columns = ["rank", "distance", "id", "name", "label", "ndim", "n_nodes", "volume", "file"];
    download(`nearest-${query.name.replace(/[^\w.-]+/g, "_")}.csv`, toCsv(rows, columns), "text/csv");
  }

  back() {
    return element("a", { class: "button", href: href("./") }, "See all shapes");
  }

  fail(error) {
    if (error.name === "AbortError") return;
    this.grid.replaceChildren();
    this.grid.removeAttribute("aria-busy");
    this.head.querySelector(".progress")?.remove();
    const gone = error.status === 404 && this.state.job;
    const title = gone ? "These answers are no longer kept" : "The search came to nothing";
    const words = gone ? "Answers to a file are kept for an hour. Drop the file again." : error.message;
    this.below.replaceChildren(notice(title, words, this.back()));
    announce(words);
  }
}
