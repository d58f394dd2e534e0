"""evidence/pages/performance.md from what benches/performance.py measured."""

import math
from statistics import median

TITLES = {"flexbody": "flexbody", "exudyn": "Exudyn", "scipy": "scipy eigsh, SuperLU", "cholmod": "scipy eigsh, CHOLMOD", "slepc": "SLEPc, MUMPS"}
SCOPE = {"flexbody": "whole process", "exudyn": "whole conversion, arrays in", "scipy": "modes alone", "cholmod": "modes alone", "slepc": "modes alone"}
LIBRARIES = {"faer": "faer", "openblas": "OpenBLAS of numpy"}
MODES = 20
SOLVE_BLOCK = {"f64": 4, "f32": 8}  # columns that flexbody solves at a time, by the precision of the factor
HEAD = """<!-- Written by benches/performance.py; edit that -->

# Performance

`./scripts/make.sh pages performance` makes the models and runs flexbody and its peers in turns. Every program computes {modes} flexible modes; the relative
residual |K x - lambda M x| / |K x| of every mode is recomputed and must be below 1e-9 (1e-8 for a million degrees of freedom), frequencies must
agree with flexbody's to 1e-8. If rounding alone exceeds this, eps | |K| |x| | / |K x| is the bound. Exudyn has no such tolerance: its
residual and frequencies are shown, not judged.

* flexbody is measured as a whole process: Matrix Market text in, checks, proof that no mode is missed, invariants, both lumped comparisons, flex-body file out.
* Peers get the matrices as arrays; reading and imports are not counted. SLEPc and scipy are measured for factorisation and modes alone, with the loosest
  tolerance that meets both conditions; Exudyn for its whole conversion. Memory is the peak of the process, models included.
* CPU is user + system seconds of all threads. Figures are medians; +/- is half the range of the runs. Model files are in the page cache. Every run
  follows an unmeasured one of the same program: a virtual machine gets memory from its host page by page, at up to 2.5 ms per MB, in the first run.
* Ratios are peer over flexbody on as many threads: above 1, flexbody needs less. `*`: measured on another occasion than flexbody's figures beside it.
"""


def number(value):
    if value is None:
        return ""
    return f"{value:.2f}" if abs(value) < 10 else f"{value:.1f}" if abs(value) < 100 else f"{value:,.0f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]


class Results:
    """Look-ups that give None for what was not measured."""

    def __init__(self, stored):
        self.cases, self.floors, self.tiers = stored["cases"], stored.get("floors"), stored.get("tiers", {})

    def program(self, case, key):
        found = self.cases.get(case, {}).get("programs", {}).get(key)
        return found if found and "failed" not in found else None

    def figure(self, case, key, what):
        found = self.program(case, key)
        return found and median(run[what] for run in found["runs"])

    def phase(self, case, key, name, what):
        found = self.program(case, key)
        phases = found["detail"]["phases"] if found else []
        return next((p[what] for p in phases if p["name"] == name), None)

    def counter(self, case, name):
        found = self.program(case, "flexbody-2")
        return found and found["detail"]["counters"].get(name)

    def dofs(self, case):
        return self.cases.get(case, {}).get("model", {}).get("dofs")

    def gemm(self, kind, threads):
        """The better of the two libraries, GF/s."""
        if not self.floors:
            return None
        return max(self.floors[library][f"gemm_{kind}"][threads - 1] for library in LIBRARIES)

    def factor_bytes(self, case):
        """Double precision where the counters do not tell."""
        entries = self.counter(case, "factor_len")
        return self.counter(case, "factor_bytes") or (entries and 8 * entries)

    def precision(self, case):
        """Of the factor, by its bytes per entry."""
        return "f32" if self.factor_bytes(case) < 6 * self.counter(case, "factor_len") else "f64"

    def tier(self, case, tier, what="wall_s"):
        """A figure of a tier."""
        return self.tiers.get(case, {}).get("tiers", {}).get(tier, {}).get(what)

    def factor_rate(self, case, threads):
        """GF/s of the factorisation, and its part of the matrix product's rate."""
        flops, wall = self.counter(case, "factor_flops"), self.phase(case, f"flexbody-{threads}", "factorisation", "wall_seconds")
        if not flops or not wall:
            return None, None
        gemm = self.gemm(self.precision(case), threads)
        return flops / wall / 1e9, gemm and flops / wall / 1e9 / gemm


