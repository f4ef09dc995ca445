/** What a shape is coloured by: the field at a rho, a map, parts, or the log field of one source. */

import { debounced, element } from "./dom.js";
import { partColour } from "./colours.js";
import { shown } from "./shape_colouring.js";

/** Steps of the slider between two sampled rho. */
const FINE = 0.02;
const MOST_PARTS = 12;
const SHOWN = { field: "Field", map: "Map", parts: "Parts", source: "Source" };

function choices(name, legend, entries, onChoice, kind) {
  const inputs = {};
  const labels = entries.map(([value, words, title]) => {
    inputs[value] = element("input", { type: "radio", name, value, onchange: () => onChoice(value) });
    return element("label", { title }, inputs[value], element("span", {}, words));
  });
  const root = element("fieldset", { class: `shape-choices ${kind}` }, element("legend", {}, legend), ...labels);
  return { root, choose: (value) => inputs[value] && (inputs[value].checked = true) };
}

export class Controls {
  /** `onRho(place)` hears of every move of the slider, `onChange(changes)` of the rest. */
  constructor({ fields, nSources, solid }, { onRho, onChange }) {
    Object.assign(this, { fields, nSources, solid, onRho, onChange });
    this.show = choices("show", "Colour by", Object.entries(SHOWN), (show) => onChange({ show }), "segments");
    this.panels = { field: this.fieldPanel(), map: this.mapPanel(), parts: this.partPanel(), source: this.sourcePanel() };
    this.root = element("section", { class: "shape-card shape-controls", "aria-label": "Colours" }, this.show.root, ...Object.values(this.panels));
  }

