"""Jobs of CalculiX: the same deck is run twice, for its matrices and for its own table of frequencies, which the flexible body has to have."""

import itertools
import re
import subprocess

from common import Row, body_of, program

# Edges of the block, cells along them. C3D8R and C3D20R have modes without energy in meshes of one element across.
SIZE, CELLS = (0.3, 0.1, 0.08), (6, 3, 2)
MODES = 8
KINDS = ["C3D4", "C3D10", "C3D8", "C3D8R", "C3D8I", "C3D20", "C3D20R", "C3D6", "C3D15"]
# The table prints seven digits of the eigenvalue.
LIMIT = 1e-6

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
# Five tetrahedra would not fit their neighbours; these six around a diagonal do.
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
WEDGES = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]
# Ends of the edges that carry a node in the middle, in the order of CalculiX.
EDGES = {
    4: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    6: [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    8: [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
}


def mesh(kind):
    """Places of the nodes and nodes of the elements, on a lattice of half cells."""
    count = int(re.match(r"C3D(\d+)", kind).group(1))
    corners, parts = {4: (4, TETRAHEDRA), 10: (4, TETRAHEDRA), 6: (6, WEDGES), 15: (6, WEDGES)}.get(count, (8, [tuple(range(8))]))
    numbers, elements = {}, []

    def number(place):
        return numbers.setdefault(place, 10 * len(numbers) + 7)

    for cell in itertools.product(*(range(n) for n in CELLS)):
        own = [tuple(2 * (c + d) for c, d in zip(cell, corner)) for corner in CORNERS]
        for part in parts:
            places = [own[k] for k in part]
            if count > corners:
                places += [tuple((a + b) // 2 for a, b in zip(places[i], places[j])) for i, j in EDGES[corners]]
            elements.append([number(place) for place in places])
    nodes = {at: [x * length / (2 * n) for x, length, n in zip(place, SIZE, CELLS)] for place, at in numbers.items()}
    return nodes, elements


def deck(kind, nodes, elements, solver):
    lines = ["*NODE, NSET=NALL"] + [f"{at}, {x:.15g}, {y:.15g}, {z:.15g}" for at, (x, y, z) in nodes.items()]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=EALL")
    for at, element in enumerate(elements, 1):
        words = [str(word) for word in [at, *element]]
        lines += [", ".join(words[k : k + 10]) + ("," if k + 10 < len(words) else "") for k in range(0, len(words), 10)]
    left = [str(at) for at, place in nodes.items() if place[0] == 0]
    lines += ["*NSET, NSET=LEFT"] + [", ".join(left[k : k + 8]) for k in range(0, len(left), 8)]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850.", "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL"]
    return "\n".join([*lines, "*STEP", f"*FREQUENCY{solver}", str(MODES + 6), "*END STEP", ""])


def eigenvalues(text):
    """The flexible eigenvalues of the table of frequencies."""
    rows = re.findall(r"^ +\d+ +(-?[\d.]+E[+-]\d+) +[\d.]+E[+-]\d+ +[\d.]+E[+-]\d+ +[\d.]+E[+-]\d+ *$", text, re.MULTILINE)
    return [float(row) for row in rows][6 : 6 + MODES]


def rows(flexbody, folder):
    import h5py

    ccx = program("ccx", "CCX", "Debian's calculix-ccx")
    version = subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    found = []
    for kind in KINDS:
        nodes, elements = mesh(kind)
        for name, solver in (("job", ", SOLVER=MATRIXSTORAGE"), ("table", "")):
            place = folder / f"{kind}_{name}.inp"
            place.write_text(deck(kind, nodes, elements, solver))
            subprocess.run([ccx, "-i", place.stem], cwd=folder, check=True, capture_output=True)
        theirs = eigenvalues((folder / f"{kind}_table.dat").read_text())
        path = body_of(flexbody, folder / f"{kind}_job.inp", folder / f"{kind}.flex.h5", "--modes", MODES, "--interface", "left=LEFT,rigid")
        with h5py.File(path) as file:
            ours = file["modes/eigenvalue"][()]
        error = max(abs(a / b - 1) for a, b in zip(ours, theirs, strict=True))
        found.append(Row(f"CalculiX {version}", kind, f"eigenvalues of {MODES} modes beside its own table", error, LIMIT))
    return found
