#!/usr/bin/env python3
"""The header of `embedded` in compilers: C99, C++ and, for a Cortex-M4F, the size of the code and of its stack.

`rows` and `arm` are called by suite.py. `cc` and `c++` on the PATH; the ARM compiler (Debian: `apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi`)
by ARM_GCC or on the PATH. That the code computes the right numbers is the matter of crates/formats/tests/formats/export_embedded.rs, in C and in C++.
"""

import re

import common
from common import Row

WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-pedantic", "-ffreestanding"]
TARGET = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
MODES = 8

# Every function that a simulation calls, for a header under the names PREFIX.
PROGRAM = """
#include "body.h"
typedef PREFIX_evaluation state;
const unsigned char state_bytes[sizeof(state)] = {0};
int open_body(state *e, const void *data, size_t size) { return PREFIX_open(e, data, size); }
void set(state *e, const PREFIX_real *q, const PREFIX_real *nu) { PREFIX_set(e, q, nu); }
int accelerations(state *e, const PREFIX_real *applied, PREFIX_real *out) { return PREFIX_accelerations(e, applied, out); }
void add_gravity(const state *e, const PREFIX_real *g, PREFIX_real *out) { PREFIX_add_gravity(e, g, out); }
int add_force(const state *e, size_t frame, const PREFIX_real *f, PREFIX_real *out) { return PREFIX_add_force(e, frame, f, out); }
int frame_motion(const state *e, size_t frame, PREFIX_real *x, PREFIX_real *v) { return PREFIX_frame_motion(e, frame, x, v); }
"""


def source(flexbody, folder, dialect):
    """A C file beside the header of a body."""
    path = common.body(flexbody, "bracket_hex20", folder / "body.flex.h5", "--modes", MODES)
    common.export(flexbody, path, "embedded", folder / "body.bin", "--dialect", dialect)
    prefix = re.search(r"(\w+)_evaluation;", (folder / "body.h").read_text())[1]
    out = folder / "program.c"
    out.write_text(PROGRAM.replace("PREFIX", prefix))
    return out


def rows(flexbody, folder):
    found = []
    program = source(flexbody, folder, "double")
    for name, variable, language, standards in [("cc", "CC", "c", ["c99", "c17"]), ("c++", "CXX", "c++", ["c++11", "c++17", "c++20"])]:
        compiler = common.program(name, variable, "Debian: apt-get install g++")
        version = common.run(compiler, "-dumpfullversion").strip()
        for standard in standards:
            command = [compiler, "-x", language, f"-std={standard}", *WARNINGS, "-c", program, "-o", folder / "program.o"]
            try:
                failed = bool(common.run(*command))
            except RuntimeError as error:
                print(error)
                failed = True
            found.append(Row(f"{name} {version}", "embedded", f"header as {standard} without a warning (1: no)", float(failed), 0.0))
    return found


def arm(flexbody, folder):
    """The table of docs/reference/formats/embedded.md."""
    compiler = common.program("arm-none-eabi-gcc", "ARM_GCC", "Debian: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi")
    program = source(flexbody, folder, "float")
    version = common.run(compiler, "-dumpfullversion").strip()
    lines = ["| option | code, bytes | largest stack, bytes: `open` | `set` | `accelerations` | `add_force` |", "|---|---|---|---|---|---|"]
    for option in ["-Os", "-O2", "-O3"]:
        out = folder / "arm.o"
        common.run(compiler, "-std=c99", option, *TARGET, *WARNINGS, "-fstack-usage", "-fcallgraph-info=su", "-c", program, "-o", out)
        symbols = [line.split() for line in common.run(compiler.replace("gcc", "nm"), "-S", out).splitlines()]
        sizes = {words[3]: (int(words[1], 16), words[2]) for words in symbols if len(words) == 4}
        state = sizes.pop("state_bytes")[0]
        code = sum(size for size, kind in sizes.values() if kind in "tTrR")
        depth = stack(out.with_suffix(".ci").read_text())
        used = [depth(name) for name in ["open_body", "set", "accelerations", "add_force"]]
        lines.append("| `" + option + "` | " + " | ".join(map(str, [code, *used])) + " |")
    data = (folder / "body.bin").stat().st_size
    text = "\n".join(lines) + (
        f"\n\n`bracket_hex20`, {MODES} modes, dialect `float`: the file has {data} bytes, one evaluation {state} bytes. arm-none-eabi-gcc {version} "
        f"with {' '.join(TARGET)}; all functions that are called in a simulation, constants and the code of the checksum with them; no function of a "
        "library but memcpy and memset.\n"
    )
    return text


def stack(graph):
    """Bytes of stack of a function with all that it calls, from what GCC tells of the calls."""
    own = {name: int(size) for name, size in re.findall(r'node: { title: "([^"]*)".*?\\n(\d+) bytes', graph)}
    calls = {}
    for caller, callee in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', graph):
        calls.setdefault(caller, []).append(callee)
    depth = lambda name: own.get(name, 0) + max((depth(callee) for callee in calls.get(name, [])), default=0)
    return depth
