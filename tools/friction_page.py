"""Writes the friction part of docs/benchmarks.md from a run of `touchstone bench friction --csv`: python3 friction_page.py CSV."""
import csv
import os
import pathlib
import platform
import subprocess
import sys

PAGE = pathlib.Path("docs/benchmarks.md")
BEGIN, END = "<!-- friction: made by tools/document_bench -->", "<!-- end of friction -->"

with open(sys.argv[1], newline="") as table:
    rows = list(csv.DictReader(table))


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def pair(r, first, second, digits=2):
    return f"{float(r[first]):.{digits}g} / {float(r[second]):.{digits}g}" if r[first] else ""


def times(r, *keys):
    return " / ".join(f"{float(r[key]):,.0f}" if float(r[key]) >= 100 else f"{float(r[key]):.1f}" for key in keys)


commit = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True).stdout.strip()
text = [BEGIN, f"One run of `touchstone bench friction`: {processor()}, {os.cpu_count()} cores shared with other programs, commit {commit};"
        f" {int(rows[0]['ticks']):,} ticks, three times.", "",
        "| feet | solver | µs: median / p99.9 | equal constant work µs: p99.9 | shortest of three µs: p99.9 | force error N: median / max"
        " | hover mm: median / max |", "|---|---|---|---|---|---|---|"]
missed = []
for r in rows:
    rubs = r["friction"] == "true"
    solver = f"`{r['solver']}`" + ("" if rubs else f" without friction, {r['rows']} rows")
    feet = r["feet"] + (", flat" if r["flat"] == "true" else "")
    if rubs and float(r["missing_share"]) > 0:
        missed.append(f"{100 * float(r['missing_share']):.2g} % by {solver} on {feet}")
    text.append(f"| {feet} | {solver} | {times(r, 'median_us', 'p999_us')} | {times(r, 'constant_p999_us')} | {times(r, 'shortest_p999_us')} |"
                f" {pair(r, 'error_p50_N', 'error_max_N')} | {pair(r, 'hover_p50_mm', 'hover_max_mm')} |")
text += ["", f"Missing answers: {'; '.join(missed) or 'none'}."]
page = PAGE.read_text()
PAGE.write_text(page[:page.index(BEGIN)] + "\n".join([*text, END]) + page[page.index(END) + len(END):])
