// SPDX-License-Identifier: Apache-2.0
// page.js PORT TOKEN FOLDER: a live run as browsers and clients see it. Headless Chromium opens the page; the official
// client of Foxglove reads the same run; a client never reads; another sends garbage; strangers ask for control. FOLDER gets
// two pictures and what the page was sent (page.json). Exit status 77: a part is not installed.
"use strict";
const { spawn, execSync } = require("child_process"), fs = require("fs"), net = require("net"), path = require("path");
let WebSocket, FoxgloveClient;
try {
  WebSocket = require(path.join(__dirname, "npm/node_modules/ws"));
  FoxgloveClient = require(path.join(__dirname, "npm/node_modules/@foxglove/ws-protocol")).FoxgloveClient;
  execSync("command -v chromium");
} catch (e) { process.exit(77); }
// page.js --check FOLDER: what the page had equals live_force.sto, number by number (the page's are float32).
if (process.argv[2] === "--check") {
  const { signals, kept } = JSON.parse(fs.readFileSync(path.join(process.argv[3], "page.json")));
  const first = signals.slice(0, signals.findIndex(s => s[0] === "force")).reduce((n, s) => n + s[1], 0);
  const rows = fs.readFileSync(path.join(process.argv[3], "live_force.sto"), "utf8").split("\n").slice(7).filter(l => l).map(l => l.split("\t").map(Number));
  let n = 0;
  for (const [number, time, , values] of kept) {
    const row = rows[number];
    if (!row || Math.abs(row[0] - time) > 1e-9) { console.error("no row of estimate " + number); process.exit(1); }
    row.slice(1).forEach((v, i) => { if (Math.fround(v) !== values[first + i]) { console.error(`estimate ${number}: ${v} is ${values[first + i]}`); process.exit(1); } n++; });
  }
  console.log(n + " numbers equal");
  process.exit(n > 0 ? 0 : 1); // how many were looked at depends on the machine; equal they must be
}
const [port, token, folder] = process.argv.slice(2), address = `127.0.0.1:${port}`;
const rest = ms => new Promise(done => setTimeout(done, ms));
let chrome = null;
const fail = what => { console.error("page.js: " + what); if (chrome) chrome.kill("SIGKILL"); process.exit(1); };
const must = (yes, what) => { if (!yes) fail(what); };
async function until(what, ask) {
  for (let i = 0; i < 4000; i++) { const v = await ask(); if (v) return v; await rest(100); }
  fail("never came: " + what);
}

async function browser() {
  const home = path.join(folder, "chrome");
  chrome = spawn("chromium", ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--remote-debugging-port=0", "--user-data-dir=" + home,
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1", "about:blank"], { stdio: "ignore" });
  const file = path.join(home, "DevToolsActivePort");
  await until("Chromium", () => fs.existsSync(file) && fs.readFileSync(file, "utf8").includes("\n"));
  const debug = fs.readFileSync(file, "utf8").split("\n")[0];
  const pages = await (await fetch(`http://127.0.0.1:${debug}/json`)).json();
  const ws = new WebSocket(pages.find(p => p.type === "page").webSocketDebuggerUrl);
  await new Promise(done => ws.on("open", done));
  let id = 0; const waiting = new Map();
  ws.on("message", m => { const a = JSON.parse(m); if (waiting.has(a.id)) { waiting.get(a.id)(a); waiting.delete(a.id); } });
  const call = (method, params) => new Promise(done => { waiting.set(++id, done); ws.send(JSON.stringify({ id, method, params })); });
  const ask = async code => {
    const a = await call("Runtime.evaluate", { expression: code, returnByValue: true });
    if (a.result.exceptionDetails) fail(code + ": " + JSON.stringify(a.result.exceptionDetails.exception));
    return a.result.result.value;
  };
  const picture = async (name, width, height, mobile) => {
    await call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: mobile ? 2 : 1, mobile });
    await rest(1500);
    const shot = await call("Page.captureScreenshot", { captureBeyondViewport: true });
    fs.writeFileSync(path.join(folder, name), Buffer.from(shot.result.data, "base64"));
    must(await ask("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than " + width);
  };
  await call("Page.enable"); await call("Runtime.enable");
  return { call, ask, picture };
}

