#!/usr/bin/env python3
"""Elements of decks that K proves, broken decks that it refuses, and stresses at nodes beside CalculiX: writes evidence/pages/elements.md.

    apt install calculix-ccx calculix-ccx-test; pip install numpy scipy h5py
    cargo build --release --locked
    python3 evidence/programs/make_element_proof.py [--public FOLDER] [--others FOLDER]

FOLDER: the public decks of CalculiX (default: where Debian's calculix-ccx-test puts them), and decks of any program with their matrices
beside them. Decks are read where they lie. Without these folders the page does not have them.
"""

import argparse
import copy
import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import scipy.sparse as sp

from element_decks import DECKS, PURE, TWO, WOOD, Deck, count_of, equations, springs
from geometric_elements import Element, run
from make_recovery import stresses as written_stresses

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/peers"))
from public_decks import INSTALLED, MOST_ROWS, free_deck, run_quietly  # noqa: E402

# Options that need the elements.
ASK = ["--geometric-stiffness", "spin", "--lumped", "none", "--modes", "4", "--threads", "1", "--json"]
# Kinds whose stiffness the element code of this page computes.
IN_NUMPY = ("C3D4", "C3D8", "C3D10", "C3D20", "C3D20R")
HEAD = """<!-- Written by evidence/programs/make_element_proof.py -->

# Elements that K proves

Written by `./scripts/make.sh pages element_proof` with CalculiX {calculix}. `flexbody convert` takes the [elements of a deck](../../docs/reference/input.md#elements) for stress and its stiffness only if their sum is K, entry by entry, within 1e-9 of the
smaller sum of row and column or the digits of the file. Proved: `--geometric-stiffness spin` gives a body.

## Decks by kind of element

A deck counts for each kind in it. Fixtures: the models with a deck and the small jobs of Abaqus, CalculiX and Nastran in `fixtures/`. Own: the next section. Public: the test suite of CalculiX (Debian's calculix-ccx-test), free, with densities added where there are none (`tests/peers/public_decks.py`). Others: two decks of
Abaqus from the test data of Exudyn and a beam of CalculiX.

"""
OWN = """
## Own decks

A block of 3 x 2 x 2 cells in mm, tonne, s, twisted and tapered, or a box where C3D8R is among its kinds (the hourglass control of CalculiX resists rotations of skewed elements, which flexbody refuses, FB410). Kinds and materials change from cell to cell.
The last column is the largest difference of K from element code in numpy, relative to the smaller sum of row and column, for the kinds that it has.

| deck | elements | rows of K | outcome | numpy less K |
|---|---|---|---|---|
"""
BROKEN = """
## Broken decks

K of the first deck, elements of the second one. Each refusal is FB462.

| change | outcome |
|---|---|
"""
STRESSES = """
## Stresses at nodes

`--stress nodes` of a body with 6 modes and two interfaces, beside stresses that CalculiX writes as 64-bit numbers. Static load: opposite forces at both interfaces with the couple that balances them, beside `*STATIC` with six supports that carry nothing; stresses of modes and static columns added up. Shapes: every mode and every static
column of unit loads and spin beside the [answers of CalculiX to the same displacements](../../docs/how_to/stresses_from_calculix.md), two recoveries of one body. The difference is the largest of any stress, relative to the largest of the load case or column.

| model | kinds | nodes | static load | shapes: modes | shapes: static columns |
|---|---|---|---|---|---|
"""
TAIL = """
* CalculiX extrapolates from 2 x 2 x 2 and 3 x 3 x 3 points with factors of three to six digits, flexbody with exact ones: that is the difference of all elements with several points. C3D4 and C3D8R, which have one, agree to the digits of the answers.
* Of C3D6 CalculiX 2.20 writes the stresses of the lower triangle at nodes 1, 3 and 5 and those of the upper one at 2, 4 and 6; flexbody gives each node that of its own triangle. Of C3D6 no stress at nodes agrees for this reason.
* Without shapes: the displacements of all nodes do not state those of the internal nodes of C3D8I, which have a mass of their own in CalculiX and a part in each mode; and C3D8R has hourglass motions, which `flexbody shapes` refuses (FB445).
"""
# Kinds whose shapes are not compared.
WITHOUT_SHAPES = ("C3D8I", "C3D8R")


