"""The types that the package states are those that it has."""

from __future__ import annotations

import importlib.util
import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import flexbody
from flexbody import _flexbody

needs_mypy = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")


@needs_mypy
def test_stubs_and_extension_agree(tmp_path: Path) -> None:
    allowed = tmp_path / "allowed.txt"
    # Names of types that stand in the stub alone.
    allowed.write_text("flexbody\\._flexbody\\._(_all__|Floats|Path|Scene|Cases|Compressed)\n")
    words = [sys.executable, "-m", "mypy.stubtest", "flexbody", "--allowlist", str(allowed), "--ignore-unused-allowlist"]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


@needs_mypy
def test_the_package_and_its_users_are_typed(tmp_path: Path) -> None:
    user = tmp_path / "user.py"
    user.write_text(
        "import flexbody\n"
        "body: flexbody.Body = flexbody.read('a.flex.h5')\n"
        "reveal_type(body.W2)\n"
        "reveal_type(body.report())\n"
        "reveal_type(body.simulate('scene.toml').paths)\n"
    )
    words = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(user)]
    environment = os.environ | {"MYPY_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stdout
    revealed = done.stdout
    assert "float64" in revealed and "None" in revealed and "PointPath" in revealed


def test_everything_has_a_docstring() -> None:
    for name in flexbody.__all__:
        item = getattr(flexbody, name)
        if isinstance(item, str):
            continue
        assert inspect.getdoc(item), name
        if inspect.isclass(item) and item.__module__ == "flexbody" and hasattr(_flexbody, name):
            for member, value in vars(item).items():
                if not member.startswith("_"):
                    assert inspect.getdoc(value), f"{name}.{member}"
