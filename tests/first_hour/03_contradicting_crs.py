"""--crs completes what a file says of its reference system; where it contradicts the file, that is an error which names
--to-crs."""
from first_hour import *


def hill(column, row):
    return 300 + column + 2 * row


def tiff(name, epsg, west, north, spacing, **more):
    return write_tiff(name, 40, 30, hill, west=west, north=north, spacing=spacing, epsg=epsg, **more)


def prj(name, text):
    (FOLDER / name).with_suffix(".prj").write_text(text)
    return FOLDER / name


def asc(name, west, south, spacing):
    return write_asc(name, 40, 30, hill, west=west, south=south, spacing=spacing)


UTM32_ESRI = ('PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,'
              '298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
              'PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",9.0],'
              'PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]')
# Easting before northing, where the code has northing first.
LAEA = ('PROJCS["ETRS89_ETRS_LAEA",GEOGCS["ETRS89",DATUM["European_Terrestrial_Reference_System_1989",SPHEROID["GRS 1980",'
        '6378137,298.257222101004]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],'
        'PROJECTION["Lambert_Azimuthal_Equal_Area"],PARAMETER["latitude_of_center",52],PARAMETER["longitude_of_center",10],'
        'PARAMETER["false_easting",4321000],PARAMETER["false_northing",3210000],UNIT["metre",1],AXIS["Easting",EAST],'
        'AXIS["Northing",NORTH]]')
UNKNOWN_DATUM = UTM32_ESRI.replace("GCS_WGS_1984", "GCS_Unknown").replace("D_WGS_1984", "Unknown").replace(
    "WGS_1984_UTM_Zone_32N", "Unknown_UTM").replace("WGS_1984\",6378137.0,298.257223563", "Intl\",6378388.0,297.0")

srtm = write_hgt("N44E006.hgt", height=lambda column, row: 1000 + column % 7)
utm = tiff("utm.tif", 32632, 400000.0, 5000000.0, 30.0)
degrees = tiff("degrees.tif", 4326, 8.0, 46.0, 0.001)
feet = tiff("feet.tif", 2263, 1000000.0, 200000.0, 100.0)
esri = prj(asc("esri.asc", 400000.0, 5000000.0, 30.0).name, UTM32_ESRI)
unknown = prj(asc("unknown.asc", 400000.0, 5000000.0, 30.0).name, UNKNOWN_DATUM)
bare = asc("bare.asc", 400000.0, 5000000.0, 30.0)
cf = write_netcdf("cf.nc", 40, 30, hill, 8.0, 46.0, 0.001)
km = write_netcdf("km.nc", 40, 30, hill, 400.0, 5000.0, 0.03, units=("km", "km"), mapping=[("crs_wkt", UTM32_ESRI)])
metres = write_netcdf("metres.nc", 40, 30, hill, 400000.0, 5000000.0, 30.0, units=("m", "m"))
moon = real("ldem_4_reduced.cub")
mars = real("megt90n000cb.lbl")

# What contradicts the file, and what it says that the file is in.
CONTRADICTIONS = [
    (srtm, "EPSG:32632", "EPSG:4326"), (srtm, "EPSG:4258", "EPSG:4326"), (srtm, "EPSG:3857", "EPSG:4326"),
    (utm, "EPSG:32633", "EPSG:32632"), (utm, "EPSG:25832", "EPSG:32632"), (utm, "EPSG:4326", "EPSG:32632"),
    (utm, "+proj=utm +zone=32 +datum=WGS84 +units=km", "EPSG:32632"),
    (degrees, "EPSG:4267", "EPSG:4326"), (feet, "EPSG:2227", "EPSG:2263"), (feet, "EPSG:32118", "EPSG:2263"),
    (esri, "EPSG:32633", "EPSG:32632"), (unknown, "EPSG:32632", "Unknown_UTM"),
    (cf, "EPSG:32632", "degrees"), (km, "EPSG:32633", "EPSG:32632"), (metres, "EPSG:4326", "metres"),
    (metres, "EPSG:2263", "metres"),
    (moon, "EPSG:4326", "SimpleCylindrical Moon"), (mars, "EPSG:32632", "MARS"),
]
# What completes it, and the codes of the system and of its heights that come out.
COMPLETIONS = [
    (bare, "EPSG:32632", 32632, None), (bare, "EPSG:2154+5720", 2154, 5720), (bare, UTM32_ESRI, 32632, None),
    (srtm, "EPSG:4326", 4326, None), (srtm, "WGS 84", 4326, None), (srtm, "EPSG:4326+5773", 4326, 5773),
    (srtm, "+proj=longlat +ellps=WGS84", 4326, None), (degrees, "EPSG:4979", 4326, None),
    (utm, "EPSG:32632+5773", 32632, 5773), (utm, UTM32_ESRI, 32632, None),
    (utm, "+proj=utm +zone=32 +datum=WGS84 +towgs84=0,0,0", 32632, None),
    (feet, "EPSG:2263+6360", 2263, 6360), (esri, "EPSG:32632", 32632, None), (esri, "EPSG:32632+3855", 32632, 3855),
    (unknown, "EPSG:23032", 23032, None), (cf, "EPSG:4258", 4258, None), (cf, "EPSG:4326", 4326, None),
    (km, "EPSG:32632", 32632, None), (metres, "EPSG:32632", 32632, None),
]

