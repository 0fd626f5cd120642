"""Writes the measured part of docs/benchmarks.md from a run of `touchstone bench` and runs of its suites:
python3 bench_page.py FOLDER HARD_FOLDER MESH_FOLDER. With MESH_FOLDER alone it writes the section on contact between meshes."""
import csv
import json
import math
import pathlib
import shutil
import sys

PAGE = pathlib.Path("docs/benchmarks.md")
PICTURES = pathlib.Path("docs/pictures")
HARD_CSV = pathlib.Path("docs/benchmarks/hard.csv")
BEGIN, END = "<!-- measured: made by tools/document_bench -->", "<!-- end of measured -->"
MESH_BEGIN, MESH_END = "## Contact between meshes\n", "## Speed against error by geometry\n"
LANES, GHZ, BYTES_PER_NS = 8, 3.0, 20  # floats per register; conservative clock rate and level-2 bandwidth
USUAL_TOLERANCE = 0.01  # N, in the paper's form N·mm
GEOMETRIES = ("spheres", "mesh")

# Between meshes: scene and motion, and the goals of a tick whose lists another thread finds and of one that finds its own:
# median and p99.9, µs. If a motion jumps, its worst tick counts.
MESH_GOALS = [(("bunnies", "together"), (3, 45), (4, 150)),
              *(((f"spline{suffix}", "demonstration"), (2, 60), (2, 250)) for suffix in ("", "-01", "-002", "-001")),
              (("peg-h7", "demonstration"), (4, 90), (5, 350)),
              (("peg-1024", "demonstration"), (12, 400), (20, 2000)),
              (("nut", "demonstration"), (40, 400), (60, 900))]
JUMPS = (("bunnies", "hard-05-teleport"), ("peg-h7", "hard-20-walk"), ("nut", "hard-20-walk"))
JUMP_GOALS = 1000, 3000
OPENING_GOALS = 8, 300  # s and bytes per triangle, of two parts with a million triangles each

mesh_folder = pathlib.Path(sys.argv[-1])
mesh = json.loads((mesh_folder / "bench.json").read_text())


def plain(r, geometry="spheres"):
    return (r["mode"] == "default" and r["solver"] == exact and r["geometry"] == geometry and r["leaves"] == 0
            and not any(word in r["key"] for word in ("/linearizations=", "/fixed-margin", "/list-worker")))


def slope(points):
    """Exponent of the growth, by least squares in logarithms."""
    logs = [(math.log(x), math.log(y)) for x, y in points if x > 0 and y > 0]
    mx, my = (sum(v) / len(logs) for v in zip(*logs))
    return sum((x - mx) * (y - my) for x, y in logs) / sum((x - mx) ** 2 for x, _ in logs)


def of_qp(solver, form, start, tolerance, count):
    return next((c for c in qp if (c["solver"], c["form"], c["start"], c["tolerance"], c["rows"])
                 == (solver, form, start, tolerance, count)), None)


def verdict(value, asked):
    return "reached" if value <= asked else "**not reached**"


def verdicts(r, keys, goals):
    """What is reached when several values have a goal each: all, none, or which is not."""
    names = {"step_p50_us": "median", "both_p50_us": "median", "step_p999_us": "p99.9", "step_worst_us": "worst"}
    missed = [names[key] for key, goal in zip(keys, goals) if not (r["valid"] and r[key] <= goal)]
    return "reached" if not missed else "**not reached**" + (f": {', '.join(missed)}" if len(missed) < len(goals) else "")