class Outcome:
    """What convert made of a deck: proved, refused with reasons (FB462), or another error before the elements were needed."""

    def __init__(self, flexbody, folder, source, *options, seconds=240):
        words = [flexbody, "convert", source, *options, *ASK, "-o", "proof.flex.h5"]
        done = run_quietly(words, folder, seconds)
        (folder / "proof.flex.h5").unlink(missing_ok=True)
        self.reasons, self.other = [], "time" if done is None else None
        if done is not None and done.returncode != 0:
            errors = [one for one in json.loads(done.stdout)["diagnostics"] if one["severity"] == "error"]
            self.reasons = [one["message"] for one in errors if one["code"] == "FB462"]
            self.other = None if self.reasons else f"{errors[0]['code']}: {errors[0]['message']}"
        self.proved = not self.reasons and self.other is None

    def __str__(self):
        return "proved" if self.proved else "; ".join(self.reasons) or self.other


def kinds_of(text):
    """Kinds of elements in a deck of keywords or of Nastran."""
    keywords = re.findall(r"^\*ELEMENT\b[^\n]*?TYPE\s*=\s*([A-Z0-9]+)", text.upper(), re.MULTILINE)
    cards = re.findall(r"^(CHEXA|CPENTA|CTETRA)\b", text, re.MULTILINE)
    return sorted(set(keywords + cards))


def fixtures(flexbody, folder):
    """Name, kinds and outcome of each deck of the fixtures."""
    for model in sorted((ROOT / "fixtures/models").glob("*/matrices.inp.gz")):
        place = folder / model.parent.name
        shutil.copytree(model.parent, place)
        with (place / "model.toml").open("a") as manifest:
            manifest.write('\n[[elements]]\nfile = "matrices.inp.gz"\n')
        yield model.parent.name, kinds_of(gzip.decompress(model.read_bytes()).decode()), Outcome(flexbody, place, "model.toml")
    for small in sorted((ROOT / "fixtures/small").iterdir()):
        for job in sorted([*small.glob("job.inp"), *small.glob("s[48].inp"), *small.glob("job.bdf")]):
            place = folder / "small" / small.name
            shutil.copytree(small, place, dirs_exist_ok=True)
            text = job.read_text()
            if "grids.bdf" in text:
                text += (small / "grids.bdf").read_text()
            yield f"{small.name}/{job.name}", kinds_of(text), Outcome(flexbody, place, job.name, "--units", "m,kg,s")


def others(flexbody, folder, source):
    """The same of decks with their matrices beside them."""
    for job in sorted([*source.rglob("*.inp"), *source.rglob("*.bdf")]):
        place = folder / job.parent.name
        shutil.copytree(job.parent, place, dirs_exist_ok=True)
        yield job.name, kinds_of(job.read_text()), Outcome(flexbody, place, job.name, "--units", "m,kg,s", "--allow-implausible")


def public(flexbody, ccx, source):
    """The same of the public decks of CalculiX that give matrices."""
    decks = sorted({path.name.removesuffix(".gz"): path for path in source.glob("*.inp*") if path.suffix in (".inp", ".gz")}.values())

    def one(path):
        text = (gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()).decode("latin-1")
        deck = free_deck(text)
        if deck is None:
            return None
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            (folder / "job.inp").write_text(deck, encoding="latin-1")
            run_quietly([ccx, "-i", "job"], folder)
            written = [folder / f"job.{ending}" for ending in ("sti", "mas", "dof")]
            if not all(path.is_file() and path.stat().st_size for path in written) or len(written[2].read_text().split()) > MOST_ROWS:
                return None
            return path.name.split(".")[0], kinds_of(deck), Outcome(flexbody, folder, "job.inp", "--units", "m,kg,s", "--allow-implausible")

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return [found for found in pool.map(one, decks) if found]


