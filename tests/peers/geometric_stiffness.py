"""Geometric stiffness of the stresses that CalculiX computes, beside element code, for four kinds of elements, as built and turned in other units; a spinning blade beside CalculiX with large displacements."""

import re
import subprocess
import sys

from common import ROOT, Row, program

sys.path.insert(0, str(ROOT / "evidence/programs"))


def rows(flexbody, folder):
    import make_geometric_stiffness as page

    ccx = program("ccx", "CCX", "Debian's calculix-ccx")
    version = "CalculiX " + subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    found = []
    for kind, name, _, count, worst, beside, _, deck in page.rows_of_kinds(flexbody, ccx, folder):
        found.append(Row(version, kind, f"geometric stiffness of {count} loads beside element code, {name}", worst, 1e-6))
        found.append(Row(version, kind, f"geometric stiffness from the deck beside that of stresses, {name}", float(beside), 1e-6))
        found.append(Row(version, kind, f"geometric stiffness from the deck beside element code, {name}", float(deck), 1e-9))
    for trap, is_taken in traps(flexbody, ccx, folder / "C3D8_m").items():
        found.append(Row(version, "C3D8", f"matrix of {trap} is taken (1: yes)", float(is_taken), 0.0))
    blade = page.Blade(flexbody, ccx, folder / "blade")
    body, theirs = blade.body(), blade.spinning()
    found.append(Row(version, "C3D20", "frequencies of a spinning blade beside CalculiX with large displacements", float(abs(body / theirs - 1).max()), 7e-3))
    found.append(Row(version, "C3D20", "frequencies of a spinning blade beside all nodes", float(abs(body / blade.all_nodes() - 1).max()), 3e-4))
    found.append(Row(version, "C3D20", "compliance of a spinning blade beside CalculiX with large displacements", float(abs(blade.compliance("body.flex.h5") / blade.compliance_of_calculix() - 1)), 1e-2))
    plate = page.Plate(flexbody, ccx, folder / "plate")
    preloaded, _ = plate.body()
    found.append(Row(version, "C3D20", "frequencies of a plate with preload beside CalculiX with large displacements", float(abs(preloaded / plate.calculix() - 1).max()), 1e-3))
    return found


def traps(flexbody, ccx, folder):
    """Whether matrices that are not K and the stress stiffness alone are taken: by name of the mistake."""
    deck, ask = (folder / "stiff_03.inp").read_text(), (folder / "stiff.inp").read_text()
    table = (folder / "stiff.toml").read_text().split("[[geometric_stiffness]]")[3]
    size = re.search(r"load_size = (\S+)", table).group(1)
    step = ask[ask.index("** step 3:") : ask.index("** step 4:")]
    displaced = ask[: ask.index("** step 1:")] + step[: step.index("*NODE PRINT")] + "*END STEP\n" + deck[deck.index("*STEP, PERTURBATION") :]
    active = f"FLEXBODY_ALL, 1, 3\n*DLOAD\nEALL, CENTRIF, {size}, 0., 0., 0., 0., 0., 1.\n"
    cases = {
        "a step without PERTURBATION": ("plain", deck.replace("*STEP, PERTURBATION", "*STEP"), size, "FB452"),
        "an active centrifugal load": ("active", deck.replace("FLEXBODY_ALL, 1, 3\n", active), size, "softening of a centrifugal load"),
        "displacements instead of initial stresses": ("displaced", displaced, re.search(r"step 3: (\S+) times", ask).group(1), "FB440"),
    }
    taken = {}
    for name, (job, text, load, wanted) in cases.items():
        (folder / f"{job}.inp").write_text(text)
        subprocess.run([ccx, "-i", job], cwd=folder, check=True, capture_output=True)
        manifest = (folder / "model.toml").read_text() + f'[[geometric_stiffness]]\nwith_stress = "{job}.sti"\nload_size = {load}\nspin = "zz"\n'
        (folder / f"{job}.toml").write_text(manifest)
        done = subprocess.run([flexbody, "convert", f"{job}.toml", "--modes", "6", "--quiet", "-o", "wrong.h5"], cwd=folder, capture_output=True, text=True)
        taken[name] = done.returncode == 0 or wanted not in done.stderr
    return taken
