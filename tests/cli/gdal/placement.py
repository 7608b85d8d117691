#!/usr/bin/env python3
"""Where surfaces lie once they are brought to another reference system, held against GDAL (a test tool here).

usage: placement.py BIN_DIR

Heights are metres to the East of a place, or to the North of it, so that a height says where its sample lies. Ends with 77 where GDAL's Python package is missing (Debian: python3-gdal).
"""
import json
import math
import subprocess
import sys

from against_gdal import Program, check, run_parts

import numpy
from osgeo import gdal, osr

METRES_PER_DEGREE = 111320.0
SIZE = 120
NEAR = 0.3  # metres: a hundredth of a sample of 30 m

# Each differs from the one before it, or from the first, in one parameter.
FIRST = "+proj=lcc +lat_1=46 +lat_2=48 +lat_0=47 +lon_0=11 +x_0=500000 +y_0=100000 +ellps=GRS80 +units=m"
OTHERS = [("lat_1=46", "lat_1=46.001"), ("lat_2=48", "lat_2=48.001"), ("lat_0=47", "lat_0=47.001"),
          ("lon_0=11", "lon_0=11.001"), ("x_0=500000", "x_0=500001"), ("y_0=100000", "y_0=100001"),
          ("ellps=GRS80", "ellps=intl"), ("units=m", "units=us-ft"), ("proj=lcc", "proj=eqdc")]


def system(text):
    made = osr.SpatialReference()
    made.SetFromUserInput(text)
    made.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return made


def plane(lon, lat, middle, axis):
    """Metres from the middle, East (axis 0) or North (axis 1)."""
    scale = METRES_PER_DEGREE * (math.cos(math.radians(middle[1])) if axis == 0 else 1.0)
    return ((lon - middle[0]) if axis == 0 else (lat - middle[1])) * scale


def write(path, text, lon, lat, spacing, middle, axis, size=SIZE):
    """A raster of `text` around a place; spacing is metres."""
    own = system(text)
    place = osr.CoordinateTransformation(system("EPSG:4326"), own).TransformPoint(lon, lat)
    step = spacing / METRES_PER_DEGREE if own.IsGeographic() else spacing / own.GetLinearUnits()
    west = place[0] - step * size / 2
    north = place[1] + step * size / 2
    points = [(west + (c + 0.5) * step, north - (r + 0.5) * step) for r in range(size) for c in range(size)]
    geo = osr.CoordinateTransformation(own, system("EPSG:4326")).TransformPoints(points)
    heights = numpy.array([plane(p[0], p[1], middle, axis) for p in geo], dtype=numpy.float32).reshape(size, size)
    raster = gdal.GetDriverByName("GTiff").Create(str(path), size, size, 1, gdal.GDT_Float32)
    raster.SetGeoTransform((west, step, 0, north, 0, -step))
    raster.SetProjection(own.ExportToWkt())
    raster.GetRasterBand(1).WriteArray(heights)
    raster = None


def worst(path, wanted, middle, axis, reach=1000.0):
    """How far, in metres, samples of a raster lie at worst from where their heights say, and how many there are: not at
    the edges, where nothing is known of the ground beyond."""
    raster = gdal.Open(str(path))
    own = raster.GetSpatialRef()
    own.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    check(own.IsSame(system(wanted), ["CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS"]), f"{path}: is not in {wanted}")
    x0, dx, _, y0, _, dy = raster.GetGeoTransform()
    band = raster.GetRasterBand(1)
    heights = band.ReadAsArray()
    void = band.GetNoDataValue()
    transform = osr.CoordinateTransformation(own, system("EPSG:4326"))
    far = 0.0
    count = 0
    for row in range(0, raster.RasterYSize, 7):
        for column in range(0, raster.RasterXSize, 7):
            height = float(heights[row, column])
            if math.isnan(height) or height == void:
                continue
            lon, lat, _ = transform.TransformPoint(x0 + (column + 0.5) * dx, y0 + (row + 0.5) * dy)
            if abs(plane(lon, lat, middle, 0)) > reach or abs(plane(lon, lat, middle, 1)) > 1400.0:
                continue
            far = max(far, abs(height - plane(lon, lat, middle, axis)))
            count += 1
    return far, count


def projections(isohf, folder):
    """convert --to-crs SYSTEM, and what is sampled and exported of it."""
    middle = (7.2, 46.6)
    for axis in (0, 1):
        source = folder / f"degrees{axis}.tif"
        write(source, "EPSG:4326", *middle, 30.0, middle, axis)
        for text in ("EPSG:2154", "EPSG:3035", "EPSG:2056", "EPSG:3857", "ESRI:54009",
                     "+proj=tmerc +lat_0=0 +lon_0=7 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=us-ft"):
            archive = folder / "a.isohf"
            isohf.must("convert", source, "-o", archive, "--overwrite", "--type", "f32", "--to-crs", text, "-q")
            isohf.must("export", archive, folder / "a.tif", "--overwrite", "-q", "--to-crs", "none")
            far, count = worst(folder / "a.tif", text, middle, axis)
            check(far <= NEAR and count > 100, f"--to-crs {text}: off by {far} m at {count} samples")
            for lon, lat in (middle, (7.21, 46.61), (7.19, 46.592)):
                at = isohf.must("sample", archive, "--in", "lonlat", "--at", f"{lon},{lat}").stdout.split()
                off = abs(float(at[0]) - plane(lon, lat, middle, axis))
                check(off <= NEAR, f"--to-crs {text}: {lon} {lat} is off by {off} m")
                isohf.must("shade", archive, "-o", folder / "a.png", "--overwrite", "-q") if lon == 7.21 else None
            isohf.must("verify", archive, "--against", source, "-q")
    results = []
    for threads in (1, 2, 7):
        isohf.must("convert", folder / "degrees0.tif", "-o", folder / "t.isohf", "--overwrite", "--to-crs", "EPSG:2056",
                   "-q", "-j", threads)
        results.append((folder / "t.isohf").read_bytes())
    check(len(set(results)) == 1, "bytes depend on the number of threads")
    for text, why in (("EPSG:4258", "counts degrees and is no map"), ("EPSG:999999", "does not understand"),
                      ("IAU_2015:49910", "is of Mars, the input of Earth"), ("EPSG:5773", "no projected or geographic")):
        isohf.refuses(why, "convert", folder / "degrees0.tif", "-o", folder / "n.isohf", "--to-crs", text)


