"use strict";
// Draws the body of this page with WebGL 2. All numbers are in the page: texts as JSON, arrays in base64.
(() => {
const byId = (id) => document.getElementById(id);
// A report has fewer controls than a page of its own.
const on = (id, event, act) => byId(id) && byId(id).addEventListener(event, act);
const isChecked = (id) => Boolean(byId(id) && byId(id).checked);
const say = (id, text) => byId(id) && (byId(id).textContent = text);
const facts = JSON.parse(byId("data").textContent);
const canvas = byId("canvas");

function fail(text) {
  byId("failure").textContent = text;
  byId("failure").hidden = false;
  document.documentElement.dataset.failed = text;
}
window.addEventListener("error", (event) => fail(event.message));

function array(id, type) {
  const element = byId("data-" + id);
  if (!element) return new type(0);
  const text = atob(element.textContent), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  element.remove();
  return new type(bytes.buffer);
}
const positions = array("positions", Int16Array), shapes = array("shapes", Int16Array);
const index = facts.vertices > 65535 ? Uint32Array : Uint16Array;
const triangles = array("triangles", index), edges = array("edges", index);
const motion = facts.motion && {
  ...facts.motion, times: array("times", Float32Array), q: array("q", Float32Array),
  origins: array("origins", Float32Array), attitudes: array("attitudes", Float32Array),
};
// Values at the vertices, field by field and set by set; -1 where there is none.
const values = array("values", Int16Array);
let firstSet = 0;
const fields = (facts.fields || []).map((field) => {
  const own = { ...field, first: firstSet };
  firstSet += field.sets.length;
  return own;
});
const vertices = facts.vertices, modes = facts.modes, half = facts.half, STEP = 1 / 32767;

// Vectors and 3 x 3 matrices, these by columns as WebGL takes them.
const times = (m, v) => [0, 1, 2].map((k) => m[k] * v[0] + m[3 + k] * v[1] + m[6 + k] * v[2]);
const product = (a, b) => [0, 3, 6].flatMap((j) => times(a, b.slice(j, j + 3)));
const sum = (a, b, factor = 1) => a.map((x, k) => x + factor * b[k]);
const turn = (axis, angle) => {
  const c = Math.cos(angle), s = Math.sin(angle), [l, m] = [(axis + 1) % 3, (axis + 2) % 3], r = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  r[4 * l] = r[4 * m] = c;
  r[3 * l + m] = s;
  r[3 * m + l] = -s;
  return r;
};
const ofEuler = ([w, x, y, z]) => [
  1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 2 * (x * y - w * z), 1 - 2 * (x * x + z * z),
  2 * (y * z + w * x), 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1];

// What is shown, and from where.
const START = () => ({ view: product(turn(0, facts.view[0]), turn(2, facts.view[1])), zoom: Number(canvas.dataset.zoom || 1), pan: [0, 0] });
const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
const state = { ...START(), mode: 0, phase: 0.25, time: 0, playing: !still, factor: 1, speed: 1, last: 0 };

const gl = canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });
if (!gl) return fail("This browser has no WebGL 2, which draws the body. Another browser, or hardware acceleration in its settings, may have it.");
document.documentElement.dataset.live = "";
const VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 displacement;
layout(location = 2) in float tone;
uniform mat3 model, view;
uniform vec3 shift, scale;
uniform vec2 pan;
uniform float size, amplitude, share, dot;
uniform int component;
uniform bool toned;
out vec3 place;
out float level, known;
void main() {
  place = view * (model * (position * size + amplitude * displacement) + shift);
  level = toned ? tone : share * (component == 0 ? length(displacement) : abs(displacement[component - 1]));
  known = toned && tone < 0.0 ? 0.0 : 1.0;
  gl_Position = vec4(place * scale + vec3(pan, 0.0), 1.0);
  gl_PointSize = dot;
}`;
// The colours are a polynomial that is close to those of `viridis` (van der Walt and Smith, CC0).
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 place;
in float level, known;
uniform vec4 plain;
uniform bool coloured, lit;
out vec4 colour;
vec3 scaled(float t) {
  return vec3(0.278, 0.005, 0.334) + t * (vec3(0.105, 1.404, 1.385) + t * (vec3(-0.331, 0.215, 0.095) + t * (vec3(-4.634, -5.799, -19.332)
    + t * (vec3(6.228, 14.180, 56.691) + t * (vec3(4.776, -13.745, -65.353) + t * vec3(-5.435, 4.646, 26.312))))));
}
void main() {
  vec4 own = coloured && known > 0.999 ? vec4(scaled(clamp(level, 0.0, 1.0)), 1.0) : plain;
  float light = 1.0;
  if (lit) {
    vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
    light = 0.45 + 0.55 * abs(dot(normal, normalize(vec3(0.25, 0.35, 1.0))));
  }
  colour = vec4(own.rgb * light * own.a, own.a);
}`;
function shader(kind, source) {
  const made = gl.createShader(kind);
  gl.shaderSource(made, source);
  gl.compileShader(made);
  if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
  return made;
}
const program = gl.createProgram();
gl.attachShader(program, shader(gl.VERTEX_SHADER, VERTEX));
gl.attachShader(program, shader(gl.FRAGMENT_SHADER, FRAGMENT));
gl.linkProgram(program);
if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
gl.useProgram(program);
const uniform = Object.fromEntries(["model", "view", "shift", "scale", "pan", "size", "amplitude", "share", "dot", "component",
  "plain", "coloured", "lit", "toned"].map((name) => [name, gl.getUniformLocation(program, name)]));