def written(ccx, folder, deck):
    """Runs the job of a deck."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "job.inp").write_text(deck.job())
    run(ccx, "-i", "job", cwd=folder)
    return len((folder / "job.dof").read_text().split())


def beside_numpy(folder, deck):
    """Largest difference of K from element code, relative to the smaller sum of row and column."""
    labels = [line.strip() for line in (folder / "job.dof").read_text().split()]
    place = {label: at for at, label in enumerate(labels)}
    table = np.loadtxt(folder / "job.sti")
    i, j = table[:, 0].astype(int) - 1, table[:, 1].astype(int) - 1
    lower = sp.coo_matrix((table[:, 2], (i, j)), shape=(len(labels),) * 2).tocsr()
    k = (lower + lower.T - sp.diags(lower.diagonal())).toarray()
    left = k.copy()
    for kind, _, nodes in deck.elements:
        x = np.array([deck.positions[node] for node in nodes])
        rows = [place[f"{node}.{d}"] for node in nodes for d in (1, 2, 3)]
        left[np.ix_(rows, rows)] -= Element(kind).stiffness(x, 210000.0, 0.3)
    sums = abs(k).sum(axis=1)
    return (abs(left) / np.minimum(sums[:, None], sums[None, :])).max()


def changed(deck, change):
    """A deck after a change."""
    other = copy.deepcopy(deck)
    change(other)
    return other


def of_material(name, elasticity, members):
    """Change: the elements `members` have another material."""

    def change(deck):
        deck.materials = {**deck.materials, name: (elasticity, 7.85e-9)}
        for at in members:
            deck.elements[at][1] = name

    return change


def exchanged(element, a, b):
    """Change: two nodes of an element stand in each other's place."""

    def change(deck):
        nodes = deck.elements[element][2]
        nodes[a], nodes[b] = nodes[b], nodes[a]

    return change


def moved(node, by):
    """Change: a node lies elsewhere."""

    def change(deck):
        at = list(deck.positions)[node]
        deck.positions[at] = deck.positions[at] + by

    return change


def swapped(deck):
    """Change: each material has the constants of the other."""
    (a, of_a), (b, of_b) = deck.materials.items()
    deck.materials = {a: of_b, b: of_a}


def with_value(**values):
    """Change: attributes of the deck have other values."""
    return lambda deck: deck.__dict__.update(values)


def of_kind(kind):
    """Change: all elements have another type."""

    def change(deck):
        deck.elements = [[kind, material, nodes] for _, material, nodes in deck.elements]

    return change


def changes():
    """Description, deck, and change."""
    bricks, layered, wooden, sprung, tied = Deck(["C3D20"]), Deck(["C3D20"], TWO), Deck(["C3D20R"], {"WOOD": WOOD}, "RECTANGULAR"), Deck(["C3D8"], extra=springs), Deck(["C3D20R"], extra=equations)
    young = lambda factor: f"*ELASTIC\n{210000 * (1 + factor):.12g}, 0.3"
    yield "none", bricks, lambda deck: None
    for factor in (1e-10, 1e-8, 1e-6):
        yield f"E of element 5 larger by {factor:.0e}", bricks, of_material("HARDER", young(factor), [4])
    yield "nu 0.3001 in place of 0.3", bricks, with_value(materials={"STEEL": ("*ELASTIC\n210000., 0.3001", 7.85e-9)})
    yield "E in Pa in place of MPa", bricks, with_value(materials={"STEEL": ("*ELASTIC\n2.1e11, 0.3", 7.85e-9)})
    yield "element 5 missing", bricks, lambda deck: deck.elements.pop(4)
    yield "nodes 1 and 2 of element 5 exchanged", bricks, exchanged(4, 0, 1)
    yield "nodes 9 and 10 of element 5 exchanged", bricks, exchanged(4, 8, 9)
    yield "nodes 9 and 17 of element 5 exchanged", bricks, exchanged(4, 8, 16)
    yield "nodes 13 to 16 of all elements before 17 to 20 (order of Nastran)", bricks, lambda deck: [nodes.__setitem__(slice(12, 20), nodes[16:20] + nodes[12:16]) for _, _, nodes in deck.elements]
    yield "a node moved by 1e-6 mm", bricks, moved(20, np.array([1e-6, 0.0, 0.0]))
    yield "a node moved by 0.01 mm", bricks, moved(20, np.array([0.01, 0.0, 0.0]))
    yield "another mesh: 2 x 2 x 2 cells", bricks, lambda deck: deck.__dict__.update(Deck(["C3D20"], cells=(2, 2, 2)).__dict__)
    yield "C3D20R in place of C3D20", bricks, of_kind("C3D20R")
    yield "steel and aluminium swapped", layered, swapped
    yield "element 4 of steel in place of aluminium", layered, lambda deck: deck.elements[3].__setitem__(1, "STEEL")
    yield "orientation missing", wooden, with_value(axes=None)
    yield "springs missing", sprung, with_value(extra=lambda deck: "")
    yield "a spring of 25000.1 in place of 25000 N/mm", sprung, with_value(extra=lambda deck: springs(deck).replace("25000.", "25000.1"))
    yield "*EQUATION missing", tied, with_value(extra=lambda deck: re.sub(r"\*EQUATION\n(.*\n){6}", "", equations(deck)))