def write_globe(path, west):
    """All the way round from a meridian; heights are those of turned()."""
    lon, lat = numpy.meshgrid(west + numpy.arange(360) + 0.5, 59.5 - numpy.arange(120))
    raster = gdal.GetDriverByName("GTiff").Create(str(path), 360, 120, 1, gdal.GDT_Float32)
    raster.SetGeoTransform((west, 1.0, 0.0, 60.0, 0.0, -1.0))
    raster.SetProjection(system("EPSG:4326").ExportToWkt())
    raster.GetRasterBand(1).WriteArray(turned(lon, lat).astype(numpy.float32))
    raster = None


def turned(lon, lat):
    return 1000.0 * numpy.cos(numpy.radians(lon)) + 300.0 * numpy.sin(numpy.radians(lon)) + 2.0 * lat


def globes(isohf, folder):
    """Rasters of longitudes from 0 to 360: maps that are cut open at 180 degrees show all of them."""
    for west in (0.0, -180.0, 20.0):
        write_globe(folder / "globe.tif", west)
        for text in ("EPSG:3857", "ESRI:54009"):
            isohf.must("convert", folder / "globe.tif", "-o", folder / "g.isohf", "--overwrite", "--type", "f32", "-q",
                       "--to-crs", text)
            isohf.must("export", folder / "g.isohf", folder / "g.tif", "--overwrite", "-q", "--to-crs", "none")
            raster = gdal.Open(str(folder / "g.tif"))
            x0, dx, _, y0, _, dy = raster.GetGeoTransform()
            heights = raster.ReadAsArray()
            to_map = osr.CoordinateTransformation(system("EPSG:4326"), system(text))
            for lon in range(-178, 179, 7):
                for lat in (-50.0, 0.0, 33.0):
                    x, y, _ = to_map.TransformPoint(float(lon), lat)
                    column, row = int((x - x0) / dx), int((y - y0) / dy)
                    back = osr.CoordinateTransformation(system(text), system("EPSG:4326")).TransformPoint(
                        x0 + (column + 0.5) * dx, y0 + (row + 0.5) * dy)
                    off = abs(float(heights[row, column]) - float(turned(*back[:2])))
                    check(off <= 1.0, f"{text} of a globe from {west}: {lon} {lat} is off by {off} m")
        for options in (["--to-crs", "none"], ["--to-crs", "equirectangular"]):
            isohf.must("convert", folder / "globe.tif", "-o", folder / "g.isohf", "--overwrite", "-q", *options)
            for lon in (200.5, 100.5):
                said = isohf.must("sample", folder / "g.isohf", "--in", "lonlat", "--at", f"{lon},3", "--with", "crs").stdout.split()
                own = west + (lon - west) % 360.0
                check(abs(float(said[-2]) - own) < 1e-6, f"--with crs says {said[-2]} for {own}, from {west} on")
    write(folder / "across.tif", "EPSG:4326", 180.0, 10.0, 30.0, (180.0, 10.0), 0)
    isohf.refuses("its edge runs through it", "convert", folder / "across.tif", "-o", folder / "n.isohf", "--to-crs",
                  "+proj=moll +datum=WGS84")


def planets(isohf, folder):
    """Systems of other bodies by their radii alone, which PROJ knows no bodies of."""
    for own, text, loses in (
            ("+proj=longlat +R=3396190", "+proj=eqc +R=3396190", False),
            ("IAU_2015:49900", "+proj=sinu +lon_0=137 +R=3396190", False),
            ("+proj=longlat +R=3396190", "IAU_2015:49910", False),
            ("+proj=longlat +a=3396190 +b=3376200", "+proj=stere +lat_0=-90 +a=3396190 +b=3376200", False),
            ("+proj=longlat +a=3396190 +b=3376200", "+proj=eqc +R=3396190", True),
            ("+proj=longlat +R=1737400", "+proj=merc +R=1737400", False)):
        raster = gdal.GetDriverByName("GTiff").Create(str(folder / "body.tif"), 60, 60, 1, gdal.GDT_Float32)
        raster.SetGeoTransform((136.0, 0.01, 0.0, -4.0, 0.0, -0.01))
        raster.SetProjection(system(own).ExportToWkt())
        raster.GetRasterBand(1).WriteArray(numpy.tile(numpy.arange(60, dtype=numpy.float32) * 0.01, (60, 1)))
        raster = None
        result = isohf.must("convert", folder / "body.tif", "-o", folder / "b.isohf", "--overwrite", "--type", "f32",
                            "--to-crs", text)
        check(("taken for one" in result.stderr) == loses, f"{own} to {text}: {result.stderr}")
        isohf.must("export", folder / "b.isohf", folder / "b.tif", "--overwrite", "-q", "--to-crs", "none")
        raster = gdal.Open(str(folder / "b.tif"))
        x0, dx, _, y0, _, dy = raster.GetGeoTransform()
        geographic = system(text).CloneGeogCS()
        geographic.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        to_own = osr.CoordinateTransformation(system(text), geographic)
        column, row = raster.RasterXSize // 2, raster.RasterYSize // 2
        lon, _, _ = to_own.TransformPoint(x0 + (column + 0.5) * dx, y0 + (row + 0.5) * dy)
        height = float(raster.ReadAsArray()[row, column])
        check(abs(height - (lon - 136.005)) < 1e-4, f"{own} to {text}: {height}, must be {lon - 136.005}")