def asked_table():
    out = ["| | goal | measured | |", "|---|---|---|---|"]

    def add(what, asked, value, unit):
        out.append(f"| {what} | ≤ {asked:g} {unit} | {value:.3g} {unit} | {verdict(value, asked)} |")

    bunnies = [r for r in valid if plain(r) and r["scene"] == "bunnies" and "inside" not in r["motion"]]
    if bunnies:
        keys, goals = ("step_p50_us", "step_p999_us", "step_worst_us"), (8, 70, 300)
        slowest = {key: max(bunnies, key=lambda r: r[key]) for key in keys}
        most = {"valid": True, **{key: r[key] for key, r in slowest.items()}}
        names = ", ".join(dict.fromkeys(f"`{r['motion']}`" for r in slowest.values()))
        out.append(f"| hard cases on bunnies except case 11, the slowest ({names}): median / p99.9 / worst | ≤ {' / '.join(map(str, goals))} µs |"
                   f" {times(most, keys)} µs | {verdicts(most, keys, goals)} |")
        slow = sum(r["step_slow_share"] * r["ticks"] for r in bunnies) / sum(r["ticks"] for r in bunnies)
        add("share of their ticks that take more than 70 µs", 0.1, 100 * slow, "%")
    for r in valid:
        if plain(r) and r["scene"] == "bunnies" and "inside" in r["motion"]:
            add(f"`{r['motion']}` (case 11), worst of its first ten ticks", 2000, r["step_first_ten_us"], "µs")
            add(f"`{r['motion']}`, median of all its ticks", 8, r["step_p50_us"], "µs")
            add(f"`{r['motion']}`, worst of all its ticks", 300, r["step_worst_us"], "µs")
    for scene, clearance, asked in (("spline", 0.2, (40, 320, 500)), ("spline-01", 0.1, (110, 700))):
        for r in valid:
            with_worker = "/list-worker" in r["key"] and r["geometry"] == "spheres"
            if r["scene"] != scene or not r["motion"].startswith("hard-12") or not (plain(r) or with_worker):
                continue
            keys = ("both_p50_us", "step_p999_us", "step_worst_us")[:len(asked)]
            which = (("median of both threads' sum" if with_worker else "median"), "p99.9", "worst")[:len(asked)]
            out.append(f"| splined peg, clearance {clearance} mm, {r['tool_leaves']:,} and {r['obstacle_leaves']:,} leaves, {'with' if with_worker else 'without'}"
                       f" the list worker: {' / '.join(which)} | ≤ {' / '.join(map(str, asked))} µs | {times(r, keys)} µs | {verdicts(r, keys, asked)} |")
    for start, asked in (("cold", 3), ("warm", 1.5)):
        add(f"exact solver, 200 rows, {start}, median", asked, of_qp(exact, "default", start, 0, 200)["median_us"], "µs")
    add("exact solver, 200 rows, p99 of cold and warm", 5, max(of_qp(exact, "default", s, 0, 200)["p99_us"] for s in ("cold", "warm")), "µs")
    for solver in approximate:
        paper = of_qp(solver, "paper", "cold", 0.0001, 200)
        ours = min((c for c in qp if c["solver"] == solver and c["form"] == "default" and c["rows"] == 200 and c["start"] == "cold"
                    and paper and c["median_error_N"] <= paper["median_error_N"]), key=lambda c: c["median_us"], default=None)
        if ours:
            ratio = paper["median_us"] / ours["median_us"]
            out.append(f"| `{solver}` at {ours['tolerance']:g} N, compared with the paper's form at {paper['tolerance']:g} N·mm, 200 rows, at no larger "
                       f"median error ({ours['median_error_N']:.2g} and {paper['median_error_N']:.2g} N) | ≥ 5 times faster | {ratio:.1f} times | "
                       f"{'reached' if ratio >= 5 else '**not reached**'} |")
    # In cases 3 to 5 the device itself jumps or moves fast, and the force follows it.
    slides, follows = ("hard-01", "hard-08", "hard-13"), ("hard-03", "hard-04", "hard-05")
    for what, key, of, asked, unit in (
            ("penetration where the rows are feasible, all motions below", "penetration_max_mm", lambda m: True, 1e-3, "mm"),
            ("hover, sliding and at rest (cases 1, 8, 13)", "hover_max_mm", lambda m: m.startswith(slides), 0.01, "mm"),
            ("hover, all other cases", "hover_max_mm", lambda m: not m.startswith(slides), 0.5, "mm"),
            ("force per ms, sliding and at rest (cases 1, 8, 13)", "dforce_max_N_per_ms", lambda m: m.startswith(slides), 0.1, "N"),
            ("force per ms, all other cases except 3 to 5 (the device itself jumps)", "dforce_max_N_per_ms", lambda m: not m.startswith(slides + follows), 0.6, "N")):
        worst = []
        for geometry in GEOMETRIES:
            feasible = [r for r in valid if plain(r, geometry) and "inside" not in r["motion"] and r["elastic_answers"] == 0 and of(r["motion"])]
            if feasible:
                r = max(feasible, key=lambda r: r[key])
                worst.append((geometry, r[key], r["motion"]))
        if worst:
            missed = [geometry for geometry, value, _ in worst if value > asked]
            out.append(f"| {what} | ≤ {asked:g} {unit} | {', '.join(f'{g} {value:.3g} {unit} (`{motion}`)' for g, value, motion in worst)} |"
                       f" {'**not reached**: ' + ', '.join(missed) if missed else 'reached'} |")
    return out


