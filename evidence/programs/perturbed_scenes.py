#!/usr/bin/env python3
"""Runs every scene of the fixtures with other last bits in K and M, and prints the table of decisions and texts that differ.

    cargo build --locked
    python3 evidence/programs/perturbed_scenes.py [--flexbody target/debug/flexbody] [--only SCENE ...]

The program must be a build with debug assertions: only these obey `FLEXBODY_TEST_ROUNDING`, which changes every entry of K and M by up to 1e-15 of
itself, as other kernels do. Of each command the whole text and the exit code are compared with those of the unperturbed run, but for times and memory. Numbers may
differ by one unit of their last printed digit, by which two numbers on both sides of a limit of rounding differ; such numbers are counted.
"""

import argparse
import difflib
import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

from make_trade import COUNTER, SCENES

ROOT = Path(__file__).resolve().parents[2]
SEEDS = (1, 2, 3, 4)

# Scenes that no page of costs has.
OTHERS = [
    ("connecting_rod_run", "connecting_rod", 20),
    ("spin_up", "connecting_rod", 20),
    ("car_frame_cases", "car_frame", 30),
    ("robot_link_slow", "robot_link", 10),
]

# Numbers that are of the run, not of the body. They stand before a unit of time or memory, in ranges, or as ratios of times.
OF_THE_RUN = re.compile(
    r"(?:[0-9.e+-]+ (?:to|instead of) )?[0-9.e+-]+ (?:ms|us|ns|s|min|MB|GB|MiB|GiB)\b(?: of processor time)?"
    r"|[0-9.]+ times (?:faster|slower)"
)
NUMBER = re.compile(r"[-+]?[0-9]+(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?")


def commands(model, scene, modes, folder):
    """Returns (name, arguments) of the commands that decide something of the scene; `trade` simulates most and gets the first seed only."""
    model, scene = f"fixtures/models/{model}/model.toml", f"fixtures/scenes/{scene}.toml"
    body = folder / "body.flex.h5"
    number = ("--modes", str(modes))
    return [
        ("convert", ["convert", model, *number, "-o", body]),
        ("select of a model", ["select", model, *number, "--scene", scene]),
        ("simulate", ["simulate", body, "--scene", scene]),
        ("select of a body", ["select", body, "--scene", scene]),
        ("trade", ["trade", body, "--scene", scene, "--repeat", "1"]),
    ]


def words(program, arguments, seed, folder):
    """Returns exit code and words of a run, without what belongs to the run."""
    environment = {name: value for name, value in os.environ.items() if name != "FLEXBODY_TEST_ROUNDING"}
    if seed:
        environment["FLEXBODY_TEST_ROUNDING"] = str(seed)
    done = subprocess.run([program, *map(str, arguments)], cwd=ROOT, env=environment, capture_output=True, text=True)
    # Lines are broken where the times leave room.
    printed = " ".join((done.stdout + done.stderr).replace(str(folder), "FOLDER").split())
    return [f"exit code {done.returncode}:"] + OF_THE_RUN.sub("TIME", printed).split()


def is_last_digit(a, b):
    """Returns true if two words differ by one unit of the last digit of their numbers."""
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False

    def unit(number):
        mantissa, _, exponent = number.partition("e")
        decimals = len(mantissa.partition(".")[2])
        return 10.0 ** (int(exponent or 0) - decimals)

    pairs = zip(NUMBER.findall(a), NUMBER.findall(b))
    return all(abs(float(x) - float(y)) <= 1.001 * max(unit(x), unit(y)) and ("." in x or "e" in x) for x, y in pairs if x != y)


def differences(before, after):
    """Returns the number of changed last digits, and the other changes in words."""
    digits, others = 0, []
    for kind, a, b, c, d in difflib.SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if kind == "replace" and b - a == d - c and all(map(is_last_digit, before[a:b], after[c:d])):
            digits += b - a
        elif kind != "equal":
            others.append(f"{' '.join(before[max(a - 8, 0) : a])} [{' '.join(before[a:b])} -> {' '.join(after[c:d])}]")
    return digits, others


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexbody", default=ROOT / "target/debug/flexbody", type=Path)
    parser.add_argument("--only", nargs="+", default=[])
    arguments = parser.parse_args()
    program = arguments.flexbody.resolve()
    for scene, model, modes in [*SCENES, COUNTER, *OTHERS]:
        if arguments.only and scene not in arguments.only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            tasks = commands(model, scene, modes, folder)
            seconds = time.monotonic()
            before = {name: words(program, command, 0, folder) for name, command in tasks}
            seconds = time.monotonic() - seconds
            runs, digits = 0, 0
            for seed in SEEDS:
                # The first command makes the body of the others.
                for name, command in tasks if seed == SEEDS[0] else tasks[:-1]:
                    last, others = differences(before[name], words(program, command, seed, folder))
                    runs, digits = runs + 1, digits + last
                    for other in others:
                        print(f"  {name}, seed {seed}: {other}", flush=True)
            print(f"{scene}: {runs} runs ({seconds:.0f} s without rounding), {digits} last digits", flush=True)


if __name__ == "__main__":
    main()
