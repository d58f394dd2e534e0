"""Sections of evidence/pages/seeds.md on motions with and without terms, and on the claims of the paper; for make_seeds.py."""

import numpy as np

import seeds_flywheel
import seeds_slider_crank

FLYWHEEL = """Guidelines I to IV in a motion: a steel beam of @LENGTH@ x @WIDTH@ x @HEIGHT@ m, without and with a wheel of @MASS@ kg (a square frame of 0.2 m in the finite element model), tumbles freely with @SPEED@ of its first circular frequency about an axis
that is neither along nor across the beam, the first mode bent by @DEFLECTION@ of the length, for @PERIODS@ periods of that mode. Terms beside I0, from the body itself and, in brackets, from the bare beam with the inertia of the wheel as `attachment.inertia` of a
scene; the largest product of inertia of W1 Q stands beside the smaller of its two moments:

@SIZES@
The inertia of the bare beam and that of the wheel, as a box and about the common centre, add up to I0 of the body to @INERTIA@.

Errors of the guidelines, as in [trade.md](trade.md#guidelines-i-to-iv): attitude in radians / root of the elastic energy, relative; **bold** above 1e-3 rad or 1 %. "IV rotation" is III with W1 Qd omega in the rows of the rotation as the only Coriolis term, "IV normal" has the
Coriolis force on the modes too. The separate program agrees with `flexbody simulate` to @AGREE@, with all terms and with those of W1 alone (`reduce --terms W1`).

@ERRORS@
Conclusion: the wheel makes the quadratic terms about the axis of the beam a thousand times smaller beside I0, and the attitude no longer depends on them. In the middle, I0 alone has the attitude to @MIDDLE@ rad. At the end the wheel moves the axis of the beam away from the
common centre, so that bending changes products of inertia, which the sizes about the principal axes do not contain; the normal case of IV needs W1 Qd omega there, and has the attitude to @END@ rad instead of @END_THREE@. The elastic energy needs the Coriolis force on the modes in all cases
(IV normal). The bare beam needs all terms. `advise --attached` takes a point mass, which adds nothing about the axis of the beam: state the moments of a wheel as `attachment.inertia` in a scene for `select`.
"""

SLIDER_CRANK = """Crank, rod and block in Exudyn: a heavy wheel turns a flexible crank (@CRANK@ m, @CRANK_MODES@ modes from @CRANK_HZ@ Hz), which is clamped to it; a pin joins it to the slender beam as the rod (@ROD_MODES@ modes from @ROD_HZ@ Hz), and a ball joint joins the rod to a block of
@BLOCK@ kg that slides along a line. Both flexible bodies hold the same groups of terms (`flexbody reduce --terms`, then `export --to exudyn`). One turn of @STEPS@ steps, damping ratio @DAMPING@. Differences are relative to all terms: of the deflections in the middle of rod and crank the
largest, of the force of the pin the root mean square over the second half of the turn. Seconds are those of the processor, medians of @RUNS@ runs in turns.

@TABLE@
Half the step changes the deflections of the rod by @HALVED@ at @SLOW@ rad/s. The rod alone in `flexbody simulate`, with the same groups and driven by the attitude and the joint forces of the same run, has the same deflections to @SIMULATED@ for every set: both programs solve the same equations
without the terms.

Conclusion: the terms have little effect here. Without any of them the deflections are off by @NONE@ at @SLOW@ rad/s, mainly without W2 (centrifugal softening) for the rod and without W1 (centrifugal load) for the crank; W1 and W2 together leave @BOTH@. W3 has no effect, since all parts bend in one plane. At
@FAST@ rad/s the rod bends by @BENT@ mm, and W3 without W2 has no solution: the coupling Q'W3 then takes @COUPLED@ times I0 from the rotation about the axis of the rod, so that the mass matrix is not positive definite; the quadratic inertia Q'W2 Q is what prevents this.

Terms save no time in Exudyn: @LEAST_SECONDS@ to @MOST_SECONDS@ s for all sets, the differences being those of the measurement. Its object has no form without the terms, and an exported body has zeros in their place. `simulate` leaves them out (@LEAST_OWN@ to @MOST_OWN@ s with reading
and writing of files); `trade` measures what this saves in a [C program](trade.md).
@MBDYN@
"""

ABSENT = """
MBDyn is not installed where this page was made, so that its column is missing: `make_seeds.py --mbdyn PROGRAM` adds it. Exported bodies in MBDyn: [exports](exports.md).
"""


def number(value):
    return f"{value:.2g}" if value == 0 or 1e-3 <= abs(value) < 1e4 else f"{value:.1e}"


