"""What became of a list of models, from the lines that `silmap build --manifest` printed: one table and one page."""
import array
import csv
import heapq
import html
import itertools
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
# One string for each, however many lines name it.
STATUS_NAMES = {status: status for status in STATUSES}
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


class Found:
    """How each model of a list ended, as far as the lines of a folder say: an asset if any try made one, else how the last try ended.

    Holds a status and a place in a file for each model, not the lines: a list may be long.
    """

    def __init__(self, numbers, folder):
        self.numbers, self.paths = numbers, sorted(folder.glob("*.jsonl"), key=order)
        place_of = {number: place for place, number in enumerate(numbers)}
        self.statuses = ["lost"] * len(numbers)
        self.files = array.array("i", [-1]) * len(numbers)
        self.offsets = array.array("q", [0]) * len(numbers)
        for index, path in enumerate(self.paths):
            with open(path, "rb") as file:
                offset = 0
                for line in file:
                    place, status = place_and_status(line, place_of)
                    if place is not None and self.is_better(status, self.statuses[place]):
                        self.statuses[place], self.files[place], self.offsets[place] = STATUS_NAMES.get(status, status), index, offset
                    offset += len(line)

    @staticmethod
    def is_better(status, before):
        # Kept by a later try of the same run: built all the same.
        if status == "kept" and before == "done":
            return False
        return status in ("done", "kept") or before not in ("done", "kept")

    def __iter__(self):
        """The lines themselves, in the list's order."""
        for place, number in enumerate(self.numbers):
            if self.files[place] < 0:
                yield lost(number)
                continue
            with open(self.paths[self.files[place]], "rb") as file:
                file.seek(self.offsets[place])
                yield json.loads(file.readline())

    def worth_a_try(self):
        """Places in the list, counted from 0."""
        return [place for place, status in enumerate(self.statuses) if status in ("resources", "lost")]


def place_and_status(line, place_of):
    try:
        row = json.loads(line)
        return place_of.get(row["line"]), row["status"]
    except (ValueError, KeyError, TypeError):
        # The end of a part that was killed while it printed.
        return None, None


class Table:
    """The lines of a table, read from its file each time they are gone through."""

    def __init__(self, path):
        self.path = path

    def __iter__(self):
        with open(self.path, encoding="utf-8") as file:
            for line in file:
                yield json.loads(line)

    def built(self):
        return (row for row in self if is_there(row))

    def failures(self):
        return (row for row in self if not is_there(row))


def order(path):
    """Tries before later ones, and within one the instances of a part."""
    numbers = [int(word) for word in path.stem.replace("-", ".").split(".") if word.isdigit()]
    return numbers, path.name


def is_there(row):
    return row["status"] in ("done", "kept")


def lost(number):
    return {
        "line": number, "model": None, "out": None, "status": "lost", "message": STATUSES["lost"], "seconds": {},
        "peak_bytes": None, "hash": None, "exit_code": None, "bytes": None, "warnings": [],
    }  # fmt: skip


def count(rows):
    counts = dict.fromkeys(STATUSES, 0)
    for row in rows:
        counts[row["status"]] += 1
    return counts


def exit_code(counts):
    return next((code for status, code in EXIT_CODES.items() if counts[status]), 0)


def total(row):
    return (row["seconds"] or {}).get("total", 0.0)


def write(found, name, out):
    """The table, as lines of JSON and as CSV, and the page; how many models ended in which way."""
    with replaced(out / "table.jsonl") as file:
        for row in found:
            file.write(json.dumps(row) + "\n")
    rows = Table(out / "table.jsonl")
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
    return count(rows)


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
    models, built = sum(counts.values()), counts["done"] + counts["kept"]
    parts = [
        f"<h1>{html.escape(name)}</h1>",
        f"<p>{models:,} models, {built:,} of them built. {html.escape(pace(rows, facts))}</p>",
        tiles(counts),
        stages(rows, built),
        failure_table(rows, models - built),
        slowest(rows),
        memory(rows),
        warnings(rows),
    ]
    return f"""<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{html.escape(name)}: {built} of {models} built</title>
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


def stages(rows, built):
    sums = {}
    for row in rows.built():
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
        [stage, f"{seconds:,.1f} s", f"{100 * seconds / whole:.1f} %", f"{1000 * seconds / built:,.1f} ms"]
        for stage, seconds in sums.items()
    ]
    bars = [f'<span class="bar" style="width: {14 * seconds / most:.2f}rem"></span>' for seconds in sums.values()]
    return "<h2>Seconds by stage</h2>" + table(["stage", "together", "share", "a model", ""], lines, {1, 2, 3}, bars)


def failure_table(rows, failures):
    if not failures:
        return ""
    shown = itertools.islice(rows.failures(), MOST_FAILURES)
    lines = [[row["line"], row["status"], row["model"] or "", row["message"] or ""] for row in shown]
    more = failures - len(lines)
    note = f"<p>{more:,} more are in table.csv.</p>" if more > 0 else ""
    return "<h2>Not built</h2>" + table(["line", "status", "model", "why"], lines, {0}) + note


def slowest(rows):
    first = heapq.nsmallest(SLOWEST, rows.built(), key=lambda row: (-total(row), row["line"]))
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
    measured = (row for row in rows if row["peak_bytes"])
    first = heapq.nsmallest(5, measured, key=lambda row: (-row["peak_bytes"], row["line"]))
    if not first:
        return ""
    lines = [[row["line"], row["model"], mebibytes(row["peak_bytes"]), row["status"]] for row in first]
    return "<h2>Most memory</h2>" + table(["line", "model", "memory", "status"], lines, {0, 2})


def warnings(rows):
    # Of each sentence: how many models have it, and the first of them.
    kinds = {}
    for row in rows.built():
        for sentence in row.get("warnings") or []:
            models, first = kinds.get(sentence, (0, row["model"]))
            kinds[sentence] = (models + 1, first)
    if not kinds:
        return ""
    most = heapq.nsmallest(50, kinds.items(), key=lambda kind: (-kind[1][0], kind[0]))
    lines = [[models, sentence, first] for sentence, (models, first) in most]
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
