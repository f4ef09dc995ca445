/** What colours mean: a bar with its limits, and the picture of both as a PNG file. */

import { css, gradient } from "./colours.js";
import { shown } from "./shape_colouring.js";
import { element } from "./dom.js";
import { pageColour } from "./shape_raster.js";

export class Bar {
  constructor() {
    this.title = element("span", { class: "shape-bar-title" });
    this.strip = element("span", { class: "shape-bar-strip", "aria-hidden": "true" });
    this.ticks = [0, 1, 2].map(() => element("span", {}));
    const ticks = element("span", { class: "shape-bar-ticks" }, ...this.ticks);
    this.scale = element("span", { class: "shape-bar-scale" }, this.strip, ticks);
    this.root = element("div", { class: "shape-bar" }, this.title, this.scale);
  }

  show({ title, table, low, high, labels, symbol }) {
    this.title.textContent = title;
    this.scale.hidden = Boolean(labels);
    if (labels) return;
    if (this.table !== table) this.strip.style.backgroundImage = gradient(table);
    this.table = table;
    [low, (low + high) / 2, high].forEach((value, i) => (this.ticks[i].textContent = shown(value)));
    this.scale.title = `${symbol} from ${shown(low)} to ${shown(high)}`;
  }
}

/** A picture with its colour bar, as a canvas to be saved. */
export function withBar(picture, { title, table, low, high, labels }) {
  const unit = Math.max(picture.width / 640, 1);
  const canvas = document.createElement("canvas");
  canvas.width = picture.width;
  canvas.height = picture.height + 72 * unit;
  const context = canvas.getContext("2d");
  context.fillStyle = pageColour("--picture") || "white";
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(picture, 0, 0);
  context.fillStyle = pageColour("--ink");
  context.font = `${14 * unit}px system-ui, sans-serif`;
  const [left, top, width] = [20 * unit, picture.height + 18 * unit, canvas.width - 40 * unit];
  context.fillText(title, left, top);
  const boxes = labels ?? Array.from({ length: 256 }, (_, level) => ({ colour: css(table[level]) }));
  boxes.forEach(({ colour, label }, i) => {
    context.fillStyle = colour;
    context.fillRect(left + (width * i) / boxes.length, top + 8 * unit, width / boxes.length + 0.5, 14 * unit);
    context.fillStyle = pageColour("--ink");
    if (labels) context.fillText(String(label + 1), left + (width * i) / boxes.length, top + 40 * unit);
  });
  if (labels) return canvas;
  for (const [align, x, value] of [["left", left, low], ["right", left + width, high]]) {
    context.textAlign = align;
    context.fillText(shown(value), x, top + 40 * unit);
  }
  return canvas;
}