# Seconds that tiers are to take at most.
TIER_SECONDS = [("block-100k", "standard", 4), ("block-100k", "fast", 2.5), ("cube-300k", "standard", 30), ("cube-300k", "fast", 12), ("cube-1m", "standard", 300),
                ("cube-1m", "fast", 90), ("shell-200k", "standard", 6), ("shell-200k", "fast", 4),
                ("frame-200k", "standard", 6), ("frame-200k", "fast", 4)]


def over(a, b):
    return a / b if a and b else None


def targets(r):
    """Name, bound, found, whether more is better."""
    best_slepc = {case: min((w for w in (r.figure(case, f"slepc-{t}", "wall_s") for t in (1, 2)) if w), default=None) for case in r.cases}
    ours = lambda case, what, threads=2: r.figure(case, f"flexbody-{threads}", what)  # noqa: E731
    found = [
        ("block-100k: CPU, Exudyn over flexbody", 40, over(r.figure("block-100k", "exudyn-1", "cpu_s"), ours("block-100k", "cpu_s", 1)), True),
        ("block-100k: memory, Exudyn over flexbody", 5, over(r.figure("block-100k", "exudyn-1", "memory_mb"), ours("block-100k", "memory_mb", 1)), True),
        ("block-100k: CPU, SLEPc over flexbody", 1, over(r.figure("block-100k", "slepc-1", "cpu_s"), ours("block-100k", "cpu_s", 1)), True),
        ("block-100k: wall, SLEPc (its better thread count) over flexbody on 2 threads", 4, over(best_slepc.get("block-100k"), ours("block-100k", "wall_s")), True),
        ("cube-300k: wall, SLEPc (its better thread count) over flexbody on 2 threads", 4, over(best_slepc.get("cube-300k"), ours("cube-300k", "wall_s")), True),
        ("cube-300k: factorisation over matrix product, 2 threads", 0.65, r.factor_rate("cube-300k", 2)[1], True),
        ("cube-1m: peak memory, MB", 18000, ours("cube-1m", "memory_mb"), False),
        ("cube-1m: residual / 1e-8", 1, over((r.program("cube-1m", "flexbody-2") or {}).get("residual"), 1e-8), False),
        ("block-30k: wall s", 3, ours("block-30k", "wall_s"), False),
        ("cube-30k: wall s", 3, ours("cube-30k", "wall_s"), False),
    ]
    for case, tier, seconds in TIER_SECONDS:
        found.append((f"{case}, `{tier}`: wall s", seconds, r.tier(case, tier), False))
    many = over(r.tier("block-100k-200-modes", "standard"), r.tier("block-100k", "standard"))
    found.append(("block-100k, `standard`: wall with 200 modes over 20", 4, many, False))
    found.append(("cube-3m, `fast`: peak memory, MB", 24000, r.tier("cube-3m", "fast", "memory_mb"), False))
    for case in r.cases:
        if (r.dofs(case) or 0) > 90000:
            found.append((f"{case}: wall, 1 thread over 2", 1.6, over(ours(case, "wall_s", 1), ours(case, "wall_s")), True))
    # A column of a cycle takes a fraction of what one takes with a factor.
    for case in (case for case in r.cases if r.counter(case, "factor_bytes")):
        found.append((f"{case}: columns solved with the factor per mode", 6, over(r.counter(case, "solved_columns"), MODES), False))
    for case in ("block-300k", "cube-300k"):
        found.append((f"{case}: condensation, CPU s", 0.6, r.phase(case, "flexbody-1", "invariants", "cpu_seconds"), False))
        reading = r.phase(case, "flexbody-2", "reading", "wall_seconds")
        found.append((f"{case}: reading on 2 threads, MB/s", 500, reading and r.cases[case]["model"]["matrix_bytes"] / reading / 1e6, True))
    return found