def broken(flexbody, ccx, folder):
    """Description of each change and its outcome."""
    for at, (what, deck, change) in enumerate(changes()):
        place = folder / str(at)
        written(ccx, place, deck)
        (place / "changed.inp").write_text(changed(deck, change).job())
        (place / "model.toml").write_text(f'{UNITS}[files]\njob = "job.inp"\n[[elements]]\nfile = "changed.inp"\n')
        yield what, Outcome(flexbody, place, "model.toml")


UNITS = '[model]\nname = "block"\n[model.units]\nlength = "mm"\nmass = "tonne"\ntime = "s"\n'


def stresses(flexbody, ccx, folder):
    """Name, kinds, nodes, and the largest differences under a static load, and of the shapes of modes and of static columns."""
    for name in [*PURE, "three linear bricks", "second order", "orthotropic", "orthotropic, CYLINDRICAL", "anisotropic"]:
        deck, place = DECKS[name], folder / re.sub(r"\W+", "_", name)
        written(ccx, place, deck)
        manifest = UNITS + '[files]\njob = "job.inp"\n'
        for end, nodes in deck.ends.items():
            reference = np.mean([deck.positions[node] for node in nodes], axis=0)
            manifest += f'[[interface]]\nname = "{end}"\nset = "{end}"\ncoupling = "averaging"\nreference = {reference.tolist()}\n'
        yield name, deck.count(), *Stressed(flexbody, ccx, place, manifest, "job.inp", deck.count()).differences()
    for model in ("bracket_hex20", "connecting_rod"):
        place = folder / model
        shutil.copytree(ROOT / "fixtures/models" / model, place)
        text = gzip.decompress((place / "matrices.inp.gz").read_bytes()).decode()
        (place / "part.inp").write_text(text)
        manifest = (place / "model.toml").read_text() + '\n[[elements]]\nfile = "part.inp"\n'
        kinds = kinds_of(text)
        yield model, kinds, *Stressed(flexbody, ccx, place, manifest, "part.inp", kinds).differences()


