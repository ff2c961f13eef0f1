# SPDX-License-Identifier: Apache-2.0
"""The folder in which a page's blocks are done: a clone with a build, and a reader's files beside it."""
import os

# The README's own config, which other pages go on with (the README's block is compared with it by own_data.sh).
CONFIG = ("model: {file: my_arm.osim}\ndata: {markers: trial.trc, emg: emg.sto}\nhorizon: {window: 7, ratio: 3}\n"
          "costs: [mhe.cost.emg-markers]\n")

ARM = {"my_arm.osim": "models/arm19/arm19.osim", "arm19.osim": "models/arm19/arm19.osim",
       "demo_reference.sto": "models/arm19/demo_reference.sto", "trial.trc": "models/arm19/demo_markers.trc",
       "emg.sto": "models/arm19/demo_emg.sto", "trial.c3d": "models/arm19/demo_recording.c3d",
       "reach_1.trc": "models/arm19/demo_markers.trc", "reach_1.sto": "models/arm19/demo_emg.sto",
       "reach_2.trc": "models/arm19/demo_markers.trc", "reach_2.sto": "models/arm19/demo_emg.sto"}
WALK = {"subject.osim": "models/gait10dof/subject01.osim", "trial.trc": "models/gait10dof/demo_walk_markers.trc",
        "trial_grf.xml": "models/gait10dof/demo_walk_loads.xml", "demo_walk_loads.sto": "models/gait10dof/demo_walk_loads.sto", "grf.xml": "models/gait10dof/demo_walk_loads.xml",
        "coordinates_6Hz.sto": "models/gait10dof/demo_walk_postures.sto"}
TASKS = """<OpenSimDocument Version="40000"><IKTaskSet><objects>
<IKMarkerTask name="R.ASIS"><apply>true</apply><weight>20</weight></IKMarkerTask>
<IKMarkerTask name="L.ASIS"><apply>true</apply><weight>20</weight></IKMarkerTask>
<IKMarkerTask name="R.Heel"><apply>true</apply><weight>1</weight></IKMarkerTask>
<IKMarkerTask name="L.Heel"><apply>true</apply><weight>1</weight></IKMarkerTask>
</objects></IKTaskSet></OpenSimDocument>
"""


def make(folder, page, source, build):
    folder.mkdir(parents=True)
    for name in os.listdir(source):
        if name not in ("build", "out") and not name.startswith("."):
            (folder / name).symlink_to(source / name)
    (folder / "build").mkdir()
    (folder / "build/release").symlink_to(build)
    for name, file in (WALK if page == "docs/walking.md" else ARM).items():
        (folder / name).symlink_to(source / file)
    if page == "docs/walking.md":
        (folder / "ik_tasks.xml").write_text(TASKS)
        emg = (source / "models/gait10dof/demo_walk_emg.sto").read_text()
        (folder / "emg.sto").write_text(emg.replace("\tsoleus_r", "\tsoleus").replace("\thamstrings_r", "\thamstrings"))
    for name in ("my.yaml", "arm.yaml"):
        (folder / name).write_text(CONFIG)
    return folder
