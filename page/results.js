// SPDX-License-Identifier: Apache-2.0
// results.js: a folder of results: moments of the run as frames, which the figure and the numbers show as they show live ones, and
// small pictures of all quantities.
"use strict";
function numbers(base64) {
  const bytes = Uint8Array.from(atob(base64), c => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}
const section = (name, ...content) => { const s = document.createElement("section"); s.className = "past " + name; s.append(...content); return s; };
function heading(text) { const h = document.createElement("h2"); h.textContent = text; return h; }

// A picture: its name, what it spans, and lines; drawn when it comes into sight, or onto paper.
const unseen = new Set();
const drawOnce = box => { if (unseen.delete(box)) { seenOnce.unobserve(box); box.show(); } };
const seenOnce = new IntersectionObserver(list => list.forEach(e => { if (e.isIntersecting) drawOnce(e.target); }), { rootMargin: "300px" });
addEventListener("beforeprint", () => { unseen.forEach(drawOnce); drawAll(); });
function picture(p, group, times, pick) {
  const box = document.createElement("div"), figure = document.createElement("figure"), caption = document.createElement("figcaption"), small = document.createElement("small");
  small.textContent = ` ${extent(...p.range)} ${group.unit}`;
  caption.append(p.name, small); box.className = "plot low"; figure.append(caption, box);
  box.setAttribute("role", "img"); box.setAttribute("aria-label", `${group.heading}: ${p.name},${small.textContent}`);
  box.show = () => {
    const kinds = { true: { name: "true", colour: css("--soft"), width: 3 }, measured: { name: "measured", colour: css("--amber") }, estimated: { name: "estimated", colour: css("--blue") } };
    const lines = [], o = { least: group.least, legend: false, pick };
    const deviation = p.lines.find(l => l[0] === "sd"), estimate = p.lines.find(l => l[0] === "estimated");
    if (deviation) { // between the two lines that nobody sees
      const sd = numbers(deviation[2]), x = times[estimate[1]], y = numbers(estimate[2]);
      for (const sign of [1, -1]) lines.push({ name: "", colour: "transparent", width: 0, x, y: y.map((v, i) => v + sign * 1.96 * sd[i]) });
      o.sd = [1, 2];
    }
    for (const [kind, time, values] of p.lines) if (kinds[kind]) lines.push({ ...kinds[kind], x: times[time], y: numbers(values) });
    drawStill(box, lines, o);
  };
  unseen.add(box); seenOnce.observe(box);
  return figure;
}

function open(r) {
  document.body.classList.add("recorded");
  begin(r, r.time.length); up = r.up;
  const verdict = /^usable: (yes|doubtful|no)\n/.exec(r.summary); // not to be overlooked
  if (verdict) { $("verdict").textContent = verdict[0].trim(); $("verdict").className = "verdict " + verdict[1]; }
  $("verdict").hidden = !verdict;
  $("findings").textContent = verdict ? r.summary.slice(verdict[0].length) : r.summary;
  $("h-figure").closest("section").hidden = !labels("skeleton").length && !labels("markers").length;
  const all = numbers(r.values), width = past.width;
  past.values = all; past.n = r.time.length; past.time = Float64Array.from(r.time); past.number = past.time.map((_, i) => i);
  $("when").max = past.n - 1;
  const show = () => {
    const k = +$("when").value;
    now.head.set([k, r.time[k], r.status[k]]); now.values.set(all.subarray(k * width, (k + 1) * width)); anything = true;
    $("moment").textContent = r.time[k].toFixed(2) + " s"; redraw(true);
  };
  const pick = t => { let best = 0; r.time.forEach((v, i) => { if (Math.abs(v - t) < Math.abs(r.time[best] - t)) best = i; }); $("when").value = best; show(); };
  $("when").oninput = show; show();
  const kinds = new Set(r.groups.flatMap(g => g.panels.flatMap(p => p.lines.map(l => l[0]))));
  $("key").textContent = "Blue: estimated" + (kinds.has("sd") ? ", with its nominal 95 % band" : "") + "." + (kinds.has("measured") ? " Orange: measured." : "") +
    (kinds.has("true") ? " Grey: the known truth." : "") + " Least and largest value stand above each picture; a click in one chooses the moment.";
  const times = r.times.map(numbers);
  for (const g of r.groups) {
    if (!g.panels.length) continue;
    const grid = document.createElement("div");
    grid.className = "pictures"; grid.append(...g.panels.map(p => picture(p, g, times, pick)));
    document.querySelector("main").append(section("wide", heading(g.heading), grid));
  }
}
