"""What the scripts of this folder share: running flexbody, finding other programs, and the rows of the table of agreement."""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class Absent(Exception):
    """The program is not on this machine; the text says where it comes from."""


@dataclass
class Row:
    """One comparison: the largest difference, and what it must not exceed."""

    program: str
    format: str
    what: str
    found: float
    limit: float

    def good(self):
        return self.found <= self.limit


def compare_alone(doc, rows):
    """The comparisons `rows(flexbody, scratch)` of one script, from the command line; exits with 1 when a number is worse than its limit."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", type=Path, default=ROOT / "target/release/flexbody")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        found = rows(args.flexbody, Path(scratch))
    for row in found:
        print(f"{row.what:90} {row.found:.1e} (limit {row.limit:.0e})")
    sys.exit(not all(row.good() for row in found))


def run(*words):
    """A program with its output; a failure shows what it said."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(str(word) for word in words)}\n{done.stdout}{done.stderr}")
    return done.stdout


def body(flexbody, model, path, *options):
    """Converts a model of the fixtures. Axes are those of the model, so that world, model and body axes are the same at the start."""
    manifest = ROOT / "fixtures/models" / model / "model.toml"
    run(flexbody, "convert", manifest, "--frame", "com", "--lumped", "none", "--quiet", "-o", path, *options)
    return path


def body_of(flexbody, job, path, *options):
    """Converts the job of an FE program."""
    run(flexbody, "convert", job, "--units", "m,kg,s", "--lumped", "none", "--quiet", "-o", path, *options)
    return path


def export(flexbody, path, to, out, *options):
    run(flexbody, "export", path, "--to", to, "--allow-loss", "--quiet", "-o", out, *options)
    return out


def audit(flexbody, path):
    """What `flexbody audit` finds: dialect, frequencies, checks. It exits with 1 where there are findings."""
    done = subprocess.run([str(flexbody), "audit", str(path), "--json"], capture_output=True, text=True)
    if not done.stdout:
        raise RuntimeError(done.stderr)
    told = json.loads(done.stdout)
    return told.get("results", told)


def failed(told):
    return [check["name"] for check in told["checks"] if not check["passed"]]


def program(name, variable, source):
    """A program by an environment variable or on the PATH."""
    found = os.environ.get(variable) or shutil.which(name)
    if not found or not (shutil.which(found) or Path(found).exists()):
        raise Absent(f"{name} ({source}, or {variable}=...)")
    return found


def folder(variable, file, source):
    """A folder of sources by an environment variable."""
    found = os.environ.get(variable)
    if not found or not (Path(found) / file).is_file():
        raise Absent(f"{file} ({source}: {variable}=folder)")
    return Path(found)
