"""The extreme bodies of make_stability.py: families of (title, what they are, cases); a case is (label, body, modes, settings)."""

import itertools

import numpy as np
from gmpy2 import mpfr, sqrt
from stability_models import STEEL, Body, bricks, frame, real, tetrahedron, tied

ALL = 1000
BAR = ("1", "0.2", "0.3")
LINE = [(str(i / 4), 0, 0) for i in range(3)]


def shifted(by):
    return lambda p: p + mpfr(by) * real(["1", "0.34", "-0.14"])


def scaled(body, k="1", m="1", x="1"):
    body.k, body.m, body.x = body.k * mpfr(k), body.m * mpfr(m), body.x * mpfr(x)
    return body


def layered(name, factor, cells=(3, 1, 1)):
    """A bar whose middle has another stiffness or density."""
    return bricks(cells, BAR, material=lambda cell: STEEL | {name: STEEL[name] * (mpfr(factor) if cell[0] == 1 else 1)})


def with_poisson(value):
    return bricks((3, 1, 1), BAR, material=lambda cell: STEEL | {"poisson": mpfr(value)})


def with_sliver(height):
    """A bar with a tetrahedron of this height on its end."""
    bar = bricks((2, 1, 1), BAR)
    face = [i for i in range(len(bar.x)) if bar.x[i, 0] == 1][:3]
    tip = bar.x[face].sum(axis=0) / 3 + real([height, "0", "0"])
    body = Body(np.vstack([bar.x, [tip]]))
    n = len(bar.dofs)
    body.k[:n, :n], body.m[:n, :n] = bar.k, bar.m
    body.add([*face, len(bar.x)], *tetrahedron(body.x[[*face, len(bar.x)]], **STEEL))
    return body


