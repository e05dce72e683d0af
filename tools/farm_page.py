"""What became of a list of models, from the lines that `silmap build --manifest` printed: one table and one page."""
import csv
import html
import json
from pathlib import Path

# How a model may end, and what that is to people. The last is ours: no process said how the model ended.
STATUSES = {
    "done": "built",
    "kept": "built before",
    "bad-input": "bad input: never again",
    "resources": "out of resources: again, elsewhere",
    "failed": "a fault of silmap: report it",
    "lost": "no worker said how it ended",
}
# As `silmap build --manifest` ends: another try is worth most, a fault is told before bad input.
EXIT_CODES = {"resources": 4, "lost": 4, "failed": 70, "bad-input": 1}
COLOURS = {"done": "#2a7d3f", "kept": "#5d9c6c", "bad-input": "#b3541e", "resources": "#8a6d00", "failed": "#b3261e", "lost": "#6b2fb3"}
SLOWEST = 20
MOST_FAILURES = 500
# Words of a cell that are not broken.
SHORT = 16
# In the order in which a build goes through them.
STAGES = ["load", "capture", "contours", "map", "hull", "textures", "write"]
COLUMNS = ["line", "model", "out", "status", "message", "total_seconds", "peak_bytes", "bytes", "exit_code", "hash"]


def model_lines(path):
    """The lines of a list that have a model, counted from 1."""
    with open(path, "rb") as file:
        return [number for number, line in enumerate(file, 1) if line.strip()]


def collect(numbers, folder):
    """One row for each model, in the list's order: an asset if any try made one, else how the last try ended."""
    rows = {}
    for path in sorted(folder.glob("*.jsonl"), key=order):
        with open(path, "rb") as file:
            for line in file:
                try:
                    row = json.loads(line)
                    number = row["line"]
                except (ValueError, KeyError, TypeError):
                    # The end of a part that was killed while it printed.
                    continue
                if row["status"] in ("done", "kept") or not is_there(rows.get(number)):
                    before = rows.get(number)
                    # Kept by a later try of the same run: built all the same.
                    if row["status"] == "kept" and before and before["status"] == "done":
                        continue
                    rows[number] = row
    return [rows.get(number) or lost(number) for number in numbers]


def order(path):
    """Tries before later ones, and within one the instances of a part."""
    numbers = [int(word) for word in path.stem.replace("-", ".").split(".") if word.isdigit()]
    return numbers, path.name


def is_there(row):
    return row is not None and row["status"] in ("done", "kept")


def lost(number):
    return {
        "line": number, "model": None, "out": None, "status": "lost", "message": STATUSES["lost"], "seconds": {},
        "peak_bytes": None, "hash": None, "exit_code": None, "bytes": None, "warnings": [],
    }  # fmt: skip


def is_worth_a_try(row):
    return row["status"] in ("resources", "lost")


def count(rows):
    counts = dict.fromkeys(STATUSES, 0)
    for row in rows:
        counts[row["status"]] += 1
    return counts


def exit_code(counts):
    return next((code for status, code in EXIT_CODES.items() if counts[status]), 0)


def total(row):
    return (row["seconds"] or {}).get("total", 0.0)


def write(rows, name, out):
    """The table, as lines of JSON and as CSV, and the page."""
    with replaced(out / "table.jsonl") as file:
        for row in rows:
            file.write(json.dumps(row) + "\n")
    with replaced(out / "table.csv") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for row in rows:
            writer.writerow([total(row) if column == "total_seconds" else row.get(column) for column in COLUMNS])
    facts = {}
    if (out / "run.json").exists():
        facts = json.loads((out / "run.json").read_text())
    with replaced(out / "report.html") as file:
        file.write(page(rows, Path(name).name, facts))


class replaced:
    """A text file that appears whole or not at all."""

    def __init__(self, path):
        self.path, self.part = path, path.with_name(f".{path.name}.part")

    def __enter__(self):
        self.file = open(self.part, "w", newline="", encoding="utf-8")
        return self.file

    def __exit__(self, kind, *_):
        self.file.close()
        if kind is None:
            self.part.replace(self.path)


def page(rows, name, facts):
    counts = count(rows)
    built = [row for row in rows if is_there(row)]
    failures = [row for row in rows if not is_there(row)]
    parts = [
        f"<h1>{html.escape(name)}</h1>",
        f"<p>{len(rows):,} models, {len(built):,} of them built. {html.escape(pace(rows, facts))}</p>",
        tiles(counts),
        stages(built),
        failure_table(failures),
        slowest(built),
        memory(rows),
        warnings(built),
    ]
    return f"""<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{html.escape(name)}: {len(built)} of {len(rows)} built</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; padding: 0 1rem; color: #1c1c1c; background: #fff }}
h1 {{ font-size: 1.5rem }} h2 {{ font-size: 1.1rem; margin-top: 2rem }}
table {{ border-collapse: collapse; width: 100% }} td, th {{ text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #ddd; vertical-align: top }}
td.number, th.number {{ text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }} td.short, th {{ white-space: nowrap }} td.name {{ overflow-wrap: anywhere }}
.tiles {{ display: flex; flex-wrap: wrap; gap: .6rem }} .tile {{ border-left: .4rem solid; padding: .4rem .9rem; background: #f6f6f6 }}
.tile b {{ font-size: 1.4rem; display: block }} .bar {{ background: #4a7fb5; height: .8rem; display: inline-block }}
</style>
<body>
{chr(10).join(part for part in parts if part)}
</body></html>
"""


