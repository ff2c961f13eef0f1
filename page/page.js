// SPDX-License-Identifier: Apache-2.0
// page.js: frames in, pictures out; they come over the socket (live), or all of them stand in the page (a folder of results).
//
// A page is one of many things on a machine, and may be open on one that also measures. A browser spends far more on each change
// of what is seen than drawing takes: some 5 ms of CPU where it draws without a graphics card. So the server is asked for what
// has come since the last picture in one go (every frame, as a message of its own), and one picture follows; what moves is drawn
// on canvases that go to the screen past the browser's layout (`desynchronized`), texts change once a second, and nothing that
// is out of sight is drawn.
"use strict";
// Whether the browser draws without a graphics card, asked by way of WebGL.
const bare = (() => {
  const g = document.createElement("canvas").getContext("webgl"), more = g && g.getExtension("WEBGL_debug_renderer_info");
  const name = g ? g.getParameter(g.RENDERER) + (more ? g.getParameter(more.UNMASKED_RENDERER_WEBGL) : "") : "";
  if (g) g.getExtension("WEBGL_lose_context")?.loseContext();
  return !g || /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
})();
const asks = new URLSearchParams(location.search), token = asks.get("token") || "";
// ms between two pictures (?pictures=N a second instead), at most; what pictures may take of this page's thread.
const TICK = +asks.get("pictures") > 0 ? Math.max(16, 1000 / asks.get("pictures")) : bare ? 180 : 66, SLOWEST = Math.max(250, TICK), SHARE = .03;
let run = null, up = 1, socket = null, picked = [], received = 0;
const recorded = JSON.parse($("recorded").textContent);
window.onerror = what => { window.thrown = what; };
window.mhe = { // for tests and the curious; `each` is called with every frame
  each: null,
  get received() { return received; }, get run() { return run; }, get uplot() { return typeof uPlot !== "undefined"; }, get tick() { return tick; },
  get frame() { return anything ? [...now.head, ...now.values] : null; },
};

/* ---- the socket ---- */
function connect() {
  socket = new WebSocket((location.protocol === "https:" ? "wss://" : "ws://") + location.host + "/", "mhe.live.v1");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { say("link", "connected", "good"); pace(); };
  socket.onclose = () => { say("link", "no connection; trying again", "bad"); setTimeout(connect, 1000); };
  socket.onmessage = e => typeof e.data === "string" ? text(JSON.parse(e.data)) : take(e.data);
}
function send(what, about) { if (socket && socket.readyState === 1) socket.send(JSON.stringify({ do: what, text: about || "", token })); }
const pace = () => send("pace", document.hidden ? "1" : (tick / 1000).toFixed(3));
document.addEventListener("visibilitychange", pace);
function text(m) {
  if (m.run) begin(m.run);
  if (m.state) showState(m.state);
  if (m.error) say("link", m.error, "bad");
  if (m.done) say("link", "connected", "good");
}
function begin(r, frames = KEPT) {
  run = r; place = {};
  let first = 0;
  for (const s of r.signals) { place[s.name] = { first, n: s.labels.length, labels: s.labels, unit: s.unit }; first += s.labels.length; }
  clearFrames(first, frames); prepareFigure();
  $("title").textContent = document.title = r.title || "Myohorizon";
  const muscles = labels("force");
  picked = muscles.slice(0, 4).map((_, i) => i);
  $("pick").replaceChildren(...muscles.map((m, i) => {
    const l = document.createElement("label"), b = document.createElement("input");
    b.type = "checkbox"; b.checked = picked.includes(i);
    b.onchange = () => { picked = b.checked ? picked.concat(i).sort((x, y) => x - y) : picked.filter(k => k !== i); redraw(true); };
    l.append(b, " " + m); return l;
  }));
  $("what").replaceChildren(...muscles.map((m, i) => option("force " + m + " (N)", "force:" + i)), ...labels("q").map((c, i) => option("angle " + c + " (deg)", "q:" + i)),
    ...muscles.map((m, i) => option("activation " + m + " (%)", "activation:" + i)));
  choose(); prepareMuscles();
}
function take(buffer) {
  if (!run) return;
  const head = new Float64Array(buffer, 0, HEAD);
  addFrame(head, new Float32Array(buffer, 8 * HEAD));
  received++; late.add(head);
  if (window.mhe.each) window.mhe.each(window.mhe.frame);
  if (performance.now() - drawn > tick - 12) redraw();
}

