#!/usr/bin/env python3
"""A tube frame of beams and a folded shell in Exudyn, which has no rotations of nodes and no stiffness of inertia: what such a body loses, and that it loses
nothing else.

`rows` is called by suite.py. Each body tumbles as in exudyn_bodies.py, at three speeds. Its motion in Exudyn is compared with that by `flexbody simulate` of

* the body that `flexbody convert --from exudyn` reads back from the file: the same equations, so that only the error of the integration is left;
* the whole body: the difference must be of the size of the change of deflections that `flexbody export --scene` states for this scene.
"""

import re
import subprocess
import warnings

import h5py
import numpy as np

import common
from common import Row, run

warnings.filterwarnings("ignore", category=DeprecationWarning)
import exudyn as exu  # noqa: E402
from exudyn.FEM import ObjectFFRFreducedOrderInterface  # noqa: E402
from exudyn_bodies import Scene  # noqa: E402

BODIES = ["frame_beams", "shell_folded"]
MODES = 8
STEPS, LIMIT = 8000, 1e-8
# In three oscillations the phase adds up to twice the error; measured are 0.9 to 2.2 times.
PHASE = 3.0
# Parts of the spin of exudyn_bodies.py, a quarter of the first frequency.
SPEEDS = [0.25, 0.5, 1.0]


class Body:
    """A body of flexbody with the attributes that the scenes need."""

    def __init__(self, flexbody, path):
        self.flexbody, self.path = flexbody, path
        with h5py.File(path) as f:
            self.axes, self.origin, self.lam = f["frame/axes"][()], f["frame/origin"][()], f["modes/eigenvalue"][()]
            self.inertia, self.mass = f["invariants/I0"][()], f["invariants/mass"][0]
            self.ids, self.interface, self.pair = [], None, []
        self.first, self.length = np.sqrt(self.lam[0]), np.sqrt(np.trace(self.inertia) / 2 / self.mass)


class Tumbling(Scene):
    """A tumbling scene at a part of its speed and deflection."""

    def __init__(self, body, part):
        super().__init__("tumbling", body)
        self.omega, self.velocity, self.q = self.omega * part, self.velocity * part, 0.1 * self.q


def stated(flexbody, body, scene, out):
    """Largest change of a deflection that the export states in a scene, of all losses together."""
    words = [str(flexbody), "export", str(body), "--to", "exudyn", "--scene", str(scene), "--allow-loss", "-o", str(out)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    parts = re.findall(r"deflections change by at most ([\d.e+-]+) %", done.stderr)
    assert parts, done.stderr
    return 0.01 * sum(float(part) for part in parts)


def rows(flexbody, folder):
    exu.SetWriteToConsole(False)
    program = f"Exudyn {exu.__version__}"
    found = []
    for name in BODIES:
        path, export, again = folder / f"{name}.flex.h5", folder / f"{name}.hdf5", folder / f"{name}.back.flex.h5"
        common.body(flexbody, name, path, "--modes", MODES)
        # No permission is needed: the losses need a motion.
        run(flexbody, "export", path, "--to", "exudyn", "--quiet", "-o", export)
        run(flexbody, "convert", export, "--from", "exudyn", "--quiet", "-o", again)
        body, back = Body(flexbody, path), Body(flexbody, again)
        # The file has no place of its frame in the model.
        back.axes, back.origin = np.eye(3), np.zeros(3)
        loaded = ObjectFFRFreducedOrderInterface()
        loaded.LoadFromFile(str(export))
        for part in SPEEDS:
            scene = Tumbling(body, part)
            theirs = scene.exudyn(loaded, STEPS)
            own = scene.ours(folder)
            error = stated(flexbody, path, folder / "scene.toml", folder / "again.hdf5")
            apart = max(scene.difference(own, theirs).values())
            same = max(scene.difference(Tumbling(back, part).ours(folder), theirs).values())
            hertz = float(np.linalg.norm(scene.omega) / (2 * np.pi))
            print(f"  {name} at {hertz:.3g} turns per unit of time: stated {error:.1e}, to the whole body {apart:.1e}, to the body of the file {same:.1e}")
            row = lambda what, value, limit: found.append(Row(program, "exudyn", f"{name}, spin {hertz:.3g} 1/time: {what}", value, limit))
            row("motion of the body in the file", same, LIMIT)
            row(f"motion of the whole body, stated change of deflections {error:.1e}", apart, PHASE * error)
    return found