// The official client: all signals, the numbers of one of them.
function foxglove() {
  return new Promise((done, no) => {
    const client = new FoxgloveClient({ ws: new WebSocket(`ws://${address}`, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
    let channel = null, n = 0;
    client.on("error", no);
    client.on("advertise", channels => {
      channel = channels.find(c => c.topic === "/force");
      must(channel && channel.encoding === "json", "no channel /force");
      client.subscribe(channel.id);
    });
    client.on("message", m => {
      const o = JSON.parse(Buffer.from(m.data.buffer, m.data.byteOffset, m.data.byteLength).toString());
      must(Number.isFinite(o.BRA), "no number of BRA");
      must(Object.keys(JSON.parse(channel.schema).properties).length === Object.keys(o).length, "schema");
      if (++n === 50) { client.close(); done(); }
    });
  });
}

// Who asks for it gets what has come every 0.3 s: each frame as a message of its own, none missing, each with how long it waited.
function paced() {
  return new Promise(done => {
    const ws = new WebSocket(`ws://${address}`, ["mhe.live.v1"]);
    let last = null, n = 0, said = [], waited = 0;
    ws.on("open", () => { for (const text of ["x", "-1", "1e9", "0.3"]) ws.send(JSON.stringify({ do: "pace", text })); });
    ws.on("message", (data, binary) => {
      if (!binary) { const o = JSON.parse(data); if (o.done || o.error) said.push(o.done || o.error); return; }
      const head = new Float64Array(Uint8Array.from(data).buffer, 0, 8);
      if (last) must(head[0] - last[0] === 1 + head[6] - last[6], `paced: frame ${head[0]} after ${last[0]}`);
      must(head[7] >= head[5] && head[7] < 600, "paced: sent before it was there");
      waited = Math.max(waited, head[7] - head[5]); last = head;
      if (++n < 150) return;
      must(said.length > 0 && said.every(t => t === "pace"), "paced: " + said);
      must(waited > 0.1, "paced: no frame waited"); ws.terminate(); done();
    });
  });
}

function command(headers, message) {
  return new Promise(done => {
    const ws = new WebSocket(`ws://${address}`, ["mhe.live.v1"], { headers });
    ws.on("error", () => done("turned away"));
    ws.on("open", () => ws.send(message));
    ws.on("message", (data, binary) => {
      const o = binary ? {} : JSON.parse(data);
      if (o.error || o.done) { ws.terminate(); done(o.error || o.done); }
    });
  });
}

async function strangers() {
  must((await command({ Origin: "http://evil.example" }, "{}")) === "turned away", "a page of another origin got in");
  must(/not allowed/.test(await command({}, '{"do": "stop"}')), "stop without a token");
  must(/not allowed/.test(await command({}, '{"do": "record-start", "text": "../../x", "token": "0"}')), "a wrong token");
  for (const m of ["", "{", "[]", '{"do":', '"do"', "{\"do\":\"" + "x".repeat(3000) + "\"}", "\\", "null"]) {
    must((await command({}, m)).length > 0, "no answer to " + m);
  }
  for (const bytes of ["\x00\xff\xfe garbage\r\n\r\n", "GET /../../etc/passwd HTTP/1.1\r\nHost: x\r\n\r\n", "GET / HTTP/9\r\n".repeat(400)]) {
    const s = net.connect(port, "127.0.0.1"); s.on("error", () => 0); s.write(Buffer.from(bytes, "latin1"));
    let said = ""; s.on("data", d => said += d); await rest(200); s.destroy();
    must(!/root:/.test(said), "a file of the system was sent");
  }
}

const begun = Date.now(), phase = what => console.error(`page.js: ${what}, ${((Date.now() - begun) / 1000).toFixed(1)} s`);
setTimeout(() => fail("not done in 500 s"), 500000);
(async () => {
  const deaf = net.connect(port, "127.0.0.1"); // a client that never reads
  deaf.on("error", () => 0); deaf.pause();
  deaf.write("GET / HTTP/1.1\r\nHost: " + address + "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n" +
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: mhe.live.v1\r\n\r\n");
  const b = await browser(); phase("browser");
  await b.call("Page.navigate", { url: `http://${address}/?token=${token}` });
  await until("frames on the page", () => b.ask("!!(window.mhe && mhe.received > 100)"));
  // 20 s of messages: none is missing between the first and the last
  await b.ask("window.kept = []; mhe.each = f => kept.push([f[0], f[1], f[6], f.slice(8)]); 1");
  const before = await b.ask("[mhe.received, mhe.frame[0], mhe.frame[6]]");
  await foxglove(); phase("foxglove"); await paced(); phase("pace"); await strangers(); phase("strangers");
  const enough = Number(process.env.MHE_PAGE_MESSAGES || 400);
  await until(enough + " messages", () => b.ask(`mhe.received - ${before[0]} >= ${enough}`));
  const after = await b.ask("[mhe.received, mhe.frame[0], mhe.frame[6]]");
  const lost = after[2] - before[2]; // a machine that is busy with other things may lose some: then they are counted
  must(after[0] - before[0] + lost === after[1] - before[1], "messages are missing: " + before + " " + after);
  const signals = await b.ask("mhe.run.signals.map(s => [s.name, s.labels.length])");
  must(signals.some(s => s[0] === "skeleton" && s[1] > 0) && signals.some(s => s[0] === "paths" && s[1] > 0), "no figure");
  fs.writeFileSync(path.join(folder, "page.json"), JSON.stringify({ signals, kept: await b.ask("kept.slice(-500)") }));
  phase("messages");
  // a marker that came under another name is given its own, by the page's "Use"
  await until("the list of what is missing", () => b.ask("/^1 labels/.test(document.getElementById('labels').textContent) && document.querySelectorAll('#pairs tr').length === 1"));
  must(await b.ask("document.querySelector('#pairs td').textContent === 'STYLr' && [...document.querySelectorAll('#pairs option')].some(o => o.value === 'Elsewhere')"), "the list does not offer what came");
  await b.ask("document.querySelector('#pairs select').value = 'Elsewhere'; document.querySelector('#pairs button').click(); 1");
  await until("the label", () => b.ask("/^All labels were found/.test(document.getElementById('labels').textContent)"));
  phase("label");
  // recording and a maximal contraction, by the page's own buttons
  await b.ask("document.getElementById('record').click(); 1");
  await until("the recording", () => b.ask("document.getElementById('record').getAttribute('aria-pressed') === 'true'"));
  await b.ask("document.getElementById('electrode').value = 'Biceps'; document.getElementById('mvc').click(); 1");
  await until("the contraction", () => b.ask("/Now Biceps/.test(document.getElementById('mvc-state').textContent)"));
  await rest(500);
  await b.ask("document.getElementById('mvc').click(); document.getElementById('record').click(); 1");
  await until("the maximum", () => b.ask("/stored in/.test(document.getElementById('mvc-state').textContent)"));
  await until("the recording's end", () => b.ask("document.getElementById('record').getAttribute('aria-pressed') === 'false'"));
  must(await b.ask("[...document.querySelectorAll('button,select,input,canvas')].every(e => e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label,[role=img],[aria-hidden=true]'))"), "a control without a name");
  phase("buttons");
  // something is drawn: no line of the page threw, the figure is not empty, the plots have their canvas
  must(await b.ask("window.thrown === undefined"), "the page threw: " + await b.ask("String(window.thrown)"));
  await until("the figure", () => b.ask("(() => { const c = document.getElementById('figure'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; return d.some(v => v > 0); })()"));
  for (const id of ["band", "force", "angle", "activation"]) { // drawn when they come into sight
    await b.ask(`document.getElementById('${id}').scrollIntoView(); 1`);
    await until("the plot " + id, () => b.ask(`!!document.querySelector('#${id} canvas')`));
  }
  await b.ask("scrollTo(0, 0); 1");
  must(await b.ask("/^-?[0-9.]+$/.test(document.getElementById('big').textContent)"), "no large number");
  await b.picture("desktop.png", 1280, 900, false);
  await b.picture("phone.png", 390, 844, true);
  await b.ask("window.confirm = () => true; document.getElementById('stop').click(); 1");
  await rest(1000);
  deaf.destroy(); chrome.kill("SIGKILL");
  console.log(JSON.stringify({ received: after[0] - before[0], lost }));
  process.exit(0);
})().catch(e => fail(e.stack || String(e)));