def heights_of_a_projection(isohf, folder):
    """A system that speaks of heights is taken where the input's are the same."""
    for own, text, taken in (("EPSG:32632", "EPSG:3035+5773", False), ("EPSG:32632+5773", "EPSG:3035+5773", True),
                             ("EPSG:32632+5773", "EPSG:3035+3855", False)):
        write(folder / "h.tif", "EPSG:32632", 8.5, 46.5, 30.0, (8.5, 46.5), 0, 40)
        arguments = ("convert", folder / "h.tif", "-o", folder / "h.isohf", "--overwrite", "-q", "--crs", own,
                     "--to-crs", text)
        isohf.must(*arguments) if taken else isohf.refuses("speaks of heights", *arguments)


def joined(isohf, folder):
    """Rasters of two zones as one surface."""
    middle = (12.0, 46.6)
    for axis in (0, 1):
        write(folder / "w.tif", "EPSG:32632", 11.985, 46.6, 30.0, middle, axis)
        write(folder / "e.tif", "EPSG:32633", 12.015, 46.6, 30.0, middle, axis)
        pair = (folder / "w.tif", folder / "e.tif")
        isohf.refuses("--to-crs joins them", "convert", *pair, "-o", folder / "n.isohf")
        for text, wanted in (("EPSG:3035", "EPSG:3035"), ("EPSG:32632", "EPSG:32632"), ("utm:33N", "EPSG:32633"),
                             ("auto", None), ("EPSG:3857", "EPSG:3857")):
            archive = folder / "j.isohf"
            isohf.must("convert", *pair, "-o", archive, "--overwrite", "--type", "f32", "--to-crs", text, "-q")
            isohf.must("export", archive, folder / "j.tif", "--overwrite", "-q", "--to-crs", "none")
            own = gdal.Open(str(folder / "j.tif")).GetProjection()
            far, count = worst(folder / "j.tif", wanted or own, middle, axis, 2400.0)
            check(far <= NEAR and count > 200, f"joined by {text}: off by {far} m at {count} samples")
            isohf.must("verify", archive, "--against", pair[0], "--against", pair[1], "-q")
            for lon in (11.97, 12.0, 12.03):
                at = isohf.must("sample", archive, "--in", "lonlat", "--at", f"{lon},46.6").stdout.split()
                off = abs(float(at[0]) - plane(lon, 46.6, middle, axis))
                check(off <= NEAR, f"joined by {text}: {lon} is off by {off} m")
        # Files of the map that they are joined on keep their samples.
        isohf.must("convert", *pair, "-o", folder / "l.isohf", "--overwrite", "--lossless", "--to-crs", "EPSG:32632", "-q")
        isohf.must("export", folder / "l.isohf", folder / "l.tif", "--overwrite", "-q")
        whole = gdal.Open(str(folder / "l.tif"))
        west = gdal.Open(str(pair[0]))
        a = whole.GetGeoTransform()
        b = west.GetGeoTransform()
        column = round((b[0] - a[0]) / a[1])
        row = round((b[3] - a[3]) / a[5])
        part = whole.ReadAsArray(column, row, 40, SIZE)
        check(numpy.array_equal(part, west.ReadAsArray(0, 0, 40, SIZE)), "samples on the map itself are not kept")
    results = []
    for threads in (1, 3):
        isohf.must("convert", *pair, "-o", folder / "t.isohf", "--overwrite", "--to-crs", "EPSG:3035", "-q", "-j", threads)
        results.append((folder / "t.isohf").read_bytes())
    check(results[0] == results[1], "bytes of a joined mosaic depend on the number of threads")


def other_parameters(isohf, folder):
    """Two maps that differ in one parameter never join as if they were equal."""
    middle = (11.2, 47.1)
    write(folder / "first.tif", FIRST, *middle, 30.0, middle, 0, 40)
    isohf.must("convert", folder / "first.tif", "-o", folder / "first.isohf", "--overwrite", "-q")
    for old, new in OTHERS:
        text = FIRST.replace(old, new)
        assert text != FIRST
        write(folder / "other.tif", text, *middle, 30.0, middle, 0, 40)
        isohf.refuses("--to-crs joins them", "convert", folder / "first.tif", folder / "other.tif", "-o",
                      folder / "n.isohf")
        like = isohf.run("export", folder / "first.isohf", folder / "like.tif", "--overwrite", "--like",
                         folder / "other.tif")
        check(like.returncode != 0 and len(like.stderr.strip().splitlines()) == 1, f"--like takes {new} for {old}")
        photo = gdal.GetDriverByName("GTiff").CreateCopy(str(folder / "photo.tif"), gdal.Translate(
            "", str(folder / "other.tif"), format="MEM", outputType=gdal.GDT_Byte))
        photo = None
        texture = isohf.run("convert", folder / "first.tif", "-o", folder / "n.isohf", "--overwrite", "--texture",
                            folder / "photo.tif")
        check(texture.returncode != 0 and len(texture.stderr.strip().splitlines()) == 1,
              f"--texture takes {new} for {old}")


