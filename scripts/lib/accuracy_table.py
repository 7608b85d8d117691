"""Called by scripts/accuracy_table: isohf DATA_FOLDER WORK_FOLDER [--quick]; the page goes to standard output."""

import fnmatch
import json
import pathlib
import statistics
import subprocess
import sys
import textwrap

DENSITIES = [(1.0, "1"), (0.25, "1/4"), (0.0625, "1/16")]
FILTERS = ["limited-cubic", "bilinear", "bspline3"]
SMALLEST_SIDE = 100  # samples; below, edges are most of the raster

NOT_LAND = [
    ("asf_*", "test pictures"),
    ("t3d_*", "brushes of a game editor"),
    ("terrabrush*", "drawn in a game editor"),
    ("egm84*", "the geoid"),
    ("terrarium*", "packed in colours"),
    ("gale_rgba*", "packed in colours"),
    ("*_filled*", "a copy of another"),
    ("*_noepsg*", "a copy of another"),
    ("*.md", "text"),
    ("*.lbl", "a label"),
]


def run(isohf, *arguments):
    return subprocess.run([isohf, *arguments], capture_output=True, text=True, check=False)


def choose(isohf, folder):
    """The rasters that are measured; says on standard error why others are not."""
    chosen = []
    for path in sorted(p for p in folder.iterdir() if p.is_file()):
        why = next((why for pattern, why in NOT_LAND if fnmatch.fnmatch(path.name, pattern)), None)
        if why is None:
            plan = run(isohf, "plan", str(path), "--json", "--quiet")
            if plan.returncode != 0:
                why = "not read: " + plan.stderr.strip().splitlines()[-1].split(": ", 2)[-1][:60]
            else:
                size = json.loads(plan.stdout)["input"]
                if min(size["width"], size["height"]) < SMALLEST_SIDE:
                    why = f"{size['width']}x{size['height']} samples"
        if why is None:
            chosen.append((path, size))
        else:
            print(f"accuracy_table: {path.name} is left out: {why}", file=sys.stderr)
    return chosen


def measure(isohf, path, work, density, kernel):
    result = run(isohf, "convert", str(path), str(work / "a.isohf"), "--overwrite", "--quiet", "--json", "--report",
                 "--density", str(density), "--filter", kernel)
    if result.returncode != 0:
        sys.exit(f"accuracy_table: {path.name}: {result.stderr.strip()}")
    return json.loads(result.stdout)["report"]


class Row:
    """One raster at one density through one filter."""

    def __init__(self, name, label, kernel, report):
        self.name, self.label, self.kernel = name, label, kernel
        self.iso, self.ortho, self.equal = report["iso"], report["ortho"], report["ortho_at_equal_rms"]
        self.error = report
        self.rms_ratio = report["rms"] / self.ortho["rms"] if self.ortho["rms"] > 0 else None
        over = lambda mesh, key, iso: iso / mesh[key] if mesh and mesh[key] > 0 else None
        self.one_ratio = over(self.ortho, "rms", self.iso["rms_regular"])
        self.least_ratio = over(self.ortho, "rms_least_curvature", self.iso["rms_regular"])
        self.best_ratio = over(self.ortho, "rms_best_diagonals", self.iso["rms_regular"])
        kept = report["decimated"]
        self.kept_ratio, self.kept_least_ratio = (over(kept, key, kept and kept["rms_iso"])
                                                  for key in ("rms", "rms_least_curvature"))
        self.p99_ratio = report["p99"] / self.ortho["p99"] if self.ortho["p99"] > 0 else None
        self.triangles_ratio = self.plain_ratio = self.stored_ratio = None
        self.codec_ratio = self.iso["tile_bytes"] / self.iso["plain_bytes"]
        if self.equal:
            self.triangles_ratio = self.equal["triangles"] / self.iso["triangles"]
            self.plain_ratio = self.equal["plain_bytes"] / self.iso["plain_bytes"]
            self.stored_ratio = self.iso["tile_bytes"] / self.equal["plain_bytes"]

    def cells(self):
        both = lambda key, form: f"{self.error[key]:{form}} / {self.ortho[key]:{form}}"
        ratio = lambda value: "-" if value is None else f"{value:.3f}"
        return [self.name, both("rms", ".3g"), ratio(self.rms_ratio), ratio(self.least_ratio), ratio(self.best_ratio),
                ratio(self.kept_ratio), ratio(self.kept_least_ratio), both("p99", ".3g"), both("max", ".4g"),
                both("psnr_db", ".1f"), f"{self.iso['triangles']:,}".replace(",", " "),
                f"{self.iso['tile_bytes'] / 1000:.0f}",
                f"{self.iso['plain_bytes'] / 1000:.0f} / {self.ortho['plain_bytes'] / 1000:.0f}",
                ratio(self.triangles_ratio), ratio(self.plain_ratio)]


