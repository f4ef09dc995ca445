/** The page of one shape: its picture, what it is coloured by, the profile of a point, and what is known of it. */

import { debounced, download, element } from "./dom.js";
import { Bar, withBar } from "./shape_bar.js";
import { Beside } from "./shape_beside.js";
import { colourField, colourMap, colourParts, colourSource, colourStrength, Colouring, shown } from "./shape_colouring.js";
import { Controls } from "./shape_controls.js";
import { onTheme } from "./colours.js";
import { loadCard, loadParts, loadPictures, loadSource } from "./shape_data.js";
import { below, downloads, facts, withoutPictures } from "./shape_details.js";
import { DEPTH } from "./shape_gl.js";
import { Profile } from "./shape_profile.js";
import { Stage } from "./shape_stage.js";
import { readView, writtenRho } from "./shape_state.js";

/** Draw the page of a shape; the address says what is looked at. */
export async function renderShape(root, id, state, setState) {
  document.title = "Shape · spem";
  const wait = element("p", { class: "shape-note", role: "status" }, "Solving for the fields of the shape…");
  root.replaceChildren(wait);
  const pictures = loadPictures(id).catch((error) => ({ error }));
  const card = await loadCard(id);
  if (!root.isConnected) return { update() {} };
  document.title = `${card.name} · spem`;
  root.replaceChildren(element("article", { class: "shape" }, head(card), wait));
  const { error, ...drawn } = await pictures;
  if (!root.isConnected) return { update() {} };
  if (error) {
    wait.replaceWith(withoutPictures(id, card, error.message));
    return { update() {} };
  }
  const page = new ShapePage(id, { card, ...drawn }, setState);
  root.replaceChildren(page.root);
  page.update(state);
  return page;
}

function head(card) {
  return element("header", { class: "shape-head" }, element("h1", {}, card.name), element("p", {}, facts(card)));
}

class ShapePage {
  constructor(id, { card, geometry, fields }, setState) {
    Object.assign(this, { id, card, geometry, fields, setState, state: {}, fetched: new Map() });
    const patches = (geometry.arrays.contour_patch ?? geometry.arrays.vertex_patch).values;
    this.nSources = geometry.header.n_patches ?? patches.reduce((most, patch) => Math.max(most, patch), 0) + 1;
    this.colouring = new Colouring(geometry.n);
    this.bar = new Bar();
    this.stage = new Stage(geometry, {
      onNode: (node, how) => this.chooseNode(node, how),
      onSource: (source) => this.change({ show: "source", source: String(source) }),
      onSlice: (axis, place) => this.cut(axis, place),
      onHover: (node) => this.hover(node),
    });
    this.controls = new Controls(
      { fields, nSources: this.nSources, solid: geometry.ndim === 3 },
      { onRho: (place) => this.slide(place), onChange: (changes) => this.change(changes) },
    );
    this.profile = new Profile(fields, card.name);
    this.keepRhoSoon = debounced(() => this.keepRho(), 250);
    this.root = this.layout();
    this.stopTheme = onTheme(() => this.draw());
  }

  layout() {
    const heading = (text) => element("h2", {}, text);
    this.readout = element("p", { class: "shape-readout", role: "status" });
    this.caption = element("figcaption", { class: "shape-note" });
    this.figure = element("figure", { class: "shape-card shape-figure" }, this.stage.root, this.bar.root, this.readout, this.caption);
    this.pointTitle = heading("Field against ρ");
    this.pointNote = element("p", { class: "shape-note" });
    const point = element("section", { class: "shape-card shape-point" }, this.pointTitle, this.pointNote, this.profile.root);
    this.beside = new Beside(this.id, () => this.change({ compare: null }));
    this.files = element("div");
    return element(
      "article",
      { class: "shape" },
      head(this.card),
      element("div", { class: "shape-main" }, this.controls.root, this.figure, point),
      this.beside.root,
      ...below(this.id, this.card, this.geometry, this.files),
    );
  }

  /** Show what the address says. */
  update(state) {
    this.state = { ...state };
    this.view = readView(this.state, this);
    this.draw();
    this.beside.show(this.view.compare);
  }

  /** Look at something else, and let the address say so. */
  change(changes, { push = true } = {}) {
    this.keepRho();
    this.setState(changes, { push });
    this.update({ ...this.state, ...changes });
  }

  /** Let the address say the rho that the slider was left at. */
  keepRho() {
    if (this.state.rho === undefined || !this.root.isConnected) return;
    this.setState({ rho: this.state.rho });
    this.offer();
  }