for path, system, own in CONTRADICTIONS:
    if path is None:
        continue
    found = refuses("convert", path, "a.isohf", "--crs", system, "-q", code=2, words=[path.stem, own, "--crs", "contradicts"])
    check(not (FOLDER / "a.isohf").exists(), f"{found.command}: wrote an archive")
    check("gdal_translate -a_srs" in found.err, f"{found.command}: no way out for a wrong file:\n{found.err}")
    is_map = not system.startswith(("EPSG:4", "+proj=longlat"))
    check(("--to-crs" in found.err) == (is_map and path != metres), f"{found.command}: {found.err}")
refuses("plan", srtm, "--crs", "EPSG:32632", code=2, words=["--to-crs EPSG:32632 projects it"])

for path, system, code, heights in COMPLETIONS:
    isohf("convert", path, "a.isohf", "--crs", system, "--overwrite", "-q", "--to-crs", "none")
    source = isohf("info", "a.isohf", "--json").json()["metadata"]["source"]
    crs, found = source["crs"], source["vertical_datum"]["epsg"]
    what = f"{path.name} --crs {system[:40]}"
    check(crs["epsg"] == code, f"{what}: is in EPSG:{crs['epsg']}, not EPSG:{code}")
    check(found == heights, f"{what}: heights of EPSG:{found}, not {heights}")
    # Nothing is moved.
    own = isohf("info", path, "--json").json()
    for axis in ("x", "y"):
        near(crs[f"origin_{axis}"], own["origin"][axis], 1e-9, f"{what}: the first sample's {axis}")
        near(crs[f"spacing_{axis}"], own["spacing"][axis], 1e-9, f"{what}: the spacing of {axis}")
isohf("convert", km, "a.isohf", "--crs", "EPSG:32632", "--overwrite", "-q")
valid = isohf("info", "a.isohf", "--json").json()["metadata"]["valid"]
near(valid["x1"] - valid["x0"], 1200, 1e-6, "kilometres stay kilometres: the width")

# Heights: what the file states stays, and other ones contradict it.
refuses("convert", srtm, "b.isohf", "--crs", "EPSG:4326+3855", "-q", code=2, words=["EGM96", "EGM2008"])
isohf("convert", degrees, "b.isohf", "--crs", "EPSG:4979", "-q")
check("heights above the ellipsoid" in isohf("info", "b.isohf").out, "EPSG:4979 gives no heights above the ellipsoid")

# The remedy, run: the Alps lie in the Alps.
isohf("convert", srtm, "alps.isohf", "--to-crs", "EPSG:32632", "-q")
near(isohf("sample", "alps.isohf", "--at", "6.5,44.5", "--in", "lonlat").numbers()[0][0], 1003, 4, "the Alps")
check("EPSG:32632" in isohf("info", "alps.isohf").out, "--to-crs EPSG:32632 is not recorded")

# Of several inputs each is compared: the one at fault is named, one without a system is completed.
east = tiff("east.tif", 32633, 401200.0, 5000000.0, 30.0)
plain = write_asc("plain.asc", 40, 30, hill, west=401200.0, south=5000000.0 - 900, spacing=30.0)
refuses("convert", utm, east, "m.isohf", "--crs", "EPSG:32632", "-q", code=2, words=["east.tif", "EPSG:32633"])
isohf("convert", utm, plain, "m.isohf", "--crs", "EPSG:32632", "-q", "--registration", "area")
check(isohf("info", "m.isohf", "--json").json()["metadata"]["source"]["width"] == 80, "the mosaic lacks a file")

# Coordinates that the file's own system cannot have: degrees of some million. --crs says what they are.
wrong = tiff("wrong.tif", 4326, 400000.0, 5000000.0, 30.0)
refuses("convert", wrong, "w.isohf", "-q", code=2, words=["--crs"])
isohf("convert", wrong, "w.isohf", "--crs", "EPSG:32632", "-q")
check(isohf("info", "w.isohf", "--json").json()["metadata"]["source"]["crs"]["epsg"] == 32632, "wrong.tif")

# verify reads the input again as it was read, and another one that contradicts the record is told by the archive's name.
isohf("convert", bare, "v.isohf", "--crs", "EPSG:32633", "-q")
isohf("verify", "v.isohf", "--against", bare, "-q")
refuses("verify", "v.isohf", "--against", esri, code=2, words=["v.isohf", "--crs", "esri.asc", "contradicts"])
# A file with the text of a system is not needed again.
(FOLDER / "mine.prj").write_text(UTM32_ESRI)
isohf("convert", bare, "p.isohf", "--crs", FOLDER / "mine.prj", "-q")
(FOLDER / "mine.prj").unlink()
isohf("verify", "p.isohf", "--against", bare, "-q")

# The same system, in words whose axes stand in another order.
laea = prj(asc("laea.asc", 3000000.0, 2000000.0, 1000.0).name, LAEA)
isohf("convert", laea.with_suffix(".asc"), "laea.isohf", "--crs", "EPSG:3035", "-q")
check("EPSG:3035" in isohf("info", "laea.isohf").out, "the code does not complete the words")
