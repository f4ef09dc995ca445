/** A plane of cells as a picture of one pixel a cell. */

/** Cells of a plane, each with its node; what has none is clear. */
export class Raster {
  constructor(width, height) {
    this.canvas = document.createElement("canvas");
    this.canvas.width = width;
    this.canvas.height = height;
    this.context = this.canvas.getContext("2d");
    this.image = this.context.createImageData(width, height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.node = new Int32Array(width * height).fill(-1);
  }

  /** Take nodes from a grid: its flat place of each pixel is begin + row * down + column * right. */
  take(grid, begin, down, right) {
    const { width, height } = this.canvas;
    for (let row = 0, pixel = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1, pixel += 1) {
        this.node[pixel] = grid[begin + row * down + column * right];
      }
    }
  }

  /** Colour the pixels. */
  paint({ level, table }) {
    const { pixels, node } = this;
    for (let pixel = 0; pixel < pixels.length; pixel += 1) {
      pixels[pixel] = node[pixel] < 0 ? 0 : table[level[node[pixel]]];
    }
    this.context.putImageData(this.image, 0, 0);
  }
}

/** Give a canvas as many pixels as its place on the screen has; false where it has none. */
export function fitCanvas(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const width = Math.round(canvas.clientWidth * ratio);
  const height = Math.round(canvas.clientHeight * ratio);
  if (!width || !height) return false;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return true;
}

/** A colour of the page by the name of its CSS variable. */
export function pageColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Draw a ring about a point, seen on light and on dark. */
export function ring(context, x, y, radius, colour) {
  for (const [width, stroke] of [[5, "rgb(0 0 0 / 75%)"], [2.5, colour]]) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.lineWidth = width;
    context.strokeStyle = stroke;
    context.stroke();
  }
}

/** Size of marks that suits a canvas, in CSS pixels. */
export function dotSize({ clientWidth }) {
  return Math.min(Math.max(clientWidth / 36, 6), 12);
}

/** Draw a filled point with a rim. */
export function dot(context, x, y, radius, colour) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = colour;
  context.fill();
  context.lineWidth = 1.5;
  context.strokeStyle = "white";
  context.stroke();
}
