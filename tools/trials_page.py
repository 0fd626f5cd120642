"""Writes the measured part of docs/trials.md from the studies' tables: python3 trials_page.py FOLDER."""
import csv
import json
import pathlib
import shutil
import sys

PAGE = pathlib.Path("docs/trials.md")
PICTURES = pathlib.Path("docs/pictures")
BEGIN, END = "<!-- measured: made by tools/document_trials -->", "<!-- end of measured -->"

folder = pathlib.Path(sys.argv[1])


def rows(study, table):
    with open(folder / study / table, newline="") as file:
        return list(csv.DictReader(file))


def number(text, digits=3):
    return f"{float(text):.{digits}g}" if text else ""


def plot(study, name, caption):
    target = PICTURES / f"trials-{name}.svg"
    shutil.copyfile(folder / study / f"{name}.svg", target)
    return f"![{caption}](pictures/{target.name})"


def five():
    columns = ["participant", "outcome", "time_s", "first_contact_s", "search_s", "align_s", "insert_s", "force_peak_N",
               "torque_peak_mNm", "path_mm", "contacts_peak", "jams"]
    out = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    for row in rows("five-trials", "trials.csv"):
        out.append("| " + " | ".join(row[c] if c in ("participant", "outcome") else number(row[c]) for c in columns) + " |")
    return out


def interval(line, of="mean"):
    if not line[of]:
        return ""
    low, high = line[of + "_low"], line[of + "_high"]
    if line["measure"] == "residual_penetration_mm" and float(high or line[of]) < 1e-9:
        return "below 1e-9"
    return number(line[of]) + (f" [{number(low)}, {number(high)}]" if low else "")


def study(name, measures):
    measures = [("seated_rate", "share seated"), ("time_s of seated", "time until seated, s"), ("search_s", "search, s"),
                ("force_peak_N", "peak force, N"), ("torque_peak_mNm", "peak torque, mN·m"), *measures]
    lines = rows(name, "summary.csv")
    out = ["| condition | trials | " + " | ".join(title for _, title in measures) + " |", "|---" * (len(measures) + 2) + "|"]
    for condition in dict.fromkeys(line["condition"] for line in lines):
        own = {line["measure"]: line for line in lines if line["condition"] == condition}
        out.append(f"| {condition} | {own['seated_rate']['trials']} | " + " | ".join(interval(own[m]) for m, _ in measures) + " |")
    return out


program = json.loads((folder / "five-trials" / "trial-0001" / "recording.json").read_text())["program"]
PICTURES.mkdir(parents=True, exist_ok=True)
text = [BEGIN, f"Results (commit {program['commit']}, {program['compiler']}):", "", *five(), "",
        "A larger study, [`docs/examples/clearance-study.json`](examples/clearance-study.json), measures the effect of clearance, stiffness and the "
        "penalty method on the same 24 hands, two of each participant. Means with 95 % intervals:", "",
        *study("clearance-study", [("contacts_mean", "contacts"), ("residual_penetration_mm", "residual penetration, mm")]), "",
        plot("clearance-study", "summary", "Share seated, time and peak torque of each condition, with 95 % intervals"), "",
        plot("clearance-study", "phases", "Mean time in each phase, by condition"), "",
        "A third one, [`docs/examples/friction-study.json`](examples/friction-study.json), sets friction against clearance,\n"
        "with the same twelve hands. A jam is a tool that is pressed in the hole and goes no deeper for half a second:", "",
        *study("friction-study", [("jams", "jams")]), END]
page = PAGE.read_text()
PAGE.write_text(page[:page.index(BEGIN)] + "\n".join(text) + page[page.index(END) + len(END):])