HEAD = ["raster", "rms", "ratio", "least curv.", "best", "kept", "kept, least curv.", "99 %", "largest", "PSNR dB", "triangles", "tiles kB", "plain kB", "triangles ×",
        "plain bytes ×"]


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(cells) + " |" for cells in rows])


def median(values):
    return statistics.median([v for v in values if v is not None] or [float("nan")])


def extent(values):
    values = [v for v in values if v is not None]
    return f"{min(values):.3f} to {max(values):.3f}" if values else "-"


def shares(rows, key):
    values = [value for value in (getattr(row, key) for row in rows) if value is not None]
    return f"{median(values):.3f} ({extent(values)})" if values else "-"


def alternatives(results):
    """Iso against what users could draw instead, both at the four placements."""
    lines = [[label, kernel] + [shares(rows, key) for key in ("one_ratio", "least_ratio", "best_ratio", "kept_ratio",
                                                              "kept_least_ratio")]
             for (label, kernel), rows in results.items()]
    return table(["density", "filter", "one diagonal", "least curvature", "best for the source", "samples kept, one diagonal",
                  "samples kept, least curvature"], lines)


def wins(rows):
    return sum(1 for row in rows if row.rms_ratio is not None and row.rms_ratio < 1)


def summary(results):
    lines = []
    for (label, kernel), rows in results.items():
        lines.append([
            label, kernel, f"{wins(rows)} of {len(rows)}",
            f"{median(r.rms_ratio for r in rows):.3f} ({extent(r.rms_ratio for r in rows)})",
            f"{median(r.p99_ratio for r in rows):.3f}",
            f"{median(r.error['psnr_db'] for r in rows):.1f} / {median(r.ortho['psnr_db'] for r in rows):.1f}",
            f"{median(r.triangles_ratio for r in rows):.3f}",
            f"{median(r.plain_ratio for r in rows):.3f}",
            f"{median(r.stored_ratio for r in rows):.3f}"])
    return table(["density", "filter", "iso lower", "rms iso/ortho, median (all)", "99 %", "PSNR dB iso / ortho",
                  "triangles ×", "plain bytes ×", "tiles / plain ortho"], lines)


def reading(results):
    """What the figures say, in words."""
    every = [row for rows in results.values() for row in rows]
    met = [row for row in every if row.equal]
    losers = sorted({row.name for row in every if row.rms_ratio is not None and row.rms_ratio >= 1})
    text = (f"In {wins(every)} of {len(every)} measurements iso's rms error is the lower one; the median is "
            f"{100 * (1 - median(r.rms_ratio for r in every)):.0f} % lower than that of an ortho mesh of as many triangles. "
            f"To err as little, ortho takes {median(r.triangles_ratio for r in met):.2f} times the triangles (median of "
            f"{len(met)}) and, both coded plainly, {median(r.plain_ratio for r in met):.2f} times the bytes: fewer than the "
            "triangles ask for, because a denser mesh takes fewer bits a vertex and neighbours on an ortho row are nearer. "
            f"The archive's tiles, by their own codec and with padding, take {median(r.stored_ratio for r in met):.2f} of "
            "the bytes of that ortho mesh coded plainly; the part of it that is the codec's, tiles over the same vertices "
            f"coded plainly, is {median(r.codec_ratio for r in met):.2f}.")
    ranked = sorted((row for row in every if row.rms_ratio is not None), key=lambda row: row.rms_ratio)
    lower = sum(1 for row in every if row.error["max"] < row.ortho["max"])
    text += (f"\n\nIt buys most on {ranked[0].name} (rms {ranked[0].rms_ratio:.3f} of ortho's, density {ranked[0].label}, "
             f"{ranked[0].kernel}) and least on {ranked[-1].name} ({ranked[-1].rms_ratio:.3f}, density {ranked[-1].label}, "
             f"{ranked[-1].kernel}). The single largest error is the lower one on iso in "
             f"{lower} of {len(every)}.")
    if losers:
        text += f"\n\nWhere iso is not the better one, at least once: {', '.join(losers)}."
    return "\n\n".join(textwrap.fill(part, 118) for part in text.split("\n\n"))