function buffer(target, data, usage = gl.STATIC_DRAW) {
  const made = gl.createBuffer();
  gl.bindBuffer(target, made);
  gl.bufferData(target, data, usage);
  return made;
}
// The part: 16-bit positions, 32-bit displacements that follow the mode or the time.
const part = gl.createVertexArray();
gl.bindVertexArray(part);
buffer(gl.ARRAY_BUFFER, positions);
gl.enableVertexAttribArray(0);
gl.vertexAttribPointer(0, 3, gl.SHORT, true, 0, 0);
const displacement = new Float32Array(3 * vertices);
const displaced = buffer(gl.ARRAY_BUFFER, displacement, gl.DYNAMIC_DRAW);
gl.enableVertexAttribArray(1);
gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
const tones = new Float32Array(vertices);
const toneBuffer = buffer(gl.ARRAY_BUFFER, tones, gl.DYNAMIC_DRAW);
gl.enableVertexAttribArray(2);
gl.vertexAttribPointer(2, 1, gl.FLOAT, false, 0, 0);
// Lines of axes and marks, anew in every frame.
const marks = gl.createVertexArray();
gl.bindVertexArray(marks);
const markBuffer = buffer(gl.ARRAY_BUFFER, new Float32Array(3), gl.DYNAMIC_DRAW);
gl.enableVertexAttribArray(0);
gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
gl.bindVertexArray(null);
const indices = (data) => ({ buffer: buffer(gl.ELEMENT_ARRAY_BUFFER, data), count: data.length, type: data instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT });
const drawn = { triangles: indices(triangles), edges: indices(edges), lines: null, held: indices(new index(facts.interfaces.flatMap((own) => own.nodes))) };
function allLines() {
  const seen = new Set(), lines = [];
  for (let t = 0; t < triangles.length; t += 3) for (let k = 0; k < 3; k++) {
    const a = triangles[t + k], b = triangles[t + (k + 1) % 3], low = Math.min(a, b), high = Math.max(a, b), key = low * vertices + high;
    if (!seen.has(key)) seen.add(key), lines.push(low, high);
  }
  return indices(new index(lines));
}

