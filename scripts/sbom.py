#!/usr/bin/env python3
"""What is linked into the program: a bill of materials (CycloneDX 1.5, JSON) and the texts of all licences.

    python3 scripts/sbom.py --target x86_64-unknown-linux-musl --sbom flexbody.cdx.json --licences LICENCES.txt

Both follow from Cargo.lock and the sources of the packages alone: equal sources give equal files. Packages that only build scripts
and macros use are not linked and not listed. tests/program/licences.rs says which licences are permitted.
"""

import argparse
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TEXTS = re.compile(r"(LICEN[CS]E|COPYING|COPYRIGHT|NOTICE|UNLICENSE)([-_.].*)?", re.IGNORECASE)
# C sources lie some folders below their package (HDF5, METIS, GKlib, zlib, mimalloc).
DEPTH = 4


def metadata(manifest, target):
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", target, "--manifest-path", manifest]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def compiled(manifest, target, package):
    """Names and versions of what is compiled into the program. The graph of the metadata also has what no feature asks for."""
    command = ["cargo", "tree", "--locked", "--edges", "normal,no-proc-macro", "--prefix", "none", "--target", target, "--format", "{p}", "--manifest-path", manifest, "--package", package]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return {tuple(line.split()[:2]) for line in lines if line.strip()}


def linked(told, wanted):
    """The root, and for every package that is linked those that it needs itself."""
    nodes = {node["id"]: node for node in told["resolve"]["nodes"]}
    among = {package["id"] for package in told["packages"] if (package["name"], f"v{package['version']}") in wanted}

    def needs(identity):
        normal = (one["pkg"] for one in nodes[identity]["deps"] if any(kind["kind"] is None for kind in one["dep_kinds"]))
        return sorted(one for one in normal if one in among)

    root = told["resolve"]["root"]
    found, left = {}, [root]
    while left:
        identity = left.pop()
        if identity not in found:
            found[identity] = needs(identity)
            left += found[identity]
    return root, found


def url(package):
    return f"pkg:cargo/{package['name']}@{package['version']}"


def component(package, checksums, kind="library"):
    own = {"type": kind, "bom-ref": url(package), "name": package["name"], "version": package["version"], "purl": url(package)}
    if package["description"]:
        own["description"] = " ".join(package["description"].split())
    checksum = checksums.get((package["name"], package["version"]))
    if checksum:
        own["hashes"] = [{"alg": "SHA-256", "content": checksum}]
    if package["license"]:
        # `/` is the old way to write OR.
        own["licenses"] = [{"expression": package["license"].replace("/", " OR ")}]
    elif package["license_file"]:
        own["licenses"] = [{"license": {"name": f"text in {package['license_file']} of the package"}}]
    if package["repository"]:
        own["externalReferences"] = [{"type": "vcs", "url": package["repository"]}]
    return own


def bill(told, wanted, checksums):
    root, found = linked(told, wanted)
    packages = {package["id"]: package for package in told["packages"]}
    others = sorted((packages[identity] for identity in found if identity != root), key=lambda one: (one["name"], one["version"]))
    graph = {url(packages[identity]): sorted(url(packages[one]) for one in needed) for identity, needed in found.items()}
    own = packages[root]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": component(own, checksums, "application"), "tools": {"components": [{"type": "application", "name": "scripts/sbom.py", "version": own["version"]}]}},
        "components": [component(package, checksums) for package in others],
        "dependencies": [{"ref": ref, "dependsOn": needed} for ref, needed in sorted(graph.items())],
    }, [own, *others]


def texts(package):
    """Licence files of a package, those of the C sources in it too."""
    folder = Path(package["manifest_path"]).parent
    if folder == ROOT or ROOT in folder.parents:
        return [ROOT / "LICENSE-MIT", ROOT / "LICENSE-APACHE"]
    own = (path for path in folder.rglob("*") if len(path.relative_to(folder).parts) <= DEPTH and TEXTS.fullmatch(path.name) and path.is_file())
    return sorted(own)


def licences(packages):
    """Every text once, under the packages that it belongs to."""
    seen, parts = {}, []
    for package in packages:
        folder = Path(package["manifest_path"]).parent
        lines = [f"{package['name']} {package['version']}: {package['license'] or package['license_file']}"]
        lines += [f"  {package['repository']}"] if package["repository"] else []
        for path in texts(package):
            text = path.read_text(errors="replace").strip()
            name = path.relative_to(folder if folder in path.parents else ROOT)
            number = seen.setdefault(text, len(seen) + 1)
            lines.append(f"  {name}: text {number}")
        if len(lines) < 2 + bool(package["repository"]):
            lines.append("  the package has no text of its own")
        parts.append("\n".join(lines))
    ruler = "=" * 80
    shown = [f"{ruler}\ntext {number}\n{ruler}\n{text}" for text, number in seen.items()]
    return "What the program is linked with, and the licences of all of it.\n\n" + "\n".join(parts) + "\n\n" + "\n\n".join(shown) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--manifest", default=ROOT / "Cargo.toml", help="Cargo.toml of the program, or python/Cargo.toml")
    parser.add_argument("--target", required=True)
    parser.add_argument("--sbom", type=Path)
    parser.add_argument("--licences", type=Path)
    args = parser.parse_args()
    told = metadata(str(args.manifest), args.target)
    lock = tomllib.loads((Path(told["workspace_root"]) / "Cargo.lock").read_text())
    checksums = {(one["name"], one["version"]): one.get("checksum") for one in lock["package"]}
    root = next(package["name"] for package in told["packages"] if package["id"] == told["resolve"]["root"])
    wanted = compiled(str(args.manifest), args.target, root)
    document, packages = bill(told, wanted, checksums)
    if len(packages) < 20 or len(packages) != len(wanted):
        sys.exit(f"{len(packages)} packages of {len(wanted)}: the graph was not read")
    if args.sbom:
        args.sbom.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    if args.licences:
        args.licences.write_text(licences(packages))
    print(f"{len(packages) - 1} packages are linked")


if __name__ == "__main__":
    main()
