"""Bytes of real DEMs against Cloud Optimized GeoTIFF and, where installed, JPEG XL."""

import pathlib
import shutil
import statistics

# Rasters of whole metres without voids: what other compressors can be given as it is.
DEMS = ["srtm_bigtujunga30m_utm11.tif", "N44E006.hgt", "N44E007.hgt", "N41E002.hgt", "N00E010_utm32.tif", "S35E145.tif"]


def measure(bench):
    folder = pathlib.Path(bench.options.data)
    dems = [folder / name for name in DEMS if (folder / name).exists()]
    if bench.options.smoke:
        dems = dems[:1]
    if not dems:
        bench.say(f"sizes: skipped: {folder} has none of the DEMs")
        return
    has_jxl = shutil.which("cjxl") is not None
    if not has_jxl:
        bench.say("sizes: without JPEG XL: cjxl is not installed")
    rows, found = [], {}
    for dem in dems:
        archive, cog = bench.work / "size.isohf", bench.work / "size.tif"
        us = bench.run(*bench.convert, dem, "-o", archive, "--overwrite", "--quiet", "--step", "1", "-j", "1")
        info = bench.info(archive)
        tile_bytes = info["tile_bytes"]
        source = info["metadata"]["source"]
        source_samples = source["width"] * source["height"]
        bench.run("gdal_translate", "-q", "-of", "COG", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=2", "-co",
                 "OVERVIEWS=NONE", dem, cog)
        row = {"bits": 8 * tile_bytes / info["lattice_samples"], "cog_bits": 8 * cog.stat().st_size / source_samples,
               "tile_bytes": tile_bytes, "convert_cpu_s": us["cpu_s"]}
        if has_jxl:
            pgm, jxl = bench.work / "size.pgm", bench.work / "size.jxl"
            bench.run(bench.root / "build/bench/lattice_to_pgm", archive, pgm)
            for effort in ("7", "9"):
                run = bench.run("cjxl", pgm, jxl, "-d", "0", "-e", effort, "--num_threads=0", "--quiet")
                row |= {f"jxl{effort}_bytes": jxl.stat().st_size, f"jxl{effort}_cpu_s": run["cpu_s"]}
            pgm.unlink()
            jxl.unlink()
        archive.unlink()
        cog.unlink()
        found[dem.name] = row
        cells = [dem.name, f"{row['bits']:.2f}", f"{row['cog_bits']:.2f}", f"{row['bits'] / row['cog_bits']:.2f}"]
        for effort in ("7", "9") if has_jxl else ():
            cells += [f"{tile_bytes / row[f'jxl{effort}_bytes']:.2f}",
                      f"{row[f'jxl{effort}_cpu_s'] / row['convert_cpu_s']:.0f}"]
        rows.append(cells)
    header = ["DEM, steps of 1 m", "isohf, bits a sample", "COG, bits a sample", "isohf / COG"]
    if has_jxl:
        header += ["bytes / JPEG XL -e 7", "its cpu ×", "bytes / JPEG XL -e 9", "its cpu ×"]
        medians = [f"{statistics.median(float(row[i]) for row in rows):.2f}" for i in range(3, 8)]
        medians[2], medians[4] = f"{float(medians[2]):.0f}", f"{float(medians[4]):.0f}"
    else:
        medians = [f"{statistics.median(float(row[3]) for row in rows):.2f}"]
    rows.append(["median", "", "", *medians])
    bench.add("sizes", header, rows,
             "Elevations alone, equal density. isohf's tiles are counted with their padding; JPEG XL gets the same "
             "vertices as one picture, each once, without padding. COG: DEFLATE, predictor 2, no overviews, of the ortho "
             "source itself. Processor time against the whole of `isohf convert`, one thread.")
    bench.results["sizes"] = found
