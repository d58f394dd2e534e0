"""The types that the package states are those that it has."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import os
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

import flexbody
from flexbody import _flexbody, _types

needs_mypy = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")


@needs_mypy
def test_stubs_and_extension_agree(tmp_path: Path) -> None:
    allowed = tmp_path / "allowed.txt"
    # Names of types that stand in the stub alone, and aliases, which stubtest does not understand.
    aliases = [name for name, value in vars(_types).items() if name[0].isupper() and not isinstance(value, type)]
    allowed.write_text(
        "flexbody\\._flexbody\\._(_all__|Floats|Path|Source|Scene|Cases|Compressed)\n"
        + f"flexbody\\._types\\.({'|'.join(aliases)})\n"
    )
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


@needs_mypy
def test_misspelt_choices_are_found(tmp_path: Path) -> None:
    right = (
        "import flexbody\n"
        "import numpy as np\n"
        "body = flexbody.convert('model.toml', basis='craig-bampton', accuracy='fast', frame='interface=tip')\n"
        "body = flexbody.convert(np.eye(3), np.eye(3), np.zeros((1, 3)), units=('mm', 't', 's'), damping=0.01)\n"
        "body = flexbody.convert(np.eye(3), np.eye(3), np.zeros((1, 3)), units=(0.001, 1000.0, 's'))\n"
        "model = flexbody.model(np.eye(3), np.eye(3), np.zeros((1, 3)), interfaces={'tip': ([1, 2], 'rigid')})\n"
        "body.export('sid', 'body.sid', dialect='py-sid', points=[1, 2], to_units=('m', 'kg', 's'))\n"
        "body.simulate({'run': {'duration': 1.0}})\n"
        "model.response('tip:z', 17, band=(0.0, 100.0)).report('html')\n"
        "body.view('motion.h5', envelope='envelope.csv').write('a.html')\n"
        "maybe: str | None = 'stress' if body.recoveries else None\n"
        "body.view(recovery=maybe, triangles=100)\n"
        "rows = body.recover('run.csv')\n"
        "flexbody.Recovered.write_envelope_of_cases({'slow': rows}, 'envelope.csv')\n"
        "channels: flexbody.Channels = body.channels({'time': [0.0], 'q': [[0.0]]}, 'ask.npz')\n"
        "factors = channels.values @ np.ones(len(channels.names))\n"
    )
    wrong = [
        "flexbody.convert('model.toml', basis='craig_bampton')",
        "flexbody.convert('model.toml', accuracy='best')",
        "flexbody.convert('model.toml', mode=3)",
        "flexbody.read_model('job.inp', units=('mm', 'tons', 's'))",
        "flexbody.read_model('job.inp', program='ansis')",
        "flexbody.model(np.eye(3), np.eye(3), np.zeros((1, 3)), interfaces={'tip': ([1, 2], 'rigd')})",
        "body.export('exudin', 'body.h5')",
        "body.export('sid', 'body.sid', to_units=('mm', 't', 'sec'))",
        "body.report('pdf')",
        "model.trade('scene.toml', reference='all')",
        "flexbody.recipe('patran')",
        "body.view(recovery='stress', envelope='envelope.csv')",
        "body.view('motion.h5', recovery='stress')",
        "flexbody.Recovered.write_envelope_of_cases([rows], 'envelope.csv')",
        "body.channels('run.csv')",
    ]
    user = tmp_path / "user.py"
    user.write_text(right + "".join(f"{line}\n" for line in wrong))
    words = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", str(user)]
    environment = os.environ | {"MYPY_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    lines = {int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line}
    first = right.count("\n") + 1
    assert lines == set(range(first, first + len(wrong))), done.stdout


def test_the_stated_choices_are_those_of_the_library() -> None:
    for name, choices in _flexbody._choices().items():
        stated = get_args(getattr(_types, name))
        assert sorted(stated) == sorted(set(choices)), name
    assert list(flexbody.export_formats()) == list(get_args(_types.ExportFormat))


def test_the_stub_has_the_docstrings_of_the_extension() -> None:
    stub = ast.parse(Path(_flexbody.__file__).with_name("_flexbody.pyi").read_text())
    found = 0
    for item in stub.body:
        if not isinstance(item, (ast.ClassDef, ast.FunctionDef)):
            continue
        own = getattr(_flexbody, item.name)
        pairs = [(item, own)]
        if isinstance(item, ast.ClassDef):
            pairs += [(member, getattr(own, member.name)) for member in item.body if isinstance(member, ast.FunctionDef)]
        for stated, actual in pairs:
            # Overloads after the first have none, nor have special methods without a doc comment.
            doc = ast.get_docstring(stated)
            if doc is not None:
                assert doc == inspect.getdoc(actual), f"{item.name}.{stated.name}"
                found += 1
    assert found > 150


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
