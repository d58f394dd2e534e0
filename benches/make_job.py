#!/usr/bin/env python3
"""Writes a hexahedral model of any size in the forms of FE programs, for benches of their readers (the models of make_block.py).

    pip install numpy
    python benches/make_job.py /tmp/cube300k --form calculix --shape cube --dofs 300000
    flexbody convert /tmp/cube300k/job.inp --units m,kg,s --modes 1 -o /tmp/body.flex.h5

Forms: calculix (job.sti, job.mas, job.dof), abaqus (COORDINATE), abaqus-labels (MATRIX INPUT), op4-text and op4 (OUTPUT4 with strings of nonzeros
in BIGMAT form, as text and in records), dmig (cards in large fields), mtx (Matrix Market).
"""

import argparse
import struct
from pathlib import Path

import numpy as np

from make_block import SHAPES, Grid, cells_for, element, tables, write_matrix_market, write_manifest, write_tables

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


class Misplaced(Grid):
    """One node lies elsewhere: the program reads the model and stops at its check of rigid motion."""

    def positions(self, first, last):
        places = super().positions(first, last)
        if first == 0:
            places[self.nodes // 2 % len(places)] += self.lengths
        return places


def bricks(grid):
    """Node numbers of the elements, from 1."""
    x, y, z = np.meshgrid(*(np.arange(cells) for cells in grid.cells), indexing="ij")
    places = [(x + a) + grid.counts[0] * ((y + b) + grid.counts[1] * (z + c)) + 1 for a, b, c in CORNERS]
    return np.stack([place.ravel() for place in places], axis=1)


def write_deck(path, grid, last):
    """A deck of CalculiX or Abaqus; `last` are the lines of its step."""
    with open(path, "w") as deck:
        deck.write("*NODE, NSET=ALL\n")
        for first, end in grid.chunks():
            deck.write("".join([f"{n}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in enumerate(grid.positions(first, end).tolist(), first + 1)]))
        deck.write("*ELEMENT, TYPE=C3D8, ELSET=BRICKS\n")
        deck.write("".join([", ".join(map(str, [n, *row])) + "\n" for n, row in enumerate(bricks(grid).tolist(), 1)]))
        deck.write("*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n*SOLID SECTION, ELSET=BRICKS, MATERIAL=STEEL\n*STEP\n" + last + "*END STEP\n")


def write_bulk(path, grid):
    with open(path, "w") as bulk:
        bulk.write("BEGIN BULK\nPARAM,COUPMASS,1\nMAT1,1,2.1+11,,.3,7850.\nPSOLID,1,1\n")
        for first, end in grid.chunks():
            bulk.write("".join([f"GRID*   {n:16}{'':16}{x:16.9E}{y:16.9E}\n*       {z:16.9E}\n" for n, (x, y, z) in enumerate(grid.positions(first, end).tolist(), first + 1)]))
        for n, row in enumerate(bricks(grid).tolist(), 1):
            bulk.write(f"CHEXA,{n},1," + ",".join(map(str, row[:6])) + f"\n,{row[6]},{row[7]}\n")
        bulk.write("ENDDATA\n")


def write_lines(path, grid, table, lower, line):
    """One line per entry; `line` makes those of a chunk from rows, columns (from 0) and places in the table."""
    with open(path, "w") as out:
        for first, end in grid.chunks():
            row, column, index = grid.columns(table, first, end, lower)
            out.write("".join(line(row.tolist(), column.tolist(), index.tolist())))


def coordinates(table, digits, gap):
    texts = [f"{gap}{value:.{digits}e}\n" for value in table.ravel()]
    return lambda rows, columns, places: [f"{c + 1} {r + 1}{texts[k]}" for r, c, k in zip(rows, columns, places)]


def labels(table):
    texts = [f"{value:.15e}\n" for value in table.ravel()]
    name = [f"{{}},{direction}" for direction in (1, 2, 3)]

    def line(rows, columns, places):
        return [f"{name[r % 3].format(r // 3 + 1)}, {name[c % 3].format(c // 3 + 1)}, {texts[k]}" for r, c, k in zip(rows, columns, places)]

    return line


def write_dmig(path, grid, matrices):
    with open(path, "w") as out:
        for name, table in matrices.items():
            texts = [f"{value:.9E}".replace("E", "D").rjust(16) for value in table.ravel()]
            out.write(f"DMIG    {name:8}{0:8}{6:8}{2:8}{0:8}{'':8}{'':8}{3 * grid.nodes:8}\n")
            for first, end in grid.chunks():
                before = -1
                for r, c, k in zip(*(part.tolist() for part in grid.columns(table, first, end, True))):
                    if c != before:
                        out.write(f"DMIG*   {name:16}{c // 3 + 1:16}{c % 3 + 1:16}\n")
                        before = c
                    out.write(f"*       {r // 3 + 1:16}{r % 3 + 1:16}{texts[k]}\n")


def runs(grid, table, first, end):
    """Column, first rows and values of its strings of nonzeros."""
    row, column, index = grid.columns(table, first, end, False)
    order = np.lexsort((row, column))
    row, column, index = row[order], column[order], index[order]
    cuts = np.flatnonzero(np.diff(column)) + 1
    for rows, columns, places in zip(np.split(row, cuts), np.split(column, cuts), np.split(index, cuts)):
        parts = np.flatnonzero(np.diff(rows) > 1) + 1
        yield int(columns[0]), [(int(part[0]), places) for part, places in zip(np.split(rows, parts), np.split(places, parts))]


def write_op4_text(path, grid, matrices):
    with open(path, "w") as out:
        for name, table in matrices.items():
            texts = [f"{value:23.16E}" for value in table.ravel()]
            size = 3 * grid.nodes
            out.write(f"{size:8}{-size:8}{6:8}{2:8}{name:8}1P,3E23.16\n")
            for first, end in grid.chunks():
                for column, strings in runs(grid, table, first, end):
                    out.write(f"{column + 1:8}{0:8}{sum(2 * len(places) + 2 for _, places in strings):8}\n")
                    for start, places in strings:
                        out.write(f"{2 * len(places) + 1:8}{start + 1:8}\n")
                        values = [texts[k] for k in places.tolist()]
                        out.write("".join(["".join(values[i:i + 3]) + "\n" for i in range(0, len(values), 3)]))
            out.write(f"{size + 1:8}{1:8}{1:8}\n{2 ** 0.5:23.16E}\n")


def write_op4(path, grid, matrices):
    def record(payload):
        mark = struct.pack("<i", len(payload))
        return mark + payload + mark

    with open(path, "wb") as out:
        for name, table in matrices.items():
            size, flat = 3 * grid.nodes, table.ravel()
            out.write(record(struct.pack("<4i", size, -size, 6, 2) + name.ljust(8).encode()))
            for first, end in grid.chunks():
                for column, strings in runs(grid, table, first, end):
                    payload = b"".join([struct.pack("<2i", 2 * len(places) + 1, start + 1) + flat[places].tobytes() for start, places in strings])
                    out.write(record(struct.pack("<3i", column + 1, 0, len(payload) // 4) + payload))
            out.write(record(struct.pack("<3i", size + 1, 1, 2) + struct.pack("<d", 2 ** 0.5)))


def write(folder, form, grid, stiffness, mass):
    both = {"K": stiffness, "M": mass}
    if form == "calculix":
        write_deck(folder / "job.inp", grid, "*FREQUENCY, SOLVER=MATRIXSTORAGE\n6\n")
        (folder / "job.dof").write_text("".join([f"{n}.1\n{n}.2\n{n}.3\n" for n in range(1, grid.nodes + 1)]))
        for extension, table in zip(("sti", "mas"), both.values()):
            write_lines(folder / f"job.{extension}", grid, table, True, coordinates(table, 13, "  "))
    elif form.startswith("abaqus"):
        kind = "COORDINATE" if form == "abaqus" else "MATRIX INPUT"
        write_deck(folder / "job.inp", grid, f"*MATRIX GENERATE, STIFFNESS, MASS\n*MATRIX OUTPUT, STIFFNESS, MASS, FORMAT={kind}\n")
        for name, table in zip(("STIF", "MASS"), both.values()):
            line = coordinates(table, 15, "  ") if form == "abaqus" else labels(table)
            write_lines(folder / f"job_{name}1.mtx", grid, table, form != "abaqus", line)
    elif form == "mtx":
        for name, table in both.items():
            write_matrix_market(folder / f"{name}.mtx", grid, table, name)
        write_tables(folder, grid.chunks(), grid.positions)
        write_manifest(folder, folder.name, "K.mtx", "M.mtx")
    else:
        write_bulk(folder / "job.bdf", grid)
        if form == "dmig":
            write_dmig(folder / "job.pch", grid, {"KAAX": stiffness, "MAAX": mass})
        else:
            {"op4": write_op4, "op4-text": write_op4_text}[form](folder / "job.op4", grid, {"KGG": stiffness, "MGG": mass})


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--form", choices=["calculix", "abaqus", "abaqus-labels", "op4-text", "op4", "dmig", "mtx"], required=True)
    parser.add_argument("--shape", choices=SHAPES, default="cube")
    parser.add_argument("--dofs", type=int, default=3000)
    parser.add_argument("--misplaced", action="store_true", help="with a node in the wrong place: what is measured is reading")
    args = parser.parse_args()
    grid = (Misplaced if args.misplaced else Grid)(SHAPES[args.shape], cells_for(SHAPES[args.shape], args.dofs))
    stiffness, mass = tables(*element(grid.lengths / grid.cells, 2.1e11, 0.3, 7850.0))
    args.folder.mkdir(parents=True, exist_ok=True)
    write(args.folder, args.form, grid, stiffness, mass)


if __name__ == "__main__":
    main()
