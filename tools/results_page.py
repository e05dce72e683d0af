"""Pages out of measured figures: docs/results.md, and tables between markers in README and docs/methods.md.

Nothing here holds a figure. A table whose runs were not made is left out.
"""

MARKER = "<!-- results: {} -->"
OUTLINES_HEAD = ["model", "`tight` mean, worst", "`hull` mean, worst", "`paper` mean, worst", "silhouettes", "asset"]


def pages(root, results):
    """The text of every page that holds figures, by its path."""
    table = Tables(results)
    inserted = {"README.md": ("begin", table.summary()), "docs/methods.md": ("methods", table.methods())}
    texts = {root / "docs" / "results.md": page(table)}
    for name, (word, text) in inserted.items():
        path = root / name
        texts[path] = between(path.read_text(), MARKER.format(word), MARKER.format("end"), text)
    return texts


def between(text, begin, end, inside):
    before, _, rest = text.partition(begin + "\n")
    _, found, after = rest.partition(end)
    if not found:
        raise SystemExit(f"the markers {begin} and {end} are missing")
    return f"{before}{begin}\n{inside}{end}{after}"


def rows(head, body):
    """A table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in body)]) + "\n"


def percent(share, digits=2):
    return f"{100 * share:.{digits}f} %"


def kib(n):
    return f"{n / 1024:,.0f} KiB"


def seconds(s):
    """Three digits in a unit that suits."""
    for unit, scale in (("s", 1), ("ms", 1e3), ("µs", 1e6)):
        if s * scale >= 1 or unit == "µs":
            return f"{s * scale:.3g} {unit}"


def name_of(stem):
    """A model's name, out of its file's."""
    return stem.removesuffix(".ply").replace("_", " ").replace("-", " ").replace("stanford", "Stanford")


class Tables:
    """Tables of some results."""

    def __init__(self, results):
        self.conditions, self.runs = results["conditions"], results["runs"]

    def stems(self, kind):
        """The models that have a run of a kind; those of one kind come in one order everywhere."""
        found = [name.split("/", 1)[1] for name in self.runs if name.startswith(kind + "/")]
        return sorted(found, key=lambda stem: (not stem.startswith("stanford-bunny"), f"generate/{stem}" not in self.runs, stem))

    def figure(self, run, key):
        return self.runs[run]["figures"][key]

    def time(self, run, key):
        return self.runs[run]["times"][key]

    def pair(self, run, method):
        mean, worst = (self.figure(run, f"methods.{method}.misclassified_{k}") for k in ("mean", "max"))
        return f"{percent(mean)}, {percent(worst, 1)}"

    def command(self, *runs):
        """Commands as they were run, in a block that no test runs again."""
        return "```sh not-run: measured\n" + "".join(self.runs[run]["command"] + "\n" for run in runs) + "```\n"

    def described(self):
        c = self.conditions
        return (f"`{c['command']}` with {c['version']}, commit {c['commit']}, on {c['date']}: {c['processor']}, {c['cores']} cores, "
                f"{c['system']}, load {c['load']}")

    def label(self, stem):
        return f"{name_of(stem)}, {self.figure(f'inspect/{stem}', 'model.faces'):,} faces"

    def outline_rows(self, stem):
        errors = [self.pair(f"evaluate/{stem}", method) for method in ("tight", "hull", "paper")]
        sizes = [kib(self.figure(f"inspect/{stem}", key)) for key in ("map.bytes", "bytes")]
        return [[self.label(stem), *errors, *sizes]]

    def summary(self):
        """Five rows for README."""
        stems = self.stems("evaluate")[:5]
        viewpoints = self.figure(f"evaluate/{stems[0]}", "viewpoints")
        head = (f"Misclassified pixels as shares of those inside the true outline, at {viewpoints} random eyes "
                "([more](docs/results.md)):\n\n")
        c = self.conditions
        lines = [row for stem in stems for row in self.outline_rows(stem)]
        return head + rows(OUTLINES_HEAD, lines) + f"\nMeasured on {c['date']} by `{c['command']}`, commit {c['commit']}.\n"

    def methods(self):
        """Errors of the three rules, for the page on methods."""
        body = []
        for stem in self.stems("evaluate")[:5]:
            run = f"evaluate/{stem}"
            for method in ("tight", "hull", "paper"):
                escaped = percent(self.figure(run, f"methods.{method}.escaped_mean"), 3)
                body.append([name_of(stem), f"`{method}`", *self.pair(run, method).split(", "), escaped])
        return rows(["model", "method", "misclassified, mean", "worst", "escaped, mean"], body)


def page(table):
    """docs/results.md."""
    parts = [INTRODUCTION.format(table.described())]
    parts += [text for one in SECTIONS if (text := one.text(table))]
    parts.append(frame_times(table))
    return "\n".join(part for part in parts if part)


INTRODUCTION = """\
# Results

