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
  const size = `${ndim === 2 ? "area" : "volume"} ${shown(volume, 4)}`;
  return [label, `${ndim}-D`, counted(nodes, "node"), size].filter(Boolean).join(" · ");
}

/** The report of a shape as a list. */
export function report(card, geometry) {
  const { report: said = {}, metadata = {}, copies, file, added, model } = card;
  const kept = said.volume_kept;
  const repairs = [...(said.repairs ?? []), ...(geometry.header.repairs ?? [])];
  const entries = [
    file && term("File", copies ? `${file}, and ${counted(copies, "copy").replace("copys", "copies")}` : file),
    said.method && term("Inside was told", said.method),
    typeof said.watertight === "boolean" && term("Mesh", said.watertight ? "watertight" : "not watertight"),
    said.components > 1 && term("Found", counted(said.components, "component")),
    Number.isFinite(kept) && kept < 1 && term("Kept", `${shown(100 * kept, 4)} % of the volume`),
    term("Repairs", ...(repairs.length ? [...new Set(repairs)] : ["none"])),
    term("Grid", `${geometry.grid.join(" × ")}, spacing ${geometry.spacing.map((value) => shown(value)).join(" × ")}`),
    geometry.header.coarser && term("Shown", `coarser, on ${counted(geometry.n, "node")}`),
    ...Object.entries(metadata).map(([key, value]) => term(key, String(value))),
    added && term("Added", new Date(added).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" })),
    model && term("Model", element("code", {}, typeof model === "string" ? model : model.digest)),
  ];
  return element("dl", { class: "shape-report" }, entries.filter(Boolean).flat());
}

/** Links to everything the server writes of a shape; `onPicture` saves what is shown, `rho` is that of the field. */
export function downloads(id, ndim, view, rho, onPicture) {
  const colours = { field: { show: "field", rho }, part: { show: "part", k: view.k } }[view.show === "strength" ? "part" : view.show];
  const file = (what, words, parameters = {}) =>
    element("a", { class: "button small", href: address(path(id, what), parameters), download: "" }, words);
  return element(
    "div",
    { class: "shape-downloads" },
    element("button", { type: "button", class: "button small", onclick: onPicture }, "Picture, PNG"),
    file("field.npz", "Fields, NPZ"),
    file("maps.npz", "Maps, NPZ"),
    file("parts.npz", "Parts, NPZ", { k: view.k }),
    ndim === 3 && file("surface.ply", "Surface, PLY", colours ?? { show: "map", map: view.map + 1 }),
    view.node !== null && file("node.csv", "Profile, CSV", { node: view.node }),
  );
}

function neighbour(id, { distance, shape }, chosen) {
  const picture = element("img", { src: thumbnail(shape.id), alt: "", width: 96, height: 96, loading: "lazy" });
  const words = element("span", { class: "name" }, shape.name);
  const far = element("span", { class: "far" }, `${shape.label ? `${shape.label} · ` : ""}${distance.toFixed(3)}`);
  const open = element("a", { href: href(`shape/${encodeURIComponent(shape.id)}`), "aria-label": `Open ${shape.name}` }, "Open");
  const link = element(
    "a",
    {
      href: href(`shape/${encodeURIComponent(id)}`, { compare: shape.id }),
      "aria-label": `Compare with ${shape.name}, distance ${distance.toFixed(3)}`,
      "aria-current": chosen === shape.id ? "true" : null,
      "data-compare": shape.id,
    },
    picture, words, far,
  );
  return element("li", {}, link, open);
}

/** The nearest shapes, each with its distance and a link to see it beside this one. */
export function similar(id, chosen) {
  const list = element("ul", { class: "shape-strip", "aria-label": "Nearest shapes" });
  const note = element("p", { class: "shape-note" }, "Looking for the nearest shapes…");
  json(path(id, "neighbours"), { k: NEIGHBOURS })
    .then(({ answers, method }) => {
      const others = answers.filter(({ shape }) => shape.id !== id);
      list.append(...others.map((answer) => neighbour(id, answer, chosen)));
      note.textContent = others.length
        ? `By correlation distance of their codes (${method} search); choose one to see both side by side.`
        : "This is the only shape of its model.";
    })
    .catch((error) => (note.textContent = error.message));
  return [note, list];
}
