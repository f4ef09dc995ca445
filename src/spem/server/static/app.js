/** What every page has: routes, search by file, keys, and what is told of the server. */

import { info } from "./api.js";
import { counted, element } from "./dom.js";
import { renderGallery } from "./gallery.js";
import { go, href, readState, route, start } from "./router.js";
import { takeFiles } from "./upload.js";

const asksForAnswers = (state) => Boolean(state.job || state.like);

route("", "search", () => import("./search.js").then((module) => module.renderSearch), asksForAnswers);
route("", "gallery", () => renderGallery);
route("map", "map", () => import("./collection_map.js").then((module) => module.renderMap));
route("shape/:id", "shape", async () => {
  const { renderShape } = await import("./shape_page.js");
  return (root, { id }, state, setState) => renderShape(root, id, state, setState);
});

function keys() {
  document.addEventListener("keydown", (event) => {
    if (event.key !== "/" || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest("input, textarea, select, dialog, [contenteditable]")) return;
    event.preventDefault();
    const box = document.getElementById("q");
    if (box) box.focus();
    else go(href("./")).then(() => document.getElementById("q")?.focus());
  });
}

async function about() {
  const [version, choice] = ["about", "model"].map((id) => document.getElementById(id));
  try {
    const known = await info();
    version.replaceChildren(`spem ${known.version}`);
    choice.replaceChildren(...(known.models.length > 1 ? [modelChoice(known.models, known.model)] : []));
  } catch {
    version.replaceChildren(); // The page itself says what is wrong.
    choice.replaceChildren();
  }
}

function modelChoice(models, chosen) {
  const choose = (event) => {
    const { q, label, ndim, sort } = readState();
    const state = new URLSearchParams({ model: event.target.value });
    for (const [key, value] of Object.entries({ q, label, ndim, sort })) if (value) state.set(key, value);
    go(`${new URL(document.baseURI).pathname}?${state}`);
  };
  const options = models.map(({ digest, features, ndim, n_shapes }) => {
    const words = [ndim ? `${ndim}-D` : "", counted(n_shapes, "shape"), features];
    return element("option", { value: digest, selected: digest === chosen }, words.filter(Boolean).join(" · "));
  });
  return element(
    "label",
    { class: "field inline" },
    element("span", {}, "Model"),
    element("select", { onchange: choose }, ...options),
  );
}

takeFiles();
keys();
addEventListener("spem-page", about);
start();
