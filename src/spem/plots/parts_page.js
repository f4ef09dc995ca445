"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const stage = document.querySelector(".stage");
const canvas = stage.querySelector("canvas");
const captions = stage.querySelector(".captions");
const tip = stage.querySelector(".tip");
const labels = [...document.querySelectorAll("label[data-part]")];
const boxes = labels.map((label) => label.querySelector("input"));
const gl = canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });

const VERTEX = `#version 300 es
in vec4 place; in vec3 normal;
uniform vec3 middle; uniform mat3 turn; uniform vec2 scale, shift; uniform float radius;
out vec3 facing; flat out int part;
void main() {
  vec3 at = turn * (place.xyz / 65535.0 - middle);
  gl_Position = vec4(at.xy * scale + shift, -at.z / (radius * 1.01), 1);
  facing = turn * normal; part = int(place.w + 0.5);
}`;
const FRAGMENT = `#version 300 es
precision highp float; precision highp int;
in vec3 facing; flat in int part;
uniform sampler2D parts; uniform vec4 light[2]; uniform float ambient; uniform vec3 ground; uniform bool picking;
out vec4 colour;
void main() {
  vec4 own = texelFetch(parts, ivec2(part, 0), 0);
  if (own.a < 0.1) discard;
  if (picking) { colour = vec4(float(part) / 255.0, 0, 0, 1); return; }
  vec3 n = normalize(facing); n *= sign(n.z);
  float shade = ambient, most = ambient;
  for (int i = 0; i < 2; i++) {
    shade += light[i].w * max(dot(n, light[i].xyz), 0.0);
    most += light[i].w * light[i].z;
  }
  if (!gl_FrontFacing) shade *= 0.6;
  vec3 lit = own.rgb * shade / most;
  colour = vec4(own.a < 0.9 ? mix(ground, lit, 0.22) : lit, 1);
}`;

const first = { turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], zoom: 1, x: 0, y: 0 };
let view = { ...first };
let singled = -1;
let scene = null;
let waiting = false;

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

// Rotations are nine numbers, row by row.
function times(a, b) {
  const c = [];
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) c.push(a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j]);
  }
  return c;
}

function turnBy(right, down) {
  const [cr, sr, cd, sd] = [Math.cos(right), Math.sin(right), Math.cos(down), Math.sin(down)];
  const step = times([1, 0, 0, 0, cd, -sd, 0, sd, cd], [cr, 0, sr, 0, 1, 0, -sr, 0, cr]);
  view.turn = times(step, view.turn);
  draw();
}

function zoomBy(factor) {
  view.zoom = Math.min(20, Math.max(0.3, view.zoom * factor));
  draw();
}

function shader(kind, source) {
  const made = gl.createShader(kind);
  gl.shaderSource(made, source);
  gl.compileShader(made);
  return made;
}

function build() {
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, VERTEX));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, FRAGMENT));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  const names = ["middle", "turn", "scale", "shift", "radius", "ground", "picking"];
  const uniforms = Object.fromEntries(names.map((name) => [name, at(name)]));
  gl.uniform4fv(at("light"), data.lights.flat());
  gl.uniform1f(at("ambient"), data.ambient);
  gl.enable(gl.DEPTH_TEST);
  const fill = (target, array) => {
    gl.bindBuffer(target, gl.createBuffer());
    gl.bufferData(target, array, gl.STATIC_DRAW);
  };
  const shapes = data.shapes.map((shape) => {
    const arrays = gl.createVertexArray();
    gl.bindVertexArray(arrays);
    fill(gl.ARRAY_BUFFER, bytes(shape.places));
    const place = gl.getAttribLocation(program, "place");
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 4, gl.UNSIGNED_SHORT, false, 8, 0);
    fill(gl.ARRAY_BUFFER, bytes(shape.normals));
    const normal = gl.getAttribLocation(program, "normal");
    gl.enableVertexAttribArray(normal);
    gl.vertexAttribPointer(normal, 3, gl.BYTE, true, 4, 0);
    const faces = bytes(shape.faces);
    fill(gl.ELEMENT_ARRAY_BUFFER, faces);
    return { ...shape, arrays, count: faces.byteLength / 4 };
  });
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return { uniforms, shapes, frame: gl.createFramebuffer(), colour: gl.createRenderbuffer(), depth: gl.createRenderbuffer() };
}

// The grid of cells in which the shapes look largest; three stand in a row or a column, without a gap.
function grid() {
  const n = data.shapes.length;
  let best = { size: -1 };
  for (let columns = 1; columns <= n; columns++) {
    const rows = Math.ceil(n / columns);
    if (n === 3 && columns === 2) continue;
    const [width, height] = [canvas.width / columns, canvas.height / rows];
    const size = Math.min(...data.shapes.map((s) => Math.min(width / s.reach[0], height / s.reach[1])));
    if (size > best.size) best = { size, columns, rows, width, height };
  }
  return best;
}

