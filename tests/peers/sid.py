#!/usr/bin/env python3
"""SID_FEM beside welib: a beam that welib condenses, as its own printer writes it (`%.6f`) and with all digits, read and audited by flexbody.

Optional, some seconds: needs Python with welib; not part of `cargo test`. welib writes SID and reads none.

    python3 -m venv target/peers && target/peers/bin/pip install welib==4.2.0
    cargo build --release
    target/peers/bin/python tests/peers/sid.py

Exits with 1 when flexbody finds another dialect, or other faults, than the files have.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from welib.yams import sid as welib

ROOT = Path(__file__).resolve().parents[2]
NODES = 11
# Checks that fail in the file of each printer; everything else holds.
EXPECTED = {"as welib prints it": ["digits"], "with all digits": []}


def beam():
    """A cantilever of steel along z, two bending modes, as welib condenses it."""
    x = np.zeros((3, NODES))
    x[2] = np.linspace(0, 10, NODES)
    one = np.ones(NODES)
    return welib.Beam2SID(x, [0, 1], m=50 * one, Iy=1e-4 * one, Iz=2e-4 * one, G=79e9, Kv=3e-4 * one, A=0.01 * one, E=210e9)


def full_digits(taylor):
    """welib's printer of an object with the digits that a number has."""
    lines = [taylor.name]
    for key in ["order", "nrow", "ncol", "nq", "nqn", "structure"]:
        lines.append(f"{key} = {getattr(taylor, key)}")
    for (i, j), v in np.ndenumerate(np.asarray(taylor.M0)):
        if not (taylor.structure == 2 and j > i):
            lines.append(f"m0({i + 1}, {j + 1}) = {v:.16e}")
    if taylor.order == 1:
        lines += [f"m1({i + 1}, {j + 1}, {k + 1}) = {v:.16e}" for (i, j, k), v in np.ndenumerate(taylor.M1)]
    return "\n".join([*lines, f"end {taylor.name}", ""])


def audit(program, text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "beam.SID_FEM"
        path.write_text(text)
        run = subprocess.run([program, "audit", path, "--json"], capture_output=True, text=True)
    if not run.stdout:
        sys.exit(run.stderr)
    return json.loads(run.stdout)["results"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/flexbody")
    program = parser.parse_args().program
    sid = beam()
    texts = [str(sid)]
    welib.Taylor.__repr__ = full_digits
    texts.append(str(sid))
    wrong = False
    for (name, expected), text in zip(EXPECTED.items(), texts):
        told = audit(program, text)
        failed = [check["name"] for check in told["checks"] if not check["passed"]]
        frequencies = ", ".join(f"{f:.5g}" for f in told["frequencies"])
        print(f"beam of welib {name}: dialect {told['dialect']}, {frequencies} Hz, {len(told['checks'])} checks, failed: {failed or 'none'}")
        wrong |= failed != expected or told["dialect"] != "fembeam"
    sys.exit(wrong)


if __name__ == "__main__":
    main()