def target_lines(r):
    rows = []
    for name, bound, found, more in targets(r):
        if found is not None:
            met = found >= bound if more else found <= bound
            rows.append((name, ("at least " if more else "at most ") + f"{bound:,g}", number(found), "yes" if met else "**no**"))
    return rows and ["## Targets", "", *table(("", "target", "measured", "met"), rows), ""]


def spread(runs, what):
    values = [run[what] for run in runs]
    half = (max(values) - min(values)) / 2
    return number(median(values)) + (f" +/- {number(half)}" if len(values) > 1 else "")


def case_lines(r, case):
    content, rows = r.cases[case], []
    for key, record in content["programs"].items():
        name, threads = key.rsplit("-", 1)
        title = f"{TITLES[name]} ({SCOPE[name]})"
        if "failed" in record:
            rows.append((title, threads, f"failed: {record['failed']}", *[""] * 8))
            continue
        own = r.program(case, f"flexbody-{threads}")
        mark = "*" if own and own["session"] != record["session"] else ""
        ratios = ["1"] * 3 if name == "flexbody" else [
            number(over(r.figure(case, key, what), r.figure(case, f"flexbody-{threads}", what))) + mark for what in ("cpu_s", "wall_s", "memory_mb")]
        rows.append((title, threads, *[spread(record["runs"], what) for what in ("cpu_s", "wall_s", "memory_mb")], *ratios,
                     f"{record['residual']:.0e}", f"{record['difference']:.0e}", len(record["runs"])))
    model = content["model"]
    about = ", ".join([f"{model['dofs']:,} DOF"] + ([f"{' x '.join(map(str, model['cells']))} hexahedra"] if "cells" in model else [f"{model['elements']:,} elements"])
                      + [f"{model['stiffness_entries'] / 1e6:.1f} million entries in K", f"{model['matrix_bytes'] / 1e6:,.0f} MB of text"])
    head = ("program", "threads", "CPU s", "wall s", "memory, MB", "CPU ratio", "wall ratio", "memory ratio", "residual", "frequencies differ", "runs")
    own = next((r.program(case, f"flexbody-{t}") for t in (2, 1) if r.program(case, f"flexbody-{t}")), None)
    floor = max((record.get("floor", 0.0) for record in content["programs"].values()), default=0.0)
    remarks = [f"Rounding alone leaves residuals of {floor:.0e}."] if floor > 1e-9 else []
    if own and floor == 0.0 and own["residual"] > 1e-9:
        remarks.append("flexbody accepts such residuals where rounding leaves them, by its own estimate; no peer was measured.")
    remarks += [f"flexbody: {own['completeness']}."] if own else []
    return [f"### {case}", "", about + ".", "", *table(head, rows), "", " ".join(remarks), ""]


def phase_lines(r):
    cases = [case for case in r.cases if r.program(case, "flexbody-2")]
    if not cases:
        return []
    names = list(dict.fromkeys(p["name"] for case in cases for p in r.program(case, "flexbody-2")["detail"]["phases"]))
    rows = [[name, *[" / ".join(number(r.phase(case, f"flexbody-{t}", name, "wall_seconds")) for t in (1, 2)) for case in cases]] for name in names]
    counters = list(dict.fromkeys(key for case in cases for key in r.program(case, "flexbody-2")["detail"]["counters"]))
    work = [[name.replace("_", " "), *[f"{r.counter(case, name):,}" if r.counter(case, name) is not None else "" for case in cases]] for name in counters]
    return ["## Time of each phase", "", "Wall seconds on 1 thread / on 2, last run.", "", *table(["phase", *cases], rows), "",
            "Work, the same at any thread count.", "", *table(["counter", *cases], work), ""]


