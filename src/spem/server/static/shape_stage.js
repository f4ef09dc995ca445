/** The pictures of a shape as one: a silhouette, or the surface of a solid and its slices. */

import { element } from "./dom.js";
import { Picture } from "./shape_picture.js";
import { Slices } from "./shape_slices.js";
import { Surface } from "./shape_surface.js";

export class Stage {
  /** `heard` has `onNode`, `onSource`, `onSlice` and `onHover`; without them there is nothing to click. */
  constructor(geometry, heard = {}, { slices = true } = {}) {
    this.geometry = geometry;
    this.views = [];
    this.root = element("div", { class: `shape-stage stage-${geometry.ndim}d` });
    if (geometry.ndim === 2) this.add(new Picture(geometry, heard));
    else this.solid(heard, slices);
    this.main = this.views[0];
  }

  solid(heard, slices) {
    let flat = slices;
    try {
      this.add(new Surface(this.geometry, heard));
    } catch (error) {
      flat = true;
      this.root.append(element("p", { class: "shape-note" }, `The surface cannot be drawn here (${error.message}); these are slices.`));
    }
    if (flat) this.add(new Slices(this.geometry, heard));
  }

  add(view) {
    this.views.push(view);
    this.root.append(view.root ?? view.canvas);
  }

  paint(colouring) {
    for (const view of this.views) view.paint(colouring);
  }

  show(what) {
    for (const view of this.views) view.show(what);
  }

  describe(text) {
    this.main.describe(text);
  }

  /** The main picture as a canvas, drawn just now. */
  drawn() {
    return this.main.drawn();
  }

  destroy() {
    for (const view of this.views) view.destroy();
  }
}
