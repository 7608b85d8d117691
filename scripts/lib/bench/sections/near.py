"""Bytes of real DEMs that may be rounded, against JPEG XL, WebP and LERC of the same codes."""

import os
import pathlib
import statistics
from concurrent.futures import ThreadPoolExecutor

DEMS = ["missionDEM_gale_hirise.tif", "S35E145.tif", "srtm_bigtujunga30m_utm11.tif", "N44E006.hgt", "mt_fuji_90m.tif",
        "N00E010_utm32.tif"]
ERRORS = ["0.1", "0.5", "2.5", "10", "20"]


def split_codes(pgm, ppm):
    """16 bits of grey as red and green, which WebP can hold."""
    data = pgm.read_bytes()
    head, size, depth, samples = data.split(b"\n", 3)
    assert (head, depth) == (b"P5", b"65535")
    colours = bytearray(len(samples) // 2 * 3)
    colours[0::3], colours[1::3] = samples[0::2], samples[1::2]
    ppm.write_bytes(b"P6\n" + size + b"\n255\n" + colours)


def peers_of(bench, name, pgm):
    """Bytes by peer. Each in its own process, all of the same codes without loss."""
    jxl, ppm, webp, tif = (pgm.with_suffix(end) for end in (".jxl", ".ppm", ".webp", ".tif"))
    found = {}
    if bench.has("near", "cjxl", "libjxl-tools"):
        bench.run_plainly("cjxl", pgm, jxl, "-d", "0", "-e", "9", "--num_threads=0", "--quiet")
        found["JPEG XL"] = jxl.stat().st_size
    if bench.has("near", "cwebp", "webp"):
        split_codes(pgm, ppm)
        bench.run_plainly("cwebp", "-quiet", "-lossless", "-exact", "-m", "6", "-q", "100", ppm, "-o", webp)
        found["WebP"] = webp.stat().st_size
    bench.run_plainly("gdal_translate", "-q", "-co", "COMPRESS=LERC_ZSTD", "-co", "MAX_Z_ERROR=0", "-co", "ZSTD_LEVEL=22",
                      "-co", "BLOCKYSIZE=4096", pgm, tif)
    found["LERC"] = tif.stat().st_size
    for path in (jxl, ppm, webp, tif):
        path.unlink(missing_ok=True)
    return found


STEPS = [2.0, 1.9, 1.6, 1.4]  # in E; those below 2 leave codes to choose from


def peers_at(bench, name, archive):
    pgm = bench.work / f"{name}.pgm"
    bench.run_plainly(bench.root / "build/bench/lattice_to_pgm", archive, pgm)
    found = peers_of(bench, name, pgm)
    pgm.unlink()
    return found


def compare(bench, dem, error):
    name = f"near_{dem.stem}_{error}"
    archive, best, ortho = (bench.work / f"{name}{end}" for end in (".isohf", "_best.isohf", "_ortho.tif"))
    found = {}
    for step in STEPS:
        chosen = ["--step", f"{step * float(error):.9g}"] if step < 2.0 else []
        bench.run_plainly(*bench.convert, dem, "-o", archive, "--overwrite", "--quiet", "--max-rounding", error, "-j", "1",
                          "--level", "12", *chosen)
        found[step] = bench.info_plainly(archive)
        if found[step]["tile_bytes"] <= min(info["tile_bytes"] for info in found.values()):
            archive.replace(best)
            if step == 2.0:
                peers = same = peers_at(bench, name, best)
            smallest = step
    if smallest < 2.0:
        same = peers_at(bench, name, best)
    bench.run_plainly("gdal_translate", "-q", "-ot", "Float32", "-co", "COMPRESS=LERC_ZSTD", "-co",
                      f"MAX_Z_ERROR={error}", "-co", "ZSTD_LEVEL=22", "-co", "BLOCKYSIZE=4096", dem, ortho)
    info = found[smallest]
    source = info["metadata"]["source"]
    samples = info["lattice_samples"]
    row = {"bytes": info["tile_bytes"], "bits": 8 * info["tile_bytes"] / samples, "step": smallest, "peers": peers,
           "ratio": info["tile_bytes"] / min(peers.values()), "best": min(peers, key=peers.get),
           "same_codes_ratio": info["tile_bytes"] / min(same.values()),
           "ortho_ratio": info["tile_bytes"] / samples / (ortho.stat().st_size / (source["width"] * source["height"]))}
    for path in (archive, best, ortho):
        path.unlink(missing_ok=True)
    return row


def measure(bench):
    folder = pathlib.Path(bench.options.data)
    dems = [folder / name for name in DEMS if (folder / name).exists()]
    errors = ERRORS
    if bench.options.small:
        dems, errors = dems[:1], ERRORS[1:2]
    if not dems:
        bench.say(f"near: skipped: {folder} has none of the DEMs")
        return
    cells = [(dem, error) for dem in dems for error in errors]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = dict(zip(cells, pool.map(lambda cell: compare(bench, *cell), cells)))
    rows = []
    for dem in dems:
        of_dem = [found[dem, error] for error in errors]
        rows.append([dem.name] + [f"{row['bits']:.2f}{'*' if row['step'] < 2.0 else ''}: {row['ratio']:.2f} {row['best']}, "
                                  f"{row['ortho_ratio']:.2f}" for row in of_dem])
    for what, ratio in (("all", "ratio"), ("all, peers of our very codes", "same_codes_ratio")):
        ratios = [row[ratio] for row in found.values()]
        rows.append([what, f"median {statistics.median(ratios):.3f}", f"worst {max(ratios):.3f}"]
                    + [""] * (len(errors) - 2))
    bench.add("near", ["DEM"] + [f"± {error} m" for error in errors], rows,
              "Bits a sample: bytes divided by those of the best peer, which; then bits a sample divided by those of "
              "LERC_ZSTD of the source itself at that `MAX_Z_ERROR`. Ours is the smallest of `--step` 2, 1.9, 1.6 and 1.4 "
              "times E, `--level 12`; * where codes were chosen from several (decision 67). Peers get the codes of 2 E, in "
              "the last row those that were chosen, each vertex once and voids as the sample before them: `cjxl -d 0 -e 9`, `cwebp -lossless -m 6 -q 100` of high and low bytes, LERC_ZSTD 22 "
              "without loss. Of JPEG-LS Debian has no program, and its GDAL no driver. Our tiles are counted with their "
              "padding.")
    bench.results["near"] = {f"{dem.name} {error}": row for (dem, error), row in found.items()}
