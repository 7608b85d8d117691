"""Longitude and latitude that are swapped, and places and boxes in another system than they are read in, are
recognised, with the numbers to type."""
import re

from first_hour import *


def hill(column, row):
    return 300 + column + 2 * row


def numbers_after(option, text):
    found = re.search(option + r"[ =](\S+ \S+|\S+)", text)
    check(found, f"no {option} in:\n{text}")
    return found[1].replace(",", " ").split()


def write_utm(name, epsg=32632, west=400000.0, north=5000000.0):
    return write_tiff(name, 80, 60, hill, west=west, north=north, spacing=100.0, epsg=epsg)


utm = write_utm("utm.tif")
south = write_utm("south.tif", 32719, 300000.0, 7500000.0)
degrees = write_tiff("degrees.tif", 80, 60, hill, west=-118.3, north=34.5, spacing=0.005, epsg=4326)
for path in (utm, south, degrees):
    isohf("convert", path, path.with_suffix(".isohf").name, "-q")


def at(x, y, system):
    return ["--at", f"{x},{y}", "--in", system]


def hinted(archive, options, words, code=0, stdin=""):
    """The places lie outside and one warning says what they may be; the place that it names lies inside."""
    result = isohf("sample", archive, *options, stdin=stdin, code=code)
    lines = result.err.splitlines()
    check(len(lines) == 1 and "warning" in lines[0], f"$ {result.command}\n{result.err}must be one warning")
    for word in words:
        check(word in lines[0], f"$ {result.command}\n{lines[0]}\nlacks '{word}'")
    place = re.search(r": --at (\S+) --in (\S+)$", lines[0])
    check(place, f"$ {result.command}\n{lines[0]}\nnames no place")
    again = isohf("sample", archive, "--at", place[1], "--in", place[2])
    check("outside" not in again.out and not again.err, f"$ {again.command}\n{again.out}{again.err}")
    return result


# Middles of the rasters: 7.76 E 45.12 N; 70.91 W 22.62 S; 118.1 W 34.35 N.
for archive, longitude, latitude in (("utm.isohf", 7.76, 45.12), ("south.isohf", -70.91, -22.62), ("degrees.isohf", -118.1, 34.35)):
    right = isohf("sample", archive, *at(longitude, latitude, "lonlat"))
    check("outside" not in right.out and not right.err, f"{right.command}: {right.out}{right.err}")
    result = hinted(archive, at(latitude, longitude, "lonlat"), ["latitude, longitude", f"--at {longitude:g},{latitude:g} --in lonlat"])
    check(result.out == "outside\n", f"{result.command} prints {result.out}")
    hinted(archive, ["--in", "lonlat"], ["latitude, longitude"], stdin=f"{longitude} {latitude}\n{latitude} {longitude}\n0 0\n")
    # Degrees where coordinates of the input, or of the world, are read.
    if archive != "degrees.isohf":
        hinted(archive, at(longitude, latitude, "crs"), ["longitude, latitude", "--in lonlat"])
        hinted(archive, at(latitude, longitude, "crs"), ["latitude, longitude", "--in lonlat"])
hinted("utm.isohf", at(4997000, 404000, "crs"), ["northing, easting", "--at 404000,4997000 --in crs"])
hinted("utm.isohf", at(404000, 4997000, "world"), ["easting, northing", "--at 404000,4997000 --in crs"])
hinted("utm.isohf", at(404000, 4997000, "lonlat"), ["easting, northing", "--at 404000,4997000 --in crs"])
# What lies outside however it is read is an answer, and no news.
for place in ((100, 45), (0, 0), (8, 50)):
    result = isohf("sample", "utm.isohf", *at(*place, "lonlat"))
    check(result.out == "outside\n" and not result.err, f"{result.command}: {result.err}")
strict = isohf("sample", "utm.isohf", *at(45.12, 7.76, "lonlat"), "--strict", code=1)
check("latitude, longitude" in strict.err, f"{strict.command}: {strict.err}")


def corrected(command, words):
    """The box is refused with what the input covers, and with the box to type, which is taken."""
    result = refuses(*command, code=2, words=words)
    box = re.search(r"--bbox (\S+)$", result.err.strip())
    check(box, f"$ {result.command}\n{result.err}names no box")
    index = next(i for i, word in enumerate(command) if str(word).startswith("--bbox"))
    again = [*command[:index], f"--bbox={box[1]}", *command[index + 1:], "-q"]
    isohf(*again)
    return [float(number) for number in box[1].split(",")]


LONLAT, SWAPPED = "7.74,45.11,7.78,45.13", "45.11,7.74,45.13,7.78"
for make in (lambda box: ("export", "utm.isohf", "part.tif", f"--bbox={box}", "--overwrite"),
             lambda box: ("extract", "utm.isohf", "-o", "part.isohf", f"--bbox={box}", "--overwrite"),
             lambda box: ("convert", utm, "part.isohf", f"--bbox={box}", "--overwrite")):
    for box, order in ((LONLAT, "longitude, latitude"), (SWAPPED, "latitude, longitude")):
        west, bottom, east, top = corrected(make(box), [order, "EPSG:32632", "400000", "4994000", "408000", "5000000"])
        for found, expected in zip((west, bottom, east, top), (400900, 4995800, 404100, 4998200)):
            near(found, expected, 400, f"{order}: a side of the box")
    west, bottom, east, top = corrected(make("4996000,401000,4999000,405000"), ["northing, easting", "EPSG:32632"])
    check((west, bottom, east, top) == (401000, 4996000, 405000, 4999000), "the box is not the swapped one")
    refuses(*make("100,10,101,11"), code=2, words=["EPSG:32632", "400000"])
for make in (lambda box: ("export", "degrees.isohf", "part.tif", f"--bbox={box}", "--overwrite"),
             lambda box: ("extract", "degrees.isohf", "-o", "part.isohf", f"--bbox={box}", "--overwrite"),
             lambda box: ("convert", degrees, "part.isohf", f"--bbox={box}", "--overwrite")):
    found = corrected(make("34.3,-118.2,34.4,-118"), ["latitude, longitude", "EPSG:4326", "-118.3", "34.5"])
    check(found == [-118.2, 34.3, -118, 34.4], f"the box is not the swapped one: {found}")
    found = corrected(make("390000,3795000,405000,3805000"), ["easting, northing in UTM zone 11N", "EPSG:4326"])
    near(found[0], -118.195, 0.01, "the West of a box in UTM")
    near(found[3], 34.38, 0.01, "the North of a box in UTM")

tuj = real("srtm_bigtujunga30m_utm11.tif")
if tuj:
    isohf("convert", tuj, "tuj.isohf", "-q")
    hinted("tuj.isohf", at(34.32, -118.15, "lonlat"), ["latitude, longitude", "--at -118.15,34.32 --in lonlat"])
    corrected(("export", "tuj.isohf", "tuj.tif", "--bbox=-118.1,34.3,-118,34.4", "--overwrite"), ["longitude, latitude", "EPSG:32611"])