// Displacements.
function showMode() {
  const factor = modes[state.mode].scale * STEP, first = 3 * vertices * state.mode;
  for (let i = 0; i < displacement.length; i++) displacement[i] = factor * shapes[first + i];
  upload();
}
function upload() {
  gl.bindBuffer(gl.ARRAY_BUFFER, displaced);
  gl.bufferSubData(gl.ARRAY_BUFFER, 0, displacement);
}
/// Field that colours the body, and its values in the mode that is shown.
const field = () => fields[Number(byId("colours") ? byId("colours").value : 0) - FIRST_FIELD];
const setOf = (own) => own.sets[own.isPerMode ? state.mode : 0];
function showTones() {
  const own = field();
  say("extreme", own ? `Largest: ${short(setOf(own).largest)} ${own.unit}, ${setOf(own).words}; marked.` : "");
  if (own) {
    const first = vertices * (own.first + (own.isPerMode ? state.mode : 0));
    for (let i = 0; i < vertices; i++) tones[i] = values[first + i] < 0 ? -1 : values[first + i] * STEP;
    gl.bindBuffer(gl.ARRAY_BUFFER, toneBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, tones);
  }
  byId("most").textContent = own ? `${short(setOf(own).largest)} ${own.unit}` : motion ? `${short(motion.largest)} ${facts.units.length}` : "largest of the mode";
  ask();
}
/// State of the motion at a time: coordinates, place and attitude between two instants.
function instant(time) {
  const t = motion.times, n = t.length;
  let k = 0;
  for (let low = 0, high = n - 1; low <= high;) {
    const middle = (low + high) >> 1;
    if (t[middle] <= time) k = middle, low = middle + 1; else high = middle - 1;
  }
  const next = Math.min(k + 1, n - 1), part = next > k ? (time - t[k]) / (t[next] - t[k]) : 0;
  const between = (from, width) => {
    const a = Array.from(from.subarray(k * width, (k + 1) * width)), b = from.subarray(next * width, (next + 1) * width);
    const sign = width === 4 && a.reduce((s, x, i) => s + x * b[i], 0) < 0 ? -1 : 1;
    return a.map((x, i) => x + part * (sign * b[i] - x));
  };
  const e = between(motion.attitudes, 4), length = Math.hypot(...e);
  return { q: between(motion.q, modes.length), origin: between(motion.origins, 3), axes: ofEuler(e.map((x) => x / length)) };
}
function showInstant(now) {
  displacement.fill(0);
  for (let j = 0; j < modes.length; j++) {
    const factor = modes[j].scale * STEP * now.q[j], first = 3 * vertices * j;
    if (factor !== 0) for (let i = 0; i < displacement.length; i++) displacement[i] += factor * shapes[first + i];
  }
  upload();
}

// Colours of the page, as it is light or dark.
let colour = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["part", "edge", "rest", "mark", "quiet"]) {
    const hex = parseInt(style.getPropertyValue("--" + name).trim().slice(1), 16);
    colour[name] = [hex >> 16, (hex >> 8) & 255, hex & 255].map((x) => x / 255);
  }
}
const AXES = [[0.85, 0.25, 0.22], [0.2, 0.62, 0.28], [0.25, 0.45, 0.9]];

// Labels are elements over the canvas.
const labels = [];
function label(text, place, tone) {
  let own = labels.find((known) => !known.used);
  if (!own) {
    own = { element: byId("labels").appendChild(document.createElement("span")) };
    labels.push(own);
  }
  own.used = true;
  own.element.hidden = false;
  if (own.element.textContent !== text) own.element.textContent = text;
  own.element.style.color = `rgb(${tone.map((x) => Math.round(255 * x))})`;
  own.element.style.transform = `translate(${(place[0] + 1) / 2 * canvas.clientWidth + 6}px, ${(1 - place[1]) / 2 * canvas.clientHeight - 9}px)`;
}

/// Ring of a mark that the body hides, over the canvas.
const ring = document.createElement("span");
ring.hidden = true;
ring.dataset.behind = "";
Object.assign(ring.style, { boxSizing: "border-box", width: "16px", height: "16px", border: "2px dashed #d9403a", borderRadius: "50%" });
byId("labels").appendChild(ring);
/// True if a triangle is in front of a point of the undeformed body with this displacement, seen along the third axis of `view`.
/// Triangles at the vertex of the point do not hide it; those of a thinned surface may pass in front of a point without one.
function isHidden(point, vertex, view, amplitude) {
  const [x, y, z] = times(view, point), front = z + (vertex === null ? 0.02 : 1e-3) * facts.radius;
  const at = (i, k) => half * STEP * positions[3 * i + k] + amplitude * displacement[3 * i + k];
  const seen = (i, row) => view[row] * at(i, 0) + view[3 + row] * at(i, 1) + view[6 + row] * at(i, 2);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    if (a === vertex || b === vertex || c === vertex) continue;
    const ax = seen(a, 0), bx = seen(b, 0), cx = seen(c, 0);
    if (Math.min(ax, bx, cx) > x || Math.max(ax, bx, cx) < x) continue;
    const ay = seen(a, 1), by = seen(b, 1), cy = seen(c, 1);
    const whole = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    const u = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) / whole, v = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) / whole, w = 1 - u - v;
    if (u >= 0 && v >= 0 && w >= 0 && u * seen(a, 2) + v * seen(b, 2) + w * seen(c, 2) > front) return true;
  }
  return false;
}

