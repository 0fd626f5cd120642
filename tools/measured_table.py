"""Turns the reports of tools/document into docs/measured.md (on standard output): python3 measured_table.py FOLDER."""
import json
import pathlib
import platform
import sys

folder = pathlib.Path(sys.argv[1])


def load(name):
    return json.loads((folder / f"{name}.json").read_text())


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def um(millimeters):
    return f"{1000 * millimeters:.3g}"


def row(name, label):
    r = load(name)
    step = r["step_us"]
    outcome = "met" if r["outcome"]["met"] else "not met"
    return (f"| {label} | {r['ticks']} | {step['p50']:.1f} / {step['p999']:.1f} / {step['max']:.0f} | {r['rows']['p50']} / {r['rows']['max']}"
            f" | {um(r['penetration_mm']['max'])} | {um(r['hover_mm']['p99'])} | {r['force_N']['max']:.2f} | {r['rows_truncated']} | {outcome} |")


print(f"""# Measured

Made by `tools/document` on one core of: {processor()}. Times are thread CPU times of `step()` without the shadow; on a shared
machine p99.9 and the maximum include the machine's own noise. Penetration is recomputed beside the tick: in
default mode from all triangles, in paper mode from the gaps of the sphere trees.

## Scenes, default mode (exact solver) and paper mode (PQP, 0.01 N·mm)

| scene, mode | ticks | step µs: median / p99.9 / max | rows: median / max | penetration µm, max | hover µm, p99 | force N, max | rows truncated | outcome |
|---|---|---|---|---|---|---|---|---|""")
for scene in ("bunnies", "spline", "wedge", "plate", "dental", "dental-inflamed"):
    for mode in ("default", "paper"):
        print(row(f"{scene}-{mode}", f"`{scene}`, {mode}"))

print(row("bunnies-10khz", "`bunnies`, default, 10 kHz, paced by the clock"))

print("""
## Rendering with each solver (bunnies, default mode)

| solver | ticks | step µs: median / p99.9 / max | rows: median / max | penetration µm, max | hover µm, p99 | force N, max | rows truncated | outcome |
|---|---|---|---|---|---|---|---|---|""")
for report in sorted(folder.glob("bunnies-solver-*.json")):
    print(row(report.stem, f"`{load(report.stem)['solver']}`"))

print("""
## Speed against error: an approximate solver as shadow of the exact one (bunnies)

| tolerance N | shadow µs: median / p99 | force error N: median / p99 / max |
|---|---|---|""")
for tolerance in ("1", "0.1", "0.01", "0.001"):
    r = load(f"shadow-{tolerance}")
    e = r["shadow_force_error_N"]
    print(f"| {tolerance} | {r['shadow_us']['p50']:.1f} / {r['shadow_us']['p99']:.1f} | {e['p50']:.2g} / {e['p99']:.2g} / {e['max']:.2g} |")
