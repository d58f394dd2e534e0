"""Bodies of the fixtures in several frames, and their files."""

import shutil
import tomllib

import h5py
import numpy as np

import common
from common import ROOT

from . import adams, arrays, embedded, exudyn, matrices, mbdyn, mbsim, openradioss, pictures, sid
from .oracle import Damping, Interface, Model, Nodes

# Rayleigh damping, 1/s and s.
ALPHA, BETA = 30.0, 1e-7


class Source:
    """A fixture with couplings and reference points for its interfaces. Its bodies have a Craig-Bampton basis, so that static deflections at interfaces are those of all nodes."""

    def __init__(self, folder, fixture, interfaces, fixed_modes, damped=False):
        """`interfaces` has tuples of name, coupling, reference point (None: the only node) and nodes (None: those of the fixture)."""
        self.folder, self.fixed_modes = folder / fixture, fixed_modes
        shutil.copytree(ROOT / "fixtures/models" / fixture, self.folder)
        path = self.folder / "model.toml"
        manifest = tomllib.loads(path.read_text())
        given = {one["name"]: one["nodes"] for one in manifest.get("interface", [])}
        lines, self.interfaces = [], []
        text = path.read_text().split("[[interface]]")[0]
        table = np.genfromtxt(self.folder / "nodes.csv", delimiter=",", names=True)
        at = {int(node): np.array([x, y, z]) for node, x, y, z in zip(table["node"], table["x"], table["y"], table["z"])}
        for name, coupling, reference, nodes in interfaces:
            nodes = nodes or given[name]
            place = at[nodes[0]] if reference is None else np.array(reference, float)
            lines.append(f'[[interface]]\nname = "{name}"\nnodes = {nodes}\ncoupling = "{coupling}"')
            if reference is not None:
                lines.append(f"reference = {place.tolist()}")
            self.interfaces.append(Interface(name, coupling, nodes, place))
        if damped:
            lines.append(f"[damping]\nrayleigh = {{ alpha = {ALPHA}, beta = {BETA} }}")
        stresses = []
        for one in manifest.get("geometric_stiffness", []):
            kind = next(kind for kind in ("acceleration", "angular_acceleration", "spin") if kind in one)
            lines.append(f'[[geometric_stiffness]]\nfile = "{one["file"]}"\n{kind} = "{one[kind]}"')
            stresses.append((kind, one[kind], one["file"]))
        path.write_text(text + "\n".join(lines) + "\n")
        # Size of the unit of length of the model in metres.
        self.metre = {"mm": 1e-3, "m": 1.0}[manifest["model"]["units"]["length"]]
        self.model = Model(self.folder, self.interfaces, Damping(ALPHA, BETA) if damped else Damping(), stresses)

    def alone(self, node):
        """Returns the name of the interface that consists of this node alone, or None."""
        return next((i.name for i in self.interfaces if i.nodes == [node]), None)


class Body:
    """A source in a frame, with the files of all formats, which are written on first use."""

    def __init__(self, flexbody, source, frame, folder):
        self.flexbody, self.source, self.frame = flexbody, source, frame
        self.folder = folder / f"{source.folder.name} {frame.replace('=', ' ')}"
        self.folder.mkdir()
        self.path = self.folder / "body.flex.h5"
        basis = ["--basis", "craig-bampton", "--modes", source.fixed_modes, "--frame", frame]
        common.run(flexbody, "convert", source.folder / "model.toml", *basis, "--lumped", "none", "--quiet", "-o", self.path)
        with h5py.File(self.path) as file:
            self.general = file["source"].attrs["mass_structure"] == "general"
            self.modes = len(file["modes/eigenvalue"])
            rotation = file["modes/rotation"][()] if "rotation" in file["modes"] else None
            # Rotations of the nodes in the modes, for formats that have none.
            self.rotation = None if rotation is None else rotation.transpose(1, 2, 0)

    def file(self, target, units=None):
        """Returns the path of the exported file. `units` are those of length, mass and time, by default those of the body."""
        to, dialect, suffix, options = target.to, target.dialect, target.suffix, []
        path = self.folder / f"{to} {dialect or 'usual'} {'other' if units else 'own'}" / f"body{suffix}"
        if not path.exists():
            path.parent.mkdir()
            options += ["--dialect", dialect] if dialect else []
            options += ["--modes", str(self.modes)] if target.all_modes else []
            options += ["--to-units", units] if units else []
            if target.places:
                options += ["--points", "interfaces," + ",".join(str(node) for node in self.source.model.ids)]
            common.export(self.flexbody, self.path, to, path, *options)
        return path

    def read(self, target, units=None):
        """Returns the equations of the file as the reader of the format forms them."""
        return target.reader(self.file(target, units), self)