function draw() {
  const ratio = Math.min(devicePixelRatio || 1, 2), width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
  if (!width || !height) return;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  // Where the body is: place = model local + shift, with local from the centre of the drawing.
  let model = IDENTITY, shift = [0, 0, 0], reach = facts.radius, now = null, amplitude, share;
  if (motion) {
    now = instant(state.time);
    showInstant(now);
    model = now.axes;
    const away = times(model, sum(facts.centre, motion.originInModel, -1));
    const target = isChecked("follow") ? sum(now.origin, times(model, sum(facts.centre, motion.originInModel, -1))) : motion.middle;
    shift = sum(sum(now.origin, away), target, -1);
    if (!isChecked("follow")) reach += motion.reach;
    amplitude = state.factor;
    share = motion.largest > 0 ? 1 / motion.largest : 0;
  } else if (!modes.length) {
    amplitude = share = 0;
  } else {
    const largest = modes[state.mode].largest;
    share = largest > 0 ? 1 / largest : 0;
    amplitude = 0.12 * facts.radius * state.factor * share * Math.sin(2 * Math.PI * state.phase);
  }
  const scale = state.zoom / reach / 1.25, aspect = width / height;
  const own = aspect > 1 ? [scale / aspect, scale, -0.1 * scale] : [scale, scale * aspect, -0.1 * scale];
  const set = (program) => {
    gl.uniformMatrix3fv(uniform.view, false, state.view);
    gl.uniformMatrix3fv(uniform.model, false, program.model || model);
    gl.uniform3fv(uniform.shift, program.shift || shift);
    gl.uniform3fv(uniform.scale, program.scale || own);
    gl.uniform2fv(uniform.pan, program.pan || state.pan);
    gl.uniform1f(uniform.size, program.size || half);
    gl.uniform1f(uniform.amplitude, program.amplitude ?? amplitude);
    gl.uniform1f(uniform.share, share);
    gl.uniform1f(uniform.dot, (program.dot || 3) * ratio);
    gl.uniform1i(uniform.component, component > 3 ? 0 : Math.max(0, component));
    gl.uniform4fv(uniform.plain, program.plain || [0, 0, 0, 1]);
    gl.uniform1i(uniform.coloured, program.coloured ? 1 : 0);
    gl.uniform1i(uniform.lit, program.lit ? 1 : 0);
    gl.uniform1i(uniform.toned, program.coloured && toned ? 1 : 0);
  };
  const component = byId("colours") ? Number(byId("colours").value) : 0, coloured = component >= 0, toned = field();
  const elements = (kind, own) => {
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, own.buffer);
    gl.drawElements(kind, own.count, own.type, 0);
  };
  gl.bindVertexArray(part);
  if (drawn.triangles.count) {
    set({ coloured, lit: true, plain: [...colour.part, 1] });
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    elements(gl.TRIANGLES, drawn.triangles);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  } else {
    set({ coloured, dot: vertices > 5000 ? 2 : vertices > 200 ? 4 : 7, plain: [...colour.part, 1] });
    gl.drawArrays(gl.POINTS, 0, vertices);
  }
  if (isChecked("lines") && drawn.triangles.count) {
    drawn.lines = drawn.lines || allLines();
    set({ plain: [...colour.edge, 0.35] });
    elements(gl.LINES, drawn.lines);
  }
  set({ plain: [...colour.edge, 1], coloured: coloured && !drawn.triangles.count });
  elements(gl.LINES, drawn.edges);
  if (isChecked("outline")) {
    set({ plain: [...colour.rest, 0.75], amplitude: 0 });
    if (drawn.edges.count) elements(gl.LINES, drawn.edges);
    else if (!drawn.triangles.count) gl.drawArrays(gl.POINTS, 0, vertices);
    else elements(gl.LINES, (drawn.lines = drawn.lines || allLines()));
  }
  labels.forEach((known) => (known.used = false));
  const seen = (local) => {
    const place = times(state.view, sum(times(model, local), shift));
    return [place[0] * own[0] + state.pan[0], place[1] * own[1] + state.pan[1]];
  };
  const segments = (points, options) => {
    gl.bindVertexArray(marks);
    gl.bindBuffer(gl.ARRAY_BUFFER, markBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points.flat()), gl.DYNAMIC_DRAW);
    set({ size: 1, amplitude: 0, ...options });
    gl.drawArrays(options.points ? gl.POINTS : gl.LINES, 0, points.length);
  };
  if (isChecked("interfaces") && drawn.held.count) {
    set({ plain: [...colour.mark, 1], dot: 3.5 });
    elements(gl.POINTS, drawn.held);
  }
  gl.disable(gl.DEPTH_TEST);
  if (isChecked("interfaces")) {
    for (const one of facts.interfaces.filter((one) => one.reference)) {
      const moved = [0, 1, 2].map((k) => motion ? now.q.reduce((s, q, j) => s + q * one.motion[3 * j + k], 0) : one.motion[3 * state.mode + k] || 0);
      const place = sum(sum(one.reference, facts.centre, -1), moved, amplitude);
      segments([place], { points: true, dot: 10, plain: [...colour.mark, 1] });
      label(one.name, seen(place), colour.mark);
    }
  }
  if (toned && setOf(toned).words) {
    const { place, vertex, largest } = setOf(toned), at = vertex === null ? 0 : 3 * vertex;
    const moved = vertex === null ? [0, 0, 0] : Array.from(displacement.subarray(at, at + 3));
    const marked = sum(sum(place, facts.centre, -1), moved, amplitude);
    const behind = isHidden(marked, vertex, product(state.view, model), amplitude), [x, y] = seen(marked);
    if (!behind) {
      segments([marked], { points: true, dot: 13, plain: [0.85, 0.25, 0.22, 1] });
      segments([marked], { points: true, dot: 7, plain: [1, 1, 1, 1] });
    }
    ring.hidden = !behind;
    ring.style.transform = `translate(${(x + 1) / 2 * canvas.clientWidth - 8}px, ${(1 - y) / 2 * canvas.clientHeight - 8}px)`;
    label(`${short(largest)}${toned.isPerMode ? "" : ` ${toned.unit}`}${behind ? ", behind" : ""}`, [x, y], AXES[0]);
    document.documentElement.dataset.mark = behind ? "behind" : "visible";
  } else {
    ring.hidden = true;
    delete document.documentElement.dataset.mark;
  }
  if (isChecked("axes")) {
    const centre = sum(facts.centreOfMass, facts.centre, -1);
    facts.principal.forEach((axis, k) => {
      const end = sum(centre, axis, 0.75 * facts.radius);
      segments([centre, end], { plain: [...AXES[k], 1] });
      label(String(k + 1), seen(end), AXES[k]);
    });
  }
  // The axes of the model in a corner.
  const corner = [-1 + 90 * ratio / width, -1 + 90 * ratio / height], arm = [70 * ratio / width, 70 * ratio / height, -0.01];
  "xyz".split("").forEach((name, k) => {
    const end = [0, 1, 2].map((l) => (l === k ? 1 : 0)), place = times(state.view, times(model, end));
    segments([[0, 0, 0], end], { plain: [...colour.quiet, 1], shift: [0, 0, 0], scale: arm, pan: corner });
    label(name, [corner[0] + arm[0] * place[0], corner[1] + arm[1] * place[1]], colour.quiet);
  });
  gl.bindVertexArray(null);
  labels.filter((known) => !known.used).forEach((known) => (known.element.hidden = true));
  byId("legend").hidden = !coloured;
  Object.assign(document.documentElement.dataset, { drawn: drawn.triangles.count ? "surface" : "points", mode: state.mode + 1,
    phase: state.phase.toFixed(4), time: state.time.toPrecision(6), field: toned ? toned.label : "" });
}

