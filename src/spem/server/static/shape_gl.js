/** Drawing a surface by WebGL 2: each of its points takes the colour of the nodes a little below it. */

/** How far below, in voxels: at the surface the nearest nodes lie now nearer and now farther, which shows as moiré. */
export const DEPTH = 1.5;

const SURFACE = [
  `#version 300 es
  in vec3 place; in vec3 normal; in float lit;
  uniform mat3 rotation; uniform vec3 middle, spacing, zoom; uniform float depth;
  out vec3 cell, facing; out float mark;
  void main() {
    vec3 seen = rotation * ((place - middle) * spacing) * zoom;
    gl_Position = vec4(seen.xy, -seen.z, 1.0);
    cell = place - depth * normalize(normal) / spacing; facing = rotation * normal; mark = lit;
  }`,
  `#version 300 es
  precision highp float; precision highp sampler3D;
  in vec3 cell, facing; in float mark;
  uniform sampler3D levels; uniform sampler2D colours; uniform bool crisp; uniform vec3 accent;
  out vec4 pixel;
  void main() {
    vec3 extent = vec3(textureSize(levels, 0));
    vec3 index = clamp(cell.zyx, vec3(0.0), extent - 1.0);
    float level = crisp ? texelFetch(levels, ivec3(index + 0.5), 0).r : texture(levels, (index + 0.5) / extent).r;
    vec3 colour = texelFetch(colours, ivec2(int(level * 255.0 + 0.5), 0), 0).rgb;
    colour = mix(colour, accent, mark > 0.5 ? 0.85 : 0.0);
    vec3 n = normalize(facing);
    n *= n.z < 0.0 ? -1.0 : 1.0;
    float light = 0.60 + 0.40 * max(dot(n, normalize(vec3(-0.4, 0.55, 0.75))), 0.0);
    pixel = vec4(colour * light, 1.0);
  }`,
];
const POINTS = [
  `#version 300 es
  in vec3 place; in vec3 paint;
  uniform mat3 rotation; uniform vec3 middle, spacing, zoom; uniform float size, lift;
  out vec3 colour;
  void main() {
    vec3 seen = rotation * ((place - middle) * spacing) * zoom;
    gl_Position = vec4(seen.xy, -seen.z - lift, 1.0);
    gl_PointSize = size; colour = paint;
  }`,
  `#version 300 es
  precision highp float;
  in vec3 colour; uniform float opacity; out vec4 pixel;
  void main() {
    float far = 2.0 * length(gl_PointCoord - 0.5);
    if (far > 1.0) discard;
    pixel = vec4(far > 0.72 ? vec3(1.0) : colour, 1.0) * opacity;
  }`,
];

function program(gl, [vertex, fragment]) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) ?? "no WebGL");
  return made;
}

/** The graphics of one canvas. Throws where there is no WebGL 2 or the grid is too long for it. */
export class Graphics {
  constructor(canvas, grid) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    if (Math.max(...grid) > gl.getParameter(gl.MAX_3D_TEXTURE_SIZE)) throw new Error("the grid is too long for WebGL");
    Object.assign(this, { gl, grid, surface: program(gl, SURFACE), points: program(gl, POINTS) });
    this.levels = gl.createTexture();
    this.colours = gl.createTexture();
    this.buffers = {};
    this.texels = new Uint8Array(grid.reduce((a, b) => a * b, 1));
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  }

  /** Put numbers of an attribute where a program reads them. */
  attribute(kind, name, values, width) {
    const { gl } = this;
    this.buffers[name] ??= gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
    if (values) gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    const at = gl.getAttribLocation(kind, name.replace(/^.*\./, ""));
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, gl.FLOAT, false, 0, 0);
  }

  /** Take a mesh. */
  mesh(vertex, normal, face) {
    const { gl } = this;
    gl.useProgram(this.surface);
    this.bundle = gl.createVertexArray();
    gl.bindVertexArray(this.bundle);
    this.attribute(this.surface, "place", vertex, 3);
    this.attribute(this.surface, "normal", normal, 3);
    this.attribute(this.surface, "lit", new Float32Array(vertex.length / 3), 1);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, face, gl.STATIC_DRAW);
    this.count = face.length;
  }

  /** Light the vertices of a source: one number each. */
  light(values) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.lit);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
  }

  /** Take the colours of the nodes; `near` gives each cell its node. */
  paint({ level, table, crisp }, near) {
    const { gl, texels, grid } = this;
    this.cells ??= near.reduce((cells, node, cell) => (node < 0 ? cells : (cells.push(cell), cells)), []);
    for (const cell of this.cells) texels[cell] = level[near[cell]];
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_3D, this.levels);
    if (this.filled) gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, grid[2], grid[1], grid[0], gl.RED, gl.UNSIGNED_BYTE, texels);
    else gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8, grid[2], grid[1], grid[0], 0, gl.RED, gl.UNSIGNED_BYTE, texels);
    this.filled = true;
    for (const edge of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) {
      gl.texParameteri(gl.TEXTURE_3D, edge, gl.CLAMP_TO_EDGE);
    }
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(table.buffer));
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    this.crisp = crisp;
  }

  view(kind, { rotation, middle, spacing, zoom }) {
    const { gl } = this;
    gl.useProgram(kind);
    gl.uniformMatrix3fv(gl.getUniformLocation(kind, "rotation"), true, rotation);
    for (const [name, value] of Object.entries({ middle, spacing, zoom })) {
      gl.uniform3fv(gl.getUniformLocation(kind, name), value);
    }
  }

  /** Draw the surface and marks on it: coordinates and colours of points. */
  draw(view, accent, marks) {
    const { gl } = this;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.view(this.surface, view);
    gl.uniform1i(gl.getUniformLocation(this.surface, "levels"), 0);
    gl.uniform1i(gl.getUniformLocation(this.surface, "colours"), 1);
    gl.uniform1i(gl.getUniformLocation(this.surface, "crisp"), this.crisp ? 1 : 0);
    gl.uniform3fv(gl.getUniformLocation(this.surface, "accent"), accent);
    gl.uniform1f(gl.getUniformLocation(this.surface, "depth"), DEPTH * Math.min(...view.spacing));
    gl.bindVertexArray(this.bundle);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
    if (marks.place.length) this.drawMarks(view, marks);
  }

  drawMarks(view, { place, paint, size }) {
    const { gl } = this;
    this.view(this.points, view);
    this.attribute(this.points, "mark.place", place, 3);
    this.attribute(this.points, "mark.paint", paint, 3);
    gl.uniform1f(gl.getUniformLocation(this.points, "size"), size);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    // First faintly through the surface, then those in front of it.
    for (const [hidden, opacity] of [[true, 0.35], [false, 1]]) {
      if (hidden) gl.disable(gl.DEPTH_TEST);
      else gl.enable(gl.DEPTH_TEST);
      gl.uniform1f(gl.getUniformLocation(this.points, "opacity"), opacity);
      gl.uniform1f(gl.getUniformLocation(this.points, "lift"), 0.04);
      gl.drawArrays(gl.POINTS, 0, place.length / 3);
    }
  }
}
