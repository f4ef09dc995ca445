/** What the server says of one shape, as the pictures need it: nodes on their grid, and fields of low rank. */

import { bytes, json } from "./api.js";
import { unpackArrays } from "./arrays.js";

/** How far the values of nodes reach beyond the shape, so that pictures of its rim have no gaps, in cells. */
const RIM = 2;

/** Nodes on their grid. */
class Geometry {
  constructor({ header, arrays }) {
    Object.assign(this, { header, arrays });
    this.ndim = header.ndim;
    this.grid = header.grid;
    this.spacing = header.spacing;
    this.origin = header.origin;
    this.node = arrays.node.values;
    this.n = arrays.node.shape[0];
    this.strides = this.grid.map((_, axis) => this.grid.slice(axis + 1).reduce((a, b) => a * b, 1));
    this.cells = new Int32Array(this.grid.reduce((a, b) => a * b, 1)).fill(-1);
    for (let i = 0; i < this.n; i += 1) this.cells[this.cell(this.place(i))] = i;
    this.near = this.cells;
    for (let round = 0; round < RIM; round += 1) this.near = this.spread(this.near);
  }

  /** Grid index of a node. */
  place(node) {
    return this.node.subarray(node * this.ndim, (node + 1) * this.ndim);
  }

  /** Coordinates of a node, in the unit of the file. */
  position(node) {
    return [...this.place(node)].map((index, axis) => this.origin[axis] + index * this.spacing[axis]);
  }

  /** Place of a cell in the flat grid, -1 off it. */
  cell(index) {
    let flat = 0;
    for (let axis = 0; axis < this.ndim; axis += 1) {
      if (index[axis] < 0 || index[axis] >= this.grid[axis]) return -1;
      flat += index[axis] * this.strides[axis];
    }
    return flat;
  }

  /** Node of a cell or beside it, -1 away from the shape. */
  nodeAt(index) {
    const flat = this.cell(index.map(Math.round));
    return flat < 0 ? -1 : this.near[flat];
  }

  /** Give the empty cells beside others the node of these. */
  spread(from) {
    let before = from;
    for (let axis = 0; axis < this.ndim; axis += 1) {
      const step = this.strides[axis];
      const extent = this.grid[axis];
      const after = before.slice();
      for (let flat = 0; flat < after.length; flat += 1) {
        if (before[flat] >= 0) continue;
        const index = Math.floor(flat / step) % extent;
        if (index > 0 && before[flat - step] >= 0) after[flat] = before[flat - step];
        else if (index < extent - 1 && before[flat + step] >= 0) after[flat] = before[flat + step];
      }
      before = after;
    }
    return before;
  }

  /** The next node from one along an axis, over gaps; the same one where there is none. */
  neighbour(node, axis, step) {
    const index = Array.from(this.place(node));
    for (index[axis] += step; ; index[axis] += step) {
      const flat = this.cell(index);
      if (flat < 0) return node;
      if (this.cells[flat] >= 0) return this.cells[flat];
    }
  }

  /** Of each axis, the place where a slice across it has most nodes. */
  fullest() {
    const counts = this.grid.map((extent) => new Int32Array(extent));
    for (let i = 0; i < this.node.length; i += 1) counts[i % this.ndim][this.node[i]] += 1;
    return counts.map((count) => count.indexOf(count.reduce((a, b) => Math.max(a, b))));
  }

  /** The node nearest to the middle of all. */
  middle() {
    const mean = new Array(this.ndim).fill(0);
    for (let i = 0; i < this.node.length; i += 1) mean[i % this.ndim] += this.node[i] / this.n;
    let best = 0;
    let least = Infinity;
    for (let i = 0; i < this.n; i += 1) {
      let far = 0;
      const place = this.place(i);
      for (let axis = 0; axis < this.ndim; axis += 1) far += ((place[axis] - mean[axis]) * this.spacing[axis]) ** 2;
      if (far < least) [best, least] = [i, far];
    }
    return best;
  }
}

/** Fields of all rho, as combinations of a few columns. */
class Fields {
  constructor({ header, arrays }) {
    this.header = header;
    this.basis = arrays.basis.values;
    [this.n, this.rank] = arrays.basis.shape;
    this.coefficients = arrays.coefficients.values;
    this.maps = arrays.maps.values;
    this.nMaps = arrays.maps.shape[0];
    this.rho = arrays.rho.values;
    this.relative = arrays.rho_relative.values;
    this.population = arrays.population.values;
    this.weights = new Float64Array(this.rank);
  }

  /** A sampled quantity at a place between samples. */
  between(samples, place) {
    const from = Math.min(Math.floor(place), samples.length - 1);
    const to = Math.min(from + 1, samples.length - 1);
    return from === place ? samples[from] : samples[from] + (place - from) * (samples[to] - samples[from]);
  }

  /** Where a rho lies among the samples, as a fraction of their steps. */
  placeOf(rho) {
    const last = this.rho.length - 1;
    let from = 0;
    while (from < last && this.rho[from + 1] <= rho) from += 1;
    if (from === last || rho <= this.rho[from]) return from;
    return from + (rho - this.rho[from]) / (this.rho[from + 1] - this.rho[from]);
  }

  /** Write the field at a place between samples. */
  at(place, out) {
    const from = Math.min(Math.floor(place), this.rho.length - 1);
    const to = Math.min(from + 1, this.rho.length - 1);
    for (let column = 0; column < this.rank; column += 1) {
      const low = this.coefficients[from * this.rank + column];
      const high = this.coefficients[to * this.rank + column];
      this.weights[column] = low + (place - from) * (high - low);
    }
    this.combine(this.weights, out);
  }

  /** Write a map, the first of which is number 0. */
  map(number, out) {
    this.combine(this.maps.subarray(number * this.rank, (number + 1) * this.rank), out);
  }

  /** Write a combination of the columns. */
  combine(weights, out) {
    const { basis, rank } = this;
    for (let node = 0, at = 0; node < out.length; node += 1) {
      let sum = 0;
      for (let column = 0; column < rank; column += 1, at += 1) sum += basis[at] * weights[column];
      out[node] = sum;
    }
  }

  /** Field of one node at every sampled rho. */
  profile(node) {
    const row = this.basis.subarray(node * this.rank, (node + 1) * this.rank);
    return Float32Array.from(this.rho, (_, sample) => {
      let sum = 0;
      for (let column = 0; column < this.rank; column += 1) {
        sum += row[column] * this.coefficients[sample * this.rank + column];
      }
      return sum;
    });
  }
}

/** Path of something of a shape. */
export function path(id, what = "") {
  return `api/shapes/${encodeURIComponent(id)}${what && `/${what}`}`;
}

/** What is known of a shape. */
export const loadCard = (id) => json(path(id));

/** What the pictures of a shape need. */
export async function loadPictures(id) {
  const [geometry, fields] = await Promise.all([bytes(path(id, "geometry")), bytes(path(id, "field"))]);
  return { geometry: new Geometry(unpackArrays(geometry)), fields: new Fields(unpackArrays(fields)) };
}

/** Parts of a shape; `k` of them, or as many as the server chooses. */
export async function loadParts(id, k) {
  return unpackArrays(await bytes(path(id, "parts"), { k }));
}

/** Log field of one source. */
export async function loadSource(id, patch) {
  return unpackArrays(await bytes(path(id, `source/${patch}`)));
}
