"""The words of evidence/pages/seeds.md, with the numbers that make_seeds.py has found."""

from importlib.metadata import version as version_of

import numpy as np

PAGE = """<!-- Written by evidence/programs/make_seeds.py -->

# Sizes of the terms

The tables of [WP19] (Witteveen and Pichler, On the relevance of inertia related terms in the equations of motion of a flexible body in the floating frame of reference formulation,
Multibody System Dynamics 2019) on six bodies of this repository, of the kinds that the paper studies. The bodies differ from those of the paper, and so do the numbers. Every column
has its formula. Misprints of the paper are corrected as in [theory, section 11](../../docs/theory.md#11-errors-in-the-literature).

| body | model | mass (kg) | largest extent (m) | modes | frequencies (Hz) |
|---|---|---|---|---|---|
@BODIES@

Made by `./scripts/make.sh pages seeds` with `flexbody` @VERSION@ and Exudyn @EXUDYN@. Free-surface modes, mass-normalised, about the centre of mass along principal axes; all numbers in kg, m, s. The car body has
nodal rotations, so that its arrays are those of [theory, section 6](../../docs/theory.md#6-mass-matrices-that-do-not-commute-with-a-rotation).

## The invariants ([WP19] Tables 2 and 3)

I0 is 3 x 3 (kg m^2), W1 3 x 60 (kg^(1/2) m), W2 60 x 60 and W3 60 x 20 (numbers without units). Largest and mean are of the magnitudes of the entries; entries below @ROUNDING@ of the largest are zeros, and not in the mean. The norm is
the root of the sum of the squares.

@INVARIANTS@
Conclusion: no entry of W2 or W3 can exceed 1, whatever the body is, and the largest ones of W2 are between @W2LEAST@ and 1 here: the size of these arrays says little about their importance. W1 differs from body to body, mainly
by mass and size: no entry can exceed 2 sqrt(I0), and the largest is @W1LEAST@ to @W1MOST@ of that. Their importance depends on the factors that they are multiplied with, which the next tables show. W3 is small for the plate, whose first modes
move all nodes in one direction: such modes do not couple by rotation. The arrays are sparse where a body is symmetric or slender, and full for the car body.

## Ratios of terms ([WP19] Tables 4 and 5)

Sizes of the terms as `flexbody select --json` states them under `significance` (`tier_1`, with the norms of the arrays): the formulas are those of [theory, section 7](../../docs/theory.md#7-sizes-of-the-terms). The body turns with a tenth of its first
frequency, omega = @SPEED@ Omega_1, about the principal axis where the term is largest, alpha = omega^2, and the deflection is @DEFLECTION@ of the largest extent: |q| is the amplitude that moves a node by that. The first three stand beside I0, the other four of them beside
the elastic or the inertia forces of the modes. The Coriolis torque (W1 Qd + Q'W2 Qd + Qd'W2 Q) omega, in its corrected form, stands beside I0 omega Omega_1 with the amplitudes of the [modes below](#significance-of-every-mode-wp19-27-28-36-to-40) at
their own frequencies: about each axis the sum over the modes of the magnitudes, largest over the axes.

@RATIOS@
Conclusion: at a deflection of @DEFLECTION@ the linear inertia is less than a tenth of I0, and the quadratic terms are smaller by another order. The slender beam is the exception that the paper studies: bending moves its mass away from an axis about which it has hardly
any inertia, and @BEAM@ of the moment about that axis is quadratic. The Coriolis force of the modes is the largest force on them nearly everywhere, since it is of the first order in omega / Omega_1 and the centrifugal loads that grow with q are of the second; the plate
hardly has one, its W3 being small. A ratio is no error: a term that is small beside another may be all that drives a slow motion ([trade.md](trade.md)).

The quadratic inertia beside the linear one, in kg m^2. Table 4: means of the terms of an entry that are not zero, times the number of terms, with @EQUAL@ modes that each move a node by @DEFLECTION@ of the extent; beside it the largest entries with
the amplitudes of all modes that the [modes below](#significance-of-every-mode-wp19-27-28-36-to-40) have, which fall like 1 / lambda:

@QUADRATIC@
Conclusion: the paper finds the quadratic inertia two to three orders of magnitude below the linear one. Here it is @TABLE_LEAST@ to @TABLE_MOST@ of it, and @TABLE_BEAM@ times as large for the slender beam; with falling amplitudes @FALLING_LEAST@ to @FALLING_MOST@, and @FALLING_BEAM@ times.
The ratio is in proportion to the deflection.

## Averaged deflections ([WP19] (19) to (22))

How much of the body a mode moves: the root mean square of the displacement of mode p over the mass, relative to its largest displacement of a node,

```math
\\bar u^2 = \\frac{1}{m} \\int u_1^2 + u_2^2 + u_3^2 \\, dm = \\frac{q^T (S_{11} + S_{22} + S_{33})\\, q}{m} \\quad (19), \\qquad \\bar u_k^2 = \\frac{q^T S_{kk}\\, q}{m} \\quad (20) - (22)
```

with the corrected third term of (19). For mass-normalised modes (19) is 1 / (sqrt(m) max |psi_i|), without any integral.

@AVERAGED@
Conclusion: the largest displacement of a mode says little about the effect of its inertia. A mode of the rod, the beam or the plate moves the body by a third to a half of its largest displacement on average, one that lives in light booms by
a few hundredths (@LOCAL@). A limit of the largest displacement therefore allows local modes
much less kinetic energy than others.

## Significance of every mode ([WP19] (27), (28), (36) to (40))

The first mode moves a node by @DEFLECTION@ of the largest extent, mode p has lambda_1 / lambda_p of its amplitude ([WP19] 5.2). The largest over the principal axes k, with the other two axes l and m:

```math
\\frac{2 \\int u_{0l} u_{fl} + u_{0m} u_{fm} \\, dm}{\\int u_{0l}^2 + u_{0m}^2 \\, dm} = \\frac{\\lvert (W_1)_{kk,p} \\rvert\\, q_p}{(I_0)_{kk}} \\quad (27), \\qquad
\\frac{\\int u_{fl}^2 + u_{fm}^2 \\, dm}{\\int u_{0l}^2 + u_{0m}^2 \\, dm} = \\frac{(W_2)_{kk,pp}\\, q_p^2}{(I_0)_{kk}} \\quad (28)
```

The inertia coupling (36) is the block Q'W3 of the mass matrix beside its diagonal blocks I0 and I. By it rotation takes modal mass away (the Schur complement (37) as corrected); (38) and (39) are the loss of the diagonal entry p:

```math
\\frac{\\lvert (Q^T W_3)_{kp} \\rvert}{\\sqrt{(I_0)_{kk}}} \\quad (36), \\qquad I - W_3^T Q\\, I_0^{-1} Q^T W_3, \\qquad 1 - m^*_{pp} = \\sum_k \\frac{(Q^T W_3)_{kp}^2}{(I_0)_{kk}} = \\sum_k \\frac{1}{(I_0)_{kk}} \\Big( \\int \\psi_{m,p}\\, u_{fl} - \\psi_{l,p}\\, u_{fm} \\, dm \\Big)^2 \\quad (37) - (39)
```

with the signs of all other amplitudes such that both are largest, and (36) about the axis where it is. The loss is at most the sum of |q|^2 / I_k over the three axes, (40). Values below 1e-9 are shown as 0.

@MODES@
Conclusion: with amplitudes that fall like 1 / lambda a few modes make all of the inertia terms; from the ninth on none is above @LATE@. Modes that bend a straight body have no linear term, since
they move mass across the distance from the axis, so that their first contribution is quadratic; what changes the inertia linearly are stretching modes and bending of bodies that are curved or have offsets. The coupling takes two modes that move the same
mass in two directions: in the beam the first and the second, which bend it in its two planes, each through the amplitude of the other.

## Bodies that qualify for guidelines I to IV ([WP19] section 8)

Guidelines as sets of terms, with the labels of [trade.md](trade.md#guidelines-i-to-iv): I keeps I0 only, II also the constant centrifugal load W1'/2, III also W1 Q and W2 Q in the load (and the inertia coupling W3(alpha)'q), "III, free" also Q'W2 Q and
Q'W3, IV everything: the Coriolis forces and torques of W2 and W3 too. A body qualifies for the first one that leaves out nothing above @NEGLIGIBLE@ of the term beside it. Where joints give the rotation, as those of a driven crank do, the inertia of the rotation itself
(W1 Q, Q'W2 Q, Q'W3 beside I0, and the Coriolis torque) does not enter the motion; of a free body it does. Beside each guideline stands the term that decides: the largest one that the guideline before it would leave out, or of I the largest that it leaves out. Deflections relative to the largest extent; the ratio of speed and frequency is omega / Omega_1 (inverted in the paper's text).

@GUIDELINES@
Conclusion: a slow body is rigid where its rotation is given: at @SLOWEST@ of the first frequency @SLOW@ of 6 qualify for I with the small deflection. II, the constant centrifugal load, is what comes first with the speed when little else bends the body (@SECOND@ of 6 at @MIDDLE@ of the
frequency): it grows with the square of the speed beside elastic forces that do not grow. At @FASTEST@ of the frequency the Coriolis force of the modes is larger, and @FAST@ of 6 need IV. For a free body the deflection counts: bent by @DEFLECTION@ @BENT@ of 6 do not qualify for I, however slow they are. The
slender beam needs everything then, since its moment about its own axis is that of its bending. A body that needs W1 Q mostly needs the Coriolis torque of the same W1 too, since the angular
momentum balances the change of inertia: a group of the kinetic energy is needed or not needed as a whole. These are conservative sizes. `select` measures the effect of a term on a given motion: compare the [errors of the guidelines](trade.md#guidelines-i-to-iv) in scenes of these bodies.

## A beam with a flywheel

@FLYWHEEL@
## A slider-crank with and without terms ([WP19] section 9)

@SLIDER_CRANK@
## Claims of the paper

@CLAIMS@
## Ninety modes in a multibody run

The slender beam with up to 90 free modes as the connecting rod of a slider-crank in Exudyn: the crank (@CRANK@ m) is a heavy wheel that turns with @OMEGA@ rad/s, a ball joint holds one end of the rod on its pin, the other end slides along a
line; damping ratio @DAMPING@ for all modes, one turn, @STEPS@ steps of generalised alpha. The body is what `flexbody export --to exudyn --points interfaces` writes. Deflections are those of the middle of the rod relative to its frame, at most
@LARGEST@ mm; differences are relative to the run with 90 modes, of deflections the largest, of the force of the ball joint the root mean square over the second half of the turn, when the shock of the undeformed start has faded. Seconds of the processor, medians of
@RUNS@ runs.

@MECHANISM@
Half the step changes the deflections by @HALVED@: that is the error of the integration. `flexbody simulate` with 90 modes, driven by the attitude and the joint forces that Exudyn found, has the same deflections to @SIMULATED@ and takes @OURS@ s.

What one learns: @ENOUGH@ modes have the deflections to 1 %. Ninety modes cost @TIMES@ times the seconds of @ENOUGH@, for frequencies up to @HIGHEST@ kHz that no step of this length resolves.
"""


