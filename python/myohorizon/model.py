# SPDX-License-Identifier: Apache-2.0
"""What is in a model file, and what the model says of a posture."""
import json

from ._config import _plain
from ._library import check, encode, ffi, host, lib, new_error, taken_text


class Model:
    """A model file, .osim or .bioMod: what `mhe-model` tells.

        model = myohorizon.Model("arm26.osim")
        model.muscle_names
        pose = model.evaluate(q={"r_elbow_flex": 1.2}, activation=0.5)
        pose["lines"]["BRA"]["moment_arm"]["r_elbow_flex"]     # m
        pose["muscles"]["BRA"]["tendon_force"]                 # N

    `info` is a dict: coordinates (with unit, range and default), couplers, bodies with masses (kg), muscles with their
    parameters (N, m, rad) and the coordinates they cross, obstacles, forces, markers, and what is `unsupported`,
    `dropped` or repaired (`warnings`), each with file:line.
    """

    def __init__(self, path):
        self.path = path
        error, out = new_error(), ffi.new("char **")
        check(lib.mhe_model_info(host, encode(path), lib.MHE_FORMAT_JSON, out, error), error)
        self.info = json.loads(taken_text(out[0]))

    def _names(self, part):
        return tuple(entry["name"] for entry in self.info[part])

    @property
    def coordinate_names(self):
        return self._names("coordinates")

    @property
    def muscle_names(self):
        return self._names("muscles")

    @property
    def marker_names(self):
        return tuple(m["name"] if isinstance(m, dict) else m for m in self.info["markers"])

    @property
    def body_names(self):
        return self._names("bodies")

    @property
    def mass(self):
        """kg, of all bodies."""
        return self.info["mass"]

    def evaluate(self, q=None, u=None, udot=None, *, activation=None, forces=None, external=None, paths="exact"):
        """The model at one posture, as a dict.

        Args:
            q, u, udot: {coordinate: rad or m, and per s, per s^2}; what is left out has the model's default, or 0.
            activation: of all muscles, or {muscle: 0..1}: adds "muscles" to the answer (rigid tendons).
            forces: {muscle or actuator: N or N m}: adds "reactions", which act on the child at the joint, in ground.
            external: [{"body", "force", "point", "torque"}], all in ground.
            paths: "exact", or "fitted" by polynomials.

        The answer holds "q" and "udot" of every coordinate, "bodies" ([x, y, z, rotation row by row], m), "markers"
        (m), "lines" ({path: {"length" m, "speed" m/s, "moment_arm" {coordinate: m}}}), "mass_matrix" (in the order of
        the free coordinates), "inverse_dynamics" (N m or N, without muscles). All of it: mhe/inspect.h.
        """
        pose = {"q": q, "u": u, "udot": udot, "activation": activation, "forces": forces, "external": external}
        return self.evaluate_all([{key: value for key, value in pose.items() if value is not None}], paths=paths)[0]

    def evaluate_all(self, poses, *, paths="exact"):
        """The same of many postures, each a dict of evaluate's arguments: a list of dicts."""
        if paths not in ("exact", "fitted"):
            raise ValueError(f"paths: 'exact' or 'fitted', not {paths!r}")
        content = json.dumps({"poses": list(poses)}, default=_plain, allow_nan=False, ensure_ascii=False).encode()
        error, out = new_error(), ffi.new("char **")
        check(lib.mhe_model_evaluate(host, encode(self.path), b"poses", content, len(content),
                                     lib.MHE_PATHS_FITTED if paths == "fitted" else lib.MHE_PATHS_EXACT, out, error), error)
        return json.loads(taken_text(out[0]))["poses"]

    def __repr__(self):
        return f"<Model {self.info['model']}: {len(self.coordinate_names)} coordinates, {len(self.muscle_names)} muscles>"
