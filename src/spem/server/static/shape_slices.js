/** Three orthogonal slices of a solid, each with a slider for its place. */

import { element } from "./dom.js";
import { packedColour } from "./colours.js";
import { dot, fitCanvas, pageColour, Raster, ring } from "./shape_raster.js";

const MARGIN = 10;

class Slice {
  constructor(geometry, axis, { onNode, onSlice, onHover }) {
    this.geometry = geometry;
    this.axis = axis;
    // The first of the other axes goes right and the second up, as x and y do.
    [this.across, this.upward] = [0, 1, 2].filter((other) => other !== axis);
    this.raster = new Raster(geometry.grid[this.across], geometry.grid[this.upward]);
    this.shadow = new Raster(geometry.grid[this.across], geometry.grid[this.upward]);
    const name = geometry.header.axes?.[axis] ?? `axis ${axis}`;
    this.canvas = element("canvas", { class: "shape-canvas", role: "application", tabindex: 0 });
    this.value = element("output", {});
    this.slider = element("input", {
      type: "range",
      min: 0,
      max: geometry.grid[axis] - 1,
      "aria-label": `Slice across ${name}`,
      oninput: () => onSlice(axis, Number(this.slider.value)),
    });
    this.name = name;
    this.root = element(
      "div",
      { class: "shape-slice" },
      this.canvas,
      element("label", { class: "shape-slice-label" }, element("span", {}, name), this.slider, this.value),
    );
    this.listen(onNode, onHover);
  }

  listen(onNode, onHover) {
    this.canvas.addEventListener("click", (event) => {
      const flat = this.geometry.cell(this.index(event));
      if (flat >= 0 && this.geometry.cells[flat] >= 0) onNode(this.geometry.cells[flat]);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      const flat = this.geometry.cell(this.index(event));
      onHover?.(flat < 0 ? -1 : this.geometry.cells[flat]);
    });
    this.canvas.addEventListener("pointerleave", () => onHover?.(-1));
    this.canvas.addEventListener("keydown", (event) => {
      const steps = {
        ArrowLeft: [this.across, -1],
        ArrowRight: [this.across, 1],
        ArrowUp: [this.upward, 1],
        ArrowDown: [this.upward, -1],
        PageUp: [this.axis, 1],
        PageDown: [this.axis, -1],
      };
      const step = steps[event.key];
      if (!step) return;
      event.preventDefault();
      let node = this.node ?? this.geometry.middle();
      if (this.node !== null) {
        for (let i = 0; i < (event.shiftKey ? 8 : 1); i += 1) node = this.geometry.neighbour(node, ...step);
      }
      onNode(node, { typed: true });
    });
  }

  index(event) {
    const box = this.canvas.getBoundingClientRect();
    const { left, bottom, right, up } = this.frame;
    const index = [0, 0, 0];
    index[this.axis] = this.place;
    index[this.across] = Math.round((event.clientX - box.left - left) / right);
    index[this.upward] = Math.round((bottom - (event.clientY - box.top)) / up);
    return index;
  }

  /** Cut at a place; only then the pixels have other nodes. */
  cut(place) {
    if (place === this.place) return;
    this.place = place;
    const { geometry, axis, upward, across } = this;
    const [down, right] = [geometry.strides[upward], geometry.strides[across]];
    const last = geometry.grid[upward] - 1;
    this.raster.take(geometry.cells, place * geometry.strides[axis] + last * down, -down, right);
    this.slider.value = place;
    this.value.textContent = String(place);
    this.canvas.setAttribute("aria-label", `Slice across ${this.name} at ${place} of ${geometry.grid[axis] - 1}`);
  }

  /** Colour the slice, and what of the shape lies before and behind it. */
  paint(colouring) {
    this.raster.paint(colouring);
    if (this.tone === pageColour("--line")) return;
    this.tone = pageColour("--line");
    const { geometry, across, upward } = this;
    const { width, height } = this.shadow.canvas;
    for (let i = 0; i < geometry.n; i += 1) {
      const place = geometry.place(i);
      this.shadow.node[(height - 1 - place[upward]) * width + place[across]] = 0;
    }
    this.shadow.paint({ level: [0], table: [packedColour(this.tone)] });
  }