def of_mesh(scene, motion):
    """The rows of the mesh suite with the lists found by the list worker and in the tick; None where one is not measured."""
    found = {"/list-worker" in r["key"]: r for r in mesh["rows"] if (name(r), r["motion"]) == (scene, motion)}
    return found.get(True), found.get(False)


def name(r):
    return pathlib.Path(r["scene"]).stem


def times(r, keys=("step_p50_us", "step_p999_us")):
    return " / ".join(f"{r[key]:.3g}" if r[key] < 1000 else f"{r[key]:,.0f}" for key in keys) if r["valid"] else f"failed: {r['why']}"


def mesh_goal_table():
    out = ["| scene, motion | goal, µs: list worker | measured | | goal, µs: in the tick | measured | |", "|---|---|---|---|---|---|---|"]

    def add(what, pair, goals, keys):
        cells = [f"{' / '.join(f'{number:,}' for number in goal)} | {times(r, keys)} | {verdicts(r, keys, goal)}" if r else " | | "
                 for r, goal in zip(pair, goals)]
        if any(pair):
            out.append(f"| {what} | {' | '.join(cells)} |")

    for (scene, motion), *goals in MESH_GOALS:
        what = "demonstration and all hard motions together" if motion == "together" else motion
        add(f"`{scene}` {what}: median / p99.9", of_mesh(scene, motion), goals, ("step_p50_us", "step_p999_us"))
    for scene, motion in JUMPS:
        add(f"`{scene}` {motion}: worst", of_mesh(scene, motion), [(goal,) for goal in JUMP_GOALS], ("step_worst_us",))
    return out


def opening():
    """What opening the largest parts costs, as a sentence."""
    largest = max((r for r in mesh["rows"] if name(r).startswith("pebbles")), key=lambda r: r["tool_triangles"], default=None)
    if not largest:
        return []
    goals = [f"{largest[key]:.3g} {unit} (goal: {asked}, {verdict(largest[key], asked)})"
             for key, asked, unit in (("open_cpu_s", OPENING_GOALS[0], "s of processor time"),
                                      ("surface_bytes_per_triangle", OPENING_GOALS[1], "bytes per triangle of surface"))]
    return [f"Opening two parts of {largest['tool_triangles']:,} triangles takes {' and '.join(goals)}.", ""]


def mesh_table(title, key, prefix):
    """The cost of the demonstration at both ends of a property of the scenes whose names begin with the prefix; the plot has the rest."""
    out = [f"| {title} | step µs, lists in the tick: median / p99.9 | by the list worker | rows: median / max | opening, s |"
           " surfaces, bytes per triangle | outcome |", "|---|---|---|---|---|---|---|"]
    scenes = dict.fromkeys(name(r) for r in mesh["rows"] if name(r).startswith(prefix))
    pairs = [pair for pair in (of_mesh(scene, "demonstration") for scene in scenes) if all(pair)]
    pairs.sort(key=lambda pair: pair[1][key])
    for with_worker, own in pairs[:1] + pairs[1:][-1:]:
        value = f"{own[key]:,}" if isinstance(own[key], int) else f"{own[key]:g}"
        out.append(f"| {value} | {times(own)} | {times(with_worker)} | {own['rows_p50']:.0f} / {own['rows_max']:.0f} | {own['open_cpu_s']:.2f} |"
                   f" {own['surface_bytes_per_triangle']:.0f} | {'met' if own['outcome_met'] else 'not met'} |")
    return out