class Stressed:
    """A body with stresses at nodes by its elements, and by the answers of CalculiX to its shapes."""

    def __init__(self, flexbody, ccx, place, manifest, deck, kinds):
        self.ccx, self.place, self.deck = ccx, place, deck
        self.shaped = not set(kinds) & set(WITHOUT_SHAPES)
        options = ["--modes", 6, "--frame", "com", "--lumped", "none", "--quiet"]
        (place / "model.toml").write_text(manifest)
        more = '\n[[recovery]]\nname = "deck"\nstress = "nodes"\n'
        if self.shaped:
            run(flexbody, "convert", "model.toml", *options, "-o", "plain.flex.h5", cwd=place)
            run(flexbody, "shapes", "plain.flex.h5", "--model", "model.toml", "--deck", deck, "--nodes", "all", "-o", "ask.inp", cwd=place)
            run(ccx, "-i", "ask", cwd=place)
            more += '[[recovery]]\nname = "calculix"\nshapes = "ask.frd"\n'
        (place / "model.toml").write_text(manifest + more)
        run(flexbody, "convert", "model.toml", *options, "-o", "body.flex.h5", cwd=place)

    def differences(self):
        """Number of nodes; differences of the static load, and of modes and static columns, as texts."""
        with h5py.File(self.place / "body.flex.h5") as file:
            own = file["recovery/deck"]
            rows = self.rows(own)
            static = self.static(file, own, rows[::6])
            shaped = list(self.beside_shapes(own, file["recovery/calculix"])) if self.shaped else []
        return len(rows) // 6, f"{static:.1e}", *(f"{value:.1e}" for value in shaped), *([] if shaped else ["", ""])

    @staticmethod
    def rows(recovery):
        return [(row["node"], row["component"]) for row in json.loads(recovery.attrs["rows"])]

    def beside_shapes(self, own, theirs):
        order = {row: at for at, row in enumerate(self.rows(theirs))}
        at = [order[row] for row in self.rows(own)]
        columns = lambda one: (one["modes"][()], np.hstack([one["spin"][()], *one["loads"][()]]))
        for mine, wanted in zip(columns(own), columns(theirs), strict=True):
            wanted = wanted[at]
            largest = abs(wanted).max(axis=0)
            yield (abs(mine - wanted).max(axis=0) / largest)[largest > 0].max()

    def static(self, file, own, nodes):
        """Difference under opposite forces, with the couple that balances them."""
        ids, x, shape = file["nodes/id"][()].tolist(), file["nodes/position"][()], file["modes/shape"][()]
        axes, origin = file["frame/axes"][()], file["frame/origin"][()]
        names = json.loads(own.attrs["loaded_interfaces"])
        force, nodal, y = np.array([1.0, -2.0, 3.0]), np.zeros_like(x), 0.0
        ends = [file["interfaces"][name] for name in names[:2]]
        at = [end["reference"][()] for end in ends]
        loads = [np.concatenate([force, np.zeros(3)]), np.concatenate([-force, -np.cross(at[0] - at[1], force)])]
        for end, place, load, columns in zip(ends, at, loads, own["loads"][()][:2]):
            members = [ids.index(node) for node in end["node_id"][()]]
            rigid = np.vstack([np.hstack([np.eye(3), np.cross(np.eye(3), r).T]) for r in x[members] - place])
            nodal[members] += (rigid @ np.linalg.solve(rigid.T @ rigid, load)).reshape(-1, 3)
            y = y + columns @ load
        q = np.linalg.solve(file["invariants/modal_stiffness"][()], np.einsum("jnk,nk->j", shape, nodal))
        mine = (y + own["modes"][()] @ q).reshape(-1, 6)
        # Rows are along the axes of the model, loads along those of the body.
        nodal = nodal @ axes.T
        text = (self.place / self.deck).read_text().split("*STEP")[0]
        supports = "".join(f"{ids[row // 3]}, {row % 3 + 1}, {row % 3 + 1}\n" for row in pivots(x @ axes.T + origin))
        loads = "".join(f"{ids[n]}, {k + 1}, {nodal[n, k]:.13e}\n" for n in range(len(ids)) for k in range(3) if nodal[n, k])
        step = f"*STEP\n*STATIC, SOLVER=SPOOLES\n*CLOAD\n{loads}*NODE OUTPUT, DOUBLE\nU\n*ELEMENT OUTPUT, DOUBLE\nS\n*END STEP\n"
        (self.place / "static.inp").write_text(f"{text}*BOUNDARY\n{supports}{step}")
        run(self.ccx, "-i", "static", cwd=self.place)
        found, theirs = written_stresses(self.place / "static.frd")
        order = {node: at for at, node in enumerate(found)}
        theirs = theirs[[order[node] for node, _ in nodes]]
        return abs(mine - theirs).max() / abs(theirs).max()


def pivots(x):
    """Six degrees of freedom (three for each node) that hold a body as far from each other as possible."""
    left = np.vstack([np.hstack([np.eye(3), np.cross(np.eye(3), r).T]) for r in (x - x.mean(axis=0)) / abs(x - x.mean(axis=0)).max()])
    rows = []
    for _ in range(6):
        rows.append(int((left**2).sum(axis=1).argmax()))
        pivot = left[rows[-1]] / np.linalg.norm(left[rows[-1]])
        left = left - np.outer(left @ pivot, pivot)
    return rows


