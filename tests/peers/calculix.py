"""Jobs of CalculiX: the same deck is run twice, for its matrices and for its own modes. The flexible body has to have the frequencies of its table, and
a body of the modes that it wrote itself (.frd) has to be the one of the modes that are computed here. The last row goes from a geometry to a body."""

import itertools
import math
import os
import re
import subprocess
import sys

from common import ROOT, Absent, Row, body_of, program

# Edges of the block, cells along them. C3D8R and C3D20R have modes without energy in meshes of one element across.
SIZE, CELLS = (0.3, 0.1, 0.08), (6, 3, 2)
MODES = 8
KINDS = ["C3D4", "C3D10", "C3D8", "C3D8R", "C3D8I", "C3D20", "C3D20R", "C3D6", "C3D15"]
# The table prints seven digits of the eigenvalue.
LIMIT = 1e-6
# The file of modes has six digits of the shapes, which the eigenvalues feel squared.
MODES_LIMIT = 1e-7

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
    return "\n".join([*lines, "*STEP", f"*FREQUENCY{solver}", str(MODES + 6), *([] if solver else ["*NODE FILE", "U"]), "*END STEP", ""])


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
        # C3D8R has modes without a finite frequency, C3D8I internal rows that the file lacks.
        shapes = folder / f"{kind}_table.frd"
        path = body_of(flexbody, folder / f"{kind}_job.inp", folder / f"{kind}_imported.flex.h5", "--basis", "imported", "--shapes", shapes)
        with h5py.File(path) as file:
            imported = file["modes/eigenvalue"][()][:MODES]
        error = max(abs(a / b - 1) for a, b in zip(imported, ours, strict=True))
        found.append(Row(f"CalculiX {version}", kind, f"{MODES} modes of its own (.frd) imported, beside ours", error, MODES_LIMIT))
    found += [shell_row(flexbody, folder, version, kind, form) for form in SHEETS for kind in ("S3", "S4", "S8", "S8R")]
    return [*found, *from_cad(flexbody, folder, version)]


def shell_row(flexbody, folder, version, kind, form):
    """Sheets of shells beside the table of CalculiX, with their mass."""
    import h5py

    stem = f"{kind}_{form}"
    for name, solver in (("job", ", SOLVER=MATRIXSTORAGE"), ("table", "")):
        (folder / f"{stem}_{name}.inp").write_text(sheet(kind, form, solver))
        subprocess.run([program("ccx", "CCX", ""), "-i", f"{stem}_{name}"], cwd=folder, check=True, capture_output=True)
    theirs = eigenvalues((folder / f"{stem}_table.dat").read_text())
    path = body_of(flexbody, folder / f"{stem}_job.inp", folder / f"{stem}.flex.h5", "--modes", MODES)
    with h5py.File(path) as file:
        ours, mass = file["modes/eigenvalue"][()], file["invariants/mass"][0]
    error = max(abs(a / b - 1) for a, b in zip(ours, theirs, strict=True))
    exact = sum(7850 * 0.2 * 0.04 * cells * thickness for _, cells, thickness in SHEETS[form])
    assert abs(mass / exact - 1) < 1e-9, f"{stem}: mass {mass}, not {exact}"
    return Row(f"CalculiX {version}", kind, f"{form} sheet: eigenvalues of {MODES} modes beside its own table", error, LIMIT)


# Strips of shells that meet in one line: angles in degrees, cells across and thickness of each. Where they meet CalculiX makes knots.
SHEETS = {
    "plate": [(0, 3, 0.004)],
    "folded": [(0, 3, 0.004), (100, 2, 0.004)],
    "tee": [(0, 2, 0.004), (180, 2, 0.004), (90, 2, 0.004)],
    "stepped": [(0, 2, 0.004), (180, 2, 0.007)],
}


