/** Two shapes side by side: the same map on one scale, and the visual words that make them alike. */

import { bytes } from "./api.js";
import { unpackArrays } from "./arrays.js";
import { onTheme, partColour } from "./colours.js";
import { element } from "./dom.js";
import { href } from "./router.js";
import { Bar } from "./shape_bar.js";
import { colourMap, Colouring, shown } from "./shape_colouring.js";
import { loadCard, loadPictures } from "./shape_data.js";
import { facts } from "./shape_details.js";
import { Stage } from "./shape_stage.js";

const WORDS = 4;
/** Points of a word that are marked, those that say most. */
const POINTS = 40;
const NONE = { header: { words: [] }, arrays: {} };

/** Fill an element with the comparison of two shapes; null where the element is gone before they have come. */
export async function compareShapes(root, queryId, answerId) {
  const load = async (id) => ({ card: await loadCard(id), ...(await loadPictures(id)) });
  const shapes = await Promise.all([load(queryId), load(answerId)]);
  if (!root.isConnected) return null;
  const comparison = new Comparison([queryId, answerId], shapes);
  root.replaceChildren(comparison.root);
  root.closest("dialog")?.addEventListener("close", () => comparison.destroy(), { once: true });
  comparison.paint();
  bytes("api/words", { query: queryId, answer: answerId, n: WORDS })
    .then((body) => root.isConnected && comparison.explain(unpackArrays(body)))
    .catch((error) => comparison.explain(NONE, error.message));
  return comparison;
}

class Comparison {
  constructor(ids, shapes) {
    this.sides = shapes.map(({ card, geometry, fields }) => ({
      card, geometry, fields,
      stage: new Stage(geometry, {}, { slices: false }),
      colouring: new Colouring(geometry.n),
    }));
    this.map = 0;
    this.picked = null;
    this.words = NONE;
    this.bar = new Bar();
    this.why = element("div", { class: "shape-why" }, element("p", { class: "shape-note", role: "status" }, "Looking for what they share…"));
    const figures = this.sides.map(({ card, stage }, i) =>
      element("figure", {}, stage.root,
        element("figcaption", {},
          element("a", { href: href(`shape/${encodeURIComponent(ids[i])}`) }, card.name),
          element("span", { class: "shape-note" }, facts(card)))));
    this.root = element("div", { class: "shape-comparison" }, this.selector(),
      element("div", { class: "shape-pair" }, ...figures), this.bar.root, this.why);
    this.stopTheme = onTheme(() => this.paint());
  }

  selector() {
    const count = Math.min(...this.sides.map(({ fields }) => fields.nMaps));
    const name = `compared-${Math.random().toString(36).slice(2)}`;
    const entry = (map) => {
      const choose = () => {
        this.map = map;
        this.paint();
      };
      const input = element("input", { type: "radio", name, value: map + 1, checked: map === 0, onchange: choose });
      return element("label", {}, input, element("span", {}, `P${map + 1}`));
    };
    return element("fieldset", { class: "shape-choices chips" }, element("legend", {}, "SPEM map"),
      ...Array.from({ length: count }, (_, map) => entry(map)));
  }

  /** Limits of the map on both shapes; the first is positive, the others are about zero. */
  limits() {
    const all = this.sides.map(({ colouring, fields }) => {
      fields.map(this.map, colouring.values);
      return colouring.limits();
    });
    const [low, high] = [Math.min(all[0][0], all[1][0]), Math.max(all[0][1], all[1][1])];
    const most = Math.max(-low, high);
    return this.map === 0 ? [low, high] : [-most, most];
  }

  paint() {
    const limits = this.limits();
    for (const { card, stage, colouring, fields } of this.sides) {
      colourMap(colouring, fields, this.map, limits);
      stage.paint(colouring);
      const words = this.words.header.words.length ? " Points mark the visual words that are told below." : "";
      stage.describe(`Map P${this.map + 1} of ${card.name}, from ${shown(limits[0])} to ${shown(limits[1])} on both shapes.${words}`);
    }
    this.bar.show({ ...this.sides[0].colouring, title: `Map P${this.map + 1}, one scale for both` });
  }

  /** Tell the words that the shapes share most, and mark their points. */
  explain(words, failure = "") {
    this.words = words;
    const { words: found } = words.header;
    if (!found.length) {
      this.why.replaceChildren(element("p", { class: "shape-note" }, failure || "No visual word makes them alike."));
      return;
    }
    const { correlation, n_words: count } = words.header;
    const total = found.reduce((sum, { share }) => sum + share, 0);
    const alike = correlation > 0;
    const all = shown(correlation, 2);
    const note = [
      "Visual words are what codes are made of: typical surroundings of a point.",
      `Of ${count} words these ${found.length} bring most to the correlation of the two codes:`,
      alike ? `${shown(total, 2)} of ${all}.` : `${shown(total, 2)}, though all words together come to ${all}.`,
      "The points that say so are marked on both.",
    ].join(" ");
    this.list = element("ol", { class: "shape-legend words" });
    this.why.replaceChildren(element("h3", {}, alike ? "Why they are alike" : "What they share"), element("p", { class: "shape-note" }, note), this.list);
    this.mark(null);
  }

  entry({ kind, of, word, share }, i) {
    const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
    swatch.style.background = partColour(i);
    const pick = () => this.mark(this.picked === i ? null : i);
    return element("li", {},
      element("button", { type: "button", "aria-pressed": String(this.picked === i), onclick: pick },
        swatch, element("span", {}, `${kindName(kind, of)}, word ${word + 1}`),
        element("span", { class: "share" }, shown(share, 2))));
  }

  /** Mark the points of one word, or of all. */
  mark(picked) {
    this.picked = picked;
    const focused = [...this.list.querySelectorAll("button")].indexOf(document.activeElement);
    this.list.replaceChildren(...this.words.header.words.map((word, i) => this.entry(word, i)));
    if (focused >= 0) this.list.querySelectorAll("button")[focused].focus();
    ["query", "answer"].forEach((side, i) => {
      const points = this.words.arrays[`${side}_points`];
      const marks = this.words.header.words
        .map((word, at) => ({ at, span: word[side], colour: partColour(at) }))
        .filter(({ at }) => picked === null || picked === at)
        .map(({ span: [from, to], colour }) => ({
          colour,
          points: points.values.subarray(from * points.shape[1], Math.min(to, from + POINTS) * points.shape[1]),
        }));
      this.sides[i].stage.show({ marks });
    });
    this.paint();
  }

  destroy() {
    this.stopTheme();
    for (const { stage } of this.sides) stage.destroy();
  }
}

/** What features of a kind are of, as a name. */
function kindName(kind, of) {
  const name = of || kind;
  return name.charAt(0).toUpperCase() + name.slice(1);
}