def by_kind(sources):
    """Table of the proved and the other decks of each kind; and the reasons of the others."""
    names = list(sources)
    kinds = sorted({kind for found in sources.values() for _, kinds, _ in found for kind in kinds}, key=lambda kind: (kind[:3] != "C3D", count_of(kind) if kind.startswith("C3D") else 0, kind))
    proved = {name: [kinds for _, kinds, outcome in found if outcome.proved] for name, found in sources.items()}
    out = f"| kind | {' | '.join(names)} | all |\n|---|{'---|' * (len(names) + 1)}\n"
    for kind in kinds:
        counts = [sum(kind in kinds for kinds in proved[name]) for name in names]
        if sum(counts) and kind.startswith("C"):
            out += f"| {kind} | {' | '.join(map(str, counts))} | {sum(counts)} |\n"
    totals = [len(proved[name]) for name in names]
    out += f"| decks proved | {' | '.join(map(str, totals))} | {sum(totals)} |\n"
    refused = [sum(bool(outcome.reasons) for _, _, outcome in sources[name]) for name in names]
    out += f"| refused, FB462 | {' | '.join(map(str, refused))} | {sum(refused)} |\n"
    before = [sum(outcome.other is not None for _, _, outcome in sources[name]) for name in names]
    out += f"| refused for another reason | {' | '.join(map(str, before))} | {sum(before)} |\n"
    reasons = Counter(shortened(outcome.reasons[0]) for found in sources.values() for _, _, outcome in found if outcome.reasons)
    out += "\nReasons of FB462: " + "; ".join(f"{text} ({count})" for text, count in reasons.most_common()) + ".\n"
    codes = Counter(outcome.other.split(":")[0] for found in sources.values() for _, _, outcome in found if outcome.other)
    return out + "Other reasons, before elements are needed (several bodies, missing rows, plane elements and others): " + ", ".join(f"{count} {code}" for code, count in codes.most_common()) + ".\n"


def shortened(reason):
    """A reason without numbers, types and names of materials."""
    return re.sub(r"^\d+ elements? of type (\w+)(: material `[^`]*`)?", r"elements of type \1", reason)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--program", default=os.environ.get("FLEXBODY", ROOT / "target/release/flexbody"), type=Path)
    options.add_argument("--output", default=ROOT / "evidence/pages/elements.md", type=Path)
    options.add_argument("--public", default=INSTALLED, type=Path)
    options.add_argument("--others", type=Path)
    chosen = options.parse_args()
    flexbody = chosen.program.resolve()
    ccx = shutil.which(os.environ.get("CCX", "ccx")) or sys.exit("CalculiX (ccx) is not found: apt install calculix-ccx")
    version = subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    with tempfile.TemporaryDirectory() as folder:
        chosen.output.write_text(page(flexbody, ccx, Path(folder), chosen).replace("{calculix}", version))


def page(flexbody, ccx, folder, chosen):
    own, table = [], OWN
    for at, (name, deck) in enumerate(DECKS.items()):
        place = folder / f"own{at}"
        rows = written(ccx, place, deck)
        outcome = Outcome(flexbody, place, "job.inp", "--units", "mm,t,s")
        own.append((name, list(deck.count()), outcome))
        difference = f"{beside_numpy(place, deck):.1e}" if name in IN_NUMPY else ""
        count = ", ".join(f"{count} {kind}" for kind, count in deck.count().items())
        table += f"| {name} | {count} | {rows} | {outcome} | {difference} |\n"
    sources = {"fixtures": list(fixtures(flexbody, folder / "fixtures")), "own": own}
    if chosen.public.is_dir():
        sources["public"] = public(flexbody, ccx, chosen.public)
    if chosen.others:
        sources["others"] = list(others(flexbody, folder / "others", chosen.others))
    out = HEAD + by_kind(sources) + table + BROKEN
    for what, outcome in broken(flexbody, ccx, folder / "broken"):
        out += f"| {what} | {str(outcome)} |\n"
    out += STRESSES
    for name, kinds, nodes, static, modes, columns in stresses(flexbody, ccx, folder / "stresses"):
        out += f"| {name} | {', '.join(kinds)} | {nodes} | {static} | {modes} | {columns} |\n"
    return out + TAIL


if __name__ == "__main__":
    main()