function paint(picking) {
  const { uniforms, shapes } = scene;
  const cells = grid();
  gl.uniform1i(uniforms.picking, picking ? 1 : 0);
  gl.clearColor(picking ? 1 : 0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  shapes.forEach((shape, i) => {
    const [row, column] = [Math.floor(i / cells.columns), i % cells.columns];
    const { width, height } = cells;
    gl.viewport(Math.round(column * width), Math.round((cells.rows - 1 - row) * height), Math.round(width), Math.round(height));
    const room = Math.min((0.92 * width) / shape.reach[0], (0.84 * height) / shape.reach[1]) * view.zoom;
    gl.uniform2f(uniforms.scale, room / width, room / height);
    gl.uniform2f(uniforms.shift, view.x, view.y);
    gl.uniform1f(uniforms.radius, shape.radius);
    gl.uniform3fv(uniforms.middle, shape.middle);
    gl.uniformMatrix3fv(uniforms.turn, true, times(view.turn, shape.rotation));
    gl.bindVertexArray(shape.arrays);
    gl.drawElements(gl.TRIANGLES, shape.count, gl.UNSIGNED_INT, 0);
  });
}

function states() {
  const texels = new Uint8Array(4 * data.colours.length);
  data.colours.forEach((colour, i) => {
    const dim = singled >= 0 && singled !== i;
    texels.set([...colour, boxes[i].checked ? (dim ? 128 : 255) : 0], 4 * i);
  });
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, data.colours.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
}

function fit() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [stage.clientWidth, stage.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
  if (canvas.width === width && canvas.height === height) return;
  [canvas.width, canvas.height] = [width, height];
  gl.bindRenderbuffer(gl.RENDERBUFFER, scene.colour);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, width, height);
  gl.bindRenderbuffer(gl.RENDERBUFFER, scene.depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, width, height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, scene.frame);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, scene.colour);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, scene.depth);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  if (data.shapes.length > 1) {
    const cells = grid();
    captions.style.gridTemplate = `repeat(${cells.rows}, 1fr) / repeat(${cells.columns}, 1fr)`;
  }
}

function draw() {
  if (waiting || !scene) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    if (gl.isContextLost()) return;
    fit();
    const ground = getComputedStyle(stage).backgroundColor.match(/[\d.]+/g).slice(0, 3).map((c) => c / 255);
    gl.uniform3fv(scene.uniforms.ground, ground);
    states();
    paint(false);
  });
}

function partAt(x, y) {
  const ratio = canvas.width / canvas.clientWidth;
  const [column, row] = [Math.floor(x * ratio), canvas.height - 1 - Math.floor(y * ratio)];
  gl.bindFramebuffer(gl.FRAMEBUFFER, scene.frame);
  gl.enable(gl.SCISSOR_TEST);
  gl.scissor(column, row, 1, 1);
  paint(true);
  const pixel = new Uint8Array(4);
  gl.readPixels(column, row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  gl.disable(gl.SCISSOR_TEST);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  return pixel[3] ? pixel[0] : -1;
}

function single(part) {
  if (part === singled) return;
  singled = part;
  labels.forEach((label, i) => label.classList.toggle("on", i === part));
  draw();
}

function point(event) {
  const part = partAt(event.offsetX, event.offsetY);
  single(part);
  tip.hidden = part < 0;
  if (part < 0) return;
  tip.textContent = labels[part].querySelector(".name").textContent;
  const x = Math.min(event.offsetX + 14, stage.clientWidth - tip.offsetWidth - 4);
  tip.style.transform = `translate(${x}px, ${Math.max(4, event.offsetY - 30)}px)`;
}

function leave() {
  tip.hidden = true;
  single(-1);
}

const down = new Map();
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  down.set(event.pointerId, [event.clientX, event.clientY]);
  tip.hidden = true;
});
for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, (event) => down.delete(event.pointerId));
}
canvas.addEventListener("pointermove", (event) => {
  if (!scene) return;
  const before = down.get(event.pointerId);
  if (!before) {
    if (event.pointerType === "mouse") point(event);
    return;
  }
  const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
  const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
  down.set(event.pointerId, [event.clientX, event.clientY]);
  if (other) {
    const [was, is] = [before, [event.clientX, event.clientY]].map((p) => Math.hypot(p[0] - other[0], p[1] - other[1]));
    if (was > 0) zoomBy(is / was);
  } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) {
    const cells = grid();
    const ratio = canvas.width / canvas.clientWidth;
    view.x += (2 * dx * ratio) / cells.width;
    view.y -= (2 * dy * ratio) / cells.height;
    draw();
  } else {
    turnBy(dx * 0.01, dy * 0.01);
  }
});
canvas.addEventListener("pointerleave", leave);
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoomBy(Math.exp(-Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 100) * 0.002));
}, { passive: false });
canvas.addEventListener("keydown", (event) => {
  const step = Math.PI / 24;
  const keys = {
    ArrowLeft: () => turnBy(-step, 0), ArrowRight: () => turnBy(step, 0),
    ArrowUp: () => turnBy(0, -step), ArrowDown: () => turnBy(0, step),
    "+": () => zoomBy(1.15), "=": () => zoomBy(1.15), "-": () => zoomBy(1 / 1.15), 0: reset, Home: reset,
  };
  if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  keys[event.key]();
});

function reset() {
  view = { ...first };
  draw();
}

function show(all) {
  boxes.forEach((box) => { box.checked = all; });
  draw();
}

labels.forEach((label, i) => {
  label.addEventListener("pointerenter", () => single(i));
  label.addEventListener("pointerleave", leave);
  boxes[i].addEventListener("focus", () => { if (boxes[i].matches(":focus-visible")) single(i); });
  boxes[i].addEventListener("blur", leave);
  boxes[i].addEventListener("change", draw);
});
document.getElementById("all").addEventListener("click", () => show(true));
document.getElementById("none").addEventListener("click", () => show(false));
document.getElementById("reset").addEventListener("click", reset);

function start() {
  scene = build();
  canvas.width = 0;
  draw();
}

if (gl) {
  stage.querySelector(".stills").hidden = true;
  canvas.hidden = false;
  document.querySelector("fieldset").disabled = false;
  for (const control of document.querySelectorAll(".controls")) control.hidden = false;
  if (data.shapes.length > 1) {
    for (const shape of data.shapes) {
      const caption = document.createElement("span");
      caption.textContent = shape.name;
      captions.append(caption);
    }
  }
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", start);
  new ResizeObserver(draw).observe(stage);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  start();
} else {
  document.getElementById("missing").hidden = false;
}
