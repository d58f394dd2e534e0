#!/usr/bin/env python3
"""Draws docs/images/view.png and report.png: the pages that `flexbody view` and `convert --report` make of the connecting rod of the
fixtures, in Chromium.

    cargo build --release --locked && python3 scripts/pages/image_view.py

Needs Chromium on the PATH.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "fixtures/models/connecting_rod"
BROWSERS = ["chromium", "chromium-browser", "google-chrome", "chrome"]
OPTIONS = (
    "--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync --hide-scrollbars"
).split()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default=ROOT / "target/release/flexbody")
    parser.add_argument("--folder", type=Path, default=ROOT / "docs/images")
    parser.add_argument("--mode", default=1)
    arguments = parser.parse_args()
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        sys.exit("no Chromium on the PATH")
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)

        def run(*words):
            subprocess.run([arguments.program, *words], cwd=place, check=True, capture_output=True)

        run("convert", MODEL / "model.toml", "-o", "rod.flex.h5", "--report", "report.html")
        run("view", "rod.flex.h5", "-o", "view.html")
        for name, size in (("view", "1200,720"), ("report", "1200,890")):
            page = f"file://{place}/{name}.html#mode={arguments.mode}&phase=0.25"
            shot = [f"--screenshot={(arguments.folder / name).resolve()}.png", f"--user-data-dir={place}/browser"]
            subprocess.run([browser, *OPTIONS, f"--window-size={size}", *shot, page], check=True, capture_output=True)


if __name__ == "__main__":
    main()
