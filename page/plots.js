// SPDX-License-Identifier: Apache-2.0
// plots.js: lines over time, by uPlot (github.com/leeoniya/uPlot, MIT) where it was there when this page was built.
"use strict";
const $ = id => document.getElementById(id);
const colours = ["#1f77b4", "#d62728", "#2ca02c", "#e07b00", "#7b4fb5", "#00838f", "#c2185b", "#6d7f1b"];
const plots = new Map(), POINTS = 250; // of a line; more would not be seen

// Colours of the page's look: asked for once, since asking makes the browser go through all styles.
let looks = new Map();
function css(name) {
  if (!looks.has(name)) looks.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return looks.get(name);
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  looks = new Map();
  for (const p of plots.values()) if (p.u) p.u.destroy();
  plots.clear(); redraw(true);
});

// From low to high, in words: beside the other end 1e-37 is 0.
function extent(low, high) {
  const least = 1e-4 * Math.max(Math.abs(low), Math.abs(high)), short = v => Math.abs(v) < least ? "0" : String(+v.toPrecision(3));
  return short(low) + " to " + short(high);
}

// As many of the names as there is room for.
function fitting(g, text, names, room) {
  let shown = names.length, all;
  do all = text + names.slice(0, shown).join(", ") + (shown < names.length ? ", \u2026" : ""); while (g.measureText(all).width > room && --shown > 0);
  return all;
}

// What is on the screen; nothing else is drawn.
const inSight = new Set(), sight = new IntersectionObserver(list => {
  for (const e of list) if (e.isIntersecting) inSight.add(e.target.id); else inSight.delete(e.target.id);
  redraw(true);
});

// A canvas in the pixels of the screen.
function sheet(c, g = c.getContext("2d", { desynchronized: true })) {
  const k = Math.min(2, window.devicePixelRatio || 1), w = c.clientWidth, h = c.clientHeight; // finer is not seen
  if (c.width !== Math.round(w * k) || c.height !== Math.round(h * k)) { c.width = Math.round(w * k); c.height = Math.round(h * k); }
  g.setTransform(k, 0, 0, k, 0, 0); g.clearRect(0, 0, w, h);
  return { g, w, h };
}

// What `make` makes draws on canvases that do not wait for the rest of the page; uPlot has no option for it.
function pastLayout(make) {
  const proper = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind) { return proper.call(this, kind, { desynchronized: true }); };
  try { return make(); } finally { HTMLCanvasElement.prototype.getContext = proper; }
}

// What an axis spans: a tenth more than the lines, and `least` at least, so that small changes stay small.
function span(low, high, least) {
  if (high - low >= least) return [low, high];
  const middle = (low + high) / 2, first = low >= 0 && middle < least / 2 ? 0 : middle - least / 2;
  return [first, first + least];
}

// `band`: () => [low, high] of a target, or null; `o`: { least, legend: false, sd: [upper, lower] } (columns between which it is shaded).
function makePlot(box, lines, band, o = {}) {
  const height = () => box.classList.contains("low") ? 110 : 210;
  const axis = { stroke: css("--soft"), grid: { stroke: css("--line"), width: 1 }, ticks: { stroke: css("--line"), width: 1 }, font: "12px system-ui, sans-serif" };
  const shade = u => {
    if (!band()) return;
    const [low, high] = band(), top = u.valToPos(high, "y", true), bottom = u.valToPos(low, "y", true);
    u.ctx.save(); u.ctx.globalAlpha = .2; u.ctx.fillStyle = css("--green");
    u.ctx.beginPath(); u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height); u.ctx.clip();
    u.ctx.fillRect(u.bbox.left, top, u.bbox.width, bottom - top); u.ctx.restore();
  };
  const range = (u, low, high) => {
    if (band()) { low = Math.min(low, band()[0]); high = Math.max(high, band()[1]); }
    if (!Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
    if (o.least) [low, high] = span(low, high, o.least);
    return uPlot.rangeNum(low, Math.max(high, low + 1e-3), .1, true);
  };
  const u = new uPlot({
    width: box.clientWidth || 300, height: height(), padding: [6, 8, 0, 0], legend: { show: o.legend !== false && lines.length > 1, live: false },
    cursor: { sync: { key: "time" }, drag: { x: true, y: false } }, scales: { x: { time: false }, y: { range } },
    axes: [{ ...axis, size: 28, values: (_, v) => v.map(t => t + " s") }, { ...axis, size: 48 }],
    series: [{}, ...lines.map((l, i) => ({ label: l.name, stroke: l.colour || colours[i % colours.length], width: l.width === undefined ? (o.width || 1.6) : l.width, dash: l.dash, points: { show: false } }))],
    bands: o.sd ? [{ series: o.sd, fill: css("--band") }] : [],
    hooks: { drawClear: [shade] },
  }, [[0, 1], ...lines.map(() => [null, null])], box);
  if (o.pick) u.over.addEventListener("click", () => o.pick(u.posToVal(u.cursor.left, "x")));
  new ResizeObserver(() => { if (box.clientWidth > 0 && box.clientWidth !== u.width) u.setSize({ width: box.clientWidth, height: height() }); }).observe(box);
  return u;
}

