"""The measurements behind docs/sphere-trees.md.

python3 tree_figures.py measure FOLDER TOUCHSTONE stores the program's results in FOLDER; write FOLDER makes the figures
and the tables between the markers of the page from them.
"""
import csv
import json
import math
import os
import pathlib
import platform
import random
import subprocess
import sys

BUNNY = "/usr/share/glmark2/models/bunny.obj"
SHAFT = ("spline", "--part", "shaft")
HOLE = ("spline", "--part", "hole")
PICTURES = pathlib.Path("docs/pictures")
PAGE = pathlib.Path("docs/sphere-trees.md")
BEGIN, END = "<!-- measured: made by tools/document_trees -->", "<!-- end of measured -->"

LEAVES = [2 ** k for k in range(6, 16)]
CURVES = {  # label: source, quality, counts of leaves
    "bunny-fast": ((BUNNY,), "fast", LEAVES),
    "bunny-best": ((BUNNY,), "best", [64, 256, 1024, 4096, 16384]),
    "shaft-fast": (SHAFT, "fast", [64, 256, 1024, 4096, 16384]),
    "shaft-best": (SHAFT, "best", [64, 256, 1024, 4096]),
}
TORI = [(32, 16), (100, 50), (320, 160), (1000, 500)]  # quads around and along; two triangles each
TORUS_LEAVES = [512, 4096]
TABLE = [  # name, label, source, options
    ("bunny-512", "bunny, 512, fast", (BUNNY,), ["--leaves", "512"]),
    ("bunny-4096", "bunny, 4,096, fast", (BUNNY,), ["--leaves", "4096"]),
    ("bunny-4096-best", "bunny, 4,096, best", (BUNNY,), ["--leaves", "4096", "--quality", "best"]),
    ("bunny-4096-solid", "bunny, 4,096, fast, solid", (BUNNY,), ["--leaves", "4096", "--interior", "solid"]),
    ("bunny-32768", "bunny, 32,768, fast", (BUNNY,), ["--leaves", "32768"]),
    ("shaft", "splined shaft, 0.02 mm", SHAFT, ["--max-error", "0.02mm", "--quality", "fast"]),
    ("hole", "splined hole, 0.02 mm", HOLE, ["--max-error", "0.02mm", "--quality", "fast"]),
]


class Measurements:
    """Runs of the program; the JSON of each is stored in a file."""

    def __init__(self, folder, touchstone=None):
        self.folder, self.touchstone = pathlib.Path(folder), touchstone

    def load(self, name):
        file = self.folder / f"{name}.json"
        return json.loads(file.read_text()) if file.exists() else None

    def run(self, name, *arguments):
        if self.load(name):
            return
        print(name, flush=True)
        aside = self.folder / f"{name}.new"
        with open(aside, "w") as out:
            child = subprocess.Popen([self.touchstone, "tree", *arguments, "--json"], stdout=out)
            _, status, usage = os.wait4(child.pid, 0)  # reports the peak memory of this child alone
        if status != 0:
            raise SystemExit(f"touchstone tree {' '.join(arguments)} failed")
        result = json.loads(aside.read_text())
        result["peak_MB"] = usage.ru_maxrss * 1024 / 1e6
        (self.folder / f"{name}.json").write_text(json.dumps(result))
        aside.unlink()

    def build(self, name, source, options):
        self.run(name, *source, *options, "--no-cache")


def torus(around, along):
    """A wavy torus, as OBJ."""
    lines = []
    for i in range(around):
        for j in range(along):
            a, b = 2 * math.pi * i / around, 2 * math.pi * j / along
            r = 3 + 0.5 * math.sin(5 * a) * math.cos(3 * b)
            axis = 10 + r * math.cos(b)
            lines.append(f"v {axis * math.cos(a):.9g} {axis * math.sin(a):.9g} {r * math.sin(b):.9g}")
    for i in range(around):
        for j in range(along):
            a, b = i * along + j + 1, i * along + (j + 1) % along + 1
            c, d = (i + 1) % around * along + j + 1, (i + 1) % around * along + (j + 1) % along + 1
            lines += [f"f {a} {c} {d}", f"f {a} {d} {b}"]
    return "\n".join(lines) + "\n"


