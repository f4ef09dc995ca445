/** What of a shape is looked at, as the address says it. */

/** What an address can say, with the numbers that people read: maps and parts begin at 1. */
function whole(text, low, high) {
  const value = Number(text);
  return text !== undefined && text !== "" && Number.isInteger(value) && value >= low && value <= high ? value : null;
}

/** What is looked at; what the address does not say, or says wrongly, is as it is at first. */
export function readView(state, { geometry, fields, nSources }) {
  const kinds = ["field", "map", "parts", "strength", "source"];
  const rho = Number(state.rho);
  const part = whole(state.part, 1, 20);
  const places = (state.slice ?? "").split(",").map((text, axis) => whole(text, 0, (geometry.grid[axis] ?? 1) - 1));
  const show = kinds.includes(state.show) ? state.show : "field";
  return {
    show: show === "strength" && part === null ? "parts" : show,
    place: rho > 0 ? fields.placeOf(rho) : firstPlace(fields),
    fit: state.fit === undefined ? geometry.ndim === 3 : state.fit === "1",
    map: (whole(state.map, 1, fields.nMaps) ?? 1) - 1,
    k: whole(state.k, 1, 12),
    part: part === null ? null : part - 1,
    node: whole(state.node, 0, geometry.n - 1),
    source: whole(state.source, 0, nSources - 1),
    slice: places.length === geometry.ndim && !places.includes(null) ? places : null,
    compare: state.compare ?? null,
  };
}

/** A rho at which most shapes show something: a third of the way. */
function firstPlace(fields) {
  return Math.floor((fields.rho.length - 1) / 3);
}

/** A rho as an address says it, so that it leads back to the same place. */
export function writtenRho(fields, place) {
  return String(Number(fields.between(fields.rho, place).toPrecision(6)));
}
