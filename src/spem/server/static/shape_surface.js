/** The surface of a solid, to be turned by mouse, touch, keys and buttons. */

import { element } from "./dom.js";
import { isDark, shares } from "./colours.js";
import { extents, faceUnder, principalView, times, turn, vertexNormals } from "./shape_camera.js";
import { Graphics } from "./shape_gl.js";
import { dotSize, fitCanvas } from "./shape_raster.js";

const STEP = Math.PI / 12;
const ZOOM = 1.25;
const TURNS = {
  ArrowLeft: turn(1, -STEP),
  ArrowRight: turn(1, STEP),
  ArrowUp: turn(0, -STEP),
  ArrowDown: turn(0, STEP),
};
const BUTTONS = [
  ["Turn left", "←", "ArrowLeft"],
  ["Turn right", "→", "ArrowRight"],
  ["Turn up", "↑", "ArrowUp"],
  ["Turn down", "↓", "ArrowDown"],
  ["Nearer", "+", "+"],
  ["Farther", "−", "-"],
  ["First view", "⟲", "Home"],
];
/** Moves of the pointer below this many pixels are clicks. */
const STILL = 4;

export class Surface {
  /** `onNode(node)` and `onSource(patch)` hear of clicks. Throws where WebGL 2 is missing. */
  constructor(geometry, { onNode, onSource, onHover } = {}) {
    this.geometry = geometry;
    this.canvas = element("canvas", { class: "shape-canvas turning", role: "application", tabindex: 0 });
    this.graphics = new Graphics(this.canvas, geometry.grid);
    const { vertex, face } = geometry.arrays;
    this.scaled = Float32Array.from(vertex.values, (value, i) => value * geometry.spacing[i % 3]);
    this.graphics.mesh(vertex.values, vertexNormals(this.scaled, face.values), face.values);
    this.near = this.covered();
    this.first = principalView(this.nodePoints());
    this.rotation = this.first;
    this.zoom = 1;
    Object.assign(this, extents(this.scaled, this.first));
    Object.assign(this, { marks: [], node: null, source: null, heard: { onNode, onSource, onHover } });
    this.buttons = element(
      "div",
      { class: "shape-buttons", role: "group", "aria-label": "Turn the surface" },
      ...BUTTONS.map(([name, sign, key]) =>
        element("button", { type: "button", "aria-label": name, title: name, onclick: () => this.key(key) }, sign),
      ),
    );
    this.root = element("div", { class: "shape-turning" }, this.canvas, this.buttons);
    this.listen();
    this.watcher = new ResizeObserver(() => this.draw());
    this.watcher.observe(this.canvas);
  }

  nodePoints() {
    const { node, spacing } = this.geometry;
    return Float32Array.from(node, (index, i) => index * spacing[i % 3]);
  }

  /** Cells with their nodes, those about every vertex included. */
  covered() {
    const { geometry } = this;
    const { vertex, vertex_node: nodes } = geometry.arrays;
    const near = geometry.near.slice();
    for (let v = 0; v < nodes.values.length; v += 1) {
      for (let corner = 0; corner < 8; corner += 1) {
        const index = [0, 1, 2].map((axis) => Math.floor(vertex.values[3 * v + axis]) + ((corner >> axis) & 1));
        const flat = geometry.cell(index);
        if (flat >= 0 && near[flat] < 0) near[flat] = nodes.values[v];
      }
    }
    return near;
  }