def percent(value):
    if value == 0:
        return "0"
    return f"{100 * value:.2g} %" if value >= 1e-6 else f"{100 * value:.0e} %"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def filled(text, words):
    for name, value in words.items():
        text = text.replace(f"@{name}@", str(value))
    return text


def flywheel(study):
    """The section of the beam with a flywheel."""
    bare, middle, end = study.cases
    rows = []
    for case in study.cases:
        pairs = [number(own) if case.attached is None else f"{number(own)} ({number(case.attached[at])})" for at, own in enumerate(case.sizes)]
        rows.append([case.name, f"{case.frequency:.3g}", ", ".join(f"{value:.2g}" for value in case.inertia), *pairs[1:], number(case.products)])
    sizes = table(["body", "first mode (Hz)", "I0 along x, y, z (kg m^2)", "Q'W2 Q", "Q'W3", "product of inertia of W1 Q"], rows)
    rows = [[case.name, *[both(case.errors[name]) for name in study.names]] for case in study.cases]
    module = seeds_flywheel
    return filled(FLYWHEEL, {
        "LENGTH": f"{module.LENGTH:g}", "WIDTH": module.WIDTH, "HEIGHT": module.HEIGHT, "MASS": f"{study.wheel.mass:.3g}", "SPEED": module.SPEED, "DEFLECTION": f"{100 * module.DEFLECTION:g} %",
        "PERIODS": module.PERIODS, "SIZES": sizes, "INERTIA": f"{max(case.inertia_error for case in (middle, end)):.0e}", "AGREE": f"{max(max(case.agree, case.group_agree) for case in study.cases):.0e}",
        "ERRORS": table(["body", *study.names], rows), "MIDDLE": number(middle.errors["I"]["attitude"]), "END": number(end.errors["IV normal"]["attitude"]), "END_THREE": number(end.errors["III"]["attitude"]),
    })


def both(errors):
    """Errors of attitude and elastic energy, in bold where they are too large."""
    if errors is None:
        return "**does not run**"
    return " / ".join(f"**{number(errors[key])}**" if errors[key] > most else number(errors[key]) for key, most in seeds_flywheel.TOLERANCE.items())


def mbdyn_words(study, speed):
    """The same sets in MBDyn."""
    rows = [[terms, *(["no solution", ""] if row is None else [percent(row[1]), f"{row[0]:.2g}"])] for terms, row in study.rows.items()]
    return f"\nThe same mechanism in MBDyn at {speed:g} rad/s (its implicit method with a spectral radius of 0.9, one run each):\n\n" + table(["groups", "rod", "seconds"], rows)


def slider_crank(study, in_mbdyn):
    """The section of the mechanism."""
    module, (slow, fast) = seeds_slider_crank, seeds_slider_crank.SPEEDS
    head = ["groups", *[f"{what}, {speed:g} rad/s" for speed in (slow, fast) for what in ("rod", "crank", "pin force")], f"seconds in Exudyn, {slow:g} rad/s", "rod in `simulate`: difference, seconds"]
    rows = []
    for at, terms in enumerate(module.SETS):
        row = [terms]
        for speed in (slow, fast):
            run, whole = study.runs[speed][at], study.runs[speed][-1]
            row += ["no solution", "", ""] if run.stops else [""] * 3 if run is whole else map(percent, run.differences(whole))
        run = study.runs[slow][at]
        rows.append([*row, f"{np.median(run.seconds):.2g}", f"{percent(run.simulated)}, {run.simulated_seconds():.2g}"])
    runs = dict(zip(module.SETS, study.runs[slow]))
    own = [run.simulated_seconds() for run in study.runs[slow]]
    seconds = [float(np.median(run.seconds)) for run in study.runs[slow]]
    worst = {terms: max(runs[terms].differences(runs["all"])[:2]) for terms in ("none", "W1,W2")}
    return filled(SLIDER_CRANK, {
        "CRANK": module.CRANK, "CRANK_MODES": module.MODES["crank"], "CRANK_HZ": f"{study.first['crank']:.0f}", "ROD_MODES": module.MODES["rod"], "ROD_HZ": f"{study.first['rod']:.0f}",
        "BLOCK": f"{module.BLOCK:g}", "STEPS": module.STEPS, "DAMPING": module.DAMPING, "RUNS": module.RUNS, "TABLE": table(head, rows), "HALVED": percent(study.halved), "SLOW": f"{slow:g}", "FAST": f"{fast:g}",
        "SIMULATED": percent(max(run.simulated for run in study.runs[slow])), "NONE": percent(worst["none"]), "BOTH": percent(worst["W1,W2"]),
        "BENT": f"{1e3 * np.abs(study.runs[fast][-1].deflections['rod']).max():.0f}", "COUPLED": f"{study.coupled[fast]:.2g}", "LEAST_SECONDS": f"{min(seconds):.2g}", "MOST_SECONDS": f"{max(seconds):.2g}",
        "LEAST_OWN": f"{min(own):.2g}", "MOST_OWN": f"{max(own):.2g}", "MBDYN": mbdyn_words(in_mbdyn, slow) if in_mbdyn else ABSENT,
    }).rstrip() + "\n"


