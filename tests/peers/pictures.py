"""The exports vtk and gltf in the libraries that read them: VTK itself by PyVista, meshio, trimesh, pygltflib, and the validator of Khronos (npm).

All are compared with the flex-body file: places, shapes, interfaces; of a simulation with its file.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import common
from common import ROOT, Absent, Row

JOB = ROOT / "fixtures/small/abaqus_labels/job.inp"
SCENE = """
[initial]
angular_velocity = [20, 0, 50]
mode = [{ number = 1, amplitude = 1e-4 }]
[run]
duration = 0.2
outputs = 20
"""
VALIDATE = """
const fs = require('fs'), validator = require(process.argv[1]);
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then(found => console.log(JSON.stringify(found.issues)));
"""


class Body:
    """A block with a surface and an interface, and its motion."""

    def __init__(self, flexbody, folder):
        import h5py
        import numpy as np

        self.path = common.body_of(flexbody, JOB, folder / "block.flex.h5", "--modes", 4, "--interface", "left=Left,rigid")
        (folder / "scene.toml").write_text(SCENE)
        common.run(flexbody, "simulate", self.path, "--scene", folder / "scene.toml", "-o", folder / "motion.h5", "--quiet")
        self.motion = folder / "motion.h5"
        with h5py.File(self.path) as f:
            axes, origin = f["frame/axes"][()], f["frame/origin"][()]
            self.ids = f["nodes/id"][()]
            self.places = f["nodes/position"][()] @ axes.T + origin
            self.shapes = [own @ axes.T for own in f["modes/shape"][()]]
            self.triangles = len(f["mesh/triangles"])
        with h5py.File(self.motion) as f:
            q, attitude = f["modes/q"][()], f["frame/attitude"][()]
            self.moved, self.deflection = [], []
            for instant, (w, x, y, z) in enumerate(attitude):
                turn = np.array([
                    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                ])
                u = sum(one * own for one, own in zip(q[instant], self.shapes))
                self.moved.append((self.places - f["frame/origin_in_model"][()].ravel() + u) @ turn.T + f["frame/origin"][instant])
                self.deflection.append(u @ turn.T)
        self.size = np.ptp(self.places, axis=0).max()


def largest(a, b, size):
    return float(abs(a - b).max() / size)


def vtk(flexbody, folder):
    import numpy as np
    import pyvista

    body = Body(flexbody, folder)
    program = f"VTK {pyvista.vtk_version_info.major}.{pyvista.vtk_version_info.minor}.{pyvista.vtk_version_info.micro}"
    mesh = pyvista.read(common.export(flexbody, body.path, "vtk", folder / "block.vtu"))
    order = [list(mesh["node"]).index(number) for number in body.ids]
    names = [name for name in mesh.point_data if name.startswith("mode_")]
    assert len(names) == len(body.shapes) and mesh["interface left"][order].sum() == 4, mesh
    shapes = max(largest(mesh[name][order], own, abs(own).max()) for name, own in zip(names, body.shapes))
    triangles = int(np.count_nonzero(mesh.celltypes == 5))
    rows = [
        Row(program, "vtk", "places of the nodes", largest(mesh.points[order], body.places, body.size), 1e-15),
        Row(program, "vtk", "shapes of the modes", shapes, 1e-14),
        Row(program, "vtk", "the surface has as many triangles (1: no)", float(triangles != body.triangles), 0.0),
    ]
    series = pyvista.get_reader(common.export(flexbody, body.path, "vtk", folder / "motion.pvd", "--simulation", body.motion))
    assert len(series.time_values) == len(body.moved)
    places, deflections = 0.0, 0.0
    for instant, (moved, deflection) in enumerate(zip(body.moved, body.deflection)):
        series.set_active_time_point(instant)
        mesh = series.read()[0]
        places = max(places, largest(mesh.points[order], moved, body.size))
        deflections = max(deflections, largest(mesh["deflection"][order], deflection, body.size))
    rows += [
        Row(program, "vtk", "a motion: places at all instants", places, 1e-12),
        Row(program, "vtk", "a motion: deflections at all instants", deflections, 1e-12),
    ]
    return rows


def meshio(flexbody, folder):
    import meshio as library

    body = Body(flexbody, folder)
    mesh = library.read(common.export(flexbody, body.path, "vtk", folder / "block.vtu"))
    order = [list(mesh.point_data["node"]).index(number) for number in body.ids]
    names = [name for name in mesh.point_data if name.startswith("mode_")]
    shapes = max(largest(mesh.point_data[name][order], own, abs(own).max()) for name, own in zip(names, body.shapes))
    program = f"meshio {library.__version__}"
    return [
        Row(program, "vtk", "places of the nodes", largest(mesh.points[order], body.places, body.size), 1e-15),
        Row(program, "vtk", "shapes of the modes", shapes, 1e-14),
    ]


def gltf(flexbody, folder):
    import numpy as np
    import pygltflib
    import trimesh

    body = Body(flexbody, folder)
    path = common.export(flexbody, body.path, "gltf", folder / "block.glb")
    scene = trimesh.load(path)
    up = np.array([body.places[:, 0], body.places[:, 2], -body.places[:, 1]]).T
    surface = next(mesh for mesh in scene.dump() if hasattr(mesh, "faces"))
    # Every node of the surface is at a vertex, and every vertex at a node.
    apart = np.linalg.norm(surface.vertices[:, None, :] - up[None, :, :], axis=2)
    found = max(apart.min(axis=1).max(), apart.min(axis=0).max()) / body.size
    rows = [
        Row(f"trimesh {trimesh.__version__}", "gltf", "vertices are the nodes of the surface", float(found), 2e-7),
        Row(f"trimesh {trimesh.__version__}", "gltf", "the surface has as many triangles (1: no)", float(len(surface.faces) != body.triangles), 0.0),
    ]
    document = pygltflib.GLTF2().load(path)
    targets = document.meshes[0].primitives[0].targets
    assert len(targets) == len(document.animations) == len(body.shapes)

    def floats(accessor):
        accessor = document.accessors[accessor]
        view = document.bufferViews[accessor.bufferView]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        data = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
        return np.frombuffer(data, "<f4").reshape(accessor.count, width).astype(float)

    vertices = floats(document.meshes[0].primitives[0].attributes.POSITION) + document.nodes[1].translation
    nearest = np.linalg.norm(vertices[:, None, :] - body.places[None, :, :], axis=2).argmin(axis=1)
    worst = 0.0
    for target, shape in zip(targets, body.shapes):
        told = floats(target["POSITION"])
        wanted = shape[nearest] / np.linalg.norm(shape[nearest], axis=1).max() * np.linalg.norm(told, axis=1).max()
        worst = max(worst, largest(told, wanted, np.linalg.norm(told, axis=1).max()))
    version = pygltflib.__version__
    return [*rows, Row(f"pygltflib {version}", "gltf", "targets are the shapes of the modes", worst, 1e-6)]


def validator(flexbody, folder):
    """What the validator of Khronos finds in files with a surface, with points alone, and of a motion."""
    source = "npm install gltf-validator --prefix target/peers"
    if not shutil.which("node"):
        raise Absent("node")
    default = ROOT / "target/peers/node_modules/gltf-validator"
    place = Path(os.environ.get("GLTF_VALIDATOR", default))
    if not (place / "package.json").is_file():
        raise Absent(f"gltf-validator ({source}, or GLTF_VALIDATOR=folder)")
    version = json.loads((place / "package.json").read_text())["version"]
    body = Body(flexbody, folder)
    points = common.body(flexbody, "bracket_hex20", folder / "points.flex.h5", "--modes", 12)
    files = [
        ("a surface", common.export(flexbody, body.path, "gltf", folder / "a.glb")),
        ("points", common.export(flexbody, points, "gltf", folder / "b.glb")),
        ("a motion", common.export(flexbody, body.path, "gltf", folder / "c.glb", "--simulation", body.motion)),
    ]
    rows = []
    for what, path in files:
        found = subprocess.run(["node", "-e", VALIDATE, str(place.resolve()), str(path)], capture_output=True, text=True, check=True)
        issues = json.loads(found.stdout)
        for message in issues["messages"]:
            print(f"  {message['severity']} {message['code']} {message.get('pointer')}: {message['message']}")
        count = issues["numErrors"] + issues["numWarnings"]
        rows.append(Row(f"gltf-validator {version}", "gltf", f"errors and warnings about {what}", float(count), 0.0))
    return rows
