/** The picture of a silhouette: crisp pixels cut along the contour, a cursor, marks and a source. */

import { element } from "./dom.js";
import { dot, dotSize, fitCanvas, pageColour, Raster, ring } from "./shape_raster.js";

const MARGIN = 14;
/** How near the contour a click means it, in CSS pixels. */
const REACH = { mouse: 7, pen: 9, touch: 14 };

export class Picture {
  /** `onNode(node)` and `onSource(patch)` hear of clicks and keys; without them the picture is only looked at. */
  constructor(geometry, { onNode, onSource, onHover } = {}) {
    this.geometry = geometry;
    this.marks = [];
    this.node = null;
    this.source = null;
    const interactive = Boolean(onNode);
    this.canvas = element("canvas", {
      class: "shape-canvas",
      role: interactive ? "application" : "img",
      tabindex: interactive ? 0 : null,
    });
    const [height, width] = geometry.grid;
    this.raster = new Raster(width, height);
    this.raster.take(geometry.near, 0, geometry.strides[0], geometry.strides[1]);
    if (interactive) this.listen(onNode, onSource, onHover);
    this.watcher = new ResizeObserver(() => this.draw());
    this.watcher.observe(this.canvas);
  }

  listen(onNode, onSource, onHover) {
    this.canvas.addEventListener("click", (event) => {
      const point = this.point(event);
      const patch = this.patchAt(point, REACH[event.pointerType] ?? REACH.mouse);
      const node = this.geometry.nodeAt(this.index(point));
      if (patch >= 0) onSource(patch);
      else if (node >= 0) onNode(node);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      const flat = this.geometry.cell(this.index(this.point(event)).map(Math.round));
      onHover?.(flat < 0 ? -1 : this.geometry.cells[flat]);
    });
    this.canvas.addEventListener("pointerleave", () => onHover?.(-1));
    this.canvas.addEventListener("keydown", (event) => {
      const step = { ArrowUp: [0, -1], ArrowDown: [0, 1], ArrowLeft: [1, -1], ArrowRight: [1, 1] }[event.key];
      if (!step) return;
      event.preventDefault();
      let node = this.node ?? this.geometry.middle();
      if (this.node !== null) {
        for (let i = 0; i < (event.shiftKey ? 8 : 1); i += 1) node = this.geometry.neighbour(node, ...step);
      }
      onNode(node, { typed: true });
    });
  }

  /** Colour the picture. */
  paint(colouring) {
    this.raster.paint(colouring);
    this.draw();
  }

  /** Show a node, a source, and marks `{points, colour}` in index units. */
  show({ node = this.node, source = this.source, marks = this.marks }) {
    Object.assign(this, { node, source, marks });
    this.draw();
  }

  /** Where an event is, in CSS pixels of the canvas. */
  point(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  index([x, y]) {
    const { left, top, right, down } = this.frame;
    return [(y - top) / down, (x - left) / right];
  }

  /** Patch of the contour point nearest to a place, -1 where none is in reach. */
  patchAt([x, y], reach) {
    const { contour, contour_patch: patch } = this.geometry.arrays;
    const { left, top, right, down } = this.frame;
    let best = -1;
    let least = reach * reach;
    for (let i = 0; i < contour.shape[0]; i += 1) {
      const far = (contour.values[2 * i + 1] * right + left - x) ** 2 + (contour.values[2 * i] * down + top - y) ** 2;
      if (far < least) [best, least] = [patch.values[i], far];
    }
    return best;
  }

  /** Place and size of the cells on the canvas, in CSS pixels. */
  layout() {
    const { geometry, canvas } = this;
    const { values } = geometry.arrays.contour;
    const low = [Infinity, Infinity];
    const high = [-Infinity, -Infinity];
    for (let i = 0; i < values.length; i += 1) {
      low[i % 2] = Math.min(low[i % 2], values[i]);
      high[i % 2] = Math.max(high[i % 2], values[i]);
    }
    const [tall, wide] = [0, 1].map((axis) => Math.max(high[axis] - low[axis], 1) * geometry.spacing[axis]);
    const scale = Math.min((canvas.clientWidth - 2 * MARGIN) / wide, (canvas.clientHeight - 2 * MARGIN) / tall);
    const [down, right] = geometry.spacing.map((spacing) => spacing * scale);
    const left = canvas.clientWidth / 2 - ((low[1] + high[1]) / 2) * right;
    const top = canvas.clientHeight / 2 - ((low[0] + high[0]) / 2) * down;
    this.frame = { left, top, right, down };
  }

  /** The closed curves, of all points or those of a source. */
  curves(source = null) {
    const { contour, contour_start: start, contour_patch: patch } = this.geometry.arrays;
    const { left, top, right, down } = this.frame;
    const path = new Path2D();
    for (let curve = 0; curve + 1 < start.values.length; curve += 1) {
      const [from, to] = [start.values[curve], start.values[curve + 1]];
      let drawing = false;
      for (let i = from; i <= to - (source === null ? 1 : 0); i += 1) {
        const at = i === to ? from : i;
        const wanted = source === null || patch.values[at] === source;
        const place = [contour.values[2 * at + 1] * right + left, contour.values[2 * at] * down + top];
        if (wanted && drawing) path.lineTo(...place);
        else if (wanted) path.moveTo(...place);
        drawing = wanted;
      }
      if (source === null) path.closePath();
    }
    return path;
  }

  draw() {
    if (!fitCanvas(this.canvas)) return;
    this.layout();
    const context = this.canvas.getContext("2d");
    const ratio = this.canvas.width / this.canvas.clientWidth;
    const { left, top, right, down } = this.frame;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    const curves = this.curves();
    context.save();
    context.clip(curves, "evenodd");
    context.imageSmoothingEnabled = false;
    const { width, height } = this.raster.canvas;
    context.drawImage(this.raster.canvas, left - right / 2, top - down / 2, width * right, height * down);
    context.restore();
    context.lineJoin = context.lineCap = "round";
    context.lineWidth = 1.5;
    context.strokeStyle = pageColour("--shape-line");
    context.stroke(curves);
    this.drawOver(context);
  }

  drawOver(context) {
    const { left, top, right, down } = this.frame;
    if (this.source !== null) {
      const path = this.curves(this.source);
      for (const [width, colour] of [[8, pageColour("--shape-line")], [4.5, pageColour("--shape-mark")]]) {
        context.lineWidth = width;
        context.strokeStyle = colour;
        context.stroke(path);
      }
    }
    for (const { points, colour } of this.marks) {
      for (let i = 0; i + 1 < points.length; i += 2) {
        dot(context, points[i + 1] * right + left, points[i] * down + top, dotSize(this.canvas) / 2, colour);
      }
    }
    if (this.node !== null) {
      const [row, column] = this.geometry.place(this.node);
      ring(context, column * right + left, row * down + top, 7, "white");
    }
  }

  /** Say what is seen. */
  describe(text) {
    this.canvas.setAttribute("aria-label", text);
  }

  /** The canvas, drawn just now. */
  drawn() {
    this.draw();
    return this.canvas;
  }

  destroy() {
    this.watcher.disconnect();
  }
}
