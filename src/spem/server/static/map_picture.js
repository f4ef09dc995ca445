/** The canvas of the map: markers, and pictures of shapes where there is room for them. */

import { thumbnail } from "./api.js";
import { sprite, style } from "./markers.js";

const LARGEST = 6.5;
const PICTURES = [72, 56, 40];
const MARGIN = PICTURES[0];
const MOST_PICTURES = 120;
const REACH = 16;

/** Draws points in a view; `points` have x, y in [-1, 1], id, name and the place of their label. */
export class MapPicture {
  constructor(canvas, view, points, n_labels) {
    Object.assign(this, { canvas, view, points, n_labels });
    this.shown = points;
    this.pictures = true;
    this.marked = null;
    this.images = new Map();
    this.dress();
    this.watcher = new ResizeObserver(() => this.draw());
    this.watcher.observe(canvas);
  }

  /** Take the colours of the page; again when the theme changes. */
  dress() {
    const colours = getComputedStyle(document.documentElement);
    this.ground = colours.getPropertyValue("--surface").trim();
    this.accent = colours.getPropertyValue("--accent").trim();
    const dark = document.documentElement.dataset.theme === "dark";
    this.styles = Array.from({ length: Math.max(this.n_labels, 1) }, (_, place) => style(place, dark));
    this.sprites = null;
    this.draw();
  }

  /** Markers, smaller in a crowd and larger on closer view. */
  size() {
    const crowd = this.points.length > 2000 ? 3 : this.points.length > 400 ? 4 : 5.5;
    const radius = Math.round(2 * Math.min(crowd * Math.max(this.view.zoom, 1) ** 0.3, LARGEST)) / 2;
    if (this.sprites && radius === this.radius) return;
    this.radius = radius;
    this.sprites = this.styles.map((one) => sprite(one, radius, this.ground));
  }

  show(points) {
    this.shown = points;
    this.draw();
  }

  mark(point) {
    if (point === this.marked) return;
    this.marked = point;
    this.draw();
  }

  stop() {
    this.watcher.disconnect();
    cancelAnimationFrame(this.frame);
  }

  draw() {
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(() => this.paint());
  }

  paint() {
    const { canvas } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    this.size();
    this.placed = this.inView();
    const pictured = this.pictures ? this.pictured() : new Set();
    for (const spot of pictured) this.paintPicture(context, spot);
    for (const spot of this.placed) if (!pictured.has(spot)) this.dot(context, spot);
    const spot = this.marked && this.placed.find(({ point }) => point === this.marked);
    if (spot) this.ring(context, spot);
  }

  dot(context, { point, px, py }) {
    const image = this.sprites[point.place];
    const side = parseFloat(image.style.width);
    context.drawImage(image, px - side / 2, py - side / 2, side, side);
  }

  /** The points in view, or nearly, with their places on the canvas. */
  inView() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const placed = [];
    for (const point of this.shown) {
      const [px, py] = this.view.toScreen(point.x, point.y);
      if (px > -MARGIN && py > -MARGIN && px < width + MARGIN && py < height + MARGIN) placed.push({ point, px, py });
    }
    return placed;
  }

  /** The points that get a picture: as large as half of them have room for, or as small as can be made out. */
  pictured() {
    let roomy;
    for (const side of PICTURES) {
      this.side = side;
      roomy = this.roomy(side);
      if (2 * roomy.size >= Math.min(this.placed.length, MOST_PICTURES)) break;
    }
    return roomy;
  }

  /** Points whose squares of this side nearly do not overlap, one after the other; the dots of others lie on top. */
  roomy(side) {
    const cells = new Map();
    const key = (px, py) => Math.floor(px / side) * 4096 + Math.floor(py / side);
    const steps = [-side, 0, side].flatMap((dx) => [-side, 0, side].map((dy) => [dx, dy]));
    const near = ({ px, py }) => steps.flatMap(([dx, dy]) => cells.get(key(px + dx, py + dy)) ?? []);
    const apart = (a, b) => Math.max(Math.abs(a.px - b.px), Math.abs(a.py - b.py));
    const roomy = new Set();
    for (const spot of this.placed) {
      if (roomy.size >= MOST_PICTURES) break;
      if (near(spot).some((other) => apart(spot, other) <= 0.9 * side)) continue;
      roomy.add(spot);
      const at = key(spot.px, spot.py);
      if (cells.has(at)) cells.get(at).push(spot);
      else cells.set(at, [spot]);
    }
    return roomy;
  }

  paintPicture(context, spot) {
    const image = this.image(spot.point);
    if (!image) {
      this.dot(context, spot);
      return;
    }
    const scale = this.side / Math.max(image.naturalWidth, image.naturalHeight);
    const [width, height] = [image.naturalWidth * scale, image.naturalHeight * scale];
    context.drawImage(image, spot.px - width / 2, spot.py - height / 2, width, height);
    if (this.n_labels) this.dot(context, { ...spot, py: spot.py + this.side / 2 + 2 });
  }

  /** The picture of a point once it is there; a redraw follows when it comes. */
  image(point) {
    let image = this.images.get(point.id);
    if (!image) {
      image = new Image();
      image.addEventListener("load", () => this.draw());
      image.src = thumbnail(point.id);
      this.images.set(point.id, image);
    }
    return image.complete && image.naturalWidth ? image : null;
  }

  ring(context, { px, py }) {
    context.beginPath();
    context.arc(px, py, REACH - 2, 0, 2 * Math.PI);
    context.lineWidth = 2.5;
    context.strokeStyle = this.accent;
    context.stroke();
  }

  /** The point at a place of the canvas, or null. */
  pick([px, py]) {
    let best = null;
    let least = REACH;
    for (const spot of this.placed ?? []) {
      const apart = Math.hypot(spot.px - px, spot.py - py);
      if (apart < least) [best, least] = [spot, apart];
    }
    return best;
  }
}