def sheet(kind, form, solver):
    """A deck of strips of shells, five cells long."""
    numbers, lines, sections = {}, [], []
    for strip, (angle, cells, thickness) in enumerate(SHEETS[form]):
        y, z = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        elements = []
        for i, j in itertools.product(range(0, 10, 2), range(0, 2 * cells, 2)):
            ends = [(i, j), (i + 2, j), (i + 2, j + 2), (i, j + 2)]
            middles = [(i + 1, j), (i + 2, j + 1), (i + 1, j + 2), (i, j + 1)]
            parts = [ends + middles] if kind.startswith("S8") else [ends] if kind.startswith("S4") else [ends[:3], [ends[0], *ends[2:]]]
            for part in parts:
                places = [(0.02 * i, round(0.02 * j * y, 12), round(0.02 * j * z, 12)) for i, j in part]
                elements.append([numbers.setdefault(place, 10 * len(numbers) + 7) for place in places])
        first = 1000 * strip + 1
        lines += [f"*ELEMENT, TYPE={kind}, ELSET=E{strip}"] + [", ".join(map(str, [at, *element])) for at, element in enumerate(elements, first)]
        sections += [f"*SHELL SECTION, ELSET=E{strip}, MATERIAL=STEEL", repr(thickness)]
    nodes = ["*NODE"] + [f"{at}, {x:.12g}, {y:.12g}, {z:.12g}" for (x, y, z), at in numbers.items()]
    material = ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850."]
    return "\n".join([*nodes, *lines, *material, *sections, "*STEP", f"*FREQUENCY{solver}", str(MODES + 6), "*END STEP", ""])


def from_cad(flexbody, folder, version):
    """examples/from_cad: the mass of the bracket of Gmsh is that of its geometry, but for the chords of the round holes."""
    import h5py

    try:
        gmsh = program("gmsh", "GMSH", "pip install gmsh")
    except Absent as missing:
        print(f"  not found: {missing}: from_cad is skipped")
        return []
    said = subprocess.run([gmsh, "--version"], capture_output=True, text=True)
    number = re.search(r"(\d+)\.(\d+)", said.stdout + said.stderr)
    if number and (int(number[1]), int(number[2])) < (4, 9):
        print(f"  Gmsh {number[0]} writes no node sets of groups, 4.9 and newer do: from_cad is skipped")
        return []
    place = folder / "from_cad"
    environment = dict(os.environ, GMSH=gmsh, CCX=program("ccx", "CCX", "Debian's calculix-ccx"), FLEXBODY=str(flexbody))
    subprocess.run([ROOT / "examples/from_cad/run.sh", place], check=True, capture_output=True, env=environment)
    with h5py.File(place / "bracket.flex.h5") as file:
        mass = file["invariants/mass"][0]
    volume = 60 * 40 * 8 + 42 * 40 * 8 - 8 * math.pi * (2 * 4**2 + 8**2)
    error = abs(mass / (volume * 7.85e-9) - 1)
    rows = [Row(f"Gmsh, CalculiX {version}", "C3D10", "examples/from_cad: mass of the bracket beside its geometry", error, 1e-3)]
    return [*rows, *tutorial(place, version, environment)]


def tutorial(place, version, environment):
    """docs/start/tutorial.md to its end: the bracket on a shaker, in Exudyn."""
    try:
        import exudyn
    except ImportError:
        print("  not found: Python module exudyn: the tutorial is run up to there")
        return []
    done = subprocess.run([ROOT / "examples/from_cad/tutorial.sh", place], check=True, capture_output=True, text=True, env=dict(environment, PYTHON=sys.executable))
    found = re.search(r"([0-9.]+) Hz in Exudyn, ([0-9.]+) Hz", done.stdout)
    error = abs(float(found[1]) / float(found[2]) - 1)
    what = "docs/start/tutorial.md: frequency of the bracket on its bolts with an instrument, beside that of K and M"
    return [Row(f"Gmsh, CalculiX {version}, Exudyn {exudyn.__version__}", "C3D10", what, error, 2e-4)]
