#!/usr/bin/env python3
"""Exports in the programs that they are for, and jobs of FE programs beside their own results, in tables: installs what it can, runs what there is, and says what was not found.

    python3 tests/peers/suite.py --install --write

installs Exudyn, welib, open FE codes, h5py, scipy and readers of pictures by pip and npm into target/peers, Octave, GetFEM, FEniCSx, CalculiX, SLEPc and an ARM compiler by apt-get (as root; else it says the command), runs every
peer with target/release/flexbody and writes the tables of evidence/pages/ and that of docs/reference/formats/embedded.md. Some minutes. Without options it runs what is
installed and prints. Programs that are in no package archive are found by environment variables: MBDYN (the program, where it is not on the PATH), PYMBS,
FEMBEAM, EMBSLIB (folders of their sources). Exits with 1 when a number is worse than its limit; what is not found is said and fails nothing.

`--small` takes those peers that need seconds (CI runs it); `--only equations` those with this word in their name: the equations of each target, evaluated from its file, beside those of
all nodes (target_equations/). `--all` also runs craig_bampton.py and mechanisms.py, which write files of their own.
"""

import argparse
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import common
from common import ROOT, Absent, Row

VENV = ROOT / "target/peers"
PIP = ["exudyn==1.13.6", "pyyeti==1.4.7", "pyNastran==1.4.1", "abaqus-mtx-parser==1.1.4", "welib==4.2.0", "h5py", "numpy", "scipy", "scikit-fem==12.0.2", "ngsolve==6.2.2608", "mfem==4.10.0.1", "pyvista", "meshio", "trimesh", "pygltflib"]
NPM = ["gltf-validator@2.0.0-dev.3.10"]
APT = ["octave", "g++", "gcc-arm-none-eabi", "libnewlib-arm-none-eabi", "calculix-ccx"]
# Public decks (GPL), read where they lie.
APT_DECKS = ["calculix-ccx-test"]
# Packages of modules for Debian's own Python.
APT_MODULES = {"python3-getfem": "getfem", "python3-dolfinx-real": "dolfinx"}
# Debian keeps these where its Python does not look by itself.
APT_CLUSTER = ["python3-petsc4py-real", "python3-slepc4py-real"]


def other_libraries(flexbody, folder):
    """json, npz, Simscape and Chrono with the libraries of Python."""
    import h5py
    import read_exports
    import scipy

    path = common.body(flexbody, "bracket_hex20", folder / "cb.flex.h5", "--basis", "craig-bampton", "--modes", 6)
    read_exports.main(str(flexbody), str(path))
    program = f"h5py {h5py.__version__}, scipy {scipy.__version__}"
    return [Row(program, "json, npz, simscape, chrono", "every array is that of the body, rigid motion has its inertia (1: no)", 0.0, 0.0)]


def arm_table(flexbody, folder):
    import compilers

    text = compilers.arm(flexbody, folder)
    print(text)
    TABLES["docs/reference/formats/embedded.md", "arm"] = text
    return []


def equations(flexbody, folder):
    """Equations of the target beside those of all nodes; with `--small` of two bodies, and no table."""
    from target_equations import table as of_targets

    found, absent, refusals = of_targets.run(flexbody, folder, quick=OPTIONS["small"])
    if not OPTIONS["small"]:
        TABLES["evidence/pages/exports.md", "target equations"] = of_targets.text(found, absent, refusals)
    return of_targets.rows(found, refusals)


def equations_can_fail(flexbody, folder):
    """Every array of every format changed: some check of its equations must fail."""
    from target_equations import selftest

    missed, made = selftest.run(flexbody, folder)
    print(f"  {made} changes, not found: {', '.join(missed) or 'none'}")
    return [Row("all nodes", "all", "equations of the target: changed arrays that no check finds", float(len(missed)), 0.0)]


