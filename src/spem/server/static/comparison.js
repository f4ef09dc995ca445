/** Two shapes side by side, in a dialog over the answers. */

import { element, icon } from "./dom.js";

/** The button of an answer that sets it beside the query. */
export function compareButton(shape, open) {
  const words = `Compare with ${shape.name}`;
  return element("button", { type: "button", class: "button small compare", "aria-label": words, onclick: open }, "Compare");
}

/** Open the comparison of a query and an answer; returns what closes it without a word. */
export function showComparison(queryId, answerId, [query, answer], onClose) {
  const body = element("div", { class: "comparison" }, element("p", { class: "stage" }, "Loading"));
  const close = element("button", { type: "button", class: "button quiet icon", "aria-label": "Close the comparison" },
    icon("M5 5l10 10M15 5L5 15"));
  const dialog = element(
    "dialog",
    { class: "dialog", "aria-labelledby": "comparison-title" },
    element("div", { class: "dialog-head" },
      element("h2", { id: "comparison-title" }, `${query} beside ${answer}`), close),
    body,
  );
  let told = false;
  const leave = (silent) => {
    if (told) return;
    told = true;
    if (dialog.open) dialog.close();
    dialog.remove();
    if (!silent) onClose();
  };
  close.addEventListener("click", () => leave(false));
  dialog.addEventListener("close", () => leave(false));
  dialog.addEventListener("click", (event) => event.target === dialog && leave(false));
  document.body.append(dialog);
  dialog.showModal();
  import("./shape_compare.js")
    .then(({ compareShapes }) => {
      body.replaceChildren();
      return compareShapes(body, queryId, answerId);
    })
    .catch((error) => body.replaceChildren(element("p", { class: "stage" }, error.message)));
  return () => leave(true);
}