def percent(value):
    return f"{100 * value:.2g} %"


def sentences(bodies, sizes, count):
    """Numbers in the sentences below the tables."""
    w1 = [np.abs(body.W1).max() / (2 * np.sqrt(body.I0.max())) for body in bodies]
    w2 = [np.abs(body.W2).max() for body in bodies]
    late = max(max(body.linear()[8:].max(), body.quadratic()[8:].max(), body.coupled()[8:].max()) for body in bodies)
    local = min(bodies, key=lambda body: body.averaged()[0].min())
    mean = local.averaged()[0]
    small, large = sorted({key[1] for key in count})
    slow, middle, fast = sorted({key[2] for key in count})
    ratios = {}
    for name, of in (("TABLE", type(bodies[0]).table_4), ("FALLING", type(bodies[0]).deformed_inertia)):
        own = {body.name: of(body)[1] / of(body)[0] for body in bodies}
        beam = own.pop("slender beam")
        ratios |= {f"{name}_LEAST": f"{min(own.values()):.2g}", f"{name}_MOST": f"{max(own.values()):.2g}", f"{name}_BEAM": f"{beam:.3g}"}
    return {
        **ratios,
        "W2LEAST": f"{min(w2):.2g}", "W1LEAST": f"{min(w1):.2g}", "W1MOST": f"{max(w1):.2g}", "LATE": percent(late),
        "LOCAL": f"mode {mean.argmin() + 1} of the {local.name}: {percent(mean.min())}",
        "SLOW": count[True, small, slow].count("I"), "SECOND": count[True, small, middle].count("II"), "FAST": count[True, large, fast].count("IV"),
        "BENT": sum(name != "I" for name in count[False, large, slow]), "SLOWEST": slow, "MIDDLE": middle, "FASTEST": fast,
        "BEAM": percent(sizes["slender beam"]["Q'W2 Q"][0]),
    }


