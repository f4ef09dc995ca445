/** Colours and marker shapes that tell labels apart, also for readers who see few colours. */

/** Okabe and Ito's colours, the yellow darkened for a light ground; shown in the order that keeps neighbours apart. */
const LIGHT = ["#0072b2", "#d55e00", "#009270", "#b4558f", "#3a9bd0", "#b97f00", "#7a7000", "#55585e"];
const DARK = ["#56a8e0", "#f0803c", "#2fc49b", "#e39ac4", "#8fd0f5", "#f0b53a", "#e6dc5a", "#b9bcc4"];

/** Outlines within a box of side 2 about 0. */
const SHAPES = [
  (path) => path.arc(0, 0, 0.92, 0, 2 * Math.PI),
  (path) => path.rect(-0.8, -0.8, 1.6, 1.6),
  (path) => polygon(path, 3, -Math.PI / 2, 1.12),
  (path) => polygon(path, 4, 0, 1.12),
  (path) => cross(path),
  (path) => polygon(path, 3, Math.PI / 2, 1.12),
];

function polygon(path, corners, turn, radius) {
  for (let corner = 0; corner < corners; corner += 1) {
    const angle = turn + (2 * Math.PI * corner) / corners;
    path.lineTo(radius * Math.cos(angle), radius * Math.sin(angle));
  }
  path.closePath();
}

function cross(path) {
  const [a, b] = [0.34, 0.95];
  const corners = [[-a, -b], [a, -b], [a, -a], [b, -a], [b, a], [a, a], [a, b], [-a, b], [-a, a], [-b, a], [-b, -a], [-a, -a]];
  for (const [x, y] of corners) path.lineTo(x, y);
  path.closePath();
}

/** Colour and outline of the label of this place: 48 pairs, neighbours differing in both. */
export function style(place, dark) {
  const round = Math.floor(place / 24);
  const path = new Path2D();
  SHAPES[(place + round) % SHAPES.length](path);
  const colours = dark ? DARK : LIGHT;
  return { colour: colours[place % colours.length], path };
}

/** Draw a marker about a point; `ground` outlines it, so that markers that overlap stay apart. */
export function drawMarker(context, { colour, path }, x, y, radius, ground) {
  context.save();
  context.translate(x, y);
  context.scale(radius, radius);
  context.fillStyle = colour;
  context.fill(path);
  context.lineWidth = 1.1 / radius;
  context.strokeStyle = ground;
  context.stroke(path);
  context.restore();
}

/** A marker as a small canvas, for legends and for drawing it often. */
export function sprite(marker, radius, ground, ratio = devicePixelRatio || 1) {
  const canvas = document.createElement("canvas");
  const side = Math.ceil(2.6 * radius + 2);
  canvas.width = canvas.height = side * ratio;
  canvas.style.width = canvas.style.height = `${side}px`;
  canvas.setAttribute("aria-hidden", "true");
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  drawMarker(context, marker, side / 2, side / 2, radius, ground);
  return canvas;
}
