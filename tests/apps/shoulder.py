#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""models/abduction/stability.yaml on the raised part of its recording: does the humeral head stay in its socket, do muscles
hold the girdle, and is the model that person.py writes the one of the file?

    shoulder.py PATH/mhe-run PATH/mhe-model SOURCE_DIR     status 77: the recording is not there
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

FIRST, LAST = 260, 420  # frames: from 50 degrees to the top and down


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def cut(source, target):
    """The recording's markers from FIRST to LAST, with their times."""
    lines = source.read_text().splitlines()
    head, rows = lines[:5], [line for line in lines[5:] if line.strip()]
    rows = rows[FIRST:LAST]
    words = head[2].split("\t")
    words[2] = str(len(rows))
    head[2] = "\t".join(words)
    target.write_text("\n".join(head + rows) + "\n")


def evaluated(model, poses, mhe_model):
    return json.loads(run(mhe_model, "evaluate", model, "--poses", poses))["poses"]


def same_model(mhe_model, person, data, folder):
    """Markers and paths of the .osim as it is are those of the .bioMod."""
    run(sys.executable, "-B", person, data / "wu_scaled.bioMod", folder / "same.osim", "--as-it-is")
    free = json.loads(run(mhe_model, "info", folder / "same.osim", "--json"))["coordinates"]
    names = [c["name"] for c in free]
    assert len(names) == 10, names
    poses = [{"q": {n: 0.1 * ((7 * k + 3 * i) % 11 - 5) for i, n in enumerate(names)}} for k in range(4)]
    (folder / "poses.json").write_text(json.dumps({"poses": poses}))
    worst = 0
    for a, b in zip(*(evaluated(m, folder / "poses.json", mhe_model) for m in (data / "wu_scaled.bioMod", folder / "same.osim"))):
        assert len(b["markers"]) == 12 and len(b["lines"]) == 31
        for name, at in b["markers"].items():
            worst = max(worst, *(abs(x - y) for x, y in zip(at, a["markers"][name])))
        for name, line in b["lines"].items():
            worst = max(worst, abs(line["length"] - a["lines"][name]["length"]))
    print(f"person.py as it is: places and lengths within {worst:.1e} m")
    assert worst < 1e-8


def main():
    mhe_run, mhe_model, source = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    data = Path(os.environ.get("MHE_SHARED", source / "../shared")) / "data/abduction"
    if not (data / "abd_markers.trc").is_file():
        sys.exit(77)
    models = source / "models/abduction"
    sys.path.insert(0, str(models))
    sys.dont_write_bytecode = True
    import figures
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "abduction").mkdir()
        same_model(mhe_model, models / "person.py", data, folder)
        run(sys.executable, "-B", models / "person.py", data / "wu_scaled.bioMod", folder / "abduction/person.osim")
        (folder / "abduction/abd_emg_raw.sto").symlink_to((data / "abd_emg_raw.sto").resolve())
        cut(data / "abd_markers.trc", folder / "abduction/abd_markers.trc")
        (folder / "stability.yaml").write_text((models / "stability.yaml").read_text())
        run(mhe_run, folder / "stability.yaml", "--out", folder / "out", "--quiet", "--set", "output.reactions=parent")
        seen = figures.figures(folder / "out")
    print(json.dumps(seen, indent=1))
    assert seen["frames"] == LAST - FIRST - 7 and seen["loaded"] > 0.9
    assert seen["within_30"] >= 0.9
    assert max(seen["residuals"].values()) < 5
    assert all(a > 1e-3 for of in seen["girdle"].values() for a in of.values())
    for group in ("serratus", "rhomboids", "trapezius"):
        assert max(seen["girdle"][group].values()) > 0.05, group


if __name__ == "__main__":
    main()