def pace(rows, facts):
    """Seconds of the whole beside those of the builds, where both are known."""
    work = sum(total(row) for row in rows if row["status"] != "kept")
    if not facts:
        return f"The builds took {work:,.0f} s together."
    wall, workers = facts["wall_seconds"], facts["workers"]
    sentence = f"The builds took {work:,.0f} s together, the whole {wall:,.0f} s in {facts['parts']:,} parts"
    if not workers:
        return f"{sentence}."
    sentence += f" on {workers} worker{'s' * (workers > 1)}"
    return f"{sentence}: {wall * workers / work:.3f} worker seconds for a second of building." if work > 0 else f"{sentence}."


def tiles(counts):
    shown = [
        f'<div class="tile" style="border-color: {COLOURS[status]}"><b>{n:,}</b>{html.escape(status)}<br><small>{html.escape(STATUSES[status])}</small></div>'
        for status, n in counts.items()
        if n
    ]
    return f'<div class="tiles">{"".join(shown)}</div>'


def stages(built):
    sums = {}
    for row in built:
        for stage, seconds in (row["seconds"] or {}).items():
            if stage != "total":
                sums[stage] = sums.get(stage, 0.0) + seconds
    # A stage that is not known here comes last.
    sums = dict(sorted(sums.items(), key=lambda sum: STAGES.index(sum[0]) if sum[0] in STAGES else len(STAGES)))
    most = max(sums.values(), default=0.0)
    if most <= 0.0:
        return ""
    whole = sum(sums.values())
    lines = [
        [stage, f"{seconds:,.1f} s", f"{100 * seconds / whole:.1f} %", f"{1000 * seconds / len(built):,.1f} ms"]
        for stage, seconds in sums.items()
    ]
    bars = [f'<span class="bar" style="width: {14 * seconds / most:.2f}rem"></span>' for seconds in sums.values()]
    return "<h2>Seconds by stage</h2>" + table(["stage", "together", "share", "a model", ""], lines, {1, 2, 3}, bars)


def failure_table(failures):
    if not failures:
        return ""
    lines = [
        [row["line"], row["status"], row["model"] or "", row["message"] or ""] for row in failures[:MOST_FAILURES]
    ]
    more = len(failures) - len(lines)
    note = f"<p>{more:,} more are in table.csv.</p>" if more > 0 else ""
    return "<h2>Not built</h2>" + table(["line", "status", "model", "why"], lines, {0}) + note


def slowest(built):
    first = sorted(built, key=lambda row: (-total(row), row["line"]))[:SLOWEST]
    if not first:
        return ""
    lines = [
        [row["line"], row["model"], f"{total(row):,.2f} s", longest_stage(row), mebibytes(row["peak_bytes"]), f"{(row['bytes'] or 0):,}"]
        for row in first
    ]
    return "<h2>Slowest</h2>" + table(["line", "model", "time", "most of it", "memory", "bytes"], lines, {0, 2, 4, 5})


def longest_stage(row):
    stages_of = {stage: s for stage, s in (row["seconds"] or {}).items() if stage != "total"}
    return max(stages_of, key=stages_of.get) if stages_of else ""


def memory(rows):
    first = sorted((row for row in rows if row["peak_bytes"]), key=lambda row: (-row["peak_bytes"], row["line"]))[:5]
    if not first:
        return ""
    lines = [[row["line"], row["model"], mebibytes(row["peak_bytes"]), row["status"]] for row in first]
    return "<h2>Most memory</h2>" + table(["line", "model", "memory", "status"], lines, {0, 2})


def warnings(built):
    kinds = {}
    for row in built:
        for sentence in row.get("warnings") or []:
            kinds.setdefault(sentence, []).append(row)
    if not kinds:
        return ""
    first = sorted(kinds.items(), key=lambda kind: (-len(kind[1]), kind[0]))[:50]
    lines = [[len(those), sentence, those[0]["model"]] for sentence, those in first]
    return "<h2>Warnings</h2>" + table(["models", "warning", "first"], lines, {0})


def mebibytes(n):
    return f"{n / 2**20:,.0f} MiB" if n else ""


def table(heads, lines, numbers, last=None):
    """An HTML table; `numbers` are the columns of numbers, `last` a column that is HTML already."""

    def cell(kind, place, text):
        name = "number" if place in numbers else "short" if len(str(text)) <= SHORT else "name"
        return f'<{kind} class="{name}">{html.escape(str(text))}</{kind}>'

    out = ["<table><tr>", *(cell("th", place, head) for place, head in enumerate(heads)), "</tr>"]
    for row, line in enumerate(lines):
        out += ["<tr>", *(cell("td", place, text) for place, text in enumerate(line))]
        if last:
            out.append(f"<td>{last[row]}</td>")
        out.append("</tr>\n")
    return "".join([*out, "</table>"])
