"""Substructures that Abaqus has written (in the package abaqus-mtx-parser), with K and M as that package reads them: the flexible body has to have their eigenvalues and
mass. The package has no places of the nodes. They follow from the matrices, up to a displacement and a turn of the whole: of the motions without energy those of the
nodes' displacements and rotations tell where the nodes lie."""

from importlib.metadata import version
from importlib.resources import files

from common import Row, body_of

MODES = 8
LIMIT = 1e-9
DIRECTIONS = [1, 2, 3, 4, 5, 6]


def places(stiffness, nodes):
    """Places of nodes with six directions each, the first of them at the origin."""
    import numpy as np

    _, shapes = np.linalg.eigh(stiffness)
    rigid = shapes[:, :6] @ np.linalg.inv(shapes[:6, :6])
    # Columns 3 to 5: the body turns about the first node, u = e x r.
    turn = rigid[:, 3:].reshape(nodes, 6, 3)
    assert np.abs(turn[:, 3:] - np.eye(3)).max() < 1e-6
    return [(u[1, 2] - u[2, 1], u[2, 0] - u[0, 2], u[0, 1] - u[1, 0]) for u in turn[:, :3] / 2]


def rows(flexbody, folder):
    import h5py
    import numpy as np
    import scipy.linalg
    from abaqus_mtx_parser import parse_mtx

    program = f"Abaqus, abaqus-mtx-parser {version('abaqus-mtx-parser')}"
    found = []
    for name in ("symmetric/inner", "symmetric/total", "unsymmetric/inner"):
        kind, file = name.split("/")
        written = files(f"abaqus_mtx_parser.mtx.{kind}").joinpath(f"{file}.mtx")
        theirs = parse_mtx(written)
        assert all(theirs.dof[node] == DIRECTIONS for node in theirs.nodes)
        stiffness = (theirs.stiffness + theirs.stiffness.T) / 2
        at = places(stiffness, len(theirs.nodes))
        deck = "*NODE\n" + "".join(f"{node}, {x[0]:.15g}, {x[1]:.15g}, {x[2]:.15g}\n" for node, x in zip(theirs.nodes, at))
        deck += f"*STEP\n*SUBSTRUCTURE GENERATE, TYPE=Z1\n*SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, MASS=YES, OUTPUT FILE=USER DEFINED, FILE NAME={file}\n*END STEP\n"
        place = folder / kind
        place.mkdir(exist_ok=True)
        (place / "job.inp").write_text(deck)
        (place / f"{file}.mtx").write_bytes(written.read_bytes())
        body = body_of(flexbody, place / "job.inp", place / f"{file}.flex.h5", "--modes", MODES)
        with h5py.File(body) as made:
            own, mass = made["modes/eigenvalue"][()], float(np.ravel(made["invariants/mass"][()])[0])
        expected = scipy.linalg.eigh(stiffness, theirs.mass, eigvals_only=True)[6 : 6 + MODES]
        ahead = np.tile([1.0, 0, 0, 0, 0, 0], len(theirs.nodes))
        found.append(Row(program, "substructure", f"{name}: eigenvalues of {MODES} modes beside scipy's", np.abs(own / expected - 1).max(), LIMIT))
        found.append(Row(program, "substructure", f"{name}: mass", abs(mass / (ahead @ theirs.mass @ ahead) - 1), LIMIT))
    return found