This page is written by `tools/results` from [results.json](results.json). Edit neither by hand. `tools/results` measures again,
`tools/results --render` writes the page again from the stored figures.

Measured by {}.

Sections that end in "time" depend on the machine. All other figures depend on the code alone, and those of textures and frames on the
graphics driver; `tools/results --repeat` measures them again and compares. Generated models are those of `silmap generate`; the
others are real models of `../shared/models`. Eyes are random points of the polytope where nothing else is said.
"""


class Section:
    """A table of the models that have a run of a kind, under a heading: `body` gives a model's rows, `runs` name commands to show."""

    def __init__(self, title, kind, head, body, text="", runs=()):
        self.title, self.kind, self.head, self.body, self.words, self.runs = title, kind, head, body, text, runs

    def text(self, table):
        stems = table.stems(self.kind)
        if not stems:
            return ""
        lines = [row for stem in stems for row in self.body(table, stem)]
        words = self.words + "\n\n" if self.words else ""
        text = f"## {self.title}\n\n{words}{rows(self.head, lines)}"
        if self.runs:
            text += "\n" + table.command(*(f"{run}/{stems[0]}" for run in self.runs))
        return text


TIGHTENINGS = ("off", "fast", "best")
METHODS = ("tight", "hull", "paper")


def off_the_polytope(table, stem):
    return [[name_of(stem), table.pair(f"evaluate/{stem}", "tight"), table.pair(f"shell/{stem}", "tight")]]


def fewer_views(table, stem):
    return [[name_of(stem), str(table.figure(f"build/{stem}", "kept")), table.pair(f"evaluate/{stem}", "tight"),
             str(table.figure(f"fewer/{stem}", "kept")), table.pair(f"evaluate-fewer/{stem}", "tight")]]


def hulls(table, stem):
    ratios = [f"{table.figure(f'hull-{t}/{stem}', 'volume_ratio'):.4f}" for t in TIGHTENINGS]
    verified = all(table.figure(f"hull-{t}/{stem}", "verified") for t in TIGHTENINGS)
    return [[name_of(stem), str(table.figure(f"hull-off/{stem}", "faces")), *ratios, "yes" if verified else "no"]]


def textures(table, stem):
    run = f"textures/{stem}"
    colours = [f"{table.figure(run, f'textures.colour_difference.{k}.largest_channel'):.1f}" for k in ("blended", "nearest", "tiles")]
    jumps = [f"{table.figure(run, f'textures.discontinuities_per_1000.{k}'):.2g}" for k in ("normal-shooting", "closest-point")]
    return [[name_of(stem), *colours, *jumps]]


def edge_methods(table, stem):
    names = [name.split("/")[0].removeprefix("edges-") for name in table.runs if name.startswith("edges-") and name.endswith("/" + stem)]
    order = ["brute", "brute-parallel", "table", "jc", "cones", "dual", "dual-bar"]
    return sorted(names, key=order.index)


def exact_edges(table, stem):
    for method in edge_methods(table, stem):
        run = f"edges-{method}/{stem}"
        found, tested, nodes = (table.figure(run, f"walk.{key}_mean") for key in ("silhouette_edges", "tested_edges", "visited_nodes"))
        yield [name_of(stem), f"`{method}`", f"{found:,.0f}", f"{tested / found:.2f}", f"{nodes / found:.2f}",
               kib(table.figure(run, "data_bytes"))]


def simplified(table, stem):
    for faces in (300, 1000):
        run = f"simplify-{faces}/{stem}"
        errors = [percent(table.figure(run, f"{kind}.misclassified_mean")) for kind in ("error", "unguided_error")]
        yield [name_of(stem), str(table.figure(run, "faces")), *errors]


def aligned(table, stem):
    run = f"align/{stem}"
    return [[name_of(stem), "yes" if table.figure(run, "converged") else "no", str(table.figure(run, "rounds")),
             f"{table.figure(run, 'distance_px'):.3f} px",
             *(percent(table.figure(run, f"{key}_off_share")) for key in ("start", "eye"))]]


def build_times(table, stem):
    run = f"build/{stem}"
    return [[table.label(stem), seconds(table.time(run, "seconds.total")), f"{table.time(run, 'peak_bytes') / 2**20:.0f} MiB"]]