def written_elsewhere(isohf, folder):
    """export --to-crs."""
    middle = (9.4, 46.8)
    for axis in (0, 1):
        for own in ("EPSG:32632", "EPSG:4326", "EPSG:2056"):
            source = folder / "own.tif"
            write(source, own, *middle, 30.0, middle, axis)
            for options in ([], ["--to-crs", "EPSG:3035"]):
                isohf.must("convert", source, "-o", folder / "o.isohf", "--overwrite", "--type", "f32", "-q", *options)
                for text in ("EPSG:4326", "EPSG:3035", "EPSG:21781", "EPSG:3857", "EPSG:25832"):
                    isohf.must("export", folder / "o.isohf", folder / "o.tif", "--overwrite", "-q", "--to-crs", text)
                    far, count = worst(folder / "o.tif", text, middle, axis)
                    check(far <= NEAR and count > 100,
                          f"export of {own} {options} --to-crs {text}: off by {far} m at {count} samples")
    isohf.must("export", folder / "o.isohf", folder / "cut.tif", "--overwrite", "-q", "--to-crs", "EPSG:3857", "--size", "64x64",
               "--tile-size", "32")
    far, count = worst(folder / "cut_x1_y1.tif", "EPSG:3857", middle, 1)
    check(far <= NEAR and count > 5, f"the South-East tile is off by {far} m at {count} samples")
    isohf.refuses("hex", "export", folder / "o.isohf", folder / "n.tif", "--to-crs", "EPSG:3857", "--method", "hex")
    isohf.refuses("does not understand", "export", folder / "o.isohf", folder / "n.tif", "--to-crs", "EPSG:999999")
    isohf.refuses("degrees", "export", folder / "o.isohf", folder / "n.tif", "--to-crs", "EPSG:4326", "--spacing", "30m")


def beside(isohf, folder):
    """Files beside a raster that is replaced say nothing of the new one; other kinds stay."""
    write(folder / "placed.tif", "EPSG:3035", 10.0, 52.0, 30.0, (10.0, 52.0), 0, 40)
    isohf.must("convert", folder / "placed.tif", "-o", folder / "p.isohf", "--overwrite", "-q")
    raster = gdal.GetDriverByName("GTiff").Create(str(folder / "bare.tif"), 40, 40, 1, gdal.GDT_Float32)
    raster.GetRasterBand(1).WriteArray(numpy.arange(1600, dtype=numpy.float32).reshape(40, 40))
    raster = None
    isohf.must("convert", folder / "bare.tif", "-o", folder / "b.isohf", "--overwrite", "-q")
    for name, said in (("a.png", ("a.pgw", "a.png.aux.xml")), ("a.exr", ("a.erw", "a.exr.aux.xml")), ("b.asc", ("b.prj",)),
                       ("b.flt", ("b.prj",)), ("c.tif", ("c.tif.aux.xml", "c.tfw", "c.prj"))):
        isohf.must("export", folder / "p.isohf", folder / name, "--overwrite", "-q")
        if name == "c.tif":
            (folder / "c.tif.aux.xml").write_text("<PAMDataset><SRS>EPSG:4326</SRS></PAMDataset>")
            (folder / "c.tfw").write_text("1\n0\n0\n-1\n5\n6\n")
            (folder / "c.prj").write_text(system("EPSG:4326").ExportToWkt())
        for other in said:
            check((folder / other).exists(), f"{name} has no {other} beside it")
        isohf.must("export", folder / "b.isohf", folder / name, "--overwrite", "-q")
        for other in said:
            check(not (folder / other).exists(), f"{other} of the raster before is still beside {name}")
    (folder / "k.tif.aux.xml").write_text("my notes")
    for _ in range(2):
        isohf.must("export", folder / "b.isohf", folder / "k.tif", "--overwrite", "-q")
    check((folder / "k.tif.aux.xml").exists(), "a file of another kind is gone")


def samples(isohf, folder):
    """The source's own samples in formats that hold them otherwise."""
    def kept(name, array, kind, scale=None, void=None):
        raster = gdal.GetDriverByName("GTiff").Create(str(folder / name), array.shape[1], array.shape[0], 1, kind)
        raster.SetGeoTransform((500000, 10, 0, 5000000, 0, -10))
        raster.SetProjection(system("EPSG:32632").ExportToWkt())
        band = raster.GetRasterBand(1)
        if scale:
            band.SetScale(scale)
        if void is not None:
            band.SetNoDataValue(void)
        band.WriteArray(array)
        band = raster = None
        isohf.must("convert", folder / name, "-o", folder / "k.isohf", "--overwrite", "--lossless", "-q")

    decimals = numpy.round(numpy.linspace(100.0, 220.0, 1600).reshape(40, 40), 2)
    kept("d.tif", decimals, gdal.GDT_Float64)
    isohf.refuses("which float32 does not hold; use another format", "export", folder / "k.isohf", folder / "d.exr")
    tenths = numpy.arange(1600, dtype=numpy.int16).reshape(40, 40)
    tenths[3, 4] = -32768
    kept("t.tif", tenths, gdal.GDT_Int16, 0.1, -32768)
    isohf.must("export", folder / "k.isohf", folder / "t.asc", "-q")
    found = numpy.loadtxt(str(folder / "t.asc"), skiprows=6)
    check(found[3, 3] == 12.3, f"123 tenths are {found[3, 3]}")
    check(found[3, 4] < -1e38, f"a void is {found[3, 4]}")
    isohf.refuses("which uint16 does not hold", "export", folder / "k.isohf", folder / "t.png")
    whole = numpy.arange(1600, dtype=numpy.int16).reshape(40, 40)
    kept("w.tif", whole, gdal.GDT_Int16, None, -32768)
    for name in ("w.png", "w.r16"):
        isohf.must("export", folder / "k.isohf", folder / name, "-q")
    check(numpy.array_equal(gdal.Open(str(folder / "w.png")).ReadAsArray(), whole), "samples of a PNG differ")


