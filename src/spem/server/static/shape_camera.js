/** Views onto a solid: rotations, and what a ray meets. Rows of a rotation point right, up and toward the viewer. */

/** How far the first view is turned off the axes, in radians, to show depth; as in the pictures of the package. */
const TILT = [0.314, -0.419];

export function times(a, b) {
  const out = new Array(9).fill(0);
  for (let i = 0; i < 9; i += 1) {
    for (let k = 0; k < 3; k += 1) out[i] += a[3 * Math.floor(i / 3) + k] * b[3 * k + (i % 3)];
  }
  return out;
}

/** A turn by an angle about the axis that points right (0), up (1) or toward the viewer (2). */
export function turn(axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  if (axis === 0) return [1, 0, 0, 0, c, -s, 0, s, c];
  return axis === 1 ? [c, 0, s, 0, 1, 0, -s, 0, c] : [c, -s, 0, s, c, 0, 0, 0, 1];
}

/** Covariance of coordinates. */
function covariance(points) {
  const mean = [0, 0, 0];
  const count = points.length / 3;
  for (let i = 0; i < points.length; i += 1) mean[i % 3] += points[i] / count;
  const out = new Array(9).fill(0);
  for (let i = 0; i < points.length; i += 3) {
    for (let a = 0; a < 3; a += 1) {
      for (let b = 0; b < 3; b += 1) out[3 * a + b] += ((points[i + a] - mean[a]) * (points[i + b] - mean[b])) / count;
    }
  }
  return out;
}

/** Eigenvectors of a symmetric matrix as rows, of the largest eigenvalue first, by Jacobi's rotations. */
function eigenvectors(matrix) {
  let m = matrix;
  let rows = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  for (let sweep = 0; sweep < 24; sweep += 1) {
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      const off = m[3 * p + q];
      if (Math.abs(off) < 1e-15 * (Math.abs(m[0]) + Math.abs(m[4]) + Math.abs(m[8]))) continue;
      const angle = 0.5 * Math.atan2(2 * off, m[4 * p] - m[4 * q]);
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      const r = [1, 0, 0, 0, 1, 0, 0, 0, 1];
      [r[4 * p], r[4 * q], r[3 * p + q], r[3 * q + p]] = [c, c, s, -s];
      const back = [0, 3, 6, 1, 4, 7, 2, 5, 8].map((i) => r[i]);
      m = times(times(r, m), back);
      rows = times(r, rows);
    }
  }
  const order = [0, 1, 2].sort((a, b) => m[4 * b] - m[4 * a]);
  return order.map((i) => rows.slice(3 * i, 3 * i + 3));
}

/** Rotation onto the broad side of some points, their longest extent to the right. */
export function principalView(points) {
  const [right, up] = eigenvectors(covariance(points)).map((axis) => {
    const strongest = axis.reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a));
    return axis.map((value) => value * Math.sign(strongest));
  });
  const toward = [0, 1, 2].map((i) => right[(i + 1) % 3] * up[(i + 2) % 3] - right[(i + 2) % 3] * up[(i + 1) % 3]);
  return times(times(turn(0, TILT[0]), turn(1, TILT[1])), [...right, ...up, ...toward]);
}

/** Unit normals of vertices, weighted by the areas of their faces. */
export function vertexNormals(vertex, face) {
  const normal = new Float32Array(vertex.length);
  for (let f = 0; f < face.length; f += 3) {
    const [a, b, c] = [3 * face[f], 3 * face[f + 1], 3 * face[f + 2]];
    const one = [0, 1, 2].map((i) => vertex[b + i] - vertex[a + i]);
    const two = [0, 1, 2].map((i) => vertex[c + i] - vertex[a + i]);
    for (let i = 0; i < 3; i += 1) {
      const value = one[(i + 1) % 3] * two[(i + 2) % 3] - one[(i + 2) % 3] * two[(i + 1) % 3];
      normal[a + i] += value;
      normal[b + i] += value;
      normal[c + i] += value;
    }
  }
  return normal;
}

/**
 * The front-most face under a place of the picture: `{face, weights}`, weights of its three corners; null for none.
 * `turned` are the vertices in the view.
 */
export function faceUnder(turned, face, x, y) {
  let best = null;
  let nearest = -Infinity;
  for (let f = 0; f < face.length; f += 3) {
    const [a, b, c] = [3 * face[f], 3 * face[f + 1], 3 * face[f + 2]];
    const [ax, ay] = [turned[a] - x, turned[a + 1] - y];
    const [bx, by] = [turned[b] - x, turned[b + 1] - y];
    const [cx, cy] = [turned[c] - x, turned[c + 1] - y];
    const area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    if (area === 0) continue;
    const weights = [(bx * cy - cx * by) / area, (cx * ay - ax * cy) / area, (ax * by - bx * ay) / area];
    if (weights[0] < 0 || weights[1] < 0 || weights[2] < 0) continue;
    const toward = weights[0] * turned[a + 2] + weights[1] * turned[b + 2] + weights[2] * turned[c + 2];
    if (toward > nearest) [best, nearest] = [{ face: f, weights }, toward];
  }
  return best;
}

/** Middle of some points, the radius of the ball about it, and how far they reach right and up of it in a view. */
export function extents(points, rotation) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; i += 1) {
    low[i % 3] = Math.min(low[i % 3], points[i]);
    high[i % 3] = Math.max(high[i % 3], points[i]);
  }
  const centre = low.map((value, axis) => (value + high[axis]) / 2);
  const extent = [0, 0];
  let radius = 0;
  for (let i = 0; i < points.length; i += 3) {
    const from = [0, 1, 2].map((axis) => points[i + axis] - centre[axis]);
    radius = Math.max(radius, Math.hypot(...from));
    for (const row of [0, 1]) {
      const along = from.reduce((sum, value, axis) => sum + rotation[3 * row + axis] * value, 0);
      extent[row] = Math.max(extent[row], Math.abs(along));
    }
  }
  return { centre, radius, extent };
}
