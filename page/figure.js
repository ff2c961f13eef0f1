// SPDX-License-Identifier: Apache-2.0
// figure.js: the posture as a stick figure: bones between the bodies' origins and their parents', muscles along their paths.
"use strict";
const view = { yaw: .6, pitch: .15, zoom: 1 }, fig = $("figure"), SHADES = 12;
const shades = Array.from({ length: SHADES }, (_, k) => { const v = (k + .5) / SHADES, w = Math.min(1, 2 * v); return `rgb(${Math.round(70 + 170 * w)},${Math.round(90 - 60 * v)},${Math.round(190 - 170 * w)})`; });
let body = null, pen = null;

// Which points make what; found once a run, so that a picture costs no names.
function prepareFigure() {
  const points = name => place[name] && place[name].n >= 3 ? { first: place[name].first, n: Math.floor(place[name].n / 3) } : { first: 0, n: 0 };
  const paths = points("paths"), name = i => place.paths.labels[3 * i].replace(/\.x$/, ""), muscles = new Map(labels("activation").map((m, i) => [m, i])), pieces = [];
  for (let i = 0; i + 1 < paths.n; i++) if (name(i) === name(i + 1)) pieces.push([i, muscles.has(name(i)) ? place.activation.first + muscles.get(name(i)) : UNSEEN]);
  const n = paths.n;
  body = { bones: points("skeleton"), paths, pieces, marks: points("markers"), seen: points("markers_measured"), x: new Float32Array(n), y: new Float32Array(n) };
}
const blank = () => { pen.g.fillStyle = css("--card"); pen.g.fillRect(0, 0, pen.w, pen.h); }; // its canvas is opaque: else it is black
const paper = () => { pen = sheet(fig, pen ? pen.g : fig.getContext("2d", { alpha: false, desynchronized: true })); blank(); };

// Turns points about the figure's middle and puts them on the paper.
const lens = { u: 0, v: 0, z: 2, middle: [0, 0, 0], scale: 1 };
function aim(v, w, h) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const p of [body.bones, body.marks]) for (let i = 0; i < 3 * p.n; i++) {
    const c = v[p.first + i], k = i % 3;
    if (c < low[k]) low[k] = c;
    if (c > high[k]) high[k] = c;
  }
  if (!(high[0] >= low[0])) return false;
  const size = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2], .2);
  for (let k = 0; k < 3; k++) lens.middle[k] = (low[k] + high[k]) / 2;
  Object.assign(lens, { cy: Math.cos(view.yaw), sy: Math.sin(view.yaw), cp: Math.cos(view.pitch), sp: Math.sin(view.pitch), scale: view.zoom * .72 * Math.min(w, h) / size, w: w / 2, h: h / 2, u: up === 1 ? 2 : 0, v: up === 1 ? 0 : 1, z: up });
  return true;
}
const across = (v, at) => lens.w + lens.scale * ((v[at + lens.u] - lens.middle[lens.u]) * lens.cy + (v[at + lens.v] - lens.middle[lens.v]) * lens.sy);
const down = (v, at) => lens.h - lens.scale * ((v[at + lens.z] - lens.middle[lens.z]) * lens.cp - ((v[at + lens.v] - lens.middle[lens.v]) * lens.cy - (v[at + lens.u] - lens.middle[lens.u]) * lens.sy) * lens.sp);

const lines = Array.from({ length: SHADES }, () => []); // pieces of muscles by shade
function muscles(g, v) {
  const { paths, pieces, x, y } = body;
  for (let i = 0; i < paths.n; i++) { x[i] = across(v, paths.first + 3 * i); y[i] = down(v, paths.first + 3 * i); }
  for (const l of lines) l.length = 0;
  for (const [i, activation] of pieces) {
    if (!(isFinite(x[i]) && isFinite(x[i + 1]))) continue;
    const a = activation === UNSEEN ? 0 : v[activation];
    lines[a > 0 ? Math.min(SHADES - 1, Math.floor(SHADES * a)) : 0].push(i);
  }
  g.lineWidth = 2.5;
  lines.forEach((l, k) => {
    if (!l.length) return;
    g.strokeStyle = shades[k]; g.beginPath();
    for (const i of l) { g.moveTo(x[i], y[i]); g.lineTo(x[i + 1], y[i + 1]); }
    g.stroke();
  });
}
function dots(g, v, p, r, colour) {
  g.fillStyle = colour; g.beginPath();
  for (let i = 0; i < p.n; i++) {
    const a = across(v, p.first + 3 * i), b = down(v, p.first + 3 * i);
    if (isFinite(a)) { g.moveTo(a + r, b); g.arc(a, b, r, 0, 7); }
  }
  g.fill();
}
function figure() {
  if (!pen) paper();
  const { g, w, h } = pen, v = now.values;
  blank();
  if (!anything || !body || !aim(v, w, h)) return;
  const b = body.bones;
  g.lineCap = "round"; g.strokeStyle = css("--bone"); g.lineWidth = 5; g.beginPath();
  for (let i = b.first; i + 5 < b.first + 3 * b.n; i += 6) if (isFinite(v[i]) && isFinite(v[i + 3])) { g.moveTo(across(v, i), down(v, i)); g.lineTo(across(v, i + 3), down(v, i + 3)); }
  g.stroke();
  muscles(g, v);
  dots(g, v, body.marks, 4, css("--blue"));
  dots(g, v, body.seen, 2, css("--amber"));
}
let grip = null;
fig.onpointerdown = e => { grip = [e.clientX, e.clientY]; fig.setPointerCapture(e.pointerId); };
fig.onpointermove = e => { if (!grip) return; view.yaw += (e.clientX - grip[0]) * .01; view.pitch = Math.max(-1.5, Math.min(1.5, view.pitch + (e.clientY - grip[1]) * .01)); grip = [e.clientX, e.clientY]; redraw(); };
fig.onpointerup = fig.onpointercancel = () => { grip = null; };
fig.onwheel = e => { e.preventDefault(); view.zoom *= Math.exp(-e.deltaY * .001); redraw(); };
fig.onkeydown = e => { const k = { ArrowLeft: [-.1, 0], ArrowRight: [.1, 0], ArrowUp: [0, -.1], ArrowDown: [0, .1] }[e.key]; if (k) { view.yaw += k[0]; view.pitch += k[1]; } else if (e.key === "+" || e.key === "-") view.zoom *= e.key === "+" ? 1.1 : .9; else return; e.preventDefault(); redraw(); };