/* ---- numbers: written where they have changed ---- */
function write(e, what) { if (e.firstChild) { if (e.firstChild.data !== what) e.firstChild.data = what; } else if (what !== "") e.textContent = what; }
const late = { // the last 500
  estimate: new Float64Array(500), page: new Float64Array(500), n: 0, sorted: new Float64Array(500),
  add(head) { const k = this.n++ % 500; this.estimate[k] = 1000 * head[5]; this.page[k] = 1000 * head[7]; },
  parts(all) { const n = Math.min(this.n, 500), s = this.sorted.subarray(0, n); s.set(all.subarray(0, n)); s.sort(); return q => n ? s[Math.round(q * (n - 1))] : NaN; },
};
function showLink() {
  const part = late.parts(late.estimate), half = part(.5), most = part(.99), shown = late.parts(late.page)(.5), status = ["", "iteration limit", "deadline", "predicted", "begun again"][now.head[2]] || "";
  if (half < 0) return say("latency", "not by the clock" + (status ? ", " + status : ""), "good"); // a recording that runs faster than it was made
  say("latency", `${half.toFixed(1)} ms (p99 ${most.toFixed(1)}), sent after ${shown.toFixed(0)} ms` + (status ? ", " + status : ""), half < 50 && now.head[2] < 3 ? "good" : "bad");
}
function showMissing() {
  const lost = now.head[6], p = place.markers_measured; let gone = 0;
  if (p) for (let i = 0; i < p.n; i += 3) gone += isFinite(now.values[p.first + i]) ? 0 : 1;
  say("missing", (p && p.n ? gone + " of " + p.n / 3 + " markers missing" : "") + (lost ? ", " + lost + " frames not shown" : ""), gone || lost ? "bad" : "good");
}
let chosen = { at: UNSEEN, factor: 1 }, low = 0, high = 100;
function choose() { chosen = spot($("what").value || "force:0"); low = +$("low").value; high = +$("high").value; redraw(true); }
const paperOfNumber = $("number").getContext("2d", { desynchronized: true });
let written = "";
function showNumber() {
  const v = valueNow(chosen), text = isFinite(v) ? v.toFixed(Math.abs(v) < 10 ? 1 : 0) : "\u2013", colour = css(v >= low && v <= high ? "--green" : "--amber");
  if (written === text + colour) return;
  written = text + colour;
  const { g, w, h } = sheet($("number"), paperOfNumber);
  g.font = `700 ${h}px system-ui, sans-serif`; g.textAlign = "center"; g.textBaseline = "middle"; g.fillStyle = colour;
  g.fillText(text, w / 2, h * .54, w);
}
// The same for those who do not see it, and for whoever asks the page.
function sayNumber() {
  const v = valueNow(chosen);
  write($("big"), isFinite(v) ? v.toFixed(Math.abs(v) < 10 ? 1 : 0) : "\u2013");
}
let rows = [];
function prepareMuscles() {
  rows = labels("force").map((m, i) => {
    const tr = row([m, "", "", ""]), bar = document.createElement("span"), c = tr.children;
    bar.className = "bar"; c[1].replaceChildren(bar); c[1].className = "part";
    return { tr, bar, title: c[1], emg: c[2], force: c[3], wide: -1, at: ["activation:", "emg:", "force:"].map(k => spot(k + i)) };
  });
  $("muscles").replaceChildren(...rows.map(r => r.tr));
}
function showMuscles() {
  for (const r of rows) {
    const [a, e, f] = r.at.map(valueNow), wide = Math.max(0, Math.min(100, Math.round(a))) || 0;
    if (wide !== r.wide) { r.wide = wide; r.bar.style.width = wide + "%"; r.title.title = wide + " %"; }
    write(r.emg, isFinite(e) ? e.toFixed(0) + " %" : "\u2013"); write(r.force, (Math.round(f) + 0).toFixed(0));
  }
}

