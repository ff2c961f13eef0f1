// SPDX-License-Identifier: Apache-2.0
// qtm_client.js PORT: the official client of Qualisys reads our test server: labels, and 20 frames whose numbers must be
// those of qtm_server.c. Exit status 77: the client is not installed.
"use strict";
const path = require("path");
let Api;
try {
  Api = require(path.join(__dirname, "npm/node_modules/qualisys-rt")).Api;
} catch (e) {
  process.exit(77);
}
const api = new Api();
const fail = what => { console.error(what); process.exit(1); };
setTimeout(() => fail("no answer in 60 s"), 60000).unref();
const marker = (k, i, a) => i === 1 && k % 7 === 0 ? NaN : 100 * (i + 1) + 10 * a + 0.25 * (k % 100);
const analog = (n, c) => 0.5 * (c + 1) + 0.001953125 * (n % 512);
let frames = 0;
// Time stamps are not compared: this client reads them one byte off (munchUInt64).
api.on("frame", f => {
  const m = f.components["3d"].markers, d = f.components.analog.devices[0];
  m.forEach((p, i) => ["x", "y", "z"].forEach((a, j) => {
    if (!Object.is(p[a] === null ? NaN : p[a], marker(f.frame, i, j))) // the client has null for NaN
      fail(`marker ${i}.${a} is ${p[a]} in frame ${f.frame}`);
  }));
  if (m.length !== 2 || d.channelCount !== 2 || d.sampleNumber !== 5 * f.frame) fail("counts " + JSON.stringify(d));
  d.data.forEach((channel, c) => channel.forEach((v, n) => {
    if (v !== analog(d.sampleNumber + n, c)) fail(`channel ${c} is ${v} at sample ${d.sampleNumber + n}`);
  }));
  if (++frames === 20) { console.log("20 frames as they should be"); process.exit(0); }
});
api.connect(Number(process.argv[2]), "127.0.0.1", 1, 22)
  .then(() => api.getParameters("3D", "Analog"))
  .then(p => {
    const labels = p.the3d.labels.map(l => l.name).join();
    if (labels.toUpperCase() !== "A,B") fail("labels " + labels);
    return api.streamFrames({ frequency: NaN, components: ["3D", "Analog"] });
  })
  .catch(e => fail(String(e && e.stack || e)));
