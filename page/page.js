// SPDX-License-Identifier: Apache-2.0
// page.js: frames in, pictures out. A frame is [number, time, status, iterations, solve time, latency, lost, spare, values ...];
// it comes over the socket (live), or all of them stand in the page (a folder of results).
"use strict";
const HEAD = 8, SECONDS = 10, token = new URLSearchParams(location.search).get("token") || "";
let run = null, up = 1, place = {}, history = [], frame = null, socket = null, picked = [], received = 0, dirty = true;
const latencies = [], recorded = JSON.parse($("recorded").textContent);
window.onerror = what => { window.thrown = what; };
window.mhe = { get received() { return received; }, get frame() { return frame; }, get run() { return run; }, get uplot() { return typeof uPlot !== "undefined"; } }; // for tests and the curious

function connect() {
  socket = new WebSocket((location.protocol === "https:" ? "wss://" : "ws://") + location.host + "/", "mhe.live.v1");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => say("link", "connected", "good");
  socket.onclose = () => { say("link", "no connection; trying again", "bad"); setTimeout(connect, 1000); };
  socket.onmessage = e => typeof e.data === "string" ? text(JSON.parse(e.data)) : take(e.data);
}
function send(what, about) { if (socket && socket.readyState === 1) socket.send(JSON.stringify({ do: what, text: about || "", token })); }
function text(m) {
  if (m.run) begin(m.run);
  if (m.state) showState(m.state);
  if (m.error) say("link", m.error, "bad");
  if (m.done) say("link", "connected", "good");
}
const labels = name => place[name] ? place[name].labels : [];
function begin(r) {
  run = r; history = []; frame = null; place = {};
  let first = HEAD;
  for (const s of r.signals) { place[s.name] = { first, n: s.labels.length, labels: s.labels, unit: s.unit }; first += s.labels.length; }
  $("title").textContent = document.title = r.title || "Myohorizon";
  const muscles = labels("force");
  picked = muscles.slice(0, 4).map((_, i) => i);
  $("pick").replaceChildren(...muscles.map((m, i) => {
    const l = document.createElement("label"), b = document.createElement("input");
    b.type = "checkbox"; b.checked = picked.includes(i);
    b.onchange = () => { picked = b.checked ? picked.concat(i).sort((x, y) => x - y) : picked.filter(k => k !== i); dirty = true; };
    l.append(b, " " + m); return l;
  }));
  $("what").replaceChildren(...muscles.map((m, i) => option("force " + m + " (N)", "force:" + i)), ...labels("q").map((c, i) => option("angle " + c + " (deg)", "q:" + i)),
    ...muscles.map((m, i) => option("activation " + m + " (%)", "activation:" + i)));
  $("muscles").replaceChildren(...muscles.map(m => row([m, "", "", ""])));
}
function take(buffer) {
  if (!run) return;
  const head = new Float64Array(buffer, 0, HEAD), values = new Float32Array(buffer, 8 * HEAD), f = new Array(HEAD + values.length);
  for (let i = 0; i < HEAD; i++) f[i] = head[i];
  for (let i = 0; i < values.length; i++) f[HEAD + i] = values[i];
  if (frame && f[1] < frame[1]) history = [];
  frame = f; history.push(f); received++; dirty = true;
  latencies.push(1000 * f[5]); if (latencies.length > 500) latencies.shift();
  while (history.length && f[1] - history[0][1] > SECONDS) history.shift();
}
function value(f, key) {
  const [name, i] = key.split(":"), p = place[name];
  if (!p || !f || +i >= p.n) return NaN;
  const v = f[p.first + +i];
  return name === "q" && p.unit.startsWith("rad") ? v * 180 / Math.PI : name === "activation" || name === "emg" ? 100 * v : v;
}

/* ---- numbers ---- */
function showMuscles() {
  const body = $("muscles");
  labels("force").forEach((m, i) => {
    const a = value(frame, "activation:" + i), e = value(frame, "emg:" + i), c = body.children[i].children;
    if (!c[1].firstElementChild) { const s = document.createElement("span"); s.className = "bar"; c[1].replaceChildren(s); c[1].style.width = "35%"; }
    c[1].firstElementChild.style.width = Math.max(0, Math.min(100, a)) + "%"; c[1].title = a.toFixed(0) + " %";
    c[2].textContent = Number.isFinite(e) ? e.toFixed(0) + " %" : "\u2013"; c[3].textContent = (Math.round(value(frame, "force:" + i)) + 0).toFixed(0);
  });
}
function showNumbers() {
  const v = value(frame, $("what").value || "force:0"), low = +$("low").value, high = +$("high").value;
  $("big").textContent = Number.isFinite(v) ? v.toFixed(Math.abs(v) < 10 ? 1 : 0) : "\u2013";
  $("big").className = v >= low && v <= high ? "in" : "out";
  const sorted = [...latencies].sort((a, b) => a - b), part = q => sorted.length ? sorted[Math.round(q * (sorted.length - 1))] : NaN;
  const status = ["", "iteration limit", "deadline", "predicted", "begun again"][frame[2]] || "";
  if (!recorded) say("latency", `${(1000 * frame[5]).toFixed(1)} ms (p50 ${part(.5).toFixed(1)}, p99 ${part(.99).toFixed(1)})` + (status ? ", " + status : ""), part(.5) < 50 && frame[2] < 3 ? "good" : "bad");
  const lost = frame[6], p = place.markers_measured; let gone = 0;
  if (p) for (let i = 0; i < p.n; i += 3) gone += Number.isFinite(frame[p.first + i]) ? 0 : 1;
  say("missing", (p && p.n ? gone + " of " + p.n / 3 + " markers missing" : "") + (lost ? ", " + lost + " frames not shown" : ""), gone || lost ? "bad" : "good");
}

/* ---- pictures: figure and number some twenty times a second, lines and tables four times: a page is one of many things on a machine ---- */
const FIGURE_EVERY = 45, LINES_EVERY = 250; // ms
let lined = 0;
function drawLines() {
  const what = $("what").value || "force:0", muscles = labels("force"), chosen = $("what").selectedOptions[0];
  drawPlot("band", history, [{ name: chosen ? chosen.textContent : "", key: what }], value, () => [+$("low").value, +$("high").value]);
  drawPlot("force", history, picked.map(i => ({ name: muscles[i], key: "force:" + i, colour: colours[i % colours.length] })), value);
  drawPlot("angle", history, labels("q").slice(0, 8).map((c, i) => ({ name: c, key: "q:" + i })), value);
  drawPlot("activation", history, picked.flatMap(i => [{ name: muscles[i], key: "activation:" + i, colour: colours[i % colours.length] },
    ...(place.emg && place.emg.n ? [{ name: "EMG " + muscles[i], key: "emg:" + i, colour: colours[i % colours.length], dash: [4, 4] }] : [])]), value);
}
function draw(now) {
  if (dirty && frame) {
    dirty = false; figure(); showNumbers();
    if (!lined || now - lined > LINES_EVERY) { lined = now; drawLines(); showMuscles(); }
  }
  setTimeout(() => requestAnimationFrame(draw), FIGURE_EVERY);
}
for (const id of ["what", "low", "high"]) $(id).oninput = () => { dirty = true; lined = 0; };

if (recorded) open(recorded); else connect();
requestAnimationFrame(draw);