  draw(node, marks) {
    this.node = node;
    if (!fitCanvas(this.canvas)) return;
    const { canvas, geometry, across, upward } = this;
    const [wide, tall] = [across, upward].map((axis) => geometry.grid[axis] * geometry.spacing[axis]);
    const scale = Math.min((canvas.clientWidth - 2 * MARGIN) / wide, (canvas.clientHeight - 2 * MARGIN) / tall);
    const [right, up] = [geometry.spacing[across] * scale, geometry.spacing[upward] * scale];
    const left = (canvas.clientWidth - wide * scale + right) / 2;
    const bottom = (canvas.clientHeight + tall * scale - up) / 2;
    this.frame = { left, bottom, right, up };
    const context = canvas.getContext("2d");
    const ratio = canvas.width / canvas.clientWidth;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
    context.imageSmoothingEnabled = false;
    const place = [left - right / 2, bottom - tall * scale + up / 2, wide * scale, tall * scale];
    context.drawImage(this.shadow.canvas, ...place);
    context.drawImage(this.raster.canvas, ...place);
    this.drawOver(context, marks);
  }

  drawOver(context, marks) {
    const { left, bottom, right, up } = this.frame;
    for (const { points, colour } of marks) {
      for (let i = 0; i + 2 < points.length; i += 3) {
        if (Math.abs(points[i + this.axis] - this.place) > 1) continue;
        dot(context, left + points[i + this.across] * right, bottom - points[i + this.upward] * up, 4, colour);
      }
    }
    if (this.node === null) return;
    const index = this.geometry.place(this.node);
    if (index[this.axis] !== this.place) return;
    ring(context, left + index[this.across] * right, bottom - index[this.upward] * up, 6, "white");
  }
}

export class Slices {
  /** `onNode(node)` and `onSlice(axis, place)` hear of clicks, keys and sliders. */
  constructor(geometry, heard) {
    this.geometry = geometry;
    this.marks = [];
    this.node = null;
    this.slices = [0, 1, 2].map((axis) => new Slice(geometry, axis, heard));
    this.root = element(
      "div",
      { class: "shape-slices", role: "group", "aria-label": "Slices" },
      ...this.slices.map(({ root }) => root),
    );
    this.watcher = new ResizeObserver(() => this.draw());
    this.watcher.observe(this.root);
  }

  /** Colour the slices. */
  paint(colouring) {
    this.colouring = colouring;
    for (const slice of this.slices) slice.paint(colouring);
    this.draw();
  }

  /** Show a node and marks, and cut at three places. */
  show({ node = this.node, marks = this.marks, places = null }) {
    Object.assign(this, { node, marks });
    const fullest = this.geometry.fullest();
    for (const slice of this.slices) {
      const before = slice.place;
      slice.cut(places?.[slice.axis] ?? slice.place ?? fullest[slice.axis]);
      if (slice.place !== before && this.colouring) slice.paint(this.colouring);
    }
    this.draw();
  }

  draw() {
    for (const slice of this.slices) if (slice.place !== undefined) slice.draw(this.node, this.marks);
  }

  /** Say what is seen. */
  describe(text) {
    this.root.setAttribute("aria-label", text);
  }

  /** The slices beside each other as one canvas. */
  drawn() {
    this.draw();
    const canvases = this.slices.map(({ canvas }) => canvas);
    const all = document.createElement("canvas");
    all.width = canvases.reduce((sum, { width }) => sum + width, 0);
    all.height = Math.max(...canvases.map(({ height }) => height));
    let left = 0;
    for (const canvas of canvases) {
      all.getContext("2d").drawImage(canvas, left, 0);
      left += canvas.width;
    }
    return all;
  }

  destroy() {
    this.watcher.disconnect();
  }
}