def list_times(table, stem):
    run = f"list/{stem}"
    done, whole, builds = table.figure(run, "done"), table.time(run, "whole"), table.time(run, "builds")
    return [[str(table.figure(run, "models")), str(done), seconds(builds / done), seconds((whole - builds) / done)]]


def interpolation_times(table, stem):
    return [[name_of(stem), *(seconds(table.time(f"contour-{m}/{stem}", "seconds")) for m in METHODS)]]


def hull_times(table, stem):
    return [[name_of(stem), *(seconds(table.time(f"hull-{t}/{stem}", "seconds")) for t in TIGHTENINGS)]]


def edge_times(table, stem):
    for method in edge_methods(table, stem):
        run = f"edges-{method}/{stem}"
        yield [name_of(stem), f"`{method}`", seconds(table.time(run, "seconds_median")), seconds(table.time(run, "build_seconds"))]


SECTIONS = [
    Section("Outlines", "evaluate", OUTLINES_HEAD, Tables.outline_rows,
            "Misclassified pixels as shares of the pixels inside the true outline. All builds have the options of the first command below.",
            ("build", "evaluate")),
    Section("Outlines off the polytope", "shell", ["model", "on the polytope: mean, worst", "off the polytope: mean, worst"], off_the_polytope,
            "Method `tight`, with eyes at distances that are log-uniform in 1.5 to 10 radii.", ("shell",)),
    Section("Fewer views", "fewer", ["model", "views", "mean, worst", "views left", "mean, worst"], fewer_views,
            "Views taken out of a finished asset. Method `tight`.", ("fewer",)),
    Section("Hulls", "hull-off", ["model", "faces", "`--tighten off`", "`fast`", "`best`", "verified"], hulls,
            "Volume of the hull over that of the model. `--verify` checks that the hull encloses the model.", ("hull-fast",)),
    Section("Textures", "textures", ["model", "blended views", "nearest view", "tiles alone", "jumps, normal shooting", "jumps, closest point"],
            textures,
            "Mean difference of colours from the full mesh, the largest of the channels, in steps of 1/255, inside both outlines; and texels "
            "beside a\njump of the atlas's parametrisation, of 1,000.", ("textures",)),
    Section("Exact silhouette edges", "edges-brute", ["model", "method", "edges", "edges tested for each", "nodes visited for each", "data"],
            exact_edges, "Work per silhouette edge, over a walk in steps of 0.5°.", ("edges-cones",)),
    Section("Simplification that keeps a silhouette", "simplify-300", ["model", "faces", "guided", "unguided"], simplified,
            "Wrong pixels as shares of those inside, seen from the eye whose silhouettes are kept.", ("simplify-300",)),
    Section("Alignment", "align", ["model", "converged", "rounds", "outlines apart", "eye off at the start", "at the end"], aligned,
            "A pose found again from a mask. The eye is off by shares of its distance, at the start and at the end.", ("align",)),
    Section("Builds: time", "build", ["model", "`build`", "peak memory"], build_times),
    Section("A list of models: time", "list", ["models", "built", "build of one", "beside it, for each"], list_times,
            "A process for each model, one after the other, and small builds.", ("list",)),
    Section("Interpolation of an outline: time", "contour-tight", ["model", "`tight`", "`hull`", "`paper`"], interpolation_times,
            "With warm buffers, the median of several calls.", ("contour-tight",)),
    Section("Hulls: time", "hull-off", ["model", "`--tighten off`", "`fast`", "`best`"], hull_times),
    Section("Exact silhouette edges: time", "edges-brute", ["model", "method", "extraction", "preparation"], edge_times,
            "For each viewpoint of the walk, the median; and the time to prepare the mesh."),
]


def frame_times(table):
    stems = table.stems("bench")
    if not stems:
        return ""
    parts = []
    for stem in stems:
        run = f"bench/{stem}"
        columns = [table.figure(run, f"rows.*.{key}") for key in ("name", "faces", "outline_error")]
        columns += [table.time(run, f"rows.*.{key}") for key in ("seconds_median", "cpu_seconds_median")]
        body = [[f"`{name}`", f"{faces:,}" if faces else "", f"{error:.3f} px" if error is not None else "", seconds(whole), seconds(cpu)]
                for name, faces, error, whole, cpu in zip(*columns)]
        parts.append(f"""\
### {name_of(stem)}

Graphics adapter: {table.figure(run, "adapter")}.

{rows(["row", "faces", "outline error", "frame", "processor"], body)}
{table.command(run)}""")
    return "## Frames: time\n\nMedians over a walk. The outline error is the mean distance to the exact outline.\n\n" + "\n".join(parts)
