/** What colours the nodes of a shape: a level of a table of 256 colours for each of them. */

import { diverging, LOGARITHMIC, partColour, partTable, SEQUENTIAL, UNEXPLAINED } from "./colours.js";

/** A number for people, of so many digits. */
export function shown(value, digits = 3) {
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e6 || size < 1e-4 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  return text.replace("-", "−");
}

/** Values of nodes and their colours; buffers are made once. */
export class Colouring {
  constructor(n) {
    this.values = new Float32Array(n);
    this.level = new Uint8ClampedArray(n);
    this.table = SEQUENTIAL;
    this.crisp = false;
    this.labels = null;
  }

  /** Least and largest value, of some of the nodes or all; infinite ones are left out. */
  limits(nodes = null) {
    let low = Infinity;
    let high = -Infinity;
    const count = nodes ? nodes.length : this.values.length;
    for (let i = 0; i < count; i += 1) {
      const value = this.values[nodes ? nodes[i] : i];
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return low <= high ? [low, high] : [0, 1];
  }

  /** Take the colours of a table for the values between two limits. */
  scale([low, high], table, words) {
    const factor = high > low ? 255 / (high - low) : 0;
    for (let i = 0; i < this.values.length; i += 1) this.level[i] = (this.values[i] - low) * factor;
    Object.assign(this, { low, high, table, crisp: false, labels: null }, words);
  }

  /** The value of a node, in words. */
  valueOf(node) {
    if (this.labels) return this.values[node] < 0 ? "no part" : `part ${this.values[node] + 1}`;
    return `${this.symbol} = ${shown(this.values[node])}`;
  }
}

/** Colour by the field at a place among the sampled rho. */
export function colourField(colouring, fields, place, fitted) {
  fields.at(place, colouring.values);
  const rho = fields.between(fields.rho, place);
  colouring.scale(fitted ? colouring.limits() : [0, 1], SEQUENTIAL, {
    title: `Field v at ρ = ${shown(rho)}`,
    symbol: "v",
  });
}

/** Colour by a map; the first of them is positive, the others are signed. */
export function colourMap(colouring, fields, number, limits = null) {
  fields.map(number, colouring.values);
  const own = colouring.limits();
  const most = Math.max(-own[0], own[1], 1e-30);
  const span = limits ?? (number === 0 ? own : [-most, most]);
  const share = fields.header.explained?.[number];
  colouring.scale(span, number === 0 ? SEQUENTIAL : diverging(), {
    title: `Map P${number + 1}${share === undefined ? "" : `, ${shown(100 * share)} % of the variance`}`,
    symbol: `P${number + 1}`,
  });
}

/** Colour by part, one of them picked out or all alike. */
export function colourParts(colouring, parts, picked) {
  const { node_part: label, sizes } = parts.arrays;
  const count = sizes.shape[0];
  for (let i = 0; i < colouring.level.length; i += 1) {
    colouring.values[i] = label.values[i];
    colouring.level[i] = label.values[i] < 0 ? UNEXPLAINED : label.values[i];
  }
  const labels = Array.from(sizes.values, (size, i) => ({ label: i, size, colour: partColour(i) }));
  Object.assign(colouring, { table: partTable(count, picked), crisp: true, labels, title: `${count} parts`, symbol: "part" });
}

/** Colour by how strongly one part explains each node. */
export function colourStrength(colouring, parts, part) {
  const { values, shape } = parts.arrays.strength;
  for (let i = 0; i < colouring.values.length; i += 1) colouring.values[i] = values[i * shape[1] + part];
  colouring.scale([0, Math.max(colouring.limits()[1], 1e-30)], SEQUENTIAL, {
    title: `Strength of part ${part + 1}`,
    symbol: "strength",
  });
}

/** Colour by the log field of one source. */
export function colourSource(colouring, source) {
  colouring.values.set(source.arrays.log.values);
  colouring.scale(colouring.limits(), LOGARITHMIC, {
    title: `Log field of source ${source.header.patch}`,
    symbol: "log v",
  });
}