def turns(isohf, folder):
    """Globes in metres go round as those in degrees do: to the samples of their other end, at whatever longitude that is."""
    turn, turn_of_mars = 2 * math.pi * 6378137.0, 2 * math.pi * 3396190.0
    for text, west, length, north, repeated in (("EPSG:4087", -turn / 2, turn, turn / 4, 0), ("EPSG:3857", -turn / 2, turn, turn / 2, 0),
                                                ("+proj=eqc +R=3396190 +lon_0=180", -turn_of_mars / 2, turn_of_mars, turn_of_mars / 4, 0),
                                                ("+proj=eqc +R=3396190", 0.0, turn_of_mars, turn_of_mars / 4, 1)):
        columns, rows = 180, 90
        step = length / columns
        own = system(text)
        geo = own.CloneGeogCS()
        geo.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
        to_geo = osr.CoordinateTransformation(own, geo)
        longitudes = numpy.radians([to_geo.TransformPoint(west + (c + 0.5) * step, 0.0)[0] for c in range(columns + repeated)])
        raster = gdal.GetDriverByName("GTiff").Create(str(folder / "g.tif"), columns + repeated, rows, 1, gdal.GDT_Float32)
        raster.SetGeoTransform((west, step, 0, north, 0, -2 * north / rows))
        raster.SetSpatialRef(own)
        raster.GetRasterBand(1).WriteArray(numpy.tile((1000 * numpy.cos(longitudes)).astype(numpy.float32), (rows, 1)))
        raster = None
        isohf.must("convert", folder / "g.tif", "-o", folder / "g.isohf", "--overwrite", "-q", "--wrap-x", "--lossless")
        isohf.must("verify", folder / "g.isohf", "--against", folder / "g.tif")
        isohf.must("export", folder / "g.isohf", folder / "back.tif", "--overwrite", "-q")
        check(numpy.array_equal(gdal.Open(str(folder / "back.tif")).ReadAsArray(), gdal.Open(str(folder / "g.tif")).ReadAsArray()[:, :columns]),
              f"{text}: samples differ")
        for longitude in (180.0, -179.5, 179.5, 0.0, 0.5, -0.5, 90.0, 200.0):
            height = float(isohf.must("sample", folder / "g.isohf", "--in", "lonlat", "--at", f"{longitude},1").stdout.split()[0])
            check(abs(height - 1000 * math.cos(math.radians(longitude))) < 2, f"{text}: {height} at longitude {longitude}")
        isohf.refuses("leave one of them out", "convert", folder / "g.tif", "-o", folder / "n.isohf", "--wrap-x", "--to-crs", "equirectangular")
    write(folder / "u.tif", "EPSG:32632", 9.0, 46.0, 30.0, (9.0, 46.0), 0, 40)
    isohf.refuses("on a map whose meridians are evenly spaced columns", "convert", folder / "u.tif", "-o", folder / "n.isohf", "--wrap-x")
    write(folder / "p.tif", "EPSG:4087", 9.0, 46.0, 30.0, (9.0, 46.0), 0, 40)
    isohf.refuses("needs columns all the way round, 40075016.68", "convert", folder / "p.tif", "-o", folder / "n.isohf", "--wrap-x")


def shows_the_same(found, wanted):
    """Whether two systems are of one ellipsoid and have the same coordinates, whatever their method's variant is called."""
    if found is None or abs(found.GetSemiMajor() - wanted.GetSemiMajor()) > 1e-3 or abs(found.GetInvFlattening() - wanted.GetInvFlattening()) > 1e-6:
        return False
    if found.IsGeographic() or wanted.IsGeographic():
        return bool(found.IsGeographic() and wanted.IsGeographic())
    for system_here in (found, wanted):
        system_here.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    there = osr.CoordinateTransformation(found, wanted)
    for x, y in ((5000.0, 20000.0), (-30000.0, -7000.0), (250000.0, 90000.0)):
        u, v, _ = there.TransformPoint(x, y)
        if not (abs(u - x) < 1e-3 and abs(v - y) < 1e-3):
            return False
    return True


