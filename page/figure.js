// SPDX-License-Identifier: Apache-2.0
// figure.js: the posture as a stick figure, muscles along their paths.
"use strict";
const view = { yaw: .6, pitch: .15, zoom: 1 };
/* ---- stick figure: bones between the bodies' origins and their parents', muscles along their paths ---- */
function points(name) {
  const p = place[name], out = []; if (!p || !frame) return out;
  for (let i = 0; i + 2 < p.n; i += 3) out.push({ label: p.labels[i].replace(/\.x$/, ""), at: [frame[p.first + i], frame[p.first + i + 1], frame[p.first + i + 2]] });
  return out;
}
function figure() {
  const { g, w, h } = sheet($("figure"));
  if (!frame) return;
  const bones = points("skeleton"), paths = points("paths"), marks = points("markers"), seen = points("markers_measured");
  const all = bones.concat(marks).filter(p => isFinite(p.at[0])); if (!all.length) return;
  const low = [0, 1, 2].map(i => Math.min(...all.map(p => p.at[i]))), high = [0, 1, 2].map(i => Math.max(...all.map(p => p.at[i])));
  const middle = low.map((v, i) => (v + high[i]) / 2), size = Math.max(...high.map((v, i) => v - low[i]), .2);
  const a = up === 1 ? [2, 0] : [0, 1];
  const project = p => {
    const u = p[a[0]] - middle[a[0]], v = p[a[1]] - middle[a[1]], z = p[up] - middle[up];
    const X = u * Math.cos(view.yaw) + v * Math.sin(view.yaw), D = -u * Math.sin(view.yaw) + v * Math.cos(view.yaw);
    const s = view.zoom * .72 * Math.min(w, h) / size;
    return [w / 2 + s * X, h / 2 - s * (z * Math.cos(view.pitch) - D * Math.sin(view.pitch))];
  };
  const draw = (from, to) => { g.beginPath(); g.moveTo(...project(from)); g.lineTo(...project(to)); g.stroke(); };
  g.lineCap = "round"; g.strokeStyle = css("--ink"); g.lineWidth = 5; g.globalAlpha = .55;
  for (let i = 0; i + 1 < bones.length; i += 2) if (isFinite(bones[i].at[0]) && isFinite(bones[i + 1].at[0])) draw(bones[i].at, bones[i + 1].at);
  g.globalAlpha = 1; g.lineWidth = 2.5;
  const act = place.activation;
  for (let i = 0; i + 1 < paths.length; i++) {
    const name = paths[i].label; if (name !== paths[i + 1].label || !isFinite(paths[i].at[0]) || !isFinite(paths[i + 1].at[0])) continue;
    const k = act ? act.labels.indexOf(name) : -1, v = k < 0 ? 0 : Math.max(0, Math.min(1, frame[act.first + k]));
    g.strokeStyle = `rgb(${Math.round(70 + 170 * Math.min(1, 2 * v))},${Math.round(90 - 60 * v)},${Math.round(190 - 170 * Math.min(1, 2 * v))})`;
    draw(paths[i].at, paths[i + 1].at);
  }
  const dot = (p, r, colour) => { if (!isFinite(p.at[0])) return; g.fillStyle = colour; g.beginPath(); g.arc(...project(p.at), r, 0, 7); g.fill(); };
  for (const p of marks) dot(p, 4, css("--blue"));
  for (const p of seen) dot(p, 2, css("--amber"));
  g.lineWidth = 1;
}
const fig = $("figure"); let grip = null;
fig.onpointerdown = e => { grip = [e.clientX, e.clientY]; fig.setPointerCapture(e.pointerId); };
fig.onpointermove = e => { if (!grip) return; view.yaw += (e.clientX - grip[0]) * .01; view.pitch = Math.max(-1.5, Math.min(1.5, view.pitch + (e.clientY - grip[1]) * .01)); grip = [e.clientX, e.clientY]; dirty = true; };
fig.onpointerup = fig.onpointercancel = () => { grip = null; };
fig.onwheel = e => { e.preventDefault(); view.zoom *= Math.exp(-e.deltaY * .001); dirty = true; };
fig.onkeydown = e => { const k = { ArrowLeft: [-.1, 0], ArrowRight: [.1, 0], ArrowUp: [0, -.1], ArrowDown: [0, .1] }[e.key]; if (k) { view.yaw += k[0]; view.pitch += k[1]; } else if (e.key === "+" || e.key === "-") view.zoom *= e.key === "+" ? 1.1 : .9; else return; e.preventDefault(); dirty = true; };
