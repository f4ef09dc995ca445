/** The place on a shape's page where another shape is set beside it. */

import { element } from "./dom.js";

export class Beside {
  /** `onClose` hears that the comparison is no longer wanted. */
  constructor(id, onClose) {
    this.id = id;
    this.other = null;
    this.body = element("div");
    const close = element("button", { type: "button", class: "button small", onclick: onClose }, "Close");
    const head = element("div", { class: "shape-compared-head" }, element("h2", {}, "Side by side"), close);
    this.root = element("section", { class: "shape-card shape-compared", hidden: true }, head, this.body);
  }

  /** Show another shape, or none. */
  async show(other) {
    if (other === this.other) return;
    this.destroy();
    this.other = other;
    this.root.hidden = other === null;
    // A place of its own for each, so that one that comes late cannot take that of a later one.
    const place = element("div", {}, element("p", { class: "shape-note", role: "status" }, "Loading both shapes…"));
    this.body.replaceChildren(place);
    if (other === null) return;
    try {
      const { compareShapes } = await import("./shape_compare.js");
      const comparison = await compareShapes(place, this.id, other);
      if (!comparison) return;
      this.comparison = comparison;
      this.root.scrollIntoView({ block: "nearest" });
    } catch (error) {
      place.replaceChildren(element("p", { class: "shape-note" }, error.message));
    }
  }

  destroy() {
    this.comparison?.destroy();
    this.comparison = null;
  }
}