class Target:
    """A row of the table: a format and dialect with the reader of its files. `places` is true if the format has the option `--points`."""

    def __init__(self, name, to, reader, suffix="", dialect=None, places=True, general="undeformed"):
        self.name, self.to, self.dialect, self.suffix, self.places = name, to, dialect, suffix, places
        self.reader = reader
        # Order to which the equations hold for nodes that turn.
        self.general = general
        # True if the format shows some of the modes unless `--modes` asks for all.
        self.all_modes = False


def targets(dialects):
    """Returns all formats with equations of the floating frame. `dialects` are those of sid that the program has."""
    found = [Target("exudyn", "exudyn", lambda path, body: exudyn.Exudyn(path), ".hdf5")]
    for dialect in dialects:
        found.append(Target(f"sid, {dialect}", "sid", lambda path, body, dialect=dialect: sid.Sid(path, dialect), ".SID_FEM", dialect, general="first"))
    found += [
        Target("mbdyn, level19", "mbdyn", lambda path, body: mbdyn.Mbdyn(path), ".fem", "level19", general="first"),
        Target("mbdyn, level13", "mbdyn", lambda path, body: mbdyn.Mbdyn(path), ".fem", "level13", general="small"),
        Target("mbsim", "mbsim", lambda path, body: mbsim.Mbsim(path), ".h5"),
        Target("openradioss", "openradioss", lambda path, body: openradioss.OpenRadioss(path), ".fxb"),
        Target("adams-invariants, json", "adams-invariants", lambda path, body: adams.Adams(path), ".json", "json"),
        Target("adams-invariants, text", "adams-invariants", lambda path, body: adams.AdamsText(path), ".txt", "text"),
        Target("npz", "npz", lambda path, body: arrays.npz(path), ".npz", places=False, general="first"),
        Target("json", "json", lambda path, body: arrays.read_json(path), ".json", places=False, general="first"),
        Target("embedded, double", "embedded", lambda path, body: embedded.Embedded(path, body.general), ".bin", "double", general="first"),
        Target("embedded, float", "embedded", lambda path, body: embedded.Embedded(path, body.general), ".bin", "float", general="first"),
    ]
    return found


CHRONO = Target("chrono", "chrono", lambda path, body: matrices.Chrono(path), ".csv", places=False)
SIMSCAPE = [Target(f"simscape, {dialect}", "simscape", lambda path, body: matrices.Simscape(path), suffix, dialect, places=False) for dialect, suffix in [("mat5", ".mat"), ("hdf5", ".h5")]]
VTK = Target("vtk", "vtk", lambda path, body: pictures.Vtk(path), ".vtu")
GLTF = Target("gltf", "gltf", lambda path, body: pictures.Gltf(path, body.source.metre), ".glb", places=False)
GLTF.all_modes = True


def fit(positions, places):
    """Returns origin and axes of the frame in which points with the given `places` in the model have `positions`, and the relative error: x_model = origin + axes x."""
    centre, other = positions.mean(0), places.mean(0)
    u, _, v = np.linalg.svd((places - other).T @ (positions - centre))
    axes = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    origin = other - axes @ centre
    wrong = np.abs(positions @ axes.T + origin - places).max() / np.ptp(places, 0).max()
    return origin, axes, wrong


def nodes_of(equations, body, model):
    """Returns the oracle with the shapes and the frame of the file, and the largest error of the places of its nodes relative to the extent."""
    source = body.source
    names = {source.alone(node): node for node in model.ids if source.alone(node)}
    # Labels of mbdyn: an interface that is a node by itself has its name, reference points are no nodes.
    number = lambda label: names[label] if label in names else int(label) if label.isdigit() else -1
    ids = [number(label) for label in equations.labels] if hasattr(equations, "labels") else equations.ids
    if getattr(equations, "counted", False):
        # Interfaces first, then the other nodes, as they were asked for.
        ids = [i.nodes[0] if len(i.nodes) == 1 else -1 for i in source.interfaces] + [node for node in model.ids if not source.alone(node)]
    first = {}
    for i, node in enumerate(ids):
        first.setdefault(node, i)
    pick = [first[node] for node in model.ids]
    origin, axes, wrong = fit(equations.positions[pick], model.x)
    # The nodes of the models do not lie in a plane, so that the frame is the only one.
    rotation = equations.rotation
    if body.rotation is None:
        rotation = None
    elif rotation is None:
        rotation = body.rotation
    else:
        rotation = rotation[pick]
    return Nodes(model, origin, axes, equations.shape[pick], rotation), wrong
