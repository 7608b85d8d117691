"""How close the surface of every filter that may be a default comes to real rasters, against bilinear."""

import json
import math
import pathlib

RASTERS = ["N44E006.hgt", "N44E007.hgt", "mt_fuji_90m.tif", "N41E002.hgt", "N49E001.hgt", "S35E145.tif",
           "N00E010_utm32.tif", "srtm_bigtujunga30m_utm11.tif", "besseggen_utm32.tif", "jacksboro_fault_dem.npz",
           "olinda_dem_utm25s.tif", "earth_0_0_0.png", "ETOPO1_1deg.tif", "megt90n000cb.lbl", "ulcn2005_lpo_inside.cub",
           "missionDEM_gale_hirise.tif", "t3d_mountain1.exr", "t3d_terrain5.exr", "t3d_hill1.exr"]
BASE = "bilinear"
FILTERS = ["limited-cubic", "catmull-rom", "bspline3"]
KEYS = ["rms", "p99", "max", "bytes"]


def figures(bench, raster, name):
    archive = bench.work / "surface.isohf"
    bench.run(bench.isohf, "convert", raster, "-o", archive, "--overwrite", "--quiet", "--filter", name)
    report = json.loads(bench.run(bench.isohf, "verify", archive, "--against", raster, "--json", "--quiet")["out"])
    found = {key: report["against"][key] for key in ("rms", "p99", "max")} | {"bytes": archive.stat().st_size}
    archive.unlink()
    return found


def measure(bench):
    folder = pathlib.Path(bench.options.data)
    rasters = [folder / name for name in RASTERS if (folder / name).exists()]
    if bench.options.small:
        rasters = rasters[:1]
    if not rasters:
        bench.say(f"surfaces: skipped: {folder} has none of the rasters")
        return
    found = {raster.name: {name: figures(bench, raster, name) for name in (BASE, *FILTERS)} for raster in rasters}
    ratio = lambda of, name, key: of[name][key] / of[BASE][key]
    mean = lambda name, key: math.exp(sum(math.log(ratio(of, name, key)) for of in found.values()) / len(found))
    cells = lambda value: [" / ".join(f"{value(name, key):.2f}" for key in KEYS) for name in FILTERS]
    rows = [[name, f"{of[BASE]['rms']:.3g}", *cells(lambda kernel, key, of=of: ratio(of, kernel, key))]
            for name, of in found.items()]
    rows.append(["geometric mean", "", *cells(mean)])
    bench.add("surfaces", ["raster", f"rms of {BASE}", *FILTERS], rows,
             f"The surface as drawn against the raster's samples (`verify --against`), equal density: rms / 99 % / "
             f"largest error / bytes of the archive, divided by {BASE}'s.")
    bench.results["surfaces"] = found
