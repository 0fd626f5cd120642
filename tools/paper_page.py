"""Writes the measured part of docs/paper.md from one run of `touchstone paper`: python3 paper_page.py FOLDER."""
import json
import pathlib
import shutil
import sys

PAGE = pathlib.Path("docs/paper.md")
PICTURES = pathlib.Path("docs/pictures")
BEGIN, END = "<!-- measured: made by tools/document_paper -->", "<!-- end of measured -->"

folder = pathlib.Path(sys.argv[1])
results = json.loads((folder / "paper.json").read_text())
motions = {m["name"]: m for m in results["motions"]}


def number(value, digits=3):
    return "" if value is None else f"{value:.{digits}g}" if abs(value) < 1000 else f"{value:,.0f}"


def plot(name, caption, extension="svg"):
    target = PICTURES / f"paper-{name}.{extension}"
    shutil.copyfile(folder / f"{name}.{extension}", target)
    return f"![{caption}](pictures/{target.name})"


def steps(name, caption):
    return ["| 1 | 2 | 3 | 4 |", "|---|---|---|---|",
            "| " + " | ".join(plot(f"{name}-step-{k}", f"{caption}, step {k}", "png") for k in range(1, 5)) + " |"]


def in_mode(mode, solver):
    return f"{mode} {solver}"


def claims():
    words = {True: "agrees", False: "**does not agree**", None: "agrees in part"}
    return ["| published | measured here | |", "|---|---|---|"] + [
        f"| {c['published']} | {c['measured']} | {words[c['agrees']]} |" for c in results["claims"]]


def times(name):
    out = ["| solver | collision, mean µs | optimization, mean µs | total µs: mean / p99.9 / max | iterations: mean / max |"
           " force error N, same rows: median / max | ticks solved / elastic / at their limit / invalid |", "|---|---|---|---|---|---|---|"]
    for r in motions[name]["rows"]:
        if r["mode"] == "paper":
            out.append(f"| `{r['solver']}` | {number(r['collision_mean_us'])} | {number(r['solve_mean_us'])} |"
                       f" {number(r['step_mean_us'])} / {number(r['step_p999_us'])} / {number(r['step_max_us'])} |"
                       f" {number(r['iterations_mean'])} / {number(r['iterations_max'])} |"
                       f" {number(r['force_error_p50_N'], 2)} / {number(r['force_error_max_N'], 2)} |"
                       f" {r['ticks_solved']} / {r['ticks_elastic']} / {r['ticks_iteration_limit']} / {r['ticks_invalid']} |")
    return out


def classes():
    solvers = [key.removesuffix("_p50_us") for key in results["classes"][0] if key.endswith("_p50_us")]
    paper = (results["solvers"]["former"], results["solvers"]["published"])
    out = ["| pairs | ticks | " + " | ".join(f"`{s}` µs: median / max" for s in solvers) + " | iterations, mean: " + " / ".join(f"`{s}`" for s in paper) + " |",
           "|---" * (len(solvers) + 3) + "|"]
    for c in results["classes"]:
        if c["ticks"]:
            out.append(f"| {c['pairs_from']} to {c['pairs_to']} | {c['ticks']} | "
                       + " | ".join(f"{number(c[s + '_p50_us'])} / {number(c[s + '_max_us'])}" for s in solvers)
                       + " | " + " / ".join(number(c[s + "_iterations"]) for s in paper) + " |")
    return out


def phases():
    out = ["| mode, solver | | axial force N: max / at the end | lateral N, max | torque mN·m, max | pairs, max | collision, optimization: mean µs |"
           " step µs, max | penetration mm, max |", "|---|---|---|---|---|---|---|---|---|"]
    for p in results["phases"]:
        if p["case"].startswith("paper ") or p["case"] in ("penalty", in_mode("default", results["solvers"]["exact"])):
            out.append(f"| {p['case']} | {p['phase']} | {number(p['axial_max_N'])} / {number(p['axial_end_N'], 2)} | {number(p['lateral_max_N'])} |"
                       f" {number(p['torque_max_mNm'])} | {number(p['pairs_max'])} | {number(p['collision_mean_us'])}, {number(p['solve_mean_us'])} |"
                       f" {number(p['step_max_us'])} | {number(p['penetration_max_mm'], 2)} |")
    return out


def depths():
    out = ["| motion | mode, solver | rows: median / max | step µs: median / p99 / p99.9 | penetration mm: median / max | hover mm, p99 | force N, max |"
           " force difference from the run of the exact solver N: median / max |", "|---|---|---|---|---|---|---|---|"]
    for name, motion in motions.items():
        for r in motion["rows"]:
            out.append(f"| {name} | {r['case']} | {number(r['rows_p50'])} / {number(r['rows_max'])} |"
                       f" {number(r['step_p50_us'])} / {number(r['step_p99_us'])} / {number(r['step_p999_us'])} |"
                       f" {number(r['penetration_p50_mm'], 2)} / {number(r['penetration_max_mm'], 2)} | {number(r['hover_p99_mm'], 2)} |"
                       f" {number(r['force_max_N'])} | {number(r['force_difference_p50_N'], 2)} / {number(r['force_difference_max_N'], 2)} |")
    return out


machine, shaft = results["machine"], motions["figure-7"]
former, published = results["solvers"]["former"], results["solvers"]["published"]
PICTURES.mkdir(parents=True, exist_ok=True)
text = [BEGIN, f"One run of `touchstone paper{' --quick' if results['quick'] else ''}`: {machine['processor']}, {machine['cores']} cores shared with "
        f"other programs, commit {results['commit']}, {results['compiler']}, `{results['flags']}`.", "",
        "## Published claims and measurements", "", *claims(), "",
        "## Figure 5: a bunny on a bunny", "", *steps("figure-5", "Figure 5"), "",
        plot("figure-5", f"Pairs, time with {former}, time with {published}"), "",
        "The same motion, deeper:", "", plot("figure-5-deeper", "The same, with 200 to 1000 pairs"), "",
        "Times by pairs, both motions together:", "", *classes(), "",
        "## Figure 6: mean times", "", plot("figure-6", "Mean time of collision, optimization and both, by solver"), "", *times("figure-5"), "",
        "And on the deeper motion:", "", *times("figure-5-deeper"), "",
        "## Figure 7: a splined shaft", "",
        f"{shaft['tool_leaves']:,} and {shaft['obstacle_leaves']:,} leaves, clearance 0.5 mm; the 200 deepest pairs form the constraints.", "",
        *steps("figure-7", "Figure 7"), "", plot("figure-7", f"Force, torque and time of the shaft in paper mode with {published}"), "",
        "The same motion in default mode with the exact solver:", "",
        plot("figure-7-default", "Force, torque and time of the shaft in default mode"), "", *phases(), "",
        "## Penetration with every mode and solver, on the same motions", "",
        plot("figure-5-penetration", "True penetration over time, figure 5"), "", plot("figure-7-penetration", "True penetration over time, figure 7"), "",
        *depths(), END]
page = PAGE.read_text()
PAGE.write_text(page[:page.index(BEGIN)] + "\n".join(text) + page[page.index(END) + len(END):])
