#!/usr/bin/env python3
"""ERDAS Imagine rasters that GDAL writes (a test tool here), with all of its options: samples, voids, place and system.

usage: imagine.py BIN_DIR

Ends with 77 where GDAL's Python package is missing (Debian: python3-gdal).
"""
import pathlib
import subprocess
import sys
import tempfile

from against_gdal import check, failures

import numpy
from osgeo import gdal, osr

TYPES = {"u8": (gdal.GDT_Byte, 0, 250), "u16": (gdal.GDT_UInt16, 0, 65000), "s16": (gdal.GDT_Int16, -30000, 30000),
         "u32": (gdal.GDT_UInt32, 0, 100000), "s32": (gdal.GDT_Int32, -100000, 100000),
         "f32": (gdal.GDT_Float32, -11000, 8848), "f64": (gdal.GDT_Float64, -11000, 8848)}
BITS = {1: 1, 2: 3, 4: 15}


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
    check(done.returncode == 0, f"isohf {' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done


def write(path, kind, array, options, system="EPSG:32632", void=None, place=(500000.0, 30.0, 0.0, 5200000.0, 0.0, -30.0)):
    raster = gdal.GetDriverByName("MEM").Create("", array.shape[1], array.shape[0], 1, kind)
    own = osr.SpatialReference()
    own.SetFromUserInput(system)
    raster.SetProjection(own.ExportToWkt())
    raster.SetGeoTransform(place)
    if void is not None:
        raster.GetRasterBand(1).SetNoDataValue(void)
    raster.GetRasterBand(1).WriteArray(array)
    gdal.GetDriverByName("HFA").CreateCopy(str(path), raster, options=options)


def comes_back(isohf, folder, source, what, array, void=None):
    """Samples, voids, place and system after a lossless conversion."""
    run(isohf, "convert", source, "-o", folder / "a.isohf", "--overwrite", "--lossless", "--projection", "none", "-q")
    run(isohf, "restore", folder / "a.isohf", folder / "a.tif", "--overwrite", "-q")
    ours, theirs = gdal.Open(str(folder / "a.tif")), gdal.Open(str(source))
    found = ours.ReadAsArray().astype(numpy.float64)
    wanted = array.astype(numpy.float64)
    if void is not None:
        void_found = ours.GetRasterBand(1).GetNoDataValue()
        check(void_found is not None, f"{what}: has no void value")
        found[(found == void_found) | numpy.isnan(found)] = void
    check(found.shape == wanted.shape and numpy.array_equal(found, wanted), f"{what}: samples differ")
    check(numpy.allclose(ours.GetGeoTransform(), theirs.GetGeoTransform(), atol=1e-6), f"{what}: lies elsewhere: "
          f"{ours.GetGeoTransform()} {theirs.GetGeoTransform()}")
    first, second = theirs.GetSpatialRef(), ours.GetSpatialRef()
    if second is None:
        return check(False, f"{what}: no system")
    # Polar axes have other names in each dialect: what counts is where a place lies.
    for system in (first, second):
        system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    x, y = theirs.GetGeoTransform()[0], theirs.GetGeoTransform()[3]
    there = osr.CoordinateTransformation(first, second).TransformPoint(x, y)
    spacing = theirs.GetGeoTransform()[1]
    check(abs(there[0] - x) < 1e-6 * spacing and abs(there[1] - y) < 1e-6 * spacing
          and first.GetLinearUnits() == second.GetLinearUnits(), f"{what}: another system: {x} {y} -> {there}")


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    isohf = str(pathlib.Path(sys.argv[1]).resolve() / "isohf")
    random = numpy.random.default_rng(5)
    with tempfile.TemporaryDirectory(prefix="imagine") as name:
        folder = pathlib.Path(name)
        rows, columns = numpy.mgrid[0:150, 0:201]
        shapes = {"noise": random.random((150, 201)), "slope": (rows + columns) / 400.0,
                  "steps": ((rows // 40 + columns // 70) % 3) / 3.0, "flat": numpy.full((150, 201), 0.25)}
        for word, (kind, least, most) in TYPES.items():
            for shape, values in shapes.items():
                array = numpy.round(least + values * (most - least)).astype(gdal_array(kind))
                for options in ([], ["COMPRESSED=YES"], ["USE_SPILL=YES"], ["BLOCKSIZE=128", "COMPRESSED=YES"]):
                    if shape not in ("noise", "steps") and len(options) != 1:
                        continue
                    write(folder / "a.img", kind, array, options)
                    comes_back(isohf, folder, folder / "a.img", f"{word} {shape} {options}", array)
        for bits, most in BITS.items():
            for options in ([], ["COMPRESSED=YES"]):
                for shape in ("noise", "steps"):
                    array = numpy.round(shapes[shape] * most).astype(numpy.uint8)
                    write(folder / "a.img", gdal.GDT_Byte, array, [f"NBITS={bits}", *options])
                    comes_back(isohf, folder, folder / "a.img", f"u{bits} {shape} {options}", array)
        voids = numpy.round(shapes["slope"] * 4000.0).astype(numpy.float32)
        voids[20:90, 30:60] = -9999.0
        for options in ([], ["COMPRESSED=YES"], ["STATISTICS=YES"]):
            write(folder / "a.img", gdal.GDT_Float32, voids, options, void=-9999.0)
            comes_back(isohf, folder, folder / "a.img", f"voids {options}", voids, -9999.0)
        heights = numpy.round(shapes["slope"] * 4000.0).astype(numpy.int16)
        for system in ("EPSG:32733", "EPSG:2154", "EPSG:3035", "EPSG:2263", "EPSG:5070", "EPSG:3031", "EPSG:26917", "EPSG:3857"):
            for options in ([], ["FORCETOPESTRING=YES"]):
                write(folder / "a.img", gdal.GDT_Int16, heights, options, system)
                comes_back(isohf, folder, folder / "a.img", f"{system} {options}", heights)
        write(folder / "a.img", gdal.GDT_Int16, heights, [], "EPSG:4326", place=(8.0, 0.001, 0.0, 47.0, 0.0, -0.001))
        comes_back(isohf, folder, folder / "a.img", "degrees", heights)
        # Without the text of ArcGIS there is ERDAS's own description.
        for system in ("EPSG:32632", "EPSG:32733", "EPSG:26917", "EPSG:3035", "EPSG:5070", "EPSG:32661"):
            write(folder / "a.img", gdal.GDT_Int16, heights, [], system)
            (folder / "b.img").write_bytes((folder / "a.img").read_bytes().replace(b"PE_COORDSYS", b"NO_COORDSYS"))
            comes_back(isohf, folder, folder / "b.img", f"{system} as ERDAS has it", heights)
        # A spill file goes with its file, and is asked for where it is missing.
        write(folder / "s.img", gdal.GDT_Int16, heights, ["USE_SPILL=YES"])
        (folder / "s.img").rename(folder / "t.img")
        (folder / "s.ige").rename(folder / "t.ige")
        said = run(isohf, "info", folder / "t.img").stdout
        check("ERDAS Imagine" in said, f"a renamed spill file: {said}")
        (folder / "t.ige").unlink()
        done = subprocess.run([isohf, "info", str(folder / "t.img")], capture_output=True, text=True, check=False)
        check(done.returncode == 1 and "must be beside it" in done.stderr, f"no spill file: {done.stderr}")
        # Tiles that were never written are void.
        sparse = gdal.GetDriverByName("HFA").Create(str(folder / "v.img"), 200, 100, 1, gdal.GDT_Float32)
        sparse.SetGeoTransform((0.0, 10.0, 0.0, 0.0, 0.0, -10.0))
        sparse.GetRasterBand(1).WriteArray(numpy.full((64, 64), 7.0, dtype=numpy.float32), 64, 0)
        sparse = None
        run(isohf, "convert", folder / "v.img", "-o", folder / "v.isohf", "--overwrite", "--lossless", "-q")
        run(isohf, "restore", folder / "v.isohf", folder / "v.tif", "--overwrite", "-q")
        found = gdal.Open(str(folder / "v.tif")).ReadAsArray()
        check((found == 7.0).sum() == 64 * 64 and found[0, 64] == 7.0, "tiles that were never written")
    print(f"{len(failures)} failures")
    return 1 if failures else 0


def gdal_array(kind):
    from osgeo import gdal_array as names
    return names.GDALTypeCodeToNumericTypeCode(kind)


if __name__ == "__main__":
    sys.exit(main())