OPTIONS = {"small": False}
# Pages and the marked places in them that `--write` fills.
TABLES = {}
# Those of the peers that have a table of their own.
PLACES = {
    "calculix.rows": ("evidence/pages/fe_programs.md", "calculix"),
    "calculix_stresses.rows": ("evidence/pages/fe_programs.md", "calculix stresses"),
    "public_decks.rows": ("evidence/pages/fe_programs.md", "public decks"),
    "nastran.rows": ("evidence/pages/fe_programs.md", "nastran"),
    "abaqus.rows": ("evidence/pages/fe_programs.md", "abaqus"),
    "open_codes.rows": ("evidence/pages/fe_programs.md", "recipes"),
    "cluster.rows": ("evidence/pages/cluster.md", "cluster"),
    "cluster.large": ("evidence/pages/cluster.md", "cluster-large"),
}
# Name, module and function, whether it needs seconds only.
PEERS = [
    ("Exudyn", "exudyn_bodies.rows", False),
    ("Exudyn, frames of beams and shells", "exudyn_frames.rows", False),
    ("Exudyn, the program beside the file", "exudyn_program.rows", True),
    ("MBDyn", "mbdyn.rows", False),
    ("Octave", "octave.simscape", True),
    ("FEMBeam in Octave", "octave.fembeam", True),
    ("pymbs", "pymbs_sid.rows", True),
    ("EMBSlib", "embs.rows", True),
    ("welib", "sid.rows", True),
    ("h5py, numpy, scipy", "suite.other_libraries", True),
    ("equations of the targets", "suite.equations", True),
    ("equations of the targets can fail", "suite.equations_can_fail", True),
    ("scipy's integrator", "scipy_spin.rows", True),
    ("compilers", "compilers.rows", True),
    ("ARM compiler", "suite.arm_table", True),
    ("VTK", "pictures.vtk", True),
    ("meshio", "pictures.meshio", True),
    ("trimesh, pygltflib", "pictures.gltf", True),
    ("validator of glTF", "pictures.validator", True),
    ("CalculiX", "calculix.rows", True),
    ("stresses of CalculiX", "calculix_stresses.rows", True),
    ("geometric stiffness of CalculiX", "geometric_stiffness.rows", True),
    ("public decks of CalculiX", "public_decks.rows", False),
    ("public decks of CalculiX, a part", "public_decks.some", True),
    ("open FE codes", "open_codes.rows", True),
    ("pyNastran, pyYeti", "nastran.rows", True),
    ("abaqus-mtx-parser", "abaqus.rows", True),
    ("SLEPc over MPI", "cluster.rows", True),
    ("SLEPc over MPI, large bodies", "cluster.large", False),
]


def measure(flexbody, small, only):
    """Rows of every peer that is here, and what is not; `only`: of those whose name has this word."""
    found, absent = [], []
    OPTIONS["small"] = small
    for name, where, quick in PEERS:
        if small and not quick or only not in name:
            continue
        print(f"{name}:", flush=True)
        module, function = where.split(".")
        with tempfile.TemporaryDirectory() as folder:
            try:
                run = globals()[function] if module == "suite" else getattr(importlib.import_module(module), function)
                rows = run(flexbody, Path(folder))
            except Absent as missing:
                absent.append(f"{name}: {missing}")
                print(f"  not found: {missing}: skipped")
                continue
            except ImportError as missing:
                absent.append(f"{name}: pip: {missing.name}")
                print(f"  not found: Python module {missing.name} (pip; --install): skipped")
                continue
            except (AssertionError, RuntimeError, ValueError, LookupError, OSError, subprocess.CalledProcessError) as error:
                print(f"  failed: {error!r}")
                said = getattr(error, "stderr", None) or b""
                print(said if isinstance(said, str) else said.decode(errors="replace"))
                rows = [Row(name, where, "runs (1: no)", 1.0, 0.0)]
        for row in rows:
            print(f"  {'good' if row.good() else 'BAD '} {row.found:8.1e} (limit {row.limit:.0e}) {row.what}", flush=True)
        if where in PLACES:
            TABLES[PLACES[where]] = table(rows, [])
        found += rows
    return found, absent