def floor_lines(r):
    if not r.floors:
        return []
    rows = [[f"matrix product, {kind}, GF/s ({title})", *map(number, r.floors[library][f"gemm_{kind}"])]
            for kind in ("f64", "f32") for library, title in LIBRARIES.items()]
    rows.append(["reading memory, GB/s", *map(number, r.floors["faer"]["read"])])
    lines = ["## Floors of this machine", "", f"Measured {r.floors['session'].replace('T', ' ')}; best of five.", "", *table(("", "1 thread", "2 threads"), rows), ""]
    rates = []
    for case in r.cases:
        for threads in (1, 2):
            rate, part = r.factor_rate(case, threads)
            if rate:
                rates.append((case, threads, r.precision(case), number(r.counter(case, "factor_flops") / 1e9), number(rate), f"{100 * part:.0f} %" if part else ""))
    if rates:
        lines += ["Numeric factorisation of K - shift M against the matrix product (the better library, same precision and threads):", "",
                  *table(("case", "threads", "factor", "GFLOP", "GF/s", "of matrix product"), rates), ""]
    passes = []
    for case in r.cases:
        # Of a search by multigrid there is no factor.
        size, columns = r.counter(case, "factor_bytes"), r.counter(case, "solved_columns")
        for threads in (1, 2):
            wall = r.phase(case, f"flexbody-{threads}", "modes", "wall_seconds")
            if size and columns and wall:
                moved = 2 * size * math.ceil(columns / SOLVE_BLOCK[r.precision(case)]) / 1e9
                floor = moved / r.floors["faer"]["read"][threads - 1]
                passes.append((case, threads, number(size / 1e9), columns, number(moved), number(floor), number(wall)))
    if passes:
        lines += [f"Solves against reading memory: the factor passes through twice for {SOLVE_BLOCK['f64']} columns ({SOLVE_BLOCK['f32']} of single precision), which takes the floor's seconds; the phase `modes` is the "
                  "solves, the products, the orthogonalisation and the final refinement. Factors that fit in the cache go below the floor.", "",
                  *table(("case", "threads", "factor, GB", "columns", "read, GB", "floor, s", "modes, s"), passes), ""]
    return lines


def growth_lines(r):
    """Exponents p of work ~ DOF^p between 30k and 300k."""
    theory = [
        ("factor operations", lambda c: r.counter(c, "factor_flops"), 2.0), ("factor entries", lambda c: r.counter(c, "factor_len"), 4 / 3),
        ("factorisation, wall on 1 thread", lambda c: r.phase(c, "flexbody-1", "factorisation", "wall_seconds"), 2.0),
        ("modes, wall on 1 thread (solves)", lambda c: r.phase(c, "flexbody-1", "modes", "wall_seconds"), 4 / 3),
        ("invariants, CPU", lambda c: r.phase(c, "flexbody-1", "invariants", "cpu_seconds"), 1.0),
        ("flexbody, CPU on 1 thread", lambda c: r.figure(c, "flexbody-1", "cpu_s"), None), ("flexbody, wall on 2 threads", lambda c: r.figure(c, "flexbody-2", "wall_s"), None),
        ("SLEPc, CPU on 1 thread", lambda c: r.figure(c, "slepc-1", "cpu_s"), None), ("peak memory of flexbody", lambda c: r.figure(c, "flexbody-1", "memory_mb"), None),
    ]
    rows = []
    for name, look, expected in theory:
        found = []
        for shape in ("block", "cube"):
            small, large = f"{shape}-30k", f"{shape}-300k"
            growth = over(look(large), look(small))
            found.append(number(math.log(growth) / math.log(r.dofs(large) / r.dofs(small))) if growth else "")
        if any(found):
            rows.append((name, *found, number(expected) if expected else "between 4/3 and 2" if "memory" not in name else "between 1 and 4/3"))
    if not rows:
        return []
    return ["## Growth", "", "Exponent p of cost ~ DOF^p between 30k and 300k; theory is nested dissection of a compact solid (factor operations n^2, "
            "entries n^(4/3)); a slender block grows like a compact one only once its cross-section has many nodes.", "", *table(("", "block", "cube", "theory"), rows), ""]