def geometry_table():
    """Speed against error with the geometry as axis, on the motion that has every choice of settings."""
    chosen = [r for r in rows if r["mode"] == "default" and r["solver"] == exact and "/fixed-margin" not in r["key"]
              and (r["geometry"] == "mesh" or (r["leaves"] and "/linearizations=" not in r["key"]))]
    motion = next(((r["scene"], r["motion"]) for r in chosen if r["leaves"]), None)
    out = ["| geometry | linearizations | step µs: median / p99.9 | force error N: median / max | of which geometry | pose error: mm / rad |", "|---|---|---|---|---|---|"]
    for r in sorted(chosen, key=lambda r: (r["geometry"] == "mesh", r["leaves"], r["linearizations"])):
        if (r["scene"], r["motion"]) == motion and "/list-worker" not in r["key"]:
            what = "mesh" if r["geometry"] == "mesh" else f"spheres, {r['leaves']:,} leaves"
            error = [("" if r[key] is None else f"{r[key]:.2g}") for key in ("error_p50_N", "error_max_N", "geometry_p50_N", "error_p50_mm", "error_p50_rad")]
            out.append(f"| {what} | {r['linearizations']} | {times(r)} | {error[0]} / {error[1]} | {error[2]} | {error[3]} / {error[4]} |")
    return motion, out


def motion_table():
    out = ["| scene, motion | geometry | step µs: median / p99.9 / worst | equal constant work µs: p99.9 / worst | rows: median / max |"
           " force error N: total / geometry / linearization / solver | pose mm / rad | outcome |",
           "|---|---|---|---|---|---|---|---|"]

    def number(value):
        return "" if value is None else f"{value:.2g}"

    for r in rows:
        if not plain(r, r["geometry"]) and "/list-worker" not in r["key"]:
            continue
        motion = r["motion"] + (", with the list worker" if "/list-worker" in r["key"] else "")
        if not r["valid"]:
            out.append(f"| `{r['scene']}` {motion} | {r['geometry']} | failed: {r['why']} | | | | | |")
            continue
        errors = " / ".join(number(r[f"{k}_p50_N"]) for k in ("error", "geometry", "linearization", "solver"))
        out.append(f"| `{r['scene']}` {motion} | {r['geometry']} | {r['step_p50_us']:.1f} / {r['step_p999_us']:.0f} /"
                   f" {r['step_worst_us']:.0f} | {r['constant_p999_us']:.0f} / {r['constant_worst_us']:.0f} |"
                   f" {r['rows_p50']:.0f} / {r['rows_max']:.0f} | {errors} | {number(r['error_p50_mm'])} / {number(r['error_p50_rad'])} |"
                   f" {'met' if r['outcome_met'] else 'not met'} |")
    return out


def one_digit(value):
    return f"{float(f'{value:.1g}'):g}"


def hard_table():
    """Every hard motion by mode, geometry and solver: what they have in common. HARD_CSV has a line for each."""
    solvers = [exact, *(solver for solver in dict.fromkeys(r["solver"] for r in hard["rows"]) if solver in approximate)]
    shown = sorted((r for r in hard["rows"] if r["solver"] in solvers),
                   key=lambda r: (r["mode"], r["geometry"], solvers.index(r["solver"]), r["scene"], r["motion"]))
    lines = [("scene", "motion", "mode", "geometry", "solver", "step_p50_us", "step_p999_us", "why_without_time", "penetration_max_mm", "within_limits")]
    groups = {}
    for r in shown:
        groups.setdefault((r["mode"], r["geometry"], r["solver"]), []).append(r)
        time = (f"{r['step_p50_us']:.1f}", f"{r['step_p999_us']:.0f}", "") if r["valid"] else ("", "", r["why"])
        lines.append((r["scene"], r["motion"], r["mode"], r["geometry"], r["solver"], *time, one_digit(r["penetration_max_mm"]),
                      "yes" if r["outcome_met"] else "no"))
    HARD_CSV.parent.mkdir(exist_ok=True)
    with HARD_CSV.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(lines)

    out = ["| mode | geometry | solver | motions | without a time | longest step µs: median / p99.9 | deepest penetration, mm | limits not met |",
           "|---|---|---|---|---|---|---|---|"]
    for (mode, geometry, solver), group in groups.items():
        timed = [r for r in group if r["valid"]]
        longest = " / ".join(f"{max(r[key] for r in timed):,.0f}" for key in ("step_p50_us", "step_p999_us")) if timed else ""
        missed = [r["motion"] for r in group if not r["outcome_met"]]
        named = ", ".join(f"`{motion}`" for motion in missed) if len(missed) < 4 else str(len(missed))
        deepest = max((r["penetration_max_mm"] for r in group if not r["motion"].startswith(("hard-10", "hard-11"))), default=0)
        out.append(f"| {mode} | {geometry} | `{solver}` | {len(group)} | {len(group) - len(timed)} | {longest} | {one_digit(deepest)} | {named} |")
    return out


