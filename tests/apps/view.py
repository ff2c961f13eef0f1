#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A folder of results on the page: report.html and `mhe-live --view` show the same, and what they show are the tables' numbers;
the server gives the page to programs of this machine and nothing else to anybody.
    view.py BIN_DIR SOURCE_DIR"""
import base64
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request

programs, source = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
work = tempfile.TemporaryDirectory()
os.chdir(work.name)
FOLDER = "a <b>& folder"


def run(*words):
    return subprocess.run(words, capture_output=True, text=True)


def table(name):
    lines = open(f"{FOLDER}/{name}").read().split("endheader\n")[1].splitlines()
    return lines[0].split("\t"), [[float(v) for v in line.split("\t")] for line in lines[1:]]


def floats(text):
    data = base64.b64decode(text, validate=True)
    return struct.unpack(f"<{len(data) // 4}f", data)


def rounded(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def results(page):
    found = re.findall(r'<script type="application/json" id="recorded">(.*?)</script>', page, re.S)
    assert len(found) == 1 and found[0] != "null"
    assert "<" not in found[0]
    return json.loads(found[0])


done = run(f"{programs}/mhe-run", f"{source}/models/arm19/demo.yaml", "--out", FOLDER, "--quiet")
assert done.returncode == 0, done.stderr
report = open(f"{FOLDER}/report.html").read()
assert not re.search(r'(src|href)="?(http|[a-z]*\.(png|css|js))', report), "the page needs other files"
shown = results(report)
assert shown["title"] == "demo" and "usable: yes" in shown["summary"]

# Frames: rows of the tables, and a posture beside them.
columns, forces = table("forces.sto")
labels, states = table("estimates.sto")
place, n = {}, 0
for s in shown["signals"]:
    place[s["name"]] = (n, s["labels"])
    n += len(s["labels"])
values = floats(shown["values"])
assert len(values) == n * len(shown["time"]) and len(shown["time"]) > 20
step = round((shown["time"][1] - shown["time"][0]) / (forces[1][0] - forces[0][0]))
for k, time in enumerate(shown["time"]):
    row, state, frame = forces[k * step], states[k * step], values[k * n:(k + 1) * n]
    assert abs(row[0] - time) < 1e-6
    first, names = place["force"]
    assert names == columns[1:]
    assert list(frame[first:first + len(names)]) == [rounded(v) for v in row[1:]]
    first, names = place["q"]
    assert [f"q_{c}" for c in names] == labels[1:1 + len(names)]
    assert list(frame[first:first + len(names)]) == [rounded(v) for v in state[1:1 + len(names)]]
    first, names = place["skeleton"]
    bones = frame[first:first + len(names)]
    assert len(names) >= 12 and all(abs(v) < 3 for v in bones)
    first, names = place["paths"]
    assert sum(v == v for v in frame[first:first + len(names)]) >= 19 * 6  # 19 muscles, two points at least
first, names = place["skeleton"]
assert values[first:first + len(names)] != values[(len(shown["time"]) // 2) * n + first:][:len(names)]  # it moves

# Small pictures: estimated, measured, true, in the units that stand above them.
groups = {g["heading"].split()[0]: g for g in shown["groups"]}
assert set(groups) == {"Joint", "Activation", "Muscle", "Distance", "Solve"}
panel = next(p for p in groups["Muscle"]["panels"] if p["name"] == "BRA")
kinds = {line[0]: line for line in panel["lines"]}
assert set(kinds) == {"estimated", "true"}
column = [row[columns.index("BRA")] for row in forces]
assert list(floats(kinds["estimated"][2])) == [rounded(v) for v in column]
assert list(floats(shown["times"][kinds["estimated"][1]])) == [rounded(row[0]) for row in forces]
assert panel["range"][0] <= min(column) + 1e-6 and panel["range"][1] >= max(column) - 1e-6
assert {line[0] for line in groups["Activation"]["panels"][0]["lines"]} == {"estimated", "measured", "true"}

# The same folder by mhe-live.
for words, said in ((["--view", "nothing"], "nothing/estimates.sto"), (["--view"], "--view needs a value"),
                    (["absent.yaml", "--view", FOLDER], "absent.yaml")):
    wrong = run(f"{programs}/mhe-live", *words)
    assert wrong.returncode == 2 and said in wrong.stderr and len(wrong.stderr.splitlines()) == 1, wrong
server = subprocess.Popen([f"{programs}/mhe-live", "--view", FOLDER], stdout=subprocess.PIPE, text=True)
address = server.stdout.readline().strip()
port = int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/", address).group(1))


def ask(path="", host=None):
    request = urllib.request.Request(address + path, headers={"Host": host} if host else {})
    try:
        return urllib.request.urlopen(request, timeout=60).read().decode()
    except urllib.error.HTTPError as error:
        return error.code


deaf = [socket.create_connection(("127.0.0.1", port), timeout=60) for _ in range(20)]  # never read, never end
for s in deaf:
    try:
        s.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    except OSError:
        pass  # one that had to make room
for garbage in (b"\x00\xff\xfe\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n", b"x" * 100000):
    with socket.create_connection(("127.0.0.1", port), timeout=60) as s:
        try:
            s.sendall(garbage)
            assert b"demo" not in s.recv(1000)
        except OSError:
            pass
again = results(ask())
assert ask("../etc/passwd") == 404 and ask("report.html") == 404
assert ask(host="evil.example") == 403 and ask(host="localhost.evil.example:80") == 403
assert again["title"] == FOLDER and "usable: yes" in again["summary"]
assert again["values"] == shown["values"] and again["signals"] == shown["signals"]
server.send_signal(signal.SIGINT)
assert server.wait() == 0
for s in deaf:
    s.close()

# A long table is thinned, but loses no peak: each row twenty times, and one row with a force that was nowhere else.
shutil.copytree(FOLDER, "long")
peak = None
for name in os.listdir("long"):
    if not name.endswith(".sto"):
        continue
    head, body = open(f"long/{name}").read().split("endheader\n")
    names, *lines = body.splitlines()
    long = []
    for line in lines:
        time, *rest = line.split("\t")
        long += ["\t".join([f"{float(time) + 0.0005 * k:.6f}"] + rest) for k in range(20)]
    if name == "forces.sto":
        cells = long[997].split("\t")
        peak = cells[names.split("\t").index("BRA")] = "4321.5"
        long[997] = "\t".join(cells)
    head = re.sub(r"nRows=\d+", f"nRows={len(long)}", head)
    with open(f"long/{name}", "w") as file:
        file.write(head + "endheader\n" + "\n".join([names] + long) + "\n")
server = subprocess.Popen([f"{programs}/mhe-live", "--view", "long"], stdout=subprocess.PIPE, text=True)
address = server.stdout.readline().strip()
shown = results(ask())
muscles = next(g for g in shown["groups"] if g["heading"].startswith("Muscle"))
line = {m[0]: m for m in next(p for p in muscles["panels"] if p["name"] == "BRA")["lines"]}["estimated"]
drawn = floats(line[2])
assert peak and len(drawn) <= 601 and len(drawn) == len(floats(shown["times"][line[1]]))
assert rounded(4321.5) in drawn and min(drawn) <= min(column) + 1e-6
server.send_signal(signal.SIGINT)
assert server.wait() == 0