def measure(folder, touchstone):
    m = Measurements(folder, touchstone)
    for leaves in (64, 512, 4096):
        picture = str(PICTURES / f"tree-{leaves}.png")
        m.build(f"picture-{leaves}", (BUNNY,), ["--leaves", str(leaves), "--picture", picture])
    for name, _, source, options in TABLE:
        tree = str(m.folder / f"{name}.spheres")
        m.build(f"{name}-tree", source, [*options, "-o", tree, "--export", str(m.folder / f"{name}.sph")])
        m.run(f"{name}-check", "check", tree, *source)
    for attempt in range(3):
        for threads in (1, 2):
            m.build(f"threads-{threads}-{attempt}", (BUNNY,), ["--leaves", "4096", "--threads", str(threads)])
    for around, along in TORI:
        mesh = m.folder / "torus.obj"
        missing = [n for n in TORUS_LEAVES if not m.load(f"torus-{2 * around * along}-{n}")]
        if missing:
            mesh.write_text(torus(around, along))
        for leaves in missing:
            m.build(f"torus-{2 * around * along}-{leaves}", (str(mesh),), ["--leaves", str(leaves)])
        mesh.unlink(missing_ok=True)
    for label, (source, quality, counts) in CURVES.items():
        for leaves in counts:
            m.build(f"{label}-{leaves}", source, ["--leaves", str(leaves), "--quality", quality])


def curvature(m, names):
    """The bunny's area in squared diagonals and, for each of its trees, the mean over the surface of diagonal / r, where r
    is the radius of the leaf that contains the point most deeply."""
    diagonal = m.load(f"{names[0]}-check")["diagonal_mm"]
    vertices, faces = [], []
    for line in open(BUNNY):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(tuple(map(float, words[1:4])))
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:4]])

    def area(face):
        a, b, c = (vertices[i] for i in face)
        u, v = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
        return 0.5 * math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])

    areas = [area(f) for f in faces]
    draw = random.Random(1)
    points = []
    for face in draw.choices(faces, areas, k=500):
        u, v = sorted((draw.random(), draw.random()))
        a, b, c = (vertices[i] for i in face)
        points.append([u * a[k] + (v - u) * b[k] + (1 - v) * c[k] for k in range(3)])
    means = []
    for name in names:
        lines = (m.folder / f"{name}.sph").read_text().splitlines()
        levels, branching = map(int, lines[0].split())
        slots = [tuple(map(float, line.split()[:4])) for line in lines[1:]]
        leaves = [s for s in slots[-branching ** (levels - 1):] if s[3] > 0]
        radii = [max(leaves, key=lambda s: s[3] - math.dist(p, s[:3]))[3] for p in points]
        means.append(sum(diagonal / r for r in radii) / len(radii))
    return sum(areas) / diagonal ** 2, means


def write_table(file, header, rows):
    with open(file, "w", newline="") as out:
        csv.writer(out).writerows([header, *rows])


def draw(m, constant):
    """Writes the tables of the figures and draws them."""
    rows = []
    for label, (_, _, counts) in CURVES.items():
        runs = [m.load(f"{label}-{n}") for n in counts]
        rows += [(label.replace("-", ", "), r["leaves"], r["protrusion_percent"], r["cpu_s"]) for r in runs if r]
    rows += [("theory, bunny", n, 100 * constant / n, "") for n in (LEAVES[0], LEAVES[-1])]
    write_table(m.folder / "tree-leaves.csv", ("series", "leaves", "protrusion_percent", "cpu_s"), rows)
    rows = []
    for leaves in TORUS_LEAVES:
        runs = [m.load(f"torus-{2 * a * b}-{leaves}") for a, b in TORI]
        rows += [(f"{leaves:,} leaves", r["triangles"], r["cpu_s"]) for r in runs if r]
    write_table(m.folder / "tree-triangles.csv", ("series", "triangles", "cpu_s"), rows)
    subprocess.run(["tools/plot", "trees", m.folder, PICTURES], check=True, stdout=subprocess.DEVNULL)


