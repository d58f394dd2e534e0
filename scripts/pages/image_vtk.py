#!/usr/bin/env python3
"""Draws docs/images/vtk.png: the file of `flexbody export --to vtk` of the connecting rod of the fixtures, by PyVista.

    cargo build --release --locked && python3 scripts/pages/image_vtk.py

Needs PyVista (pip install pyvista).
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import pyvista

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "fixtures/models/connecting_rod"


def draw(file, mode, output, zoom=1.5):
    """A mode, deformed by a tenth of the size, before the edges of the undeformed body."""
    mesh = pyvista.read(file)
    name = next(name for name in mesh.point_data if name.startswith(f"mode_{mode:03}"))
    size = max(mesh.bounds[1] - mesh.bounds[0], mesh.bounds[3] - mesh.bounds[2], mesh.bounds[5] - mesh.bounds[4])
    largest = (mesh[name] ** 2).sum(axis=1).max() ** 0.5
    bent = mesh.warp_by_vector(name, factor=0.1 * size / largest)
    plotter = pyvista.Plotter(off_screen=True, window_size=(1200, 720))
    plotter.set_background("white")
    plotter.add_mesh(mesh.extract_cells(mesh.celltypes == 3), color="grey", line_width=1)
    bar = {"title": name, "color": "black", "n_labels": 3}
    plotter.add_mesh(bent.extract_cells(bent.celltypes == 5), scalars=name, smooth_shading=False, scalar_bar_args=bar)
    plotter.add_mesh(bent.extract_cells(bent.celltypes == 3), color="black", line_width=2)
    plotter.camera_position = "iso"
    plotter.camera.zoom(zoom)
    plotter.screenshot(output)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default=ROOT / "target/release/flexbody")
    parser.add_argument("--output", default=ROOT / "docs/images/vtk.png")
    parser.add_argument("--mode", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)

        def run(*words):
            subprocess.run([arguments.program, *words], cwd=place, check=True, capture_output=True)

        run("convert", MODEL / "model.toml", "-o", "rod.flex.h5")
        run("export", "rod.flex.h5", "--to", "vtk", "-o", "rod.vtu")
        draw(place / "rod.vtu", arguments.mode, arguments.output)


if __name__ == "__main__":
    main()
