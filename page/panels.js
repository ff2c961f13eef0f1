// SPDX-License-Identifier: Apache-2.0
// panels.js: what the run says of itself and what may be asked of it: streams, labels, maximal contractions.
"use strict";
let recording = false, mvc = null, electrodes = [], guide = null;

const option = (label, value) => { const o = document.createElement("option"); o.textContent = label; o.value = value; return o; };
function row(cells) {
  const tr = document.createElement("tr");
  for (const c of cells) { const td = document.createElement("td"); td.append(c); tr.append(td); }
  return tr;
}
function say(id, what, kind) { // what has not changed is left alone: each change makes the browser draw
  const e = $(id), look = e.className.replace(/ ?(good|bad)/, "") + (kind ? " " + kind : "");
  if (e.textContent !== what) e.textContent = what;
  if (e.className !== look) e.className = look;
}

/* ---- streams, and labels that were not found ---- */
let shown = "", listed = "";
function showStreams(s) {
  const streams = s.streams || [], rows = JSON.stringify(streams.map(t => [t.name, t.rate, t.found, t.of, t.state]));
  if (rows !== listed) $("streams").replaceChildren(...streams.map(t => {
    const r = row([t.name, t.rate ? (+t.rate).toFixed(0) + " Hz" : "\u2013", t.found + " of " + t.of, t.state]);
    r.lastChild.className = t.state === "running" ? "good" : "bad";
    return r;
  }));
  listed = rows;
  const key = JSON.stringify(streams.map(t => [t.missing, t.unused]));
  if (key === shown) return; // a list that somebody has open stays as it is
  shown = key;
  const missing = streams.flatMap(t => (t.missing || []).map(m => ({ name: m, came: t.unused || [] })));
  const unused = streams.flatMap(t => t.unused || []);
  $("labels").textContent = (missing.length ? missing.length + " labels of the model did not come. " : "All labels were found. ") +
    (unused.length ? "Came and not used: " + unused.join(", ") + "." : "");
  $("map").hidden = !missing.length;
  $("pairs").replaceChildren(...missing.map(m => {
    const list = document.createElement("select"), use = document.createElement("button"), cell = document.createElement("span");
    list.setAttribute("aria-label", "what " + m.name + " came as");
    list.append(option("\u2013", ""), ...m.came.map(c => option(c, c)));
    use.type = "button"; use.textContent = "Use"; use.setAttribute("aria-label", "Use it for " + m.name);
    use.onclick = () => { if (list.value) send("label", list.value + "=" + m.name); };
    cell.append(list, " ", use);
    return row([m.name, cell]);
  }));
}

/* ---- maximal contractions: rest, contract, next ---- */
const REST = 3, CONTRACT = 5;
function stopGuide() {
  if (!guide) return;
  clearInterval(guide.timer);
  if (guide.contracting) send("mvc-stop");
  guide = null;
  $("mvc-now").textContent = "";
  for (const id of ["mvc", "mvc-all"]) $(id).setAttribute("aria-pressed", "false");
  $("mvc").textContent = "Start"; $("mvc-all").textContent = "All in turn";
}
function startGuide(names, button, text) {
  if (!names.length) return;
  guide = { names, at: 0, left: REST, contracting: false };
  $(button).setAttribute("aria-pressed", "true"); $(button).textContent = text;
  const step = () => {
    const name = guide.names[guide.at];
    $("mvc-now").textContent = guide.contracting ? `${name}: as hard as you can! ${guide.left}` : `${name}: rest, then go in ${guide.left}`;
    if (guide.left-- > 0) return;
    if (!guide.contracting) { guide.contracting = true; guide.left = CONTRACT; send("mvc-start", name); return; }
    send("mvc-stop"); guide.contracting = false; guide.left = REST;
    if (++guide.at === guide.names.length) stopGuide();
  };
  guide.timer = setInterval(step, 1000); step();
}
$("mvc").onclick = () => { if (guide) stopGuide(); else startGuide([$("electrode").value], "mvc", "Stop"); };
$("mvc-all").onclick = () => { if (guide) stopGuide(); else startGuide(electrodes.map(e => e.name), "mvc-all", "Stop"); };

function showElectrodes(s) {
  electrodes = s.electrodes || []; mvc = s.mvc || null;
  if ($("electrode").children.length !== electrodes.length) $("electrode").replaceChildren(...electrodes.map(e => option(e.name, e.name)));
  $("maxima").replaceChildren(...electrodes.filter(e => e.max !== undefined && e.max !== null).map(e => row([e.name, (+e.max).toPrecision(3)])));
  $("mvc-all").disabled = $("mvc").disabled = !electrodes.length;
  if (mvc) {
    const before = (electrodes.find(e => e.name === mvc.name) || {}).max || 0;
    $("mvc-bar").max = Math.max(before, mvc.max, 1e-9); $("mvc-bar").value = mvc.max;
    $("mvc-state").textContent = `Now ${mvc.name}: ${(+mvc.max).toPrecision(3)} after ${(+mvc.seconds).toFixed(1)} s`;
  } else if (s.mvc_file) {
    $("mvc-state").textContent = "The EMG is relative to the maxima found; stored in " + s.mvc_file;
  } else if (!electrodes.length) {
    $("mvc-state").textContent = "There are no raw electrodes (emg.channels): the EMG comes as it is used.";
  }
}

let told = "";
function showState(s) {
  showStreams(s);
  const key = JSON.stringify([s.recording, s.up, s.electrodes, s.mvc, s.mvc_file]);
  if (key === told) return;
  told = key;
  recording = !!s.recording; up = s.up === 2 ? 2 : 1;
  $("record").setAttribute("aria-pressed", recording); $("record").textContent = recording ? "Stop recording" : "Record";
  $("record").title = s.recording || "";
  showElectrodes(s);
}
$("record").onclick = () => send(recording ? "record-stop" : "record-start");
$("stop").onclick = () => { if (confirm("End the run?")) send("stop"); };
