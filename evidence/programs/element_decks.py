"""Decks of CalculiX of one block whose cells have elements of any kind and material."""

import itertools

import numpy as np

from geometric_elements import CORNERS, HEX_EDGES, TET_EDGES, TETRAHEDRA

WEDGES = [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]
WEDGE_EDGES = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
# Elements of a cell by the corners of the cell, and the edges that may have a middle node.
SHAPES = {4: (TETRAHEDRA, TET_EDGES, 4), 10: (TETRAHEDRA, TET_EDGES, 4), 6: (WEDGES, WEDGE_EDGES, 6), 15: (WEDGES, WEDGE_EDGES, 6), 8: ([tuple(range(8))], HEX_EDGES, 8), 20: ([tuple(range(8))], HEX_EDGES, 8)}
STEEL = ("*ELASTIC\n210000., 0.3", 7.85e-9)
ALUMINIUM = ("*ELASTIC\n70000., 0.33", 2.7e-9)
WOOD = ("*ELASTIC, TYPE=ENGINEERING CONSTANTS\n12000., 900., 500., 0.4, 0.35, 0.6, 700., 800.,\n100.", 6e-10)
# A positive definite matrix without symmetry.
CRYSTAL = (
    "*ELASTIC, TYPE=ANISO\n160000., 60000., 150000., 55000., 65000., 170000., 3000., -4000.,\n2000., 75000., -5000., 1000., 6000., 2500., 70000., 4000.,\n-3000., 1500., -2000., 3500., 80000.",
    2.3e-9,
)
ORIENTATIONS = {
    "RECTANGULAR": "*ORIENTATION, NAME=AXES, SYSTEM=RECTANGULAR\n0.8, 0.5, 0.1, -0.3, 0.9, 0.4",
    "CYLINDRICAL": "*ORIENTATION, NAME=AXES, SYSTEM=CYLINDRICAL\n30., -400., 20., 50., -360., 140.",
}
SIZE = (300.0, 100.0, 80.0)


def count_of(kind):
    """Number of nodes in the name of a type."""
    return int("".join(letter for letter in kind.removeprefix("C3D") if letter.isdigit()))


def twisted(x):
    """Place of a point of the unit cube in a twisted, tapered and skewed block."""
    angle = 0.4 * x[0]
    y, z = SIZE[1] * (x[1] - 0.5) * (1 - 0.2 * x[0]), SIZE[2] * (x[2] - 0.4) * (1 + 0.1 * x[1])
    c, s = np.cos(angle), np.sin(angle)
    return np.round([SIZE[0] * x[0] + 0.15 * y - 0.1 * z, y * c - z * s, y * s + z * c], 6)


def box(x):
    """Place of a point of the unit cube in a box."""
    return np.round(np.array(SIZE) * x, 6)


