"""Maps without a place for a sample, photos in feet, seeds over degrees, other taps.

What reads outside a buffer or divides by zero cannot be seen from the command line: EdgeRange.*, Surface.* under the
sanitizers do.
"""
from first_hour import *


# 2. Taps are kept in the metadata, and a conversion with others does not continue.
write_asc("small.asc", 300, 200, lambda column, row: math.sin(column * 0.3) * 50 + row)
taps = ("--filter", "bspline3", "--acquisition")
isohf("convert", "small.asc", "a.isohf", *taps, "0.1,0.8,0.1")
found = isohf("info", "a.isohf", "--json").json()["metadata"]["acquisition"]
check(found == "0.1,0.8,0.1", f"the metadata name the acquisition {found}")
isohf("convert", "small.asc", "b.isohf", *taps, "0.05,0.9,0.05")
check((FOLDER / "a.isohf").read_bytes() != (FOLDER / "b.isohf").read_bytes(), "taps make no difference")
refuses("convert", "small.asc", "a.isohf", *taps, "0.05,0.9,0.05", "--resume", words=("acquisition", "0.1,0.8,0.1"),
        code=None)

# 4. Half of a globe on a map that does not show the other half: planned, converted and compared, in several tiles.
write_tiff("globe.tif", 360, 180, lambda column, row: 1000 * math.sin(column * 0.1) * math.cos(row * 0.05), "f",
           west=-180.0, north=90.0, spacing=1.0, epsg=4326)
system = "+proj=ortho +lat_0=0 +lon_0=180 +units=m"
isohf("plan", "globe.tif", "--to-crs", system)
for more in (("--shape", "20x19"), ("--spacing", "500km"), ("--max-error", "2000")):
    isohf("convert", "globe.tif", "globe.isohf", "--overwrite", "--to-crs", system, "--type", "f32", *more)
    report = isohf("verify", "globe.isohf", "--against", "globe.tif", "--json").json()["against"]
    # A hemisphere: half of the samples of a globe in degrees, on its outline some more or less.
    near(report["samples_off_map"], 32400, 200, f"{more}: samples that the map does not show")
    check(report["samples_compared"] + report["samples_lost"] + report["samples_off_map"] == 64800,
          f"{more}: some samples do not count")
    check(report["lost_inside"] == 0, f"{more}: {report['lost_inside']} samples are lost inside")
# The first sample is on the far side, and its place has to be stated.
refuses("plan", "globe.tif", "--to-crs", system.replace("180", "10"), words=("--to-crs", "--bbox"), code=None)

# 5. Seeds of shadows have no length in a world of degrees.
write_tiff("degrees.tif", 60, 40, lambda column, row: column * row, "h", west=9.0, north=47.0, spacing=0.001, epsg=4326)
refuses("convert", "degrees.tif", "seeds.isohf", "--to-crs", "none", "--shadow-seeds",
        words=("degrees.tif", "--shadow-seeds", "--to-crs", "degrees"), code=None)
isohf("convert", "degrees.tif", "seeds.isohf", "--shadow-seeds")

# 6. A photo and a raster in US feet, from writers that round the foot's length differently, or write its WKT differently.
WKT = ('PROJCS["NAD83 / New York Long Island (ftUS)",GEOGCS["NAD83",DATUM["North_American_Datum_1983",'
       'SPHEROID["GRS 1980",6378137,298.257222101]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],'
       'PROJECTION["Lambert_Conformal_Conic_2SP"],PARAMETER["latitude_of_origin",40.1666666666667],'
       'PARAMETER["central_meridian",-74],PARAMETER["standard_parallel_1",41.0333333333333],'
       'PARAMETER["standard_parallel_2",40.6666666666667],PARAMETER["false_easting",984250],'
       'PARAMETER["false_northing",0],UNIT["US survey foot",{foot}]]')
WORLD = "10\n0\n0\n-10\n1000005\n200395\n"


def photo(name, foot):
    """A PNG with a world file and a .prj: 40 x 40 pixels."""
    rows = b"".join(b"\0" + bytes((x * 6, y * 6, 90)[c] for x in range(40) for c in range(3)) for y in range(40))
    chunks = ((b"IHDR", struct.pack(">LLBBBBB", 40, 40, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    (FOLDER / f"{name}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">L", len(body)) + kind + body + struct.pack(">L", zlib.crc32(kind + body)) for kind, body in chunks))
    (FOLDER / f"{name}.pgw").write_text(WORLD)
    (FOLDER / f"{name}.prj").write_text(WKT.format(foot=foot))


write_asc("feet.asc", 40, 40, lambda column, row: column + row, west=1000000.0, south=200000.0, spacing=10.0)
(FOLDER / "feet.prj").write_text(WKT.format(foot="0.3048006096012192"))
for name, foot in (("same", "0.3048006096012192"), ("short", "0.304800609601"), ("long", "0.30480060960121924")):
    photo(name, foot)
    isohf("convert", "feet.asc", f"{name}.isohf", "--texture", f"{name}.png")
    bounds = isohf("info", f"{name}.isohf", "--json").json()["metadata"]
    check("textures" in json.dumps(bounds), f"{name}: no textures")
photo("metres", "1.0")
refuses("convert", "feet.asc", "metres.isohf", "--texture", "metres.png", words=("metres.png", "gdalwarp"), code=None)