// Time goes on, or a frame is wanted.
let asked = false, inView = true;
function ask() {
  if (!asked) asked = true, requestAnimationFrame(frame);
}
function frame(clock) {
  asked = false;
  const passed = state.last ? Math.min(clock - state.last, 100) / 1000 : 0;
  state.last = state.playing ? clock : 0;
  if (state.playing) {
    if (motion) {
      const start = motion.times[0], length = motion.times[motion.times.length - 1] - start;
      if (length > 0) state.time = start + (state.time - start + passed * state.speed * length / 8) % length;
      showTime();
    } else state.phase = (state.phase + passed * state.speed / 1.6) % 1;
    if (inView) ask();
  }
  draw();
}
const short = (x) => (x === 0 || (Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5) ? String(Number(x.toPrecision(4))) : x.toExponential(2));
function showTime() {
  byId("time").value = state.time;
  byId("now").textContent = `${short(state.time)} ${facts.units.time}`;
}
function play(playing) {
  state.playing = playing;
  byId("play").textContent = playing ? "Pause" : "Play";
  ask();
}
function choose(mode) {
  if (!modes.length) return showTones();
  state.mode = (mode + modes.length) % modes.length;
  byId("mode").value = state.mode;
  byId("kind").textContent = modes[state.mode].kind;
  if (!motion) showMode();
  showTones();
}
function step(direction) {
  if (!motion) return choose(state.mode + direction);
  play(false);
  let k = motion.times.findIndex((t) => t >= state.time);
  k = Math.max(0, Math.min(motion.times.length - 1, (k < 0 ? motion.times.length - 1 : k) + direction));
  state.time = motion.times[k];
  showTime();
}
function setAmplitude(value) {
  state.factor = motion ? 10 ** value : value;
  byId("amplitude").value = value;
  byId("times").textContent = motion ? `${short(state.factor)} \u00d7` : `${Math.round(100 * value)} %`;
  ask();
}
function rotate(dx, dy) {
  state.view = product(product(turn(0, dy), turn(1, dx)), state.view);
  ask();
}
function zoom(factor) {
  state.zoom = Math.max(0.05, Math.min(200, state.zoom * factor));
  ask();
}
function reset() {
  Object.assign(state, START());
  ask();
}