def main():
    isohf, folder, work = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    chosen = choose(isohf, folder)
    densities = DENSITIES
    if "--quick" in sys.argv[4:]:
        chosen, densities = chosen[:3], DENSITIES[1:2]
    if not chosen:
        sys.exit(f"accuracy_table: no elevation raster in {folder}")
    results = {}
    for density, label in densities:
        for kernel in FILTERS:
            results[label, kernel] = [Row(path.name, label, kernel, measure(isohf, path, work, density, kernel))
                                      for path, _ in chosen]
            print(f"accuracy_table: density {label}, {kernel}: done", file=sys.stderr)
    print(PAGE.format(reading=reading(results), summary=summary(results), alternatives=alternatives(results), count=len(chosen),
                      rasters="\n".join(f"- `{p.name}`: {s['width']} x {s['height']}, {s['sample_type']}, "
                                        f"{s['spacing_x']:.4g} x {s['spacing_z']:.4g}"
                                        f"{' m' if s['in_metres'] else ''}" for p, s in chosen)))
    for (label, kernel), rows in results.items():
        print(f"\n### Density {label}, {kernel}\n")
        print(table(HEAD, [row.cells() for row in rows]))


PAGE = """# What the iso lattice buys on real terrain

Written by `scripts/accuracy_table`, which runs `isohf convert --report` on {count} elevation rasters, at three densities
(lattice samples for one of the raster's) and with three filters. [cli.md](cli.md#verify) says what is measured.

{reading}

That is against squares all cut one way, and resampled as iso is. What else could be drawn with as many triangles, in rms of
iso over the other, medians and ranges over the rasters, both laid at four places:

{alternatives}

- *One diagonal*: all squares cut one way, the better of the two.
- *Least curvature*: each square cut along the diagonal on which its vertices bend less; that needs no more than the vertices.
- *Best for the source*: each cut as suits the source's samples inside it. No rule can do better; it takes the source to find.
- *Samples kept*: every second (density 1/4) or fourth (1/16) sample of each row and column, unchanged, and iso at just that
  density. At density 1 that is the source itself, without error: a mesh that may keep all samples should.

So iso with a good filter errs less than a mesh that keeps its rows and columns straight and chooses its diagonals by its
vertices, by little, and more than one whose diagonals are fitted to the source. Chosen diagonals lose what the lattice is
for, though: one strip for all tiles of a level, a lookup without a bit for each square, shadows along rows, and
coarser levels that meet without cracks.

For long waves of all directions the closed form is 0.816 (erratum E19) and 1.22 times the triangles. Ground has detail that
neither lattice resolves, which both miss alike, so that its figures lie between that and 1.

## Summary

Medians over the rasters. "iso lower": rasters on which iso's rms is the lower one. Ratios with × are of the ortho mesh of
equal rms error over iso; the last column is the archive's tiles over that mesh coded plainly.

{summary}

## Rasters

{rasters}

## All figures

Pairs are iso / ortho at as many triangles. "ratio" is rms of the archive over ortho; the four columns after it are the ratios of
the table above. Errors are in the raster's own vertical units."""

main()
