"""Files of Nastran, which pyYeti and pyNastran write and read: OUTPUT4 in every form, an external superelement of pyYeti, and places of grids by pyNastran. The
flexible body has to be that of the same matrices in Matrix Market."""

import re
import sys
from pathlib import Path

from common import ROOT, Row, body_of, run

sys.path.insert(0, str(ROOT / "fixtures/make"))
MODES = 8
# Text has 17 digits here; punch files have ten.
LIMIT = 1e-9
PUNCH_LIMIT = 1e-6


def read_op4(path):
    """Matrices of a file by pyYeti, names in upper case."""
    from pyyeti.nastran import op4

    return {name.upper(): matrix for name, (matrix, *_) in op4.load(str(path), into="dct", sparse=False).items()} if path else {}


def eigenvalues(path):
    import h5py

    with h5py.File(path) as file:
        return file["modes/eigenvalue"][()]


def differences(found, expected):
    return max(abs(a / b - 1) for a, b in zip(found, expected, strict=True))


def without_defaults(folder, to):
    """The deck with what GRDSET says written into the grids: pyNastran takes an explicit zero of a grid for none."""
    to.mkdir(exist_ok=True)
    (to / "job.bdf").write_text((folder / "job.bdf").read_text())
    lines = (folder / "grids.bdf").read_text().splitlines()
    lines = [f"{line},1" if line.startswith("grid,") else line for line in lines if not line.startswith("GRDSET")]
    (to / "grids.bdf").write_text("\n".join(lines) + "\n")
    return to / "job.bdf"


def places(deck):
    """Numbers and places of the grids of a deck by pyNastran."""
    from pyNastran.bdf.bdf import read_bdf

    model = read_bdf(str(deck), xref=True, punch=False, debug=None)
    return {node: grid.get_position() for node, grid in sorted(model.nodes.items())}, model


def tables(folder, nodes, stiffness, mass):
    """The same model in Matrix Market."""
    import scipy.io
    import scipy.sparse

    for name, matrix in (("K", stiffness), ("M", mass)):
        scipy.io.mmwrite(folder / f"{name}.mtx", scipy.sparse.coo_matrix(matrix), symmetry="general", precision=17)
    (folder / "nodes.csv").write_text("node,x,y,z\n" + "".join(f"{node},{x[0]!r},{x[1]!r},{x[2]!r}\n" for node, x in nodes.items()))
    return ["--stiffness", folder / "K.mtx", "--mass", folder / "M.mtx", "--nodes", folder / "nodes.csv"]


def of_tables(flexbody, folder, words):
    path = folder / "tables.flex.h5"
    run(flexbody, "convert", *words, "--units", "m,kg,s", "--lumped", "none", "--quiet", "--modes", MODES, "-o", path)
    return eigenvalues(path)


def of_job(flexbody, folder, job):
    return eigenvalues(body_of(flexbody, job, folder / "job.flex.h5", "--modes", MODES))