def same_for_gdal(isohf, folder):
    """What GDAL reads of an export is the system that it reads of the source, and its unit."""
    for text in ("+proj=eqc +lat_ts=0 +lon_0=180 +R=3396190", "+proj=eqc +lat_ts=20 +lon_0=30 +R=1737400", "IAU_2015:49910", "IAU_2015:30100",
                 "+proj=stere +lat_0=-90 +lon_0=0 +R=1737400", "+proj=stere +lat_0=90 +lon_0=30 +a=3396190 +b=3376200",
                 "+proj=sinu +lon_0=137 +R=3396190", "+proj=longlat +R=6051800"):
        raster = gdal.GetDriverByName("MEM").Create("", 20, 12, 1, gdal.GDT_Int16)
        raster.GetRasterBand(1).WriteArray(numpy.arange(240, dtype=numpy.int16).reshape(12, 20))
        raster.SetSpatialRef(system(text))
        raster.SetGeoTransform((10.0, 0.25, 0, 20.0, 0, -0.25) if system(text).IsGeographic() else (5000.0, 100.0, 0, 20000.0, 0, -100.0))
        for driver, name in (("GTiff", "a.tif"), ("ISIS3", "a.cub"), ("PDS4", "a.xml"), ("AAIGrid", "a.asc")):
            path = folder / name
            for old in folder.glob("a.*"):
                old.unlink()
            try:
                gdal.GetDriverByName(driver).CreateCopy(str(path), raster)
            except RuntimeError:
                continue
            for old in folder.glob("*.aux.xml"):
                old.unlink()
            wanted = gdal.Open(str(path)).GetSpatialRef()
            if wanted is None:
                continue
            isohf.must("convert", path, "-o", folder / "s.isohf", "--overwrite", "-q", "--to-crs", "none", "--lossless")
            isohf.must("export", folder / "s.isohf", folder / "s.tif", "--overwrite", "-q")
            found = gdal.Open(str(folder / "s.tif")).GetSpatialRef()
            check(shows_the_same(found, wanted), f"{text} in {name}: {found.ExportToWkt(['FORMAT=WKT2_2019'])}, must be {wanted.ExportToWkt(['FORMAT=WKT2_2019'])}")
    for unit, wanted, text in (("m", "m", "EPSG:32632"), ("meters", "m", "EPSG:4326"), ("ft", "ft", "EPSG:2263"), ("US survey foot", "US survey foot", "EPSG:2263"),
                               ("", "metre", "EPSG:32632+5773"), ("", "US survey foot", "EPSG:2263+6360"), ("", "", "EPSG:32632")):
        write(folder / "u.tif", text, -74.0, 40.7, 30.0, (-74.0, 40.7), 0, 40)
        raster = gdal.Open(str(folder / "u.tif"), gdal.GA_Update)
        raster.GetRasterBand(1).SetUnitType(unit)
        raster = None
        for name in ("out.tif", "out.png"):
            isohf.must("convert", folder / "u.tif", "-o", folder / "u.isohf", "--overwrite", "-q", "--to-crs", "none")
            isohf.must("export", folder / "u.isohf", folder / name, "--overwrite", "-q")
            ours = gdal.Open(str(folder / name))
            found = ours.GetRasterBand(1).GetUnitType()
            check(found == wanted, f"unit {unit!r} of {text} in {name}: {found!r}, must be {wanted!r}")
            check(ours.GetSpatialRef().IsCompound() == system(text).IsCompound(), f"{text} with unit {unit!r} in {name}: heights")
    # A .hgt lies on degrees alone for GDAL, and its heights go on being above EGM96.
    (folder / "N44E006.hgt").write_bytes(numpy.full((1201, 1201), 500, dtype=">i2").tobytes())
    isohf.must("convert", folder / "N44E006.hgt", "-o", folder / "h.isohf", "-q", "--to-crs", "none")
    isohf.must("export", folder / "h.isohf", folder / "h.tif", "-q")
    check(gdal.Open(str(folder / "h.tif")).GetSpatialRef().GetAuthorityCode(None) == "4326", "a .hgt is no EPSG:4326")
    check("EGM96" in isohf.must("info", folder / "h.tif").stdout, "a .hgt's geoid is lost")


def pages(isohf, folder):
    """A TIFF's images are named by numbers; overviews and masks are none."""
    for i in range(3):
        one = gdal.GetDriverByName("MEM").Create("", 40, 30 + i, 1, gdal.GDT_Int16)
        one.GetRasterBand(1).WriteArray(numpy.full((30 + i, 40), 7 * i) + numpy.arange(40, dtype=numpy.int16))
        options = ["APPEND_SUBDATASET=YES"] if i else []
        gdal.GetDriverByName("GTiff").CreateCopy(str(folder / "p.tif"), one, options=options)
        if i == 0:
            gdal.Open(str(folder / "p.tif"), gdal.GA_Update).BuildOverviews("AVERAGE", [2, 4])
    check("there are 3 images in the file; the first is read, --part 0 to 2 names one" in isohf.must("info", folder / "p.tif").stderr, "pages are not told")
    for part, height in (("0", 30), ("1", 31), ("2", 32)):
        found = json.loads(isohf.must("info", folder / "p.tif", "--json", "--part", part).stdout)
        check(found["height"] == height, f"page {part}: {found['height']} rows")
        isohf.must("convert", folder / "p.tif", "-o", folder / "p.isohf", "--overwrite", "-q", "--part", part, "--lossless")
        isohf.must("export", folder / "p.isohf", folder / "q.tif", "--overwrite", "-q")
        check(gdal.Open(str(folder / "q.tif")).ReadAsArray()[3, 0] == 7 * int(part), f"page {part}: other samples")
        isohf.must("verify", folder / "p.isohf", "--against", folder / "p.tif")
    isohf.refuses("there is no image 3; there are 0 to 2", "info", folder / "p.tif", "--part", "3")
    isohf.refuses("its images have numbers", "info", folder / "p.tif", "--part", "last")


