"""Stresses that CalculiX computes for the shapes of a body, beside its static runs of all nodes; the forms of its results; another material, which has to be refused."""

import json
import subprocess
import sys

from common import ROOT, Row, program

sys.path.insert(0, str(ROOT / "evidence/programs"))

# Largest difference of a component, relative to the largest, by the digits of the results.
LIMITS = {15: 1e-9, 7: 2e-6, 6: 2e-5}


def rows(flexbody, folder):
    import make_recovery

    ccx = program("ccx", "CCX", "Debian's calculix-ccx")
    version = "CalculiX " + subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    found = []
    for digits, limit in LIMITS.items():
        case = make_recovery.Case(flexbody, ccx, "bracket_hex20", 10, folder / f"bracket_{digits}", digits)
        centrif, _ = case.spinning()
        found.append(Row(version, "C3D20", f"stresses under spin from results of {digits} digits", centrif[1], limit))
        first, second = list(case.loads)[:2]
        found.append(Row(version, "C3D20", f"stresses under a balanced load from results of {digits} digits", case.loaded(first, second)[1], limit))
    found.append(Row(version, "C3D20", "recovery from its own modes and static columns, beside that of our modes", own_modes(flexbody, ccx, folder), 1e-5))
    found.append(Row(version, "C3D20", "results with another modulus are taken (1: yes)", float(foreign(flexbody, ccx, folder)), 0.0))
    found.append(Row(version, "C3D8", "averaged stresses of two materials without a warning (1: yes)", float(two_materials(flexbody, ccx, folder)), 0.0))
    return found


def own_modes(flexbody, ccx, folder):
    """Largest difference of the stresses in the modes when the modes of CalculiX replace ours among the shapes."""
    import h5py
    import numpy as np

    place = folder / "bracket_15"
    deck = (place / "ask.inp").read_text()
    # Six rigid and ten flexible modes, then the static columns of our deck.
    output = "*NODE OUTPUT, DOUBLE\nU\n*ELEMENT OUTPUT, DOUBLE\nS, NOE\n"
    modes = f"*STEP\n*FREQUENCY\n16\n{output}*END STEP\n"
    steps = deck[deck.index("** step 11") :]
    (place / "own.inp").write_text(deck[: deck.index("** step 1:")] + modes + steps.replace("NSET=FLEXBODY_WATCHED, ", ""))
    subprocess.run([ccx, "-i", "own"], cwd=place, check=True, capture_output=True)
    manifest = (place / "model.toml").read_text().replace('"ask.frd"', '"own.frd"\ndisplacements = "own.frd"')
    (place / "own.toml").write_text(manifest)
    options = ["--modes", "10", "--frame", "com", "--lumped", "none", "--quiet"]
    subprocess.run([flexbody, "convert", "own.toml", *options, "-o", "own.h5"], cwd=place, check=True, capture_output=True)
    with h5py.File(place / "own.h5") as own, h5py.File(place / "body.flex.h5") as ours:
        # The files have their nodes in orders of their own.
        named = [dict(zip([row["name"] for row in json.loads(body["recovery/all"].attrs["rows"])], body["recovery/all/modes"][()])) for body in (ours, own)]
        ours, own = (np.array([one[name] for name in named[0]]) for one in named)
    return float(abs(own - ours).max() / abs(ours).max())


def foreign(flexbody, ccx, folder):
    """Whether stresses of a modulus that is 0.1 % larger are taken."""
    place = folder / "bracket_15"
    deck = (place / "ask.inp").read_text()
    (place / "ask.inp").write_text(deck.replace("210000, 0.3", "210210, 0.3"))
    subprocess.run([ccx, "-i", "ask"], cwd=place, check=True, capture_output=True)
    done = subprocess.run([flexbody, "convert", "model.toml", "--modes", "10", "-o", "foreign.h5"], cwd=place, capture_output=True, text=True)
    return done.returncode == 0 or "FB446" not in done.stderr


def two_materials(flexbody, ccx, folder):
    """A bar of two materials: the nodes between them are named, and the integration points differ from their means."""
    place = folder / "bar"
    place.mkdir()
    nodes = {1 + i + 5 * (j + 2 * k): (0.1 * i, 0.1 * j, 0.1 * k) for k in range(2) for j in range(2) for i in range(5)}
    lines = ["*NODE"] + [f"{at}, {x:.3f}, {y:.3f}, {z:.3f}" for at, (x, y, z) in nodes.items()]
    for name, cells in (("STEEL", (0, 1)), ("ALUMINIUM", (2, 3))):
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
        for i in cells:
            own = [1 + i, 2 + i, 7 + i, 6 + i]
            lines.append(", ".join(str(word) for word in [i + 1, *own, *(at + 10 for at in own)]))
    for name, modulus, density in (("STEEL", 2.1e11, 7850), ("ALUMINIUM", 0.7e11, 2700)):
        lines += [f"*MATERIAL, NAME={name}", "*ELASTIC", f"{modulus}, 0.3", "*DENSITY", f"{density}.", f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    lines += ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "4", "*END STEP", ""]
    (place / "bar.inp").write_text("\n".join(lines))
    subprocess.run([ccx, "-i", "bar"], cwd=place, check=True, capture_output=True)
    manifest = '[model]\nname = "bar"\n[model.units]\nlength = "m"\nmass = "kg"\ntime = "s"\n[files]\njob = "bar.inp"\n'
    (place / "model.toml").write_text(manifest)
    words = ["--modes", "4", "--lumped", "none"]
    run = lambda *line: subprocess.run([flexbody, *map(str, line)], cwd=place, check=True, capture_output=True, text=True)
    run("convert", "model.toml", *words, "-o", "plain.h5")
    for at, ending in (("nodes", "frd"), ("integration-points", "dat")):
        run("shapes", "plain.h5", "--model", "model.toml", "--at", at, "-o", f"{at}.inp")
        subprocess.run([ccx, "-i", at], cwd=place, check=True, capture_output=True)
        (place / f"{at}.toml").write_text(manifest + f'[[recovery]]\nname = "stress"\nshapes = "{at}.{ending}"\n')
    warned = {at: "FB448" in run("convert", f"{at}.toml", *words, "-o", f"{at}.h5").stderr for at in ("nodes", "integration-points")}
    return not warned["nodes"] or warned["integration-points"]