def screening_table():
    out = ["| solver at N, screening | rows: median / max | remaining: median / max | ticks where screening is inexact | solver µs: median / p99.9 | solver's force error N: median / max |",
           "|---|---|---|---|---|---|"]
    for r in rows:
        if "/fixed-margin" not in r["key"] or r["solver"] not in approximate:
            continue
        times = f"{r['solve_p50_us']:.1f} / {r['solve_p999_us']:.0f}" if r["valid"] else f"failed: {r['why']}"
        errors = "" if r["solver_p50_N"] is None else f"{r['solver_p50_N']:.2g} / {r['solver_max_N']:.2g}"
        out.append(f"| `{r['solver']}` at {r['tolerance']:g}, {r['screening']} | {r['rows_p50']:.0f} / {r['rows_max']:.0f} | {r['rows_screened_p50']:.0f} /"
                   f" {r['rows_screened_max']:.0f} | {r['screen_inexact_ticks']} of {r['ticks']} | {times} | {errors} |")
    return out


def growth():
    leaves = sorted((r["leaves"], r["step_p50_us"], r["error_p50_N"]) for r in valid if r["leaves"] and r["solver"] == exact
                    and r["mode"] == "default" and r["geometry"] == "spheres" and "/linearizations=" not in r["key"])
    text = [f"Step against leaves ({leaves[0][0]:,} to {leaves[-1][0]:,} a part): leaves^{slope([l[:2] for l in leaves]):.2f}."]
    error = [(n, e) for n, _, e in leaves if e]
    if len(error) > 2:
        text.append(f"Force error against leaves: leaves^{slope(error):.2f}.")
    triangles = [(r["tool_triangles"], r["step_p50_us"]) for r in mesh["rows"]
                 if name(r).startswith("pebbles") and r["valid"] and "/list-worker" not in r["key"]]
    if len(triangles) > 1:
        text.append(f"Step between meshes against triangles ({min(triangles)[0]:,} to {max(triangles)[0]:,} a part): triangles^{slope(triangles):.2f}.")
    kinds = dict.fromkeys((c["solver"], c["form"], c["start"], c["tolerance"]) for c in qp
                          if c["start"] == "cold" and c["tolerance"] in (0, USUAL_TOLERANCE))
    for solver, form, start, tolerance in kinds:
        points = [(c["rows"], c["median_us"]) for c in qp if (c["solver"], c["form"], c["start"], c["tolerance"]) ==
                  (solver, form, start, tolerance) and c["rows"] >= 100]
        text.append(f"{solver}{' in the paper form' if form == 'paper' else ''}{f' at {tolerance:g}' if tolerance else ''}, "
                    f"{start}, from 100 rows: rows^{slope(points):.2f}.")
    deep = next((r for r in valid if plain(r) and r["motion"] == "hard-02-deep"), None)
    if deep:
        depth = [(end, deep[f"depth_{end}mm_us"]) for end in (1, 2, 5, 10, 20, 40) if deep[f"depth_{end}mm_us"]]
        text.append(f"Step against depth (`hard-02-deep`, {depth[0][0]} to {depth[-1][0]} mm): depth^{slope(depth):.2f}.")
    return " ".join(text)


def floor_table():
    """The work that one linearization cannot avoid: reading the tool's pose, reading each used row twice, six unknowns."""
    out = ["| motion | rows, median | bytes | operations | floor, µs | measured, median µs |", "|---|---|---|---|---|---|"]
    for r in valid:
        if not plain(r) or r["motion"] not in ("hard-01-slide", "hard-02-deep", "hard-12-peg"):
            continue
        n, lin = r["rows_p50"], r["linearizations"]
        size, flops = lin * n * (16 + 16 + 28 + 28), lin * n * (2 * 15 + 20 + 14)
        us = (max(size / BYTES_PER_NS, flops / (2 * LANES * GHZ))) / 1000
        out.append(f"| `{r['scene']}` {r['motion']} | {n:.0f} | {size:,.0f} | {flops:,.0f} | {us:.3f} | {r['step_p50_us']:.1f} |")
    return out


