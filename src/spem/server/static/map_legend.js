/** The legend of the map: labels with their markers; chosen ones alone are shown. */

import { element } from "./dom.js";
import { sprite } from "./markers.js";

/** Make a legend; `onChoose` hears of the labels that are chosen, null for all. */
export function legend(labels, picture, onChoose) {
  let chosen = new Set();
  const buttons = labels.map(({ label, n }) => {
    const toggle = () => {
      const next = new Set(chosen);
      if (!next.delete(label)) next.add(label);
      onChoose(next.size ? [...next] : null);
    };
    return element(
      "button",
      { type: "button", class: "legend-entry", "aria-pressed": "false", onclick: toggle },
      element("span", { class: "legend-marker" }),
      element("span", { class: "legend-name" }, label || "no label"),
      element("span", { class: "facts" }, n.toLocaleString("en")),
    );
  });
  const all = element("button", { type: "button", class: "button small quiet", hidden: true, onclick: () => onChoose(null) }, "All labels");
  const list = element("ul", { class: "legend", role: "list" }, buttons.map((button) => element("li", {}, button)));
  const title = element("div", { class: "legend-title" }, element("h2", { id: "legend-title" }, "Labels"), all);
  const box = element("section", { class: "map-section", "aria-labelledby": "legend-title", hidden: !labels.length }, title, list);

  const dress = () =>
    buttons.forEach((button, place) =>
      button.firstChild.replaceChildren(sprite(picture.styles[place], 5.5, picture.ground)));
  const choose = (set) => {
    chosen = set;
    all.hidden = !set.size;
    list.classList.toggle("filtered", set.size > 0);
    buttons.forEach((button, place) => button.setAttribute("aria-pressed", String(set.has(labels[place].label))));
  };
  dress();
  return { box, dress, choose };
}
