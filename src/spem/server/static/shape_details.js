/** What is known of a shape: where it came from, what was done to it, its nearest shapes, its files. */

import { address, json, thumbnail } from "./api.js";
import { counted, element } from "./dom.js";
import { href } from "./router.js";
import { shown } from "./shape_colouring.js";
import { path } from "./shape_data.js";

const NEIGHBOURS = 12;

function term(name, ...values) {
  return [element("dt", {}, name), ...values.map((value) => element("dd", {}, value))];
}

/** Numbers of a shape on one line. */
export function facts({ label, ndim, n_nodes: nodes, volume }) {
  const size = `${["", "length", "area"][ndim] ?? "volume"} ${shown(volume, 4)}`;
  return [label, `${ndim}-D`, counted(nodes, "node"), size].filter(Boolean).join(" · ");
}

/** The report of a shape as a list. */
function report(card, geometry) {
  const { report: said = {}, metadata = {}, copies, file, added, model } = card;
  const kept = said.volume_kept;
  const repairs = [...(said.repairs ?? []), ...(geometry?.header.repairs ?? [])];
  const entries = [
    file && term("File", copies ? `${file}, and ${counted(copies, "copy").replace("copys", "copies")}` : file),
    said.method && term("Inside was told", said.method),
    typeof said.watertight === "boolean" && term("Mesh", said.watertight ? "watertight" : "not watertight"),
    said.components > 1 && term("Found", counted(said.components, "component")),
    Number.isFinite(kept) && kept < 1 && term("Kept", `${shown(100 * kept, 4)} % of the volume`),
    term("Repairs", ...(repairs.length ? [...new Set(repairs)] : ["none"])),
    geometry && term("Grid", `${geometry.grid.join(" × ")}, spacing ${geometry.spacing.map((value) => shown(value)).join(" × ")}`),
    geometry?.header.coarser && term("Shown", `coarser, on ${counted(geometry.n, "node")}`),
    ...Object.entries(metadata).map(([key, value]) => term(key, String(value))),
    added && term("Added", new Date(added).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" })),
    model && term("Model", element("code", {}, typeof model === "string" ? model : model.digest)),
  ];
  return element("dl", { class: "shape-report" }, entries.filter(Boolean).flat());
}

/** Links to everything the server writes of a shape; `onPicture` saves what is shown, `rho` is that of the field. */
export function downloads(id, ndim, view, rho, onPicture) {
  const colours = { field: { show: "field", rho }, parts: { show: "part", k: view.k } }[view.show === "strength" ? "parts" : view.show];
  const file = (what, words, parameters = {}) =>
    element("a", { class: "button small", href: address(path(id, what), parameters), download: "" }, words);
  return element(
    "div",
    { class: "shape-downloads" },
    onPicture && element("button", { type: "button", class: "button small", onclick: onPicture }, "Picture, PNG"),
    file("field.npz", "Fields, NPZ"),
    file("maps.npz", "Maps, NPZ"),
    file("parts.npz", "Parts, NPZ", { k: view.k }),
    ndim === 3 && file("surface.ply", "Surface, PLY", colours ?? { show: "map", map: view.map + 1 }),
    view.node !== null && file("node.csv", "Profile, CSV", { node: view.node }),
  );
}

function neighbour(id, { distance, shape }, drawn) {
  const picture = element("img", {
    src: thumbnail(shape.id), alt: "", width: 96, height: 96, loading: "lazy",
    onerror: () => picture.replaceWith(element("span", { class: "no-picture" }, `${shape.ndim}-D`)),
  });
  const words = element("span", { class: "name" }, shape.name);
  const far = element("span", { class: "far" }, `${shape.label ? `${shape.label} · ` : ""}${distance.toFixed(3)}`);
  const page = href(`shape/${encodeURIComponent(shape.id)}`);
  if (!drawn) return element("li", {}, element("a", { href: page }, picture, words, far));
  const open = element("a", { href: page, class: "open", "aria-label": `Open ${shape.name}` }, "Open");
  const link = element(
    "a",
    {
      href: href(`shape/${encodeURIComponent(id)}`, { compare: shape.id }),
      "aria-label": `Compare with ${shape.name}, distance ${distance.toFixed(3)}`,
      "data-compare": shape.id,
    },
    picture, words, far,
  );
  return element("li", {}, link, open);
}

/** The nearest shapes, each with its distance and a link to see it beside this one. */
function similar(id, drawn) {
  const list = element("ul", { class: "shape-strip", "aria-label": "Nearest shapes" });
  const note = element("p", { class: "shape-note" }, "Looking for the nearest shapes…");
  json(path(id, "neighbours"), { k: NEIGHBOURS })
    .then(({ answers, method }) => {
      const others = answers.filter(({ shape }) => shape.id !== id);
      list.append(...others.map((answer) => neighbour(id, answer, drawn)));
      note.textContent = others.length
        ? `By correlation distance of their codes (${method} search)${drawn ? "; choose one to see both side by side" : ""}.`
        : "This is the only shape of its model.";
    })
    .catch((error) => (note.textContent = error.message));
  return [note, list];
}

/** What stands below the pictures: similar shapes, the report, and `files`. */
export function below(id, card, geometry, files) {
  const section = (heading, ...children) => element("section", {}, element("h2", {}, heading), ...children);
  return [
    section("Similar shapes", ...similar(id, geometry !== null)),
    element("div", { class: "shape-more" }, section("About this shape", report(card, geometry)), section("Downloads", files)),
  ];
}

/** What is left of the page where a shape has no picture: why, and all the rest. */
export function withoutPictures(id, card, why) {
  const all = document.createDocumentFragment();
  const files = downloads(id, card.ndim, { show: "none", map: 0, k: null, node: null }, null, null);
  all.append(element("p", { class: "shape-card shape-note" }, why), ...below(id, card, null, files));
  return all;
}
