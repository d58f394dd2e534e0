#!/usr/bin/env python3
"""Builds the conda package of the static program and tests it in an environment of its own: `build.py VERSION FOLDER OUT`.

FOLDER is the unpacked archive of the program, OUT gets the package. Needs py-rattler-build.
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

version, archive, out = sys.argv[1], Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()
os.environ["FLEXBODY_VERSION"], os.environ["FLEXBODY_ARCHIVE"] = version, str(archive)

from rattler_build import PlatformConfig, RenderConfig, Stage0Recipe, ToolConfiguration  # noqa: E402

recipe = Stage0Recipe.from_file(Path(__file__).with_name("recipe.yaml"))
(rendered,) = recipe.render(render_config=RenderConfig(platform=PlatformConfig(target_platform="linux-64")))
with tempfile.TemporaryDirectory() as place:
    # The package depends on nothing, so that no channel is asked.
    result = rendered.run_build(tool_config=ToolConfiguration(test_strategy="native"), output_dir=place, channels=[])
    for package in result.packages:
        shutil.copy(package, out)
        print(f"   {Path(package).name}: built, installed and tested")