def split(bodies, holds):
    """The bodies on which a claim holds, and those on which it does not."""
    yes, no = ([name for name in bodies if holds(name) is answer] for answer in (True, False))
    if not no:
        return "holds on all bodies"
    if not yes:
        return "does not hold on any body"
    return f"holds: {', '.join(yes)}; does not hold: {', '.join(no)}"


def claims(bodies, sizes, wheels, crank):
    """Each claim with the bodies on which it holds."""
    by_name = {body.name: body for body in bodies}
    names = list(by_name)
    speeds = sorted({key[2] for key in sizes if isinstance(key, tuple)})
    negligible = 0.05

    def ratio(name):
        linear, quadratic = by_name[name].table_4()
        return quadratic / linear

    def beside_inertia(name):
        return max(sizes[name][term][0] for term in ("W1 Q", "Q'W2 Q", "Q'W3"))

    def late(name):
        body = by_name[name]
        return max(body.linear()[8:].max(), body.quadratic()[8:].max(), body.coupled()[8:].max())

    def coriolis(speed):
        return lambda name: bool(sizes[name, 0.01, speed]["2 W3'Qd w"][0] <= negligible)

    def holds(case, guideline):
        errors = case.errors[guideline]
        return errors is not None and all(bool(errors[key] <= most) for key, most in seeds_flywheel.TOLERANCE.items())

    def attitude(case, guideline):
        return bool(case.errors[guideline]["attitude"] <= seeds_flywheel.TOLERANCE["attitude"])

    cases = {case.name: case for case in wheels.cases}
    slow = crank.runs[seeds_slider_crank.SPEEDS[0]]
    off = max(slow[0].differences(slow[-1])[:2])
    rows = [
        ["the quadratic inertia Q'W2 Q is two to three orders of magnitude below the linear one W1 Q (Table 4)", "Table 4 at most 0.01", split(names, lambda name: bool(ratio(name) <= 0.01))],
        ["amplitudes that fall like 1 / lambda leave few modes that count (5.2)", "terms of modes 9 to 20 below 1 %", split(names, lambda name: bool(late(name) <= 0.01))],
        ["I0 is enough where the body is neither soft nor slender (I)", "terms beside I0 at most 5 % at a deflection of 1 %", split(names, lambda name: bool(beside_inertia(name) <= negligible))],
        ["slender free bodies need Q'W2 Q and Q'W3 (III)", "larger than 5 %", split(["slender beam"], lambda name: bool(sizes[name]["Q'W2 Q"][0] > negligible)).replace("all bodies", "the slender beam")],
        ["the loss of modal mass is at most (40)", "the inequality", split(names, lambda name: bool(by_name[name].coupled().max() <= by_name[name].coupling_bound()))],
    ]
    rows += [["Coriolis forces may be left out where speed over frequency is small (IV, corrected)", f"at most 5 % at {speed:g} Omega_1", split(names, coriolis(speed))] for speed in speeds]
    rows += [
        ["I0 is enough where stiffly attached inertia is large (I)", "attitude to 1e-3 rad in the motion above", split(list(cases), lambda name: attitude(cases[name], "I"))],
        ["of the Coriolis torques W1 Qd omega is enough unless the body is slender and free (IV, normal case)", "attitude to 1e-3 rad, elastic energy to 1 % in the motion above", split(list(cases), lambda name: holds(cases[name], "IV normal"))],
        ["terms change the motion of crank, rod and block little (9)", f"deflections to 1 % without any term at {seeds_slider_crank.SPEEDS[0]:g} rad/s", f"{'holds' if off <= 0.01 else 'does not hold'} ({percent(off)})"],
        ["terms that are left out save time (9)", "seconds in Exudyn", "does not hold in Exudyn, whose object has no form without them"],
    ]
    return "Claims of sections 5 to 9 and of the guidelines, shortened, with the criterion of each test.\n\n" + table(["claim", "criterion", "result"], rows)


def words(bodies, sizes, wheels, crank, in_mbdyn):
    """The sections by their names."""
    return {"FLYWHEEL": flywheel(wheels), "SLIDER_CRANK": slider_crank(crank, in_mbdyn), "CLAIMS": claims(bodies, sizes, wheels, crank)}