def one_tetrahedron():
    body = Body(real([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    body.add(range(4), *tetrahedron(body.x, **STEEL))
    return body


def hinged(stiffness):
    """Two beams whose ends move together but for a rotation about z."""
    body = frame([(0, 0, 0), ("0.5", 0, 0), ("0.5", 0, 0), (1, 0, 0)], [(0, 1), (2, 3)], ("0.1", "0.08"))
    return tied(body, 1, 2, ["1e9"] * 5 + [stiffness])


def needle(points, side):
    return frame(points, [(0, 1), (1, 2)], (side, side))


def flattened(to):
    """Positions that the stiffness is not of: on a plane, or on a line."""
    body = bricks((2, 1, 1), BAR)
    body.x = body.x * real(to)
    return body


def chain():
    """Masses and springs on a line."""
    body = Body(real([[i, 0, 0] for i in range(4)]))
    for i in range(3):
        body.add([i, i + 1], np.kron(real([[1, -1], [-1, 1]]), real(np.diag([1000, 0, 0]))))
    body.m = real(np.eye(12, dtype=int))
    return body


def massless_rotations():
    body = frame([(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1), (1, 2)], ("0.1", "0.08"))
    turning = [row for row, (_, k) in enumerate(body.dofs) if k >= 3]
    body.m[turning], body.m[:, turning] = mpfr(0), mpfr(0)
    return body


def four_points():
    """Mass integrated at four of the eight points of each brick: singular, as CalculiX has it for C3D10."""
    at = 1 / sqrt(mpfr(3))
    points = [tuple(s * at for s in corner) for corner in itertools.product((-1, 1), repeat=3) if np.prod(corner) == -1]
    return bricks((3, 1, 1), BAR, mass_points=points)


def triangle(sides):
    return frame([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1), (1, 2), (2, 0)], sides)


def case(label, make, modes=8, **settings):
    return label, make, modes, settings


FAMILIES = [
    ("Units", "A bar of two bricks in other units; silicon of 100 x 10 x 2 micrometres and a kilometre of steel in metres. Powers of two change no digit at all "
     "(`crates/body/tests/body/extremes.rs`). Numbers whose products leave the range of double precision are refused before any work.",
     [case("m, kg, s", lambda: bricks((2, 1, 1), BAR)),
      case("um, kg, s", lambda: scaled(bricks((2, 1, 1), BAR), "1", "1", "1e6")),
      case("MEMS, in m", lambda: bricks((2, 1, 1), ("1e-4", "1e-5", "2e-6"), material=lambda c: {"young": mpfr("169e9"), "poisson": mpfr("0.22"), "density": mpfr(2330)})),
      case("1 km", lambda: bricks((2, 1, 1), ("1000", "40", "30"))),
      *(case(f"K 1e{e}", lambda e=e: scaled(bricks((2, 1, 1), BAR), k=f"1e{e}")) for e in (-120, 120, -150, 150)),
      *(case(f"M 1e{e}", lambda e=e: scaled(bricks((2, 1, 1), BAR), m=f"1e{e}")) for e in (-120, 120, -150, 150)),
      *(case(f"x 1e{e}", lambda e=e: scaled(bricks((2, 1, 1), BAR), x=f"1e{e}")) for e in (-60, 60, -150, 150)),
      case("K, M 1e120", lambda: scaled(bricks((2, 1, 1), BAR), "1e120", "1e120")),
      case("K, M, x 1e-150", lambda: scaled(bricks((2, 1, 1), BAR), "1e-150", "1e-150", "1e-150"))]),
    ("Distance from the origin", "A bar of one metre; matrices of the exact positions. FB425 is told when stiffness and positions no longer agree to 10^-9. An FE program "
     "that starts from coordinates rounded far from the origin makes the matrices of the rounded body, and nothing is lost.",
     [case(f"{by} m" if by != "0" else "at it", lambda by=by: bricks((2, 1, 1), BAR, shifted(by))) for by in ("0", "1e1", "1e3", "1e5", "1e7", "1e9")]),
    ("Slenderness", "Three bricks in a row, and two beams: along x, and along an oblique line, where the small moment is the difference of large numbers in the files.",
     [*(case(f"bricks, 1 : {a}", lambda a=a: bricks((3, 1, 1), (a, "1", "0.9")), 6) for a in ("1", "1e1", "1e2", "1e3", "1e4", "1e5")),
      *(case(f"beams, 1 : {a}", lambda a=a: needle(LINE, str(mpfr(1) / mpfr(a) / 2)), 8) for a in ("1e1", "1e3", "1e5")),
      *(case(f"oblique beams, 1 : {a}", lambda a=a: needle([[mpfr(i) * mpfr(c) for c in ("0.3", "0.2", "0.1")] for i in range(3)], str(mpfr("0.75") / mpfr(a))), 8)
        for a in ("1e1", "1e3", "1e5"))]),
    ("Thinness", "A plate of 2 x 2 bricks: the stiffness of bending is the square of the thickness ratio below that of shear. Where it is below the last digit of K, the plate is refused.",
     [case(f"1 : {a}", lambda a=a: bricks((2, 2, 1), (a, str(mpfr("0.8") * mpfr(a)), "1")), 6) for a in ("1", "1e1", "1e2", "1e3", "1e4", "1e5")]),
    ("Contrast of stiffness", "The middle of three bricks, Young's modulus times.",
     [case(f"{c}", lambda c=c: layered("young", c)) for c in ("1e3", "1e6", "1e9", "1e12", "1e-3", "1e-6", "1e-9", "1e-12", "1e-16")]),
    ("Contrast of density", "The middle of three bricks, density times. What `out` misses in W1 to W3 of the light ones are two modes that differ by 6e-5 in their eigenvalues.",
     [case(f"{c}", lambda c=c: layered("density", c)) for c in ("1e3", "1e6", "1e12", "1e-3", "1e-6", "1e-12")]),
    ("Poisson's ratio", "Three bricks.", [case(v, lambda v=v: with_poisson(v)) for v in ("0", "0.3", "0.49", "0.499", "0.4999", "0.49999")]),
    ("Sliver elements", "A tetrahedron on the end of a bar, of this height.", [case(f"{h} m", lambda h=h: with_sliver(h)) for h in ("1e-2", "1e-4", "1e-6", "1e-8")]),
    ("Repeated and nearly repeated modes", "A bar of square section, one side longer by this part; a cube. Eigenvalues within 10^-9 of each other are a cluster.",
     [*(case(d, lambda d=d: bricks((2, 1, 1), ("1", "0.25", str(mpfr("0.25") * (1 + mpfr(d)))))) for d in ("0", "1e-14", "1e-12", "1e-10", "1e-9", "1e-8", "1e-6", "1e-3")),
      case("cube", lambda: bricks((1, 1, 1), ("1", "1", "1")), 18)]),
    ("Nearly free mechanisms", "Two beams and a hinge of this stiffness (N m); all other springs 10^9.",
     [case(k, lambda k=k: hinged(k)) for k in ("1e6", "1e3", "1", "1e-3", "1e-6", "1e-9", "1e-12", "0")]),
    ("Singular mass", "A brick without density, mass integrated at four points, rotations without mass.",
     [case("massless brick", lambda: bricks((4, 1, 1), BAR, material=lambda c: STEEL | {"density": mpfr(0 if c[0] == 3 else 7850)})),
      case("four points", four_points, 12), case("massless rotations", massless_rotations, ALL)]),
    ("All n - 6 modes", "Elements and blocks with every mode.",
     [case("one tetrahedron", one_tetrahedron, ALL), *(case(f"{a} x {b} x {c} bricks", lambda s=(a, b, c): bricks(s, ("1", "0.45", "0.3")), ALL) for a, b, c in ((1, 1, 1), (2, 1, 1), (2, 2, 1)))]),
    ("Collinear and plane bodies", "Beams on a line, in a plane; a body in two dimensions; nodes of solids that leave no room for one.",
     [case("beams on a line", lambda: needle(LINE, "0.05")), case("springs on a line", chain), case("triangle of beams", lambda: triangle(("0.1", "0.05")), 10),
      case("2D, 1 : 3", lambda: bricks((4, 2), ("1", "0.3"))), case("2D, 1 : 100", lambda: bricks((4, 1), ("100", "1")), 6), case("2D, 1 : 10000", lambda: bricks((4, 1), ("10000", "1")), 6),
      case("bricks on a plane", lambda: flattened(["1", "1", "0"])), case("bricks on a line", lambda: flattened(["1", "0", "0"])), case("bricks on a point", lambda: flattened(["0", "0", "0"]))]),
    ("Digits of the files", "K and M written with so many digits: a bar of 1 : 3, and one of 1 : 100.",
     [*(case(f"{d}, stocky", lambda: bricks((3, 1, 1), BAR), digits=d) for d in range(8, 18)),
      *(case(f"{d}, slender", lambda: bricks((3, 1, 1), ("100", "1", "0.9")), 6, digits=d) for d in range(8, 18))]),
]