  fieldPanel() {
    this.rho = element("output", { class: "shape-rho", for: "shape-rho" });
    this.slider = element("input", {
      id: "shape-rho",
      type: "range",
      min: 0,
      max: this.fields.rho.length - 1,
      step: FINE,
      oninput: () => this.onRho(Number(this.slider.value)),
      onkeydown: (event) => {
        // One sample a key, as the samples are what is computed; what lies between is for the pointer.
        const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 8, PageDown: -8 }[event.key];
        if (!step) return;
        event.preventDefault();
        const next = step > 0 ? Math.floor(Number(this.slider.value) + 1e-9) : Math.ceil(Number(this.slider.value) - 1e-9);
        this.slider.value = next + step;
        this.onRho(Number(this.slider.value));
      },
    });
    this.fit = element("input", { type: "checkbox", onchange: () => this.onChange({ fit: this.fit.checked ? "1" : "0" }) });
    return element(
      "div",
      { class: "shape-panel" },
      element("label", { class: "shape-slider", for: "shape-rho" }, "Screening length"),
      this.rho,
      this.slider,
      element("label", { class: "shape-check" }, this.fit, "Spread the colours over the values shown"),
    );
  }

  mapPanel() {
    const share = (map) => this.fields.header.explained?.[map];
    const entries = Array.from({ length: this.fields.nMaps }, (_, map) => [
      String(map + 1),
      `P${map + 1}`,
      share(map) === undefined ? null : `${shown(100 * share(map))} % of the variance`,
    ]);
    this.map = choices("map", "SPEM map", entries, (map) => this.onChange({ map }), "chips");
    return element(
      "div",
      { class: "shape-panel" },
      this.map.root,
      element("p", { class: "shape-note" }, "Principal components of the fields over ρ; from P2 on, blue is below zero and red above."),
    );
  }

  partPanel() {
    const options = Array.from({ length: MOST_PARTS }, (_, i) => element("option", { value: i + 1 }, String(i + 1)));
    this.k = element("select", { id: "shape-k", onchange: () => this.onChange({ k: this.k.value || null, part: null }) },
      element("option", { value: "" }, "chosen by the shape"), ...options);
    this.legend = element("ul", { class: "shape-legend" });
    this.strength = element("input", { type: "checkbox", onchange: () => this.onChange({ show: this.strength.checked ? "strength" : "parts" }) });
    this.partNote = element("p", { class: "shape-note" });
    return element(
      "div",
      { class: "shape-panel" },
      element("label", { class: "field inline", for: "shape-k" }, element("span", {}, "Number of parts k"), this.k),
      this.legend,
      element("label", { class: "shape-check" }, this.strength, "How strongly the chosen part explains each point"),
      this.partNote,
    );
  }

  sourcePanel() {
    const chosen = debounced(() => this.source.value !== "" && this.step(0), 250);
    this.source = element("input", { id: "shape-source", type: "number", min: 0, max: this.nSources - 1, oninput: chosen });
    const button = (words, sign, step) =>
      element("button", { type: "button", class: "button small", "aria-label": words, onclick: () => this.step(step) }, sign);
    this.sourceNote = element("p", { class: "shape-note" });
    return element(
      "div",
      { class: "shape-panel" },
      element("div", { class: "shape-stepper" },
        element("label", { for: "shape-source" }, "Source"),
        button("Previous source", "−", -1), this.source, button("Next source", "+", 1)),
      element("p", { class: "shape-note" },
        `Click the ${this.solid ? "surface" : "contour"} to choose one of ${this.nSources} patches of the boundary: it is held at 1 and the rest at 0.`),
      this.sourceNote,
    );
  }

  step(by) {
    const source = (Number(this.source.value) + by + this.nSources) % this.nSources;
    this.onChange({ show: "source", source: String(source) });
  }

  /** Show what is chosen. */
  update(view) {
    const kind = view.show === "strength" ? "parts" : view.show;
    this.show.choose(kind);
    for (const [name, panel] of Object.entries(this.panels)) panel.hidden = name !== kind;
    this.fit.checked = view.fit;
    this.map.choose(String(view.map + 1));
    this.k.value = view.k ?? "";
    this.strength.checked = view.show === "strength";
    this.strength.disabled = view.part === null;
    if (document.activeElement !== this.source) this.source.value = view.source ?? 0;
    this.moveTo(view.place);
  }

  /** Show a rho. */
  moveTo(place) {
    const [rho, relative] = [this.fields.rho, this.fields.relative].map((samples) => this.fields.between(samples, place));
    if (Math.abs(Number(this.slider.value) - place) > FINE / 2) this.slider.value = place;
    const words = `ρ = ${shown(rho)}, ${shown(relative)} of the size`;
    this.slider.setAttribute("aria-valuetext", words);
    this.rho.textContent = words;
  }

  /** Show the parts that were found, one of them picked out. */
  showParts(parts, picked) {
    const { values, shape } = parts.arrays.sizes;
    const entry = (part) =>
      element("button", {
        type: "button",
        "aria-pressed": String(picked === part),
        "aria-label": `Part ${part + 1}, ${shown(100 * values[part])} % of the shape`,
        onclick: () => this.onChange(picked === part ? { part: null, show: "parts" } : { part: String(part + 1) }),
      }, this.swatch(partColour(part)), element("span", {}, `Part ${part + 1}`), element("span", { class: "share" }, `${shown(100 * values[part])} %`));
    // Focus stays where it was, as the list is made anew.
    const focused = [...this.legend.querySelectorAll("button")].indexOf(document.activeElement);
    this.legend.replaceChildren(...Array.from({ length: shape[0] }, (_, part) => element("li", {}, entry(part))));
    if (focused >= 0) this.legend.querySelectorAll("button")[focused]?.focus();
    this.partNote.textContent = partWords(parts.header);
  }

  swatch(colour) {
    const made = element("span", { class: "swatch", "aria-hidden": "true" });
    made.style.background = colour;
    return made;
  }

  /** Say what is known of a source. */
  showSource({ header }) {
    const { unreached, rho } = header;
    const words = [`Natural logarithm, at ρ = ${Number.isFinite(rho) ? shown(rho) : "∞"}.`];
    if (unreached) words.push(`${unreached} nodes are not reached; they have the least value.`);
    this.sourceNote.textContent = words.join(" ");
  }
}

/** k and the sparsity of some parts, in words. */
function partWords({ k, chosen, sparsity, unexplained }) {
  const words = [`k = ${k}${chosen ? ", where more parts explain little more" : ""}`];
  if (sparsity) words.push(`λ = ${shown(sparsity.penalty)}, ${shown(100 * sparsity.share)} % of the λ at which all codes vanish`);
  if (unexplained) words.push(`${shown(100 * unexplained)} % of the nodes are in no part`);
  return `${words.join("; ")}.`;
}