def processor():
    for text in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if text.startswith("model name"):
            return text.split(":", 1)[1].strip()
    return platform.machine()


def row(m, name, label):
    tree, check = m.load(f"{name}-tree"), m.load(f"{name}-check")
    if not tree or not check:
        return f"| {label} | not measured | | | | | | | | |"
    percent = 100 / check["diagonal_mm"]
    protrusion = " / ".join(f"{percent * check[f'protrusion_{k}_mm']:.3f}" for k in ("max", "rms", "certified"))
    bare = "0, proven" if check["coverage_proven"] else f"{check['uncovered_percent']:.2g} %"
    missed, tests = check["pairs_missed"] + check["pressed_pairs_missed"], check["tests_per_pose"]
    return (f"| {label} | {tree['leaves']:,} | {protrusion} | {bare} | {check['leaves_outside_ancestor']} | {missed}"
            f" | {check['walk_us']:.2f} | {tests:,.0f} | {tree['cpu_s']:.1f} | {tree['peak_MB']:.0f} |")


def slope(first, last, key, factor):
    """How a run's peak memory grows with a count, in bytes / factor."""
    return (last["peak_MB"] - first["peak_MB"]) * 1e6 / factor / (last[key] - first[key])


def write(folder):
    m = Measurements(folder)
    area, inverse = curvature(m, ["bunny-512", "bunny-4096", "bunny-32768"])
    constant = 0.19 * area * inverse[1] / 2
    draw(m, constant)
    text = [BEGIN, f"""Processor: {processor()}. CPU seconds are those of all threads, without reading the mesh;
the machine was not quiet.

| mesh, options | leaves | protrusion %D: max / RMS / certified | uncovered surface | leaves outside an ancestor \
| pairs missed | walk µs | sphere tests | CPU s | peak MB |
|---|---|---|---|---|---|---|---|---|---|"""]
    text += [row(m, name, label) for name, label, _, _ in TABLE]
    text += ["", "| bunny, 4,096, fast; the fastest of three | wall-clock s | CPU s |", "|---|---|---|"]
    for threads in (1, 2):
        best = min((m.load(f"threads-{threads}-{attempt}") for attempt in range(3)), key=lambda r: r["wall_s"])
        text.append(f"| {threads} thread{'s'[:threads - 1]} | {best['wall_s']:.1f} | {best['cpu_s']:.1f} |")
    few, many = m.load("bunny-fast-4096"), m.load("bunny-fast-32768")
    small, large = (m.load(f"torus-{2 * a * b}-512") for a, b in TORI[-2:])
    if few and many and small and large:
        triangle, leaf = slope(small, large, "triangles", 1), slope(few, many, "leaves", 1000)
        text += ["", f"""Peak memory of the program, two threads: {triangle:.0f} bytes per triangle (512 leaves,
{small['triangles']:,} to {large['triangles']:,} triangles) and {leaf:.1f} kB per leaf (bunny,
{few['leaves']:,} to {many['leaves']:,} leaves)."""]
    text += ["", f"""The theory's line for the bunny: surface A = {area:.2f} D², ⟨1/R⟩ = {inverse[1]:.0f} / D, so
N·e = {100 * constant:.0f} %D. Estimated from 512 leaves ⟨1/R⟩ is {inverse[0]:.0f} / D, from 32,768 it is
{inverse[2]:.0f} / D.""", END]
    page = PAGE.read_text()
    PAGE.write_text(page[:page.index(BEGIN)] + "\n".join(text) + page[page.index(END) + len(END):])


if __name__ == "__main__":
    {"measure": measure, "write": write}[sys.argv[1]](*sys.argv[2:])
