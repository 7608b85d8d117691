"""Heights in feet: the same terrain has the same slopes and shadows as in metres, at vertices and between them.

`sample` blended the unit normals of heights in plain feet and scaled the blend: 19 degrees wrong beside level ground.
"""
import math

from first_hour import *

FOOT, US_FOOT = 0.3048, 1200 / 3937
COLUMNS, ROWS, SPACING = 64, 48, 10.0


def elevation(column, row):
    """Metres: a level half, a cliff of 60 m beside it, then steep hills."""
    return 300.0 if column < 20 else 360.0 + 40 * math.sin(column * 0.9) * math.cos(row * 0.7)


def unit_of(name):
    return f'<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">{name}</Item></GDALMetadata>'


def archive(name, metres, *options, unit=None, spacing=SPACING, epsg=32632, west=500000.0, north=5000000.0):
    """An archive of the terrain, in elevation units of so many metres."""
    write_tiff(name + ".tif", COLUMNS, ROWS, lambda column, row: elevation(column, row) / metres, "d", west=west,
               north=north, spacing=spacing, epsg=epsg, metadata=unit and unit_of(unit))
    isohf("convert", name + ".tif", name + ".isohf", "--type", "f32", *options)
    return name + ".isohf"


def lines(name, places, *options):
    found = isohf("sample", name, *options, stdin="".join(f"{x!r} {z!r}\n" for x, z in places)).numbers()
    check(len(found) == len(places), f"{name}: {len(found)} answers to {len(places)} places")
    return found


def apart(a, b):
    """Degrees between two normals; the chord, since a cosine of seven digits is too coarse."""
    return math.degrees(2 * math.asin(min(1.0, math.dist(a[1:4], b[1:4]) / 2)))


def compare(found, wanted, metres, what, slack_deg=0.01):
    for here, there in zip(found, wanted):
        near(here[0] * metres, there[0], 0.001, f"{what}: elevation")
    worst = max(map(apart, found, wanted))
    check(worst <= slack_deg, f"{what}: a normal is {worst:.3g} degrees off, must be at most {slack_deg}")


# Vertices (multiples of half a step) and places between them.
places = [(20 + 6.7 * i, 15 + 7.1 * j) for i in range(85) for j in range(55)]
metres = lines(archive("m", 1.0, unit="m"), places)
steep = [math.degrees(math.acos(line[2])) for line in metres]
check(max(steep) > 60 and min(steep) < 0.1, "the terrain has no level and steep ground side by side")
for name, unit, length in (("ft", "ft", FOOT), ("usft", "US survey foot", US_FOOT), ("km", "km", 1000.0),
                           ("none", None, 1.0)):
    compare(lines(archive(name, length, unit=unit), places), metres, length, f"heights in {name}")
    shadow = ("--shadow", "--sun", "290,20")
    for here, there in zip(lines(f"{name}.isohf", places, *shadow), lines("m.isohf", places, *shadow)):
        near(here[6] * length, there[6], 0.001, f"heights in {name}: shadow's elevation")
        near(here[7], there[7], 0.001, f"heights in {name}: share of the sun")

# A plane: one in ten to the East, seen by a surveyor. 5.7106 degrees in whatever units.
for name, unit, length in (("plane_m", "m", 1.0), ("plane_ft", "ft", FOOT)):
    write_tiff(name + ".tif", 40, 40, lambda column, row: (100 + column) / length, "d", west=500000.0, north=5000000.0,
               spacing=SPACING, epsg=32632, metadata=unit_of(unit))
    isohf("convert", name + ".tif", name + ".isohf", "--type", "f32")
    for line in lines(name + ".isohf", [(100.0, 100.0), (133.3, 171.9), (205.0, 201.7)]):
        near(math.degrees(math.acos(line[2])), math.degrees(math.atan(0.1)), 0.002, f"{name}: slope")
        near(line[3], 0.0, 1e-5, f"{name}: normal's z")

# Maps in feet: the world is in metres all the same.
compare(lines(archive("map_ft", FOOT, unit="ft", epsg=2256, spacing=SPACING / FOOT, west=1e6, north=1e6), places), metres,
        FOOT, "a map in feet")
# A scale given by hand, after which the elevations are metres.
compare(lines(archive("scaled", FOOT, "--z-scale", str(FOOT)), places), metres, 1.0, "feet by --z-scale")

# Laid out in degrees, on the equator, where both are as long: the normals are those of metres as well. Shadows too.
DEGREE_M = math.radians(6378137.0)
for name, unit, length in (("deg_m", "m", 1.0), ("deg_ft", "ft", FOOT)):
    archive(name, length, "--to-crs", "none", unit=unit, epsg=4326, spacing=SPACING / DEGREE_M, west=9.0,
            north=ROWS / 2 * SPACING / DEGREE_M)
    in_degrees = [(x / DEGREE_M, z / DEGREE_M) for x, z in places]
    found = lines(f"{name}.isohf", in_degrees, "--shadow", "--sun", "290,20")
    compare(found, metres, length, f"{name}, laid out in degrees", 0.05)
    off = sum(abs(here[7] - there[7]) > 0.05 for here, there in zip(found, lines("m.isohf", places, *shadow)))
    check(off < len(places) // 100, f"{name}, laid out in degrees: {off} of {len(places)} places are lit differently")

# Pictures are the same to rounding, whatever the exaggeration. The last bit of a height decides whether a triangle that turns
# its edge to the sun is dark: those pixels differ, but in hillshades, which have no shadows.
for kind in ((), ("--kind", "hillshade",), ("--kind", "hillshade", "--exaggeration", "3"), ("--kind", "shadow-mask",)):
    pictures = []
    for name in ("m", "ft", "usft"):
        isohf("shade", f"{name}.isohf", f"{name}.png", "--overwrite", "--size", "96", *kind)
        pictures.append(read_png(f"{name}.png")[3])
    for other in pictures[1:]:
        off = sum(abs(a - b) > 2 for a, b in zip(pictures[0], other))
        most = 0 if "hillshade" in kind else len(other) // 1000
        check(off <= most, f"shade {' '.join(kind)}: {off} of {len(other)} values of heights in feet are off")