def tier_lines(tiers):
    """What each `--accuracy` costs and gives."""
    if not tiers:
        return []
    rows = []
    for case, found in tiers.items():
        for tier, own in found["tiers"].items():
            errors = [f"{own[key]:.0e}" if key in own else "" for key in ("frequency", "invariant")]
            way = "cycles" if own["without_factor"] else "factor"
            proof = "proved" if own["completeness"].startswith("proved") else "not proved"
            rows.append((case if tier == "fast" else "", f"`{tier}`", number(own["wall_s"]), number(own["cpu_s"]), number(own["memory_mb"]), way, f"{own['residual']:.0e}", proof, *errors))
    commits = ", ".join(f"{case} on {found['machine']['processor']} at commit {found['commit']}" for case, found in tiers.items())
    said = (f"Whole processes on two threads, from Matrix Market text to the file, in turns (`python3 benches/tiers.py`; {commits}). Errors are "
            "those beside the last tier of the case: the largest relative difference of a frequency, and of an invariant in the norms of `compare`.")
    head = ("case", "`--accuracy`", "wall, s", "CPU, s", "memory, MB", "modes by", "residual", "completeness", "frequencies", "invariants")
    return ["## Tiers", "", said, "", *table(head, rows), ""]


def reader_lines(found):
    """How fast the files of FE programs are read."""
    if not found:
        return []
    rows = [(row["form"], number(row["dofs"]), number(row["files_mb"]), number(row["wall_s"]), number(row["cpu_s"]), number(row["files_mb"] / row["wall_s"]),
             number(row["memory_mb"]), number(row["memory_mb"] / row["kept_mb"])) for row in found["rows"]]
    said = (f"Files of FE programs for a cube, on two threads (`python3 benches/readers.py`; {found['machine']['processor']}, commit {found['commit']}, medians of {found['runs']}): "
            "the whole process of `prepare` until its check of rigid motion, which one misplaced node fails. Memory is also given over that of K and M in compressed columns.")
    head = ("form", "rows", "files, MB", "wall, s", "CPU, s", "MB/s", "memory, MB", "over K and M")
    return ["## Readers", "", said, "", *table(head, rows), ""]


def render(stored):
    r, machine = Results(stored), stored.get("machine", {})
    versions, loads = {}, []
    for content in r.cases.values():
        for record in content["programs"].values():
            loads.append(record["load"])
            versions |= record.get("versions", {})
    lines = [HEAD.format(modes=MODES)]
    if machine:
        lines += [f"Machine: {machine['processor']}, {machine['cores']} cores, {machine['memory_gb']} GB, {machine['system']}; load average when a case began: "
                  f"{min(loads, default=0)} to {max(loads, default=0)}.", "",
                  "Versions: " + ", ".join(f"{name} {version}" for name, version in sorted(versions.items())) + ".", "", "Measured by:", ""]
        lines += [f"* {when.replace('T', ' ')}, commit {session['commit']}: `{session['command']}`" for when, session in stored["sessions"].items()] + [""]
    lines += target_lines(r) + tier_lines(stored.get("tiers")) + reader_lines(stored.get("readers")) + ["## Cases", ""]
    for case in r.cases:
        lines += case_lines(r, case)
    return "\n".join(lines + phase_lines(r) + floor_lines(r) + growth_lines(r)).rstrip() + "\n"
