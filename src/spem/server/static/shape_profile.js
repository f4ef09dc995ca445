/** The field of one point against rho, beside what it is over the whole shape: a chart and a table. */

import { shown } from "./shape_colouring.js";
import { download, element } from "./dom.js";
import { toCsv } from "./table.js";

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT] = [400, 250];
const BOX = { left: 40, right: 388, top: 12, bottom: 208 };
const COLUMNS = ["rho", "v", "p5", "p25", "p50", "p75", "p95"];
const HEADINGS = ["ρ", "v here", "5 %", "25 %", "median", "75 %", "95 %"];

function svg(tag, properties = {}, ...children) {
  const made = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(properties)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** Round steps of an axis, about so many. */
function steps(low, high, count) {
  const rough = (high - low) / count;
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * unit >= rough) * unit;
  const ticks = [];
  for (let tick = Math.ceil(low / step) * step; tick <= high + 1e-9 * step; tick += step) ticks.push(Number(tick.toPrecision(12)));
  return ticks;
}

export class Profile {
  constructor(fields, name) {
    this.fields = fields;
    this.name = name;
    this.node = null;
    this.finite = [...fields.rho].filter(Number.isFinite);
    this.low = Math.min(0, this.finite[0]);
    this.high = this.finite.at(-1);
    this.chart = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", class: "shape-chart" });
    this.line = svg("path", { class: "chart-own" });
    this.cursor = svg("line", { class: "chart-rho", y1: BOX.top, y2: BOX.bottom });
    this.point = svg("circle", { class: "chart-point", r: 4.5 });
    this.chart.append(...this.axes(), ...this.bands(), this.cursor, this.line, this.point);
    this.body = element("tbody");
    this.root = element("div", { class: "shape-profile" }, this.chart, this.legend(), this.table());
    this.show(null);
  }

  x(rho) {
    return BOX.left + ((rho - this.low) / (this.high - this.low)) * (BOX.right - BOX.left);
  }

  y(value) {
    return BOX.bottom - Math.min(Math.max(value, 0), 1) * (BOX.bottom - BOX.top);
  }

  axes() {
    const made = [];
    for (const tick of [0, 0.25, 0.5, 0.75, 1]) {
      made.push(svg("line", { class: "chart-grid", x1: BOX.left, x2: BOX.right, y1: this.y(tick), y2: this.y(tick) }));
      made.push(svg("text", { x: BOX.left - 7, y: this.y(tick) + 4, "text-anchor": "end" }, String(tick)));
    }
    for (const tick of steps(this.low, this.high, 5)) {
      made.push(svg("text", { x: this.x(tick), y: BOX.bottom + 17, "text-anchor": "middle" }, shown(tick)));
    }
    const middle = (BOX.left + BOX.right) / 2;
    made.push(svg("text", { x: middle, y: HEIGHT - 6, "text-anchor": "middle", class: "chart-name" }, "screening length ρ, in units of the file"));
    made.push(svg("text", { x: 10, y: this.y(0.625) + 4, "text-anchor": "middle", class: "chart-name" }, "v"));
    return made;
  }

  /** Path of one of the quantiles, forth or back. */
  along(quantile, back = false) {
    const places = this.finite.map((rho, i) => `${this.x(rho).toFixed(1)} ${this.y(this.quantile(i, quantile)).toFixed(1)}`);
    return (back ? places.reverse() : places).join("L");
  }

  quantile(sample, which) {
    return this.fields.population[5 * sample + which];
  }

  bands() {
    const band = (low, high, kind) => svg("path", { class: kind, d: `M${this.along(low)}L${this.along(high, true)}Z` });
    return [band(0, 4, "chart-wide"), band(1, 3, "chart-half"), svg("path", { class: "chart-median", d: `M${this.along(2)}` })];
  }

  legend() {
    const entry = (kind, words) => element("li", {}, element("span", { class: `key ${kind}`, "aria-hidden": "true" }), words);
    this.own = entry("key-own", "this point");
    return element(
      "ul",
      { class: "shape-key" },
      this.own,
      entry("key-median", "median of the nodes"),
      entry("key-half", "middle half"),
      entry("key-wide", "5 to 95 %"),
    );
  }

  table() {
    const head = element("tr", {}, HEADINGS.map((name) => element("th", { scope: "col" }, name)));
    const scroller = element(
      "div",
      { class: "shape-table", tabindex: 0, role: "region", "aria-label": "Table of the profile" },
      element("table", {}, element("thead", {}, head), this.body),
    );
    const save = element("button", { type: "button", class: "button small", onclick: () => this.save() }, "Profile as CSV");
    return element("details", {}, element("summary", {}, "As a table"), scroller, save);
  }

  /** Show the profile of a node, or only that of the shape. */
  show(node) {
    this.node = node;
    this.values = node === null ? null : this.fields.profile(node);
    const places = this.finite.map((rho, i) => (this.values ? `${this.x(rho).toFixed(1)} ${this.y(this.values[i]).toFixed(1)}` : ""));
    this.line.setAttribute("d", this.values ? `M${places.join("L")}` : "");
    this.own.hidden = node === null;
    this.body.replaceChildren(
      ...this.rows().map((row) => element("tr", {}, COLUMNS.map((key) => element("td", { "data-value": row[key] }, row[key] === "" ? "–" : shown(row[key], 4))))),
    );
    this.describe();
    if (this.at !== undefined) this.move(this.at);
  }

  /** Rows of the table: numbers, the field of the node empty where none is chosen. */
  rows() {
    return Array.from(this.fields.rho, (rho, i) => ({
      rho,
      v: this.values ? this.values[i] : "",
      ...Object.fromEntries(COLUMNS.slice(2).map((key, q) => [key, this.quantile(i, q)])),
    }));
  }

  describe() {
    const last = this.finite.length - 1;
    const range = `ρ from ${shown(this.finite[0])} to ${shown(this.high)}`;
    const median = `the median of the nodes rises from ${shown(this.quantile(0, 2))} to ${shown(this.quantile(last, 2))}`;
    const own = this.values ? `The field at node ${this.node} rises from ${shown(this.values[0])} to ${shown(this.values[last])}; ` : "";
    this.chart.setAttribute("aria-label", `Chart over ${range}. ${own}${median}.`);
  }

  /** Move the line of the rho that is shown. */
  move(place) {
    this.at = place;
    const x = this.x(Math.min(this.fields.between(this.fields.rho, place), this.high)).toFixed(1);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    this.point.style.display = this.values ? "" : "none";
    if (!this.values) return;
    this.point.setAttribute("cx", x);
    this.point.setAttribute("cy", this.y(this.fields.between(this.values, place)).toFixed(1));
  }

  /** Hand the table to the browser's downloads. */
  save() {
    const name = this.node === null ? `${this.name}-profile.csv` : `${this.name}-node-${this.node}.csv`;
    download(name, toCsv(this.rows(), COLUMNS), "text/csv");
  }
}