// Mouse and touch.
const held = new Map();
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  held.set(event.pointerId, [event.clientX, event.clientY]);
});
const release = (event) => held.delete(event.pointerId);
canvas.addEventListener("pointerup", release);
canvas.addEventListener("pointercancel", release);
canvas.addEventListener("pointermove", (event) => {
  const before = held.get(event.pointerId);
  if (!before) return;
  const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
  const other = [...held].find(([id]) => id !== event.pointerId);
  const pan = (part) => (state.pan = [state.pan[0] + 2 * part * dx / canvas.clientWidth, state.pan[1] - 2 * part * dy / canvas.clientHeight]);
  if (other) {
    const apart = (point) => Math.hypot(point[0] - other[1][0], point[1] - other[1][1]);
    zoom(apart([event.clientX, event.clientY]) / Math.max(1, apart(before)));
    pan(0.5);
  } else if (event.shiftKey || event.buttons & 6) pan(1);
  else rotate(0.01 * dx, 0.01 * dy);
  held.set(event.pointerId, [event.clientX, event.clientY]);
  ask();
});
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  // In a report the wheel moves the page until the body is asked for.
  if (canvas.dataset.keys && document.activeElement !== canvas) return;
  event.preventDefault();
  zoom(Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 30 : 1)));
}, { passive: false });

// Keyboard: letters work everywhere but in lists, arrows where no control takes them.
const KEYS = {
  "+": () => zoom(1.15), "=": () => zoom(1.15), "-": () => zoom(1 / 1.15), "0": reset, n: () => step(1), p: () => step(-1), " ": () => play(!state.playing),
  ArrowLeft: () => rotate(-0.1, 0), ArrowRight: () => rotate(0.1, 0), ArrowUp: () => rotate(0, -0.1), ArrowDown: () => rotate(0, 0.1),
};
(canvas.dataset.keys ? canvas : document).addEventListener("keydown", (event) => {
  const control = event.target.closest("select, input, button");
  if (event.ctrlKey || event.altKey || event.metaKey || !KEYS[event.key]) return;
  if (control && (control.tagName === "SELECT" || event.key.startsWith("Arrow") || event.key === " ")) return;
  event.preventDefault();
  KEYS[event.key]();
});