/* ---- lines ---- */
const coloured = i => colours[i % colours.length];
const charts = {
  band: () => drawPlot("band", [{ name: ($("what").selectedOptions[0] || {}).textContent || "", key: $("what").value || "force:0" }], () => [low, high]),
  force: () => drawPlot("force", picked.map(i => ({ name: labels("force")[i], key: "force:" + i, colour: coloured(i) }))),
  angle: () => drawPlot("angle", labels("q").slice(0, 8).map((c, i) => ({ name: c, key: "q:" + i }))),
  activation: () => drawPlot("activation", picked.flatMap(i => [{ name: labels("force")[i], key: "activation:" + i, colour: coloured(i) },
    ...(place.emg && place.emg.n ? [{ name: "EMG " + labels("force")[i], key: "emg:" + i, colour: coloured(i), dash: [4, 4] }] : [])])),
};

/* ---- when ---- */
const EVERY = bare ? 8 : 5; // pictures from one drawing of a plot to the next; one plot a picture, the number in those between
const since = new Map(Object.keys(charts).map(id => [id, EVERY])), bell = new MessageChannel();
let tick = TICK, drawn = -Infinity, cost = 0, asked = false, whole = true, texts = -Infinity;
// Asks for a picture once what is on its way has been taken; `all`: of everything, as something was chosen or has come into sight.
function redraw(all) {
  whole = whole || !!all;
  if (!asked) { asked = true; bell.port2.postMessage(0); }
}
function draw() {
  const begun = performance.now(), everything = whole;
  asked = false; drawn = begun;
  if (!anything || document.hidden) return;
  whole = false;
  if (inSight.has("figure")) figure();
  let free = true;
  for (const [id, n] of since) {
    const due = inSight.has(id) && (everything || (free && n >= EVERY));
    if (due) { charts[id](); free = false; }
    since.set(id, due ? 1 : n + 1);
  }
  if (inSight.has("number") && (everything || free)) showNumber();
  if (everything || begun - texts > 1000) { // all at once: the browser goes through the page once for them
    texts = begun; sayNumber(); showMissing();
    if (!recorded) showLink();
    if (inSight.has("muscles")) showMuscles();
  }
  if (!recorded && !everything) { spent = begun; bell.port2.postMessage(1); }
}
// All there is, in sight or not: for paper.
function drawAll() {
  if (!anything) return;
  figure(); for (const id of since.keys()) charts[id]();
  sayNumber(); showNumber(); showMuscles();
}
let spent = 0;
bell.port1.onmessage = e => e.data ? measure(spent) : draw();
// What a picture cost this thread, the browser's own work on it included, decides how many there are.
function measure(begun) {
  cost += .05 * (performance.now() - begun - cost);
  const wanted = Math.max(TICK, Math.min(SLOWEST, cost / SHARE));
  if (Math.abs(wanted - tick) > .2 * tick || (wanted === TICK && tick !== TICK)) { tick = wanted; pace(); }
}
for (const id of ["what", "low", "high"]) $(id).oninput = choose;
new ResizeObserver(() => { if (fig.clientWidth > 0) { paper(); redraw(true); } }).observe(fig);
for (const id of ["figure", "number", "muscles", ...Object.keys(charts)]) sight.observe($(id));

if (recorded) open(recorded); else connect();
redraw(true);
