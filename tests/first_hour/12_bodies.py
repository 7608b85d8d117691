"""A projection that is named without a body takes the input's; one that states another body is refused."""
import math

from first_hour import FOLDER, check, isohf, near, real, refuses, sample, write_tiff

COLUMNS, ROWS, STEP = 72, 36, 5.0
MARS, MOON = 3396190.0, 1737400.0


def ground(longitude, latitude):
    return 300.0 * math.sin(math.radians(2 * longitude)) * math.cos(math.radians(latitude)) + 10.0 * latitude


def degrees_of(body, radius):
    return (f'GEOGCS["GCS_{body}",DATUM["D_{body}",SPHEROID["{body}",{radius},0]],PRIMEM["Reference_Meridian",0],'
            'UNIT["Degree",0.0174532925199433]]')


def globe(name, body, radius):
    write_tiff(name + ".tif", COLUMNS, ROWS, lambda c, r: ground(-177.5 + c * STEP, 87.5 - r * STEP), kind="f",
               west=-180.0, north=90.0, spacing=STEP)
    (FOLDER / (name + ".prj")).write_text(degrees_of(body, radius))


WGS84 = 'GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],' \
        'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]'
(FOLDER / "mollweide.prj").write_text(f'PROJCS["World_Mollweide",{WGS84},PROJECTION["Mollweide"],'
                                      'PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],'
                                      'PARAMETER["Central_Meridian",0.0],UNIT["Meter",1.0]]')
for name, body, radius in (("mars", "Mars", MARS), ("moon", "Moon", MOON)):
    globe(name, body, radius)
    for code in ("ESRI:54009", "+proj=moll", "mollweide.prj"):
        made = isohf("convert", name + ".tif", name + ".isohf", "--overwrite", "--to-crs", code)
        line = next(line for line in made.out.splitlines() if line.startswith("map"))
        check(body in line and "in place of the Earth" in line, f"{code} on {body}: {line}")
        check(made.err == "", made.err)
        metadata = isohf("info", name + ".isohf", "--json").json()["metadata"]
        check(body in metadata["projection"]["why"], f"{code} on {body}: {metadata['projection']}")
        check(metadata["projection"]["semi_major_axis_m"] == radius, f"{metadata['projection']}")
        width = metadata["valid"]["x1"] - metadata["valid"]["x0"]
        near(width, 4.0 * math.sqrt(2.0) * radius, 0.01 * radius, f"{code}: Mollweide's width on {body}")
        places = [(lon, lat) for lon in (-120.0, -10.0, 95.0) for lat in (-40.0, 0.0, 55.0)]
        for place, found in zip(places, sample(name + ".isohf", places, "--in", "lonlat")):
            near(found, ground(*place), 15.0, f"{code} on {body} at {place}")
    isohf("verify", name + ".isohf", "--against", name + ".tif", "-q")
    planned = isohf("plan", name + ".tif", "--to-crs", "ESRI:54009")
    check("in place of the Earth" in planned.out, f"plan does not say that the body was replaced: {planned.out}")
    # A local map of one place, in other units and from metres: parameters stay what they are.
    isohf("convert", name + ".tif", "zone.isohf", "--overwrite", "-q", "--to-crs", "EPSG:3035", "--bbox", "0,30,20,50")
    isohf("convert", name + ".tif", "flat.isohf", "--overwrite", "-q", "--to-crs", "EPSG:2225", "--bbox", "-130,30,-110,50")

    # And out again: from an archive in degrees, the raster is on the body.
    isohf("convert", name + ".tif", "own.isohf", "--overwrite", "-q")
    out = isohf("export", "own.isohf", "out.tif", "--overwrite", "--to-crs", "ESRI:54009", "--size", "200x100")
    check(body in out.out + out.err, f"export does not say on which body: {out.out}{out.err}")
    back = isohf("info", "out.tif", "--json").json()
    check(body in str(back) and str(int(radius)) in str(back), f"export to ESRI:54009 of {body}: {back}")
    bounds = back["bounds"]
    near(bounds["east"] - bounds["west"], 4.0 * math.sqrt(2.0) * radius, 0.05 * radius, f"the exported width on {body}")
    refuses("export", "own.isohf", "none.tif", "--to-crs", "EPSG:4326", words=["is of Earth", body], code=2)

# What states a body is taken at its word.
isohf("convert", "mars.tif", "stated.isohf", "-q", "--to-crs", "+proj=moll +R=3396000 +units=m")
isohf("convert", "moon.tif", "iau.isohf", "-q", "--to-crs", "IAU_2015:30110")
for stated, whose in (("IAU_2015:30110", "Moon"), ("+proj=moll +R=6371000", "Earth"), ("+proj=moll +ellps=WGS84", "Earth"),
                      (f"+proj=moll +R={MOON}", "Moon"), ("EPSG:4326", "Earth"), ("EPSG:32632", "Earth")):
    refuses("convert", "mars.tif", "none.isohf", "--to-crs", stated, words=["--to-crs", whose, "Mars"], code=2)
    refuses("export", "stated.isohf", "none.tif", "--to-crs", stated, words=[whose, "Mars"], code=2)
write_tiff("earth.tif", COLUMNS, ROWS, lambda c, r: ground(-177.5 + c * STEP, 87.5 - r * STEP), kind="f", west=-180.0,
           north=90.0, spacing=STEP, epsg=4326)
refuses("convert", "earth.tif", "none.isohf", "--to-crs", "IAU_2015:49910", words=["Mars", "Earth"], code=2)
earth = isohf("convert", "earth.tif", "earth.isohf", "--to-crs", "ESRI:54009")
check("in place of" not in earth.out, earth.out)

# The recipe's own command.
mola = real("megt90n000cb.lbl")
if mola:
    made = isohf("convert", mola, "mola.isohf", "--to-crs", "ESRI:54009")
    check("World_Mollweide on Mars" in made.out, made.out)
    near(sample("mola.isohf", [(226.2, 18.65)], "--in", "lonlat")[0], 21000.0, 1500.0, "Olympus Mons on Mollweide")
lola = real("ldem_4_reduced.cub")
if lola:
    isohf("convert", lola, "lola.isohf", "--to-crs", "ESRI:54009", "-q")
