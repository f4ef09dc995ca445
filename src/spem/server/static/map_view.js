/** The part of the plane that a map shows, and how pointers, the wheel and keys move it. */

const CLOSEST = 400;
const FARTHEST = 0.6;
const STEP = 1.5;
const CLICK_REACH = 5;

/** A view of points that reach as far as `extent` from 0: its centre and magnification. */
export class MapView {
  constructor(canvas, extent, { onMove, onHover, onPick }) {
    Object.assign(this, { canvas, extent, onMove, onHover, onPick });
    this.centre = [0, 0];
    this.zoom = 1;
    this.pointers = new Map();
    this.listen();
  }

  /** Pixels of a unit. */
  get scale() {
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = this.extent.map((half) => 2 * Math.max(half, 1e-3));
    return 0.86 * this.zoom * Math.min(clientWidth / width, clientHeight / height);
  }

  toScreen(x, y) {
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth / 2 + (x - this.centre[0]) * this.scale, clientHeight / 2 - (y - this.centre[1]) * this.scale];
  }

  toPlane(px, py) {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.centre[0] + (px - clientWidth / 2) / this.scale, this.centre[1] - (py - clientHeight / 2) / this.scale];
  }

  /** Show what was shown when `text` was made; all where it says nothing. */
  read(text) {
    const [x, y, zoom] = (text ?? "").split(",").map(Number);
    const told = [x, y, zoom].every(Number.isFinite) && zoom > 0;
    this.centre = told ? [x, y] : [0, 0];
    this.zoom = told ? Math.min(Math.max(zoom, FARTHEST), CLOSEST) : 1;
    this.onMove();
  }

  write() {
    if (this.zoom === 1 && !this.centre[0] && !this.centre[1]) return null;
    return [...this.centre, this.zoom].map((value) => Number(value.toPrecision(4))).join(",");
  }

  fit() {
    this.read("");
  }

  pan(dx, dy) {
    const reach = 1.2;
    const bounded = (value) => Math.min(Math.max(value, -reach), reach);
    this.centre = [bounded(this.centre[0] - dx / this.scale), bounded(this.centre[1] + dy / this.scale)];
    this.onMove();
  }

  /** Magnify about a place of the canvas, its middle where none is given. */
  magnify(factor, px = this.canvas.clientWidth / 2, py = this.canvas.clientHeight / 2) {
    const before = this.toPlane(px, py);
    this.zoom = Math.min(Math.max(this.zoom * factor, FARTHEST), CLOSEST);
    const after = this.toPlane(px, py);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
    this.onMove();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [px, py] = this.place(event);
      this.magnify(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0018)), px, py);
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    canvas.addEventListener("pointerup", (event) => this.release(event));
    canvas.addEventListener("pointercancel", (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("pointerleave", (event) => {
      // A finger leaves when it is lifted; what it pointed at stays told.
      if (!this.pointers.size && event.pointerType !== "touch") this.onHover(null, event.relatedTarget);
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  press(event) {
    if (event.button) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.place(event));
    this.travelled = this.pointers.size > 1 ? Infinity : 0;
  }

  drag(event) {
    const now = this.place(event);
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      if (!this.pointers.size) this.onHover(now);
      return;
    }
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.pointers.set(event.pointerId, now);
    if (others.length) {
      const [other] = others;
      const apart = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      this.magnify(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
      this.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
      return;
    }
    this.travelled += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (this.travelled > CLICK_REACH) {
      this.canvas.classList.add("dragged");
      this.pan(now[0] - before[0], now[1] - before[1]);
    }
  }

  release(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    this.canvas.classList.remove("dragged");
    if (this.travelled <= CLICK_REACH) this.onPick(this.place(event), event.pointerType === "touch");
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const far = 60;
    const moves = { ArrowLeft: [far, 0], ArrowRight: [-far, 0], ArrowUp: [0, far], ArrowDown: [0, -far] };
    if (event.key in moves) this.pan(...moves[event.key]);
    else if (event.key === "+" || event.key === "=") this.magnify(STEP);
    else if (event.key === "-") this.magnify(1 / STEP);
    else if (event.key === "0") this.fit();
    else return;
    event.preventDefault();
  }
}