def numbers_of_no_unit(isohf, folder):
    """Codes that are told for what they may be, and what half floats take."""
    for name, high, is_told in (("a.png", 60000, True), ("b.png", 4000, False)):
        raster = gdal.GetDriverByName("MEM").Create("", 40, 30, 1, gdal.GDT_UInt16)
        raster.GetRasterBand(1).WriteArray(numpy.linspace(0, high, 1200).reshape(30, 40).astype(numpy.uint16))
        gdal.GetDriverByName("PNG").CreateCopy(str(folder / name), raster)
        said = isohf.must("convert", folder / name, "-o", folder / "n.isohf", "--overwrite").stderr
        check(("more than any ground is high; where they are not metres, give --z-scale and --z-offset" in said) == is_told, f"{name}: {said}")
    said = isohf.must("export", folder / "n.isohf", folder / "h.tif", "--type", "f16").stderr
    check("half floats have 11 bits: elevations are rounded by up to 1 of their unit" in said, f"f16: {said}")


def ellipsoidal(isohf, folder):
    """Codes of three coordinates count heights from the ellipsoid, whoever says them."""
    for text in ("EPSG:4979", "EPSG:4937", "EPSG:6319"):
        raster = gdal.GetDriverByName("GTiff").Create(str(folder / "e.tif"), 20, 20, 1, gdal.GDT_Int16)
        raster.SetSpatialRef(system(text))
        raster.SetGeoTransform((8.0, 0.01, 0, 47.0, 0, -0.01))
        raster = None
        check("heights above the ellipsoid" in isohf.must("info", folder / "e.tif").stdout, f"{text}: no heights above the ellipsoid")
        isohf.must("convert", folder / "e.tif", "-o", folder / "e.isohf", "--overwrite", "-q", "--lossless")
        isohf.must("export", folder / "e.isohf", folder / "back.tif", "--overwrite", "-q")
        own = gdal.Open(str(folder / "back.tif")).GetSpatialRef()
        check(own.IsSame(system(text), ["IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES"]) and not own.IsCompound(), f"{text}: {own.ExportToWkt()}")
    # The last is NAD83(2011).
    isohf.refuses("--crs EPSG:4979 contradicts", "convert", folder / "e.tif", "-o", folder / "n.isohf", "--crs", "EPSG:4979")
    write(folder / "flat.tif", "EPSG:4326", 9.0, 46.0, 30.0, (9.0, 46.0), 0, 40)
    isohf.must("convert", folder / "flat.tif", "-o", folder / "e.isohf", "--overwrite", "-q", "--lossless", "--crs", "EPSG:4979")
    check("heights above the ellipsoid" in isohf.must("info", folder / "e.isohf").stdout, "--crs EPSG:4979: no heights above the ellipsoid")


def large_chunks(isohf, folder):
    """What is looked at in a netCDF-4 file before it is read decodes no chunk of a gigabyte."""
    path = folder / "c.nc"
    subprocess.run([sys.executable, "-c", WRITE_CHUNK, str(path)], check=True)
    measured = subprocess.run([sys.executable, "-c", PEAK, f"{isohf.bin}/isohf", "info", str(path), "-q", "--json"], stdout=subprocess.PIPE, text=True,
                              check=True)
    peak = int(measured.stdout.split()[-1])
    check(peak < 300000, f"info of a large chunk takes {peak} kB")


def feet(isohf, folder):
    """Elevations beside coordinates in feet are in a unit that somebody has to say; a system with heights in another one
    than the file's is refused."""
    asks = "nothing says what its elevations are in"
    write(folder / "feet.tif", "EPSG:2263", -74.0, 40.7, 30.0, (-74.0, 40.7), 0, 40)
    write(folder / "both.tif", "EPSG:2263+6360", -74.0, 40.7, 30.0, (-74.0, 40.7), 0, 40)
    for name, options, is_asked, unit in (("feet.tif", (), True, None), ("feet.tif", ("--z-scale", "0.3048006096"), False, None),
                                          ("feet.tif", ("--crs", "EPSG:2263+6360"), False, "US survey foot"),
                                          ("both.tif", (), False, "US survey foot"),
                                          ("both.tif", ("--crs", "EPSG:2263"), False, "US survey foot"),
                                          ("both.tif", ("--crs", "EPSG:2263+5703", "--z-scale", "0.3048006096"), False, "metre")):
        said = isohf.must("convert", folder / name, "-o", folder / "f.isohf", "--overwrite", "--json", *options)
        check((asks in said.stderr) == is_asked, f"{name} {options}: {said.stderr}")
        found = json.loads(said.stdout)["metadata"]["units"]["vertical"]
        check(found == (unit or "unknown"), f"{name} {options}: another unit than {unit}: {found}")
    isohf.refuses("--z-scale 0.304800609601", "plan", folder / "both.tif", "--crs", "EPSG:2263+5703")
    isohf.refuses("--crs EPSG:32618+5773 contradicts", "convert", folder / "both.tif", "-o", folder / "n.isohf", "--crs", "EPSG:32618+5773")