  /** Move to another rho: the next frame shows it. */
  slide(place) {
    this.asked ??= performance.now();
    this.view.place = place;
    this.keepRhoSoon();
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      this.state.rho = writtenRho(this.fields, this.view.place);
      this.paint();
      const asked = this.asked;
      this.asked = null;
      // What is drawn here is on the screen when the next frame begins.
      requestAnimationFrame(() => (this.figure.dataset.milliseconds = (performance.now() - asked).toFixed(1)));
    });
  }

  chooseNode(node, { patch, typed } = {}) {
    const changes = { node: String(node) };
    if (patch !== undefined && this.view.show === "source") changes.source = String(patch);
    if (this.geometry.ndim === 3) changes.slice = [...this.geometry.place(node)].join(",");
    this.change(changes, { push: !typed });
  }

  cut(axis, place) {
    const slice = [...(this.view.slice ?? this.geometry.fullest())];
    slice[axis] = place;
    this.change({ slice: slice.join(",") }, { push: false });
  }

  /** Say the value under the pointer, or that of the chosen node. */
  hover(node) {
    const at = node >= 0 ? node : this.view.node;
    if (at === null) {
      this.readout.textContent = "Click a point, or use the arrow keys on the picture.";
      return;
    }
    const names = this.geometry.header.axes ?? [];
    const place = this.geometry.position(at).map((value, axis) => `${names[axis] ?? `axis ${axis}`} ${shown(value, 4)}`);
    this.readout.textContent = `${this.colouring.valueOf(at)} at ${place.join(", ")}`;
  }

  /** Something of the server, asked for once; null until it is here, when the page is drawn again. */
  get(key, load) {
    const known = this.fetched.get(key);
    if (known !== undefined) return known;
    this.fetched.set(key, null);
    this.figure.setAttribute("aria-busy", "true");
    load()
      .then((answer) => this.fetched.set(key, answer))
      .catch((error) => {
        this.fetched.delete(key);
        this.failure = error.message;
      })
      .finally(() => {
        if (!this.root.isConnected) return;
        this.figure.removeAttribute("aria-busy");
        if (this.failure) this.caption.textContent = this.failure;
        else this.draw();
        this.failure = null;
      });
    return null;
  }

  /** Write the colours of what is looked at; false while they are on their way. */
  colour() {
    const { show, place, fit, map, k, part, source } = this.view;
    if (show === "field") colourField(this.colouring, this.fields, place, fit);
    else if (show === "map") colourMap(this.colouring, this.fields, map);
    else if (show === "source") {
      const found = this.get(`source ${source ?? 0}`, () => loadSource(this.id, source ?? 0));
      if (!found) return false;
      colourSource(this.colouring, found);
      this.controls.showSource(found);
    } else {
      const found = this.get(`parts ${k}`, () => loadParts(this.id, k));
      if (!found) return false;
      const picked = part !== null && part < found.header.k ? part : null;
      if (show === "strength" && picked !== null) colourStrength(this.colouring, found, picked);
      else colourParts(this.colouring, found, picked);
      this.controls.showParts(found, picked);
    }
    return true;
  }

  draw() {
    const { node, source, show, slice } = this.view;
    this.controls.update(this.view);
    this.stage.show({ node, source: show === "source" ? (source ?? 0) : null, places: slice });
    if (this.profile.node !== node) this.profile.show(node);
    this.pointNote.textContent = node === null
      ? "How far the boundary is felt, over the whole shape. Choose a point of the picture to see its own curve."
      : `Node ${node}, beside all ${this.geometry.n.toLocaleString("en")} nodes of the shape.`;
    this.paint();
    this.offer();
  }

  /** Colour the pictures, and say what they show. */
  paint() {
    this.profile.move(this.view.place);
    if (this.view.show === "field") this.controls.moveTo(this.view.place);
    if (!this.colour()) {
      if (!this.bar.table) this.paintMeanwhile();
      this.caption.textContent = this.view.show === "source" ? "Solving for the source…" : "Dividing the shape into parts…";
      return;
    }
    this.stage.paint(this.colouring);
    this.bar.show(this.colouring);
    this.hover(-1);
    const solid = this.geometry.ndim === 3;
    const why = ["field", "map"].includes(this.view.show) ? ", as on it the field is 1 by definition" : "";
    this.caption.textContent = solid ? `The surface has the values ${DEPTH} voxels below it${why}.` : "";
    const { title, low, high, labels } = this.colouring;
    const range = labels ? labels.map(({ label, size }) => `part ${label + 1} ${shown(100 * size)} %`).join(", ") : `from ${shown(low)} to ${shown(high)}`;
    this.stage.describe(`${solid ? "Surface" : "Picture"} of ${this.card.name}. ${title}, ${range}. Arrow keys ${solid ? "turn it" : "choose a point"}.`);
  }

  /** Offer files of what is shown. */
  offer() {
    const rho = writtenRho(this.fields, this.view.place);
    this.files.replaceChildren(downloads(this.id, this.geometry.ndim, this.view, rho, () => this.savePicture()));
  }

  /** Show the field until what was asked for is here. */
  paintMeanwhile() {
    colourField(this.colouring, this.fields, this.view.place, this.view.fit);
    this.stage.paint(this.colouring);
    this.bar.show(this.colouring);
  }

  savePicture() {
    const what = `${this.card.name}-${this.colouring.title}`.replace(/[^\p{L}\p{N}.]+/gu, "-");
    withBar(this.stage.drawn(), this.colouring).toBlob((blob) => download(`${what}.png`, blob, "image/png"));
  }

  destroy() {
    this.stopTheme();
    this.stage.destroy();
    this.beside.destroy();
  }
}
