"""Geometric stiffness of the stresses that CalculiX computes, beside element code, for four kinds of elements, as built and turned in other units; a spinning blade beside CalculiX with large displacements."""

import subprocess
import sys

from common import ROOT, Row, program

sys.path.insert(0, str(ROOT / "scripts/pages"))


def rows(flexbody, folder):
    import make_geometric_stiffness as page

    ccx = program("ccx", "CCX", "Debian's calculix-ccx")
    version = "CalculiX " + subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout.split()[-1]
    found = []
    for kind, name, _, count, worst in page.rows_of_kinds(flexbody, ccx, folder):
        found.append(Row(version, kind, f"geometric stiffness of {count} loads beside element code, {name}", worst, 1e-6))
    blade = page.Blade(flexbody, ccx, folder / "blade")
    body, theirs = blade.body(), blade.spinning()
    found.append(Row(version, "C3D20", "frequencies of a spinning blade beside CalculiX with large displacements", float(abs(body / theirs - 1).max()), 7e-3))
    found.append(Row(version, "C3D20", "frequencies of a spinning blade beside all nodes", float(abs(body / blade.all_nodes() - 1).max()), 3e-4))
    found.append(Row(version, "C3D20", "compliance of a spinning blade beside CalculiX with large displacements", float(abs(blade.compliance("body.flex.h5") / blade.compliance_of_calculix() - 1)), 1e-2))
    plate = page.Plate(flexbody, ccx, folder / "plate")
    preloaded, _ = plate.body()
    found.append(Row(version, "C3D20", "frequencies of a plate with preload beside CalculiX with large displacements", float(abs(preloaded / plate.calculix() - 1).max()), 1e-3))
    return found