  listen() {
    const held = new Map();
    let moved = 0;
    this.canvas.addEventListener("pointerdown", (event) => {
      held.set(event.pointerId, [event.clientX, event.clientY]);
      this.canvas.setPointerCapture(event.pointerId);
      moved = 0;
    });
    this.canvas.addEventListener("pointermove", (event) => {
      const from = held.get(event.pointerId);
      if (!from) return;
      const by = [event.clientX - from[0], event.clientY - from[1]];
      moved += Math.abs(by[0]) + Math.abs(by[1]);
      const others = [...held.entries()].filter(([id]) => id !== event.pointerId);
      held.set(event.pointerId, [event.clientX, event.clientY]);
      if (others.length) this.pinch(from, [event.clientX, event.clientY], others[0][1]);
      else if (moved > STILL) this.rotate(times(turn(1, by[0] / 120), turn(0, by[1] / 120)));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      this.canvas.addEventListener(end, (event) => {
        held.delete(event.pointerId);
        if (end === "pointerup" && moved <= STILL) this.pick(event);
      });
    }
    this.canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== this.canvas) return;
      event.preventDefault();
      this.setZoom(this.zoom * Math.exp(-event.deltaY / 500));
    }, { passive: false });
    this.canvas.addEventListener("keydown", (event) => {
      if (this.key(event.key)) event.preventDefault();
    });
  }

  /** Do what a key or its button stands for; false where it stands for nothing. */
  key(key) {
    if (TURNS[key]) this.rotate(TURNS[key]);
    else if (key === "+" || key === "=") this.setZoom(this.zoom * ZOOM);
    else if (key === "-") this.setZoom(this.zoom / ZOOM);
    else if (key === "Enter") this.choose(0, 0, false);
    else if (key === "Home") [this.rotation, this.zoom] = [this.first, 1];
    else return false;
    this.draw();
    return true;
  }

  rotate(by) {
    this.rotation = times(by, this.rotation);
    this.draw();
  }

  setZoom(zoom) {
    this.zoom = Math.min(Math.max(zoom, 0.5), 12);
    this.draw();
  }

  pinch(from, to, other) {
    const far = ([x, y]) => Math.hypot(x - other[0], y - other[1]);
    this.setZoom((this.zoom * far(to)) / Math.max(far(from), 1));
  }

  /** Half the height of the picture in the unit of the file. */
  reach() {
    const aspect = this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1);
    return (1.06 * Math.max(this.extent[1], this.extent[0] / aspect)) / this.zoom;
  }

  pick(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    this.choose(x, y, true);
  }

  /** Choose the point under a place of the picture, from -1 to 1 in both directions. */
  choose(x, y, asked) {
    const { vertex, face, vertex_patch: patch } = this.geometry.arrays;
    const reach = this.reach();
    const aspect = this.canvas.clientWidth / this.canvas.clientHeight;
    const hit = faceUnder(this.turned(), face.values, x * reach * aspect, y * reach);
    if (!hit) return;
    const corners = [0, 1, 2].map((i) => face.values[hit.face + i]);
    const place = [0, 1, 2].map((axis) =>
      corners.reduce((sum, corner, i) => sum + hit.weights[i] * vertex.values[3 * corner + axis], 0),
    );
    const nearest = corners[hit.weights.indexOf(Math.max(...hit.weights))];
    const flat = this.geometry.cell(place.map(Math.round));
    const node = flat < 0 || this.near[flat] < 0 ? this.geometry.arrays.vertex_node.values[nearest] : this.near[flat];
    this.heard.onNode?.(node, { patch: patch.values[nearest], typed: !asked });
  }

  turned() {
    const out = new Float32Array(this.scaled.length);
    for (let i = 0; i < out.length; i += 3) {
      for (let row = 0; row < 3; row += 1) {
        for (let axis = 0; axis < 3; axis += 1) {
          out[i + row] += this.rotation[3 * row + axis] * (this.scaled[i + axis] - this.centre[axis]);
        }
      }
    }
    return out;
  }

  /** Colour the surface. */
  paint(colouring) {
    this.graphics.paint(colouring, this.near);
    this.painted = true;
    this.draw();
  }

  /** Show a node, a source, and marks `{points, colour}` in index units. */
  show({ node = this.node, source = this.source, marks = this.marks }) {
    if (source !== this.source) {
      const patch = this.geometry.arrays.vertex_patch.values;
      this.graphics.light(Float32Array.from(patch, (own) => (own === source ? 1 : 0)));
    }
    Object.assign(this, { node, source, marks });
    this.draw();
  }

  /** Coordinates and colours of what is marked. */
  marked() {
    const all = [...this.marks];
    if (this.node !== null) all.push({ points: Array.from(this.geometry.place(this.node)), colour: "#16181d" });
    return {
      place: Float32Array.from(all.flatMap(({ points }) => Array.from(points))),
      paint: Float32Array.from(all.flatMap(({ points, colour }) => Array.from(points, (_, i) => shares(colour)[i % 3]))),
      size: (dotSize(this.canvas) * this.canvas.width) / Math.max(this.canvas.clientWidth, 1),
    };
  }

  draw() {
    if (!this.painted || !fitCanvas(this.canvas)) return;
    const reach = this.reach();
    const aspect = this.canvas.clientWidth / this.canvas.clientHeight;
    const middle = this.centre.map((value, axis) => value / this.geometry.spacing[axis]);
    const zoom = [1 / (reach * aspect), 1 / reach, 0.45 / this.radius];
    const accent = shares(isDark() ? "#ff7ac6" : "#d6007a");
    this.graphics.draw({ rotation: this.rotation, middle, spacing: this.geometry.spacing, zoom }, accent, this.marked());
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
    this.graphics.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}