def rows(flexbody, folder):
    import numpy as np
    import pyNastran
    import pyyeti
    from pyNastran.bdf.bdf import BDF
    from pyyeti.nastran import op4

    found = []
    small = ROOT / "fixtures/small"
    grids, model = places(without_defaults(small / "nastran", folder / "deck"))
    theirs = {node: tuple(float(x) for x in place) for node, place in grids.items()}
    # Matrices of the punch file by pyNastran, turned by its transformations.
    punch = BDF(debug=None)
    punch.read_bdf(str(small / "nastran/job.pch"), punch=True, xref=False)
    ids = list(theirs)
    matrices = {}
    for name in ("KAAX", "MAAX"):
        matrix, labels, _ = punch.dmig[name].get_matrix(is_sparse=False, apply_symmetry=True)
        order = [next(k for k, own in labels.items() if tuple(own) == (node, c)) for node in ids for c in (1, 2, 3)]
        turn = np.zeros((3 * len(ids),) * 2)
        for k, node in enumerate(ids):
            grid = model.nodes[node]
            turn[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = axes(grid, np)
        matrices[name] = turn.T @ matrix[np.ix_(order, order)] @ turn
    expected = of_tables(flexbody, folder, tables(folder, theirs, matrices["KAAX"], matrices["MAAX"]))
    ours = of_job(flexbody, folder, small / "nastran/job.bdf")
    found.append(Row(f"pyNastran {pyNastran.__version__}", "DMIG", f"eigenvalues of {MODES} modes, places and axes of grids", differences(ours, expected), PUNCH_LIMIT))

    # The same body as the g-set in every form that pyYeti writes.
    output = read_op4(small / "nastran_op4/job.op4")
    exact = of_job(flexbody, folder, small / "nastran_op4/job.bdf")
    kept = np.flatnonzero(np.abs(output["KGG"]).sum(axis=0))
    words = tables(folder, theirs, *(output[name][np.ix_(kept, kept)] for name in ("KGG", "MGG")))
    found.append(
        Row(f"pyYeti {pyyeti.__version__}", "OUTPUT4", "matrices that it reads", differences(exact, of_tables(flexbody, folder, words)), LIMIT)
    )
    deck = folder / "forms.bdf"
    deck.write_text((small / "nastran_op4/job.bdf").read_text())
    for form in ("dense", "bigmat", "nonbigmat"):
        for binary, endian in ((True, "<"), (True, ">"), (False, "")):
            names, values = ["KGG", "MGG"], [output["KGG"], output["MGG"]]
            op4.write(str(folder / "forms.op4"), names, values, binary=binary, digits=16, endian=endian, sparse=form)
            kind = {"<": "little endian", ">": "big endian", "": "text"}[endian]
            difference = differences(of_job(flexbody, folder, deck), exact)
            found.append(Row(f"pyYeti {pyyeti.__version__}", "OUTPUT4", f"{form}, {kind}: eigenvalues", difference, LIMIT))
    return found + of_nastran(flexbody, folder)


def of_nastran(flexbody, folder):
    """An external superelement that NX Nastran has written (in the tests of pyYeti), without its modal coordinates: mass and moments of inertia as its table of the
    weight check prints them. One of its grids has rows along axes of its own."""
    import h5py
    import numpy as np
    import pyyeti
    from pyyeti.nastran import op4

    samples = Path(pyyeti.__file__).parent / "tests/nas2cam_extseout"
    if not (samples / "inboard.out").exists():
        return []
    punch = (samples / "inboard.pch").read_text()
    cards = punch[punch.index("CORD2R*") : punch.index("$ EXTRN DATA")] + punch[punch.index("GRID* ") : punch.index("$ ASET DEFINITIONS")]
    (folder / "boundary.bdf").write_text("BEGIN BULK\n" + cards)
    whole = read_op4(samples / "inboard.op4")
    op4.write(str(folder / "boundary.op4"), ["KAA", "MAA"], [whole[name][:24, :24] for name in ("KXX", "MXX")])
    path = body_of(flexbody, folder / "boundary.bdf", folder / "boundary.flex.h5", "--modes", 3)
    with h5py.File(path) as file:
        mass, inertia = file["invariants/mass"][()], np.sort(np.diag(file["invariants/I0"][()]))
    table = (samples / "inboard.out").read_text().split("MASS AXIS SYSTEM (S)")[1]
    number = r"([-+.\dE]+)"
    moments = [float(word) for word in re.findall(rf"^ +\* +{number} +\*$", table.split("I(Q)")[1].split(" Q\n")[0], re.MULTILINE)]
    printed = [float(re.search(rf" X +{number}", table).group(1)), *sorted(moments)]
    difference = differences([float(np.ravel(mass)[0]), *inertia], printed)
    return [Row("NX Nastran 9.1", "OUTPUT4, CD", "mass and moments of a superelement beside its own table", difference, 1e-6)]


def axes(grid, np):
    """Unit vectors, in rows, along the rows of a grid, by pyNastran's coordinate systems."""
    system = grid.cd_ref
    if system.cid == 0:
        return np.eye(3)
    beta = system.beta()
    if system.type.endswith("R"):
        return beta
    local = beta @ (grid.get_position() - system.origin)
    r = np.hypot(local[0], local[1])
    if r < 1e-12:
        return beta
    cos, sin = local[0] / r, local[1] / r
    return np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) @ beta
