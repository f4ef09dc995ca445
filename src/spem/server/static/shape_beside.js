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
    this.body.replaceChildren(element("p", { class: "shape-note", role: "status" }, "Loading both shapes…"));
    if (other === null) return;
    try {
      const { compareShapes } = await import("./shape_compare.js");
      const comparison = await compareShapes(this.body, this.id, other);
      if (this.other === other) this.comparison = comparison;
      else comparison.destroy();
      this.root.scrollIntoView({ block: "nearest" });
    } catch (error) {
      this.body.replaceChildren(element("p", { class: "shape-note" }, error.message));
    }
  }

  destroy() {
    this.comparison?.destroy();
    this.comparison = null;
  }
}