// Without uPlot: the lines alone, and the range they span.
function plainPlot(box, lines, data, band, o = {}) {
  let c = box.querySelector("canvas");
  if (!c) { c = document.createElement("canvas"); c.style.cssText = `width:100%;height:${box.classList.contains("low") ? 100 : 190}px;display:block`; box.replaceChildren(c); }
  const { g, w, h } = sheet(c), all = data.slice(1).flat().filter(v => Number.isFinite(v)).concat(band() || []);
  if (!all.length || data[0].length < 2) return;
  const [low, high] = span(all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b)), o.least || 1e-3), first = data[0][0], last = data[0][data[0].length - 1];
  const x = t => 4 + (t - first) / (last - first) * (w - 8), y = v => h - 18 - (v - low) / (high - low) * (h - 36);
  if (band()) { g.fillStyle = css("--green"); g.globalAlpha = .2; g.fillRect(0, y(band()[1]), w, y(band()[0]) - y(band()[1])); g.globalAlpha = 1; }
  if (o.sd) {
    const [upper, lower] = o.sd.map(i => data[i].map((v, k) => [data[0][k], v]).filter(p => Number.isFinite(p[1])));
    g.fillStyle = css("--band"); g.beginPath();
    for (const p of upper.concat(lower.reverse())) g.lineTo(x(p[0]), y(p[1]));
    g.fill();
  }
  lines.forEach((l, i) => {
    if (l.width === 0) return;
    let open = false; // a value that is not there (undefined) is passed over, one that is missing (null) breaks the line
    g.strokeStyle = l.colour || colours[i % colours.length]; g.lineWidth = l.width || 1; g.setLineDash(l.dash || []); g.beginPath();
    data[i + 1].forEach((v, k) => { if (v === undefined) return; if (v !== null) open ? g.lineTo(x(data[0][k]), y(v)) : g.moveTo(x(data[0][k]), y(v)); open = v !== null; });
    g.stroke(); g.lineWidth = 1;
  });
  g.fillStyle = css("--soft"); g.font = "12px system-ui, sans-serif";
  const text = `${extent(low, high)}; ${+first.toFixed(1)} to ${+last.toFixed(1)} s`;
  g.fillText(o.legend === false ? text : fitting(g, text + ": ", lines.map(l => l.name), w - 8), 4, h - 4);
}

// Lines with times of their own [{ x, y }] on one axis: where a line has no sample it has undefined, where it misses one null.
function joined(lines) {
  const xs = [...new Set(lines.flatMap(l => Array.from(l.x)))].sort((a, b) => a - b), place = new Map(xs.map((x, i) => [x, i]));
  return [xs, ...lines.map(l => { const out = new Array(xs.length).fill(undefined); l.x.forEach((x, i) => { out[place.get(x)] = Number.isFinite(l.y[i]) ? l.y[i] : null; }); return out; })];
}

// Draws lines [{ name, x, y, colour, width }] once.
function drawStill(box, lines, o) {
  const data = joined(lines);
  if (typeof uPlot === "undefined") plainPlot(box, lines, data, () => null, o); else makePlot(box, lines, () => null, o).setData(data);
}

// Draws `lines` [{ name, key, colour, dash }] of the last seconds into the box `id`; `band` () => [low, high] or null. The
// arrays are kept from one time to the next.
function drawPlot(id, lines, band = () => null) {
  const names = lines.map(l => l.name + l.key).join();
  let p = plots.get(id);
  if (!p || p.names !== names) {
    if (p && p.u) p.u.destroy();
    p = { names, spots: lines.map(l => spot(l.key)), data: [[], ...lines.map(() => [])], u: typeof uPlot === "undefined" ? null : pastLayout(() => makePlot($(id), lines, band, { width: 1.2 })) };
    plots.set(id, p);
  }
  const step = past.step * Math.ceil(past.n / POINTS);
  let n = 0;
  for (let i = 0; i < past.n; i++) {
    const k = slot(i);
    if (past.number[k] % step) continue; // by the frame's number: the same ones each time
    p.data[0][n] = past.time[k];
    p.spots.forEach((s, j) => { const v = s.at === UNSEEN ? NaN : s.factor * past.values[k * past.width + s.at]; p.data[j + 1][n] = isFinite(v) ? v : null; });
    n++;
  }
  for (const d of p.data) d.length = n;
  if (p.u) p.u.setData(p.data); else plainPlot($(id), lines, p.data, band);
}