class Deck:
    """A twisted block of cells in mm, tonne, s. `kinds` and `materials` are repeated over the cells; `axes` names an orientation of all sections;
    `extra` makes further lines from the deck; `straight` blocks are not twisted."""

    def __init__(self, kinds, materials=None, axes=None, extra=lambda deck: "", cells=(3, 2, 2), straight=False):
        self.materials = materials or {"STEEL": STEEL}
        self.axes, self.extra = axes, extra
        numbers, self.elements = {}, []
        for at, cell in enumerate(itertools.product(*(range(n) for n in cells))):
            kind, material = kinds[at % len(kinds)], list(self.materials)[at % len(self.materials)]
            parts, edges, corners = SHAPES[count_of(kind)]
            own = [tuple(2 * (np.array(cell) + corner)) for corner in CORNERS]
            for nodes in parts:
                lattice = [own[k] for k in nodes]
                if count_of(kind) > corners:
                    lattice += [tuple((np.array(lattice[i]) + lattice[j]) // 2) for i, j in edges]
                self.elements.append([kind, material, [numbers.setdefault(tuple(map(int, x)), 10 * len(numbers) + 7) for x in lattice]])
        self.numbers = numbers
        self.positions = {node: (box if straight else twisted)(np.array(x) / (2 * np.array(cells))) for x, node in numbers.items()}
        self.ends = {name: [node for x, node in numbers.items() if x[0] == at] for name, at in (("ROOT", 0), ("TIP", 2 * cells[0]))}

    def model(self):
        """Cards up to the step."""
        lines = ["*NODE, NSET=NALL"]
        lines += [f"{node}, " + ", ".join(f"{value:.12g}" for value in x) for node, x in self.positions.items()]
        sections = {}
        for number, (kind, material, nodes) in enumerate(self.elements, 1):
            sections.setdefault((kind, material), []).append((number, nodes))
        for (kind, material), members in sections.items():
            lines.append(f"*ELEMENT, TYPE={kind}, ELSET={kind}_{material}")
            for number, nodes in members:
                words = [str(word) for word in [number, *nodes]]
                lines += [", ".join(words[k : k + 10]) + ("," if k + 10 < len(words) else "") for k in range(0, len(words), 10)]
        for name, nodes in self.ends.items():
            lines += [f"*NSET, NSET={name}"] + [f"{node}," for node in nodes]
        for name, (elasticity, density) in self.materials.items():
            lines += [f"*MATERIAL, NAME={name}", elasticity, "*DENSITY", f"{density}"]
        if self.axes:
            lines.append(ORIENTATIONS[self.axes])
        turned = ", ORIENTATION=AXES" if self.axes else ""
        lines += [f"*SOLID SECTION, ELSET={kind}_{material}, MATERIAL={material}{turned}" for kind, material in sections]
        return "\n".join(lines) + "\n" + self.extra(self)

    def job(self):
        """The deck that writes its matrices."""
        return self.model() + "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n4\n*END STEP\n"

    def count(self):
        """Number of elements by kind."""
        kinds = [kind for kind, _, _ in self.elements]
        return {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)}


def springs(deck):
    """Springs between nodes of both ends."""
    (a, b, *_), (c, d, *_) = deck.ends["ROOT"], deck.ends["TIP"]
    return f"*ELEMENT, TYPE=SPRINGA, ELSET=SPRINGS\n9001, {a}, {d}\n9002, {b}, {c}\n*SPRING, ELSET=SPRINGS\n\n25000.\n"


def equations(deck):
    """A node in the middle of two others, with a spring to the other end."""
    (a, b, *_), (c, *_) = deck.ends["ROOT"], deck.ends["TIP"]
    middle = (deck.positions[a] + deck.positions[b]) / 2
    text = "*NODE\n9000, " + ", ".join(f"{value:.12g}" for value in middle) + "\n*EQUATION\n"
    text += "".join(f"3\n9000, {k}, -1., {a}, {k}, 0.5, {b}, {k}, 0.5\n" for k in (1, 2, 3))
    return text + f"*ELEMENT, TYPE=SPRINGA, ELSET=SPRINGS\n9001, 9000, {c}\n*SPRING, ELSET=SPRINGS\n\n25000.\n"


def rigid_body(deck):
    """The root as a rigid body."""
    return "*NODE\n9000, -10., 5., 3.\n9001, -10., 5., 3.\n*RIGID BODY, NSET=ROOT, REF NODE=9000, ROT NODE=9001\n"


def kinematic(deck):
    """A kinematic coupling of the tip."""
    nodes = "".join(f"{node},\n" for node in deck.ends["TIP"])
    return f"*NODE\n9000, 310., 5., 3.\n*SURFACE, NAME=NODES, TYPE=NODE\n{nodes}*COUPLING, REF NODE=9000, SURFACE=NODES, CONSTRAINT NAME=C\n*KINEMATIC\n1, 3\n"


def distributing(deck):
    """A distributing coupling of the tip with a spring to its reference node."""
    nodes = "".join(f"{node}, 1.\n" for node in deck.ends["TIP"])
    mean = np.mean([deck.positions[node] for node in deck.ends["TIP"]], axis=0)
    text = "*NODE\n9000, " + ", ".join(f"{value:.12g}" for value in mean) + "\n*ELEMENT, TYPE=DCOUP3D, ELSET=MEAN\n9001, 9000\n"
    text += f"*DISTRIBUTING COUPLING, ELSET=MEAN\n{nodes}"
    return text + f"*ELEMENT, TYPE=SPRINGA, ELSET=SPRINGS\n9002, 9000, {deck.ends['ROOT'][0]}\n*SPRING, ELSET=SPRINGS\n\n25000.\n"


TWO = {"STEEL": STEEL, "ALUMINIUM": ALUMINIUM}
PURE = ("C3D4", "C3D6", "C3D8", "C3D8I", "C3D8R", "C3D10", "C3D10T", "C3D15", "C3D20", "C3D20R")
DECKS = {
    # In skewed elements the hourglass control of C3D8R resists rigid rotations, which flexbody refuses (FB410).
    **{kind: Deck([kind], straight=kind == "C3D8R") for kind in PURE},
    "bricks and wedges": Deck(["C3D8", "C3D6"]),
    "three linear bricks": Deck(["C3D8", "C3D8I", "C3D8R"], straight=True),
    "second order": Deck(["C3D20", "C3D15", "C3D10", "C3D20R"]),
    "all kinds": Deck(["C3D4", "C3D6", "C3D8", "C3D8I", "C3D8R", "C3D10", "C3D15", "C3D20", "C3D20R"], straight=True),
    "orthotropic": Deck(["C3D20R"], {"WOOD": WOOD}),
    "orthotropic, RECTANGULAR": Deck(["C3D8", "C3D10"], {"WOOD": WOOD}, "RECTANGULAR"),
    "orthotropic, CYLINDRICAL": Deck(["C3D20", "C3D8I"], {"WOOD": WOOD}, "CYLINDRICAL"),
    "orthotropic, CYLINDRICAL, reduced": Deck(["C3D8R", "C3D20R", "C3D6"], {"WOOD": WOOD}, "CYLINDRICAL", straight=True),
    "anisotropic": Deck(["C3D20", "C3D15"], {"CRYSTAL": CRYSTAL}),
    "anisotropic, RECTANGULAR": Deck(["C3D4", "C3D8"], {"CRYSTAL": CRYSTAL}, "RECTANGULAR"),
    "two materials": Deck(["C3D20"], TWO),
    "two materials, two kinds": Deck(["C3D8I", "C3D15", "C3D10"], TWO),
    "springs": Deck(["C3D8"], extra=springs),
    "*EQUATION": Deck(["C3D20R"], extra=equations),
    "*RIGID BODY": Deck(["C3D10"], extra=rigid_body),
    "*COUPLING, *KINEMATIC": Deck(["C3D8I"], extra=kinematic),
    "*DISTRIBUTING COUPLING": Deck(["C3D20"], extra=distributing),
}