def voids_of_files(isohf, folder):
    """What a mosaic says of undeclared voids keeps those of every file."""
    for i, void in enumerate((-9999, -32768)):
        write(folder / f"v{i}.tif", "EPSG:32632", 9.0, 46.0, 30.0, (9.0, 46.0), 0, 40)
        raster = gdal.Translate("", str(folder / f"v{i}.tif"), format="MEM", outputType=gdal.GDT_Int16)
        place = list(raster.GetGeoTransform())
        raster.SetGeoTransform((place[0] + i * 40 * place[1], *place[1:]))
        heights = numpy.full((40, 40), 100 + i, dtype=numpy.int16)
        heights[0, :3] = void
        heights[1, :5] = 32767
        raster.GetRasterBand(1).WriteArray(heights)
        raster.GetRasterBand(1).SetNoDataValue(void)
        gdal.GetDriverByName("GTiff").CreateCopy(str(folder / f"v{i}.tif"), raster)
    said = isohf.must("convert", folder / "v0.tif", folder / "v1.tif", "-o", folder / "v.isohf").stderr
    remedy = "--nodata -32768,-9999,32767"
    check(remedy in said, f"void values of two files: {said}")
    again = isohf.must("convert", folder / "v0.tif", folder / "v1.tif", "-o", folder / "v.isohf", "--overwrite", "--lossless",
                       *remedy.split())
    check("--nodata" not in again.stderr, f"the remedy asks again: {again.stderr}")
    # The source's own samples have them all, and a TIFF one void value.
    said = isohf.must("export", folder / "v.isohf", folder / "v.tif").stderr
    check("3 samples hold -9999," in said and "10 samples hold 32767," in said, f"export of three void values: {said}")
    isohf.must("export", folder / "v.isohf", folder / "v.tif", "--overwrite", "--method", "hex")
    found = gdal.Open(str(folder / "v.tif"))
    # The surface reaches less than a step of the lattice into what is void.
    count = int(((found.ReadAsArray() < 99) | (found.ReadAsArray() > 102) | numpy.isnan(found.ReadAsArray())).sum())
    check(8 <= count <= 16, f"{count} voids after the remedy, must be 16 but for those beside elevations")


def beside_samples(isohf, folder):
    """What GDAL's .aux.xml says of arrays and bare samples."""
    heights = numpy.arange(1600, dtype="<u2").reshape(40, 40)
    (folder / "a.r16").write_bytes(heights.tobytes())
    numpy.save(folder / "a.npy", heights)
    for name, options in (("a.r16", ("--raw", "40x40:u16le")), ("a.npy", ())):
        (folder / (name + ".aux.xml")).write_text(
            f"<PAMDataset><SRS>{system('EPSG:2154').ExportToWkt()}</SRS><GeoTransform>700000, 25, 0, 6600000, 0, -25"
            "</GeoTransform><PAMRasterBand band='1'><NoDataValue>7</NoDataValue><UnitType>ft</UnitType></PAMRasterBand></PAMDataset>")
        isohf.must("convert", folder / name, "-o", folder / "s.isohf", "--overwrite", "--lossless", "--to-crs", "none", "-q", *options)
        isohf.must("export", folder / "s.isohf", folder / "s.tif", "--overwrite", "-q")
        found = gdal.Open(str(folder / "s.tif"))
        check(found.GetGeoTransform() == (700000.0, 25.0, 0.0, 6600000.0, 0.0, -25.0), f"{name}: {found.GetGeoTransform()}")
        check(found.GetSpatialRef().GetAuthorityCode("PROJCS") == "2154", f"{name}: another system")
        check(found.GetRasterBand(1).GetUnitType() in ("ft", "foot"), f"{name}: unit {found.GetRasterBand(1).GetUnitType()}")
        check(numpy.array_equal(found.ReadAsArray(), heights) and found.GetRasterBand(1).GetNoDataValue() == 7.0, f"{name}: samples differ")


def rotated(isohf, folder):
    """Degrees about a pole that is not the Earth's are refused."""
    raster = gdal.GetDriverByName("GTiff").Create(str(folder / "turned.tif"), 40, 40, 1, gdal.GDT_Float32)
    raster.SetGeoTransform((2.0, 0.1, 0, 1.0, 0, -0.1))
    raster.SetSpatialRef(system("+proj=ob_tran +o_proj=longlat +o_lat_p=39.25 +o_lon_p=0 +lon_0=18 +R=6371229"))
    raster = None
    isohf.refuses("rotated pole", "convert", folder / "turned.tif", "-o", folder / "n.isohf")
    write(folder / "plain.tif", "EPSG:4326", 9.0, 46.0, 30.0, (9.0, 46.0), 0, 40)
    isohf.refuses("rotated pole", "plan", folder / "plain.tif", "--crs", "+proj=ob_tran +o_proj=longlat +o_lat_p=39.25 +o_lon_p=0 +lon_0=18 +R=6371229")


# Of a program that a small process starts: its peak would count that of a large one.
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


WRITE_CHUNK = """
import sys
import numpy
from osgeo import gdal
root = gdal.GetDriverByName("netCDF").CreateMultiDimensional(sys.argv[1]).GetRootGroup()
y, x = (root.CreateDimension(name, "", "", 12000) for name in "yx")
made = root.CreateMDArray("z", [y, x], gdal.ExtendedDataType.Create(gdal.GDT_Float32),
                          ["BLOCKSIZE=12000,12000", "COMPRESS=DEFLATE", "ZLEVEL=1"])
made.Write(numpy.zeros((12000, 12000), dtype=numpy.float32))
"""


PARTS = (projections, globes, planets, heights_of_a_projection, joined, other_parameters, written_elsewhere, beside,
         samples, turns, same_for_gdal, pages, numbers_of_no_unit, ellipsoidal, large_chunks, feet, voids_of_files, beside_samples, rotated)

if __name__ == "__main__":
    sys.exit(run_parts(PARTS, __doc__))