def failed():
    bad = [r for r in rows if not r["valid"]]
    if not bad:
        return [f"All {len(rows)} rows of this run are valid."]
    return [f"{len(bad)} of {len(rows)} rows failed and have no time:", ""] + [f"- `{r['key']}`: {r['why']}" for r in bad]


def command(run):
    return "touchstone bench" + (f" --suite {run['suite']}" if run["suite"] != "sweep" else "") + (" --quick" if run["quick"] else "")


def replace(begin, end, text):
    page = PAGE.read_text()
    PAGE.write_text(page[:page.index(begin)] + text + page[page.index(end):])


PICTURES.mkdir(parents=True, exist_ok=True)
for picture in sorted(mesh_folder.glob("mesh_*.svg")):
    shutil.copyfile(picture, PICTURES / f"bench-{picture.name}")
meshes = [MESH_BEGIN,
          f"`{command(mesh)}`, commit {mesh['parts'][0]['commit']}. The near pairs are found in the tick, or by the list worker as in a"
          " window; the times, in µs, are those of the tick's thread.", "", *mesh_goal_table(), "", *opening(),
          "Two pebbles, the same motion with any number of triangles (`make_scenes pebbles --triangles N`):", "",
          *mesh_table("triangles per part", "tool_triangles", "pebbles"), "",
          "![Time between meshes against triangles](pictures/bench-mesh_triangles.svg)", "",
          "A splined fit of the same parts (`make_scenes spline --clearance C`):", "",
          *mesh_table("clearance, mm", "clearance_mm", "spline"), "",
          "![Time between meshes against clearance](pictures/bench-mesh_clearance.svg)", ""]
if len(sys.argv) == 2:
    replace(MESH_BEGIN, MESH_END, "\n".join(meshes) + "\n")
    sys.exit()

folder = pathlib.Path(sys.argv[1])
results = json.loads((folder / "bench.json").read_text())
hard = json.loads((pathlib.Path(sys.argv[2]) / "bench.json").read_text())
rows, qp = results["rows"], results["qp"]
exact = results["exact_solver"]
approximate = list(dict.fromkeys(c["solver"] for c in qp if c["tolerance"]))
valid = [r for r in rows if r["valid"]]
part = results["parts"][0]
for picture in sorted(folder.glob("*.svg")):
    shutil.copyfile(picture, PICTURES / f"bench-{picture.name}")
motion, geometries = geometry_table()
text = [BEGIN, f"One run of `{command(results)}`: {part['machine']['processor']}, {part['machine']['cores']} cores shared with other programs, "
        f"commit {part['commit']}, {part['compiler']}, `{part['flags']}`.", "", "## Goals and measurements", "", *asked_table(), "",
        *meshes, MESH_END,
        f"`{motion[0]} {motion[1]}`, default mode, exact solver; errors are relative to the triangle meshes.", "", *geometries, "",
        "![Time against force error by geometry](pictures/bench-geometry.svg)", "",
        "## Scenes and motions, default mode, exact solver", "",
        "*Met*: the motion stays within all limits that its scene sets: penetration, hover, noise, force per ms.", "", *motion_table(), "",
        "## Hard cases, both modes", "",
        f"`{command(hard)}`, commit {hard['parts'][0]['commit']}; [hard.csv](benchmarks/hard.csv) has each motion. The limits are those of default"
        " mode. An answer at its iteration limit, or a residual above the tolerance, has no time. The penetration leaves out cases 10 (slots"
        " that are too narrow) and 11 (begins inside).", "", *hard_table(), "", "## Growth", "", growth(), "",
        "## The floor", "", f"""The least time of a tick between spheres that knows which rows matter: it reads two leaves (16 bytes each) for each row, and writes and
reads the row as floats (28 bytes), with 15 operations per center, 20 per row and 14 to check it, at {LANES} lanes, two operations
per cycle, {GHZ:g} GHz and {BYTES_PER_NS} bytes per ns. The measured times include finding those rows.""", "", *floor_table(), "",
        "## Redundant rows removed before an approximate solver", "", f"`{next((r['scene'] + ' ' + r['motion'] for r in rows if '/fixed-margin' in r['key']), '')}`, with all rows within the margin given to the solver.", "",
        *screening_table(), "", "## Rows that do not count", "", *failed(), ""]
replace(BEGIN, END, "\n".join(text))