// Controls.
say("name", facts.name);
say("generator", facts.generator);
for (const [term, text] of byId("facts") ? facts.terms : []) {
  byId("facts").appendChild(document.createElement("dt")).textContent = term;
  byId("facts").appendChild(document.createElement("dd")).textContent = text;
}
modes.forEach((mode, j) => byId("mode").add(new Option(mode.label, j)));
on("mode", "change", (event) => choose(Number(event.target.value)));
on("previous", "click", () => step(-1));
on("next", "click", () => step(1));
on("play", "click", () => play(!state.playing));
on("reset", "click", reset);
on("amplitude", "input", (event) => setAmplitude(Number(event.target.value)));
on("speed", "input", (event) => setSpeed(Number(event.target.value)));
function setSpeed(value) {
  state.speed = 2 ** value;
  say("pace", `${short(state.speed)} \u00d7`);
}
const FIRST_FIELD = 4;
if (byId("colours")) {
  if (!modes.length && !motion) for (const known of [...byId("colours").options]) known.value >= 0 && known.remove();
  fields.forEach((own, k) => byId("colours").add(new Option(own.label, FIRST_FIELD + k), k));
  const asked = Number(new URLSearchParams(location.hash.slice(1)).get("colours") ?? (facts.startsWithField ? 1 : 0));
  byId("colours").value = fields[asked - 1] ? FIRST_FIELD + asked - 1 : byId("colours").options[modes.length || motion ? fields.length : 0].value;
}
if (byId("tones")) byId("tones").hidden = !fields.length;
if (!modes.length && !motion) {
  state.playing = false;
  document.querySelectorAll(".moving").forEach((own) => (own.hidden = true));
  if (byId("outline")) byId("outline").checked = false, byId("outline").closest("label").hidden = true;
  if (byId("axes")) byId("axes").checked = false;
}
on("colours", "change", showTones);
for (const id of ["outline", "lines", "interfaces", "axes", "follow"]) on(id, "change", ask);
byId("lines").closest("label").hidden = !triangles.length;
byId("interfaces").closest("label").hidden = !facts.interfaces.length;
const bar = Array.from({ length: 11 }, (_, k) => {
  const t = k / 10, c = [[0.278, 0.105, -0.331, -4.634, 6.228, 4.776, -5.435], [0.005, 1.404, 0.215, -5.799, 14.18, -13.745, 4.646], [0.334, 1.385, 0.095, -19.332, 56.691, -65.353, 26.312]];
  return `rgb(${c.map((p) => Math.round(255 * Math.max(0, Math.min(1, p.reduceRight((s, a) => s * t + a, 0)))))})`;
});
byId("legend").querySelector("i").style.background = `linear-gradient(90deg, ${bar})`;
if (motion) {
  for (const id of ["instant", "following"]) byId(id).hidden = false;
  byId("choice").hidden = byId("kind").hidden = true;
  showTones();
  Object.assign(byId("time"), { min: motion.times[0], max: motion.times[motion.times.length - 1] });
  byId("time").addEventListener("input", (event) => {
    play(false);
    state.time = Number(event.target.value);
    showTime();
  });
  state.time = motion.times[0];
  showTime();
}
Object.assign(byId("amplitude"), motion ? { min: 0, max: 4 } : { min: 0, max: 4 });

// The address may say what to show first: #mode=3&phase=0.25 or #time=0.5 stand still.
const asks = new URLSearchParams(location.hash.slice(1));
const number = (name) => (asks.has(name) && Number.isFinite(Number(asks.get(name))) ? Number(asks.get(name)) : null);
if (number("phase") !== null) state.phase = number("phase"), state.playing = false;
if (number("time") !== null) state.time = number("time"), state.playing = false;
readColours();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (readColours(), ask()));
// Before the frame is shown that has the new size.
new ResizeObserver(draw).observe(canvas);
// What is scrolled away stands still.
new IntersectionObserver((entries) => {
  inView = entries[entries.length - 1].isIntersecting;
  if (inView) ask();
}).observe(canvas);
setSpeed(0);
setAmplitude(number("amplitude") ?? (motion ? 0 : 1));
choose(Math.max(0, (number("mode") ?? 1) - 1) % (modes.length || 1));
if (motion) showTime();
play(state.playing);
draw();

// #frames=60 says how long a frame takes: that many of one period, each read back from the card.
const frames = Math.min(number("frames") ?? 0, 1000);
if (frames >= 1) {
  const begun = performance.now(), pixel = new Uint8Array(4);
  for (let k = 0; k < frames; k++) {
    state.phase = k / frames;
    draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  }
  document.documentElement.dataset.frameTime = `${((performance.now() - begun) / frames).toFixed(2)} ms`;
}
})();
