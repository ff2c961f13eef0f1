// SPDX-License-Identifier: Apache-2.0
// frames.js: what came, in place. A frame is a head [number, time, status, iterations, solve time, latency, lost, latency with
// the way to the page] and the values of all signals; the newest stands in `now`, those of the last seconds in a ring.
"use strict";
const HEAD = 8, SECONDS = 10, KEPT = 1024, UNSEEN = -1;
const now = { head: new Float64Array(HEAD), values: new Float32Array(0) };
const past = { room: 0, first: 0, n: 0, width: 0, step: 1, time: new Float64Array(0), number: new Float64Array(0), values: new Float32Array(0) };
let place = {}, anything = false; // signal: { first, n, labels, unit }; whether `now` holds a frame

const labels = name => place[name] ? place[name].labels : [];
function clearFrames(width, room) {
  Object.assign(past, { room, first: 0, n: 0, width, step: 1, time: new Float64Array(room), number: new Float64Array(room), values: new Float32Array(room * width) });
  now.values = new Float32Array(width); anything = false;
}
const slot = i => (past.first + i) % past.room; // of the i-th frame, the oldest first
// Where frames come so often that the ring does not hold SECONDS of them, every second one is kept, then every fourth.
function thin() {
  past.step *= 2;
  let n = 0;
  for (let i = 0; i < past.n; i++) {
    const from = slot(i), to = slot(n);
    if (past.number[from] % past.step) continue;
    past.number[to] = past.number[from]; past.time[to] = past.time[from];
    past.values.copyWithin(to * past.width, from * past.width, (from + 1) * past.width); n++;
  }
  past.n = n;
}
function addFrame(head, values) {
  if (anything && head[1] < now.head[1]) { past.n = 0; past.step = 1; } // another run
  now.head.set(head); now.values.set(values); anything = true;
  while (past.n && head[1] - past.time[past.first] > SECONDS) { past.first = (past.first + 1) % past.room; past.n--; }
  if (past.n === past.room) thin();
  if (head[0] % past.step) return;
  const k = slot(past.n++);
  past.number[k] = head[0]; past.time[k] = head[1]; past.values.set(values, k * past.width);
}

// Where a quantity ("force:3") stands among the values, and what makes it degrees or per cent of what came.
function spot(key) {
  const [name, i] = key.split(":"), p = place[name];
  if (!p || +i >= p.n) return { at: UNSEEN, factor: 1 };
  return { at: p.first + +i, factor: name === "q" && p.unit.startsWith("rad") ? 180 / Math.PI : name === "activation" || name === "emg" ? 100 : 1 };
}
const valueNow = s => s.at === UNSEEN || !anything ? NaN : s.factor * now.values[s.at];