def mechanism_words(study, module):
    rows = ["| modes | up to (kHz) | seconds in Exudyn | difference of deflections | of the joint force |", "|---|---|---|---|---|"]
    for modes, highest, seconds, deflection, force in study.rows:
        last = modes == study.rows[-1][0]
        rows.append(f"| {modes} | {highest / 1e3:.2g} | {seconds:.2g} | {'' if last else percent(deflection)} | {'' if last else percent(force)} |")
    enough = next(row for row in study.rows if row[3] <= 0.01)
    return {
        "MECHANISM": "\n".join(rows) + "\n", "CRANK": module.CRANK, "OMEGA": f"{module.SPEED:g}", "DAMPING": module.DAMPING, "STEPS": study.steps, "RUNS": module.RUNS,
        "LARGEST": f"{1e3 * study.largest:.2g}", "HALVED": percent(study.halved), "SIMULATED": percent(study.simulated), "OURS": f"{study.simulated_seconds:.2g}",
        "ENOUGH": enough[0], "TIMES": f"{study.rows[-1][2] / enough[2]:.2g}", "HIGHEST": f"{study.rows[-1][1] / 1e3:.2g}",
    }


def page(bodies, sizes, tables, count, study, module, settings, version):
    """The whole page."""
    listed = [f"| {b.name} | {b.what} | {b.mass:.3g} | {b.extent:.3g} | {b.nf} | {b.rate[0] / 2 / np.pi:.4g} to {b.rate[-1] / 2 / np.pi:.4g} |" for b in bodies]
    words = {**tables, **sentences(bodies, sizes, count), **mechanism_words(study, module), **settings, "BODIES": "\n".join(listed), "VERSION": version, "EXUDYN": version_of("exudyn")}
    text = PAGE
    for name, value in words.items():
        text = text.replace(f"@{name}@", str(value))
    assert "@" not in text, text[text.index("@") - 40 :][:80]
    return text
