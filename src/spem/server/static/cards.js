/** Cards of shapes in a grid: thumbnail, name, and what else is known at a glance. */

import { thumbnail } from "./api.js";
import { element } from "./dom.js";

/** The picture of a shape, and its dimension where it has none. */
export function picture(shape, { eager = false } = {}) {
  const frame = element("span", { class: "picture" });
  const image = element("img", {
    src: thumbnail(shape.id), alt: `Picture of ${shape.name}`, width: 160, height: 160, decoding: "async",
    loading: eager ? "eager" : "lazy",
    onerror: () => image.replaceWith(element("span", { class: "no-picture" }, `${shape.ndim}-D`)),
  });
  frame.append(image);
  return frame;
}

/** A card that leads to an address. */
export function card(shape, address, ...below) {
  const facts = [shape.label, `${shape.ndim}-D`].filter(Boolean).join(" · ");
  return element(
    "a",
    { class: "card", href: address },
    picture(shape),
    element("span", { class: "name", title: shape.name }, shape.name),
    element("span", { class: "facts" }, facts),
    ...below,
  );
}

/** Grey cards that stand in while shapes are on their way. */
export function skeletons(number) {
  return Array.from({ length: number }, () =>
    element("li", { "aria-hidden": "true" }, element("span", { class: "card skeleton" }, element("span", { class: "picture" }))),
  );
}

/** Let the arrow keys move between the cards of a grid, by rows and columns. */
export function arrowKeys(grid) {
  grid.addEventListener("keydown", (event) => {
    const cards = [...grid.querySelectorAll("a.card")];
    const at = cards.indexOf(event.target.closest("a.card"));
    if (at < 0 || event.altKey || event.ctrlKey || event.metaKey) return;
    const top = cards[0].getBoundingClientRect().top;
    const columns = cards.findIndex((one) => one.getBoundingClientRect().top > top + 1);
    const row = columns < 0 ? cards.length : columns;
    const moves = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -row, ArrowDown: row };
    const target = { Home: 0, End: cards.length - 1 }[event.key] ?? at + moves[event.key];
    if (Number.isNaN(target)) return;
    event.preventDefault();
    if (target < 0 && event.key === "ArrowUp") document.getElementById("q")?.focus();
    else cards[Math.min(Math.max(target, 0), cards.length - 1)].focus();
  });
}