def table(rows, absent):
    lines = ["| program | format | compared | largest difference | limit |", "|---|---|---|---|---|"]
    lines += [f"| {row.program} | {row.format} | {row.what} | {row.found:.1e} | {row.limit:.0e} |" for row in rows]
    missing = f"\nNot at hand when this was written: {'; '.join(absent)}.\n" if absent else ""
    return "\n".join(lines) + "\n" + missing


def write(page, mark, text):
    """Replaces what stands between the marks of a page."""
    path = ROOT / page
    before, rest = path.read_text().split(f"<!-- {mark} -->\n", 1)
    _, after = rest.split(f"<!-- end of {mark} -->", 1)
    path.write_text(f"{before}<!-- {mark} -->\n{text}<!-- end of {mark} -->{after}")


def install():
    """A virtual environment with the modules, and the packages; goes on in that environment."""
    python = VENV / "bin/python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", VENV], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PIP], check=True)
    if shutil.which("npm"):
        subprocess.run(["npm", "install", "--silent", "--prefix", VENV, *NPM], check=False)
    missing = [name for name, tool in zip(APT, ["octave-cli", "g++", "arm-none-eabi-gcc", "arm-none-eabi-gcc", "ccx"]) if not shutil.which(tool)]
    debian = "/usr/bin/python3"
    missing += [name for name, module in APT_MODULES.items() if subprocess.run([debian, "-c", f"import {module}"], capture_output=True).returncode]
    if shutil.which("dpkg"):
        missing += [name for name in [*APT_CLUSTER, *APT_DECKS] if subprocess.run(["dpkg", "--status", name], capture_output=True).returncode]
    if missing:
        command = ["apt-get", "install", "--yes", "--no-install-recommends", *missing]
        if shutil.which("apt-get") and os.geteuid() == 0:
            subprocess.run(command, check=False)
        else:
            print("as root:", " ".join(command))
    words = [word for word in sys.argv[1:] if word != "--install"]
    os.execv(python, [str(python), __file__, *words])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    parser.add_argument("--install", action="store_true", help="install what pip and apt-get have, then run")
    parser.add_argument("--write", action="store_true", help="write the tables of evidence/ and docs/")
    parser.add_argument("--small", action="store_true", help="only what needs seconds")
    parser.add_argument("--only", default="", metavar="WORD", help="only peers whose name has this word; with --write their own tables")
    parser.add_argument("--all", action="store_true", help="also the scripts that write files of their own")
    args = parser.parse_args()
    if args.install:
        install()
    if not args.flexbody.is_file():
        sys.exit(f"{args.flexbody} is not there: cargo build --release, or --flexbody PROGRAM")
    rows, absent = measure(args.flexbody.resolve(), args.small, args.only)
    bad = [row for row in rows if not row.good()]
    if args.write and not (bad or args.small):
        elsewhere = ("CalculiX", "Abaqus", "pyNastran", "pyYeti", "NX Nastran", "public decks", "all nodes")
        of_exports = [row for row in rows if not (row.program.startswith(elsewhere) or "CalculiX" in row.program or row.format.startswith(("recipe", "cluster")))]
        if not args.only:
            TABLES["evidence/pages/exports.md", "peers"] = table(of_exports, absent)
        for (page, mark), text in TABLES.items():
            write(page, mark, text)
    print(f"\n{len(rows)} comparisons, {len(bad)} worse than allowed" + "".join(f"\nnot found: {one}" for one in absent))
    if args.all:
        for script in ["craig_bampton.py", "mechanisms.py"]:
            subprocess.run([sys.executable, Path(__file__).with_name(script), "--flexbody", args.flexbody.resolve()], check=True)
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
