#!/usr/bin/env python3
"""Reference systems through every reader and writer, as GDAL reads them (a test tool here: nothing links it).

usage: reference_systems.py BIN_DIR PAGE [--write]
       reference_systems.py BIN_DIR --real FOLDER...

Makes a raster of each system in SYSTEMS in each format of READERS with GDAL, converts it, restores it as GeoTIFF, and
the first of them in each format of WRITERS too; then holds system, heights and the four corners of both files, as GDAL
reads them, beside each other. PAGE has the table of all of it; --write writes it anew, else a cell that differs is an
error. Unless ISOHF_REFERENCE_SYSTEMS is "all", each system is tried in GeoTIFF, one other reader and one writer, so that
each of these has its turn. With --real it does so with every raster of FOLDER, and of the folder that ISOHF_REAL_DATA names, that has a place
for GDAL, exported as well as restored; what KNOWN names may differ. Ends with
77 where GDAL's Python package is missing (Debian: python3-gdal).
"""
import concurrent.futures
import difflib
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

try:
    from osgeo import gdal, osr
except ImportError:
    print("GDAL's Python package is missing")
    sys.exit(77)

gdal.UseExceptions()
osr.UseExceptions()
gdal.SetConfigOption("GTIFF_REPORT_COMPD_CS", "YES")
gdal.PushErrorHandler("CPLQuietErrorHandler")

# What it is, what GDAL is given, and a longitude and latitude that it shows.
SYSTEMS = [
    ("UTM 32N", "EPSG:32632", 8.5, 46.5),
    ("UTM 33S", "EPSG:32733", 14.5, -22.5),
    ("ETRS89 / UTM 32N", "EPSG:25832", 8.5, 51.5),
    ("NAD83 / UTM 17N", "EPSG:26917", -81.5, 40.0),
    ("GDA94 / MGA 55", "EPSG:28355", 147.5, -42.0),
    ("UTM 32N in km", "+proj=utm +zone=32 +datum=WGS84 +units=km", 8.5, 46.5),
    ("ED50 / UTM 31N", "EPSG:23031", 2.5, 42.0),
    ("British National Grid", "EPSG:27700", -3.0, 55.0),
    ("Irish Grid", "EPSG:29903", -8.0, 53.0),
    ("Gauss-Krüger zone 3", "EPSG:31467", 9.0, 50.0),
    ("KKJ zone 3", "EPSG:2393", 27.0, 62.0),
    ("SWEREF99 TM", "EPSG:3006", 15.0, 60.0),
    ("NZTM 2000", "EPSG:2193", 172.0, -43.0),
    ("Hong Kong 1980", "EPSG:2326", 114.1, 22.3),
    ("Poland CS92", "EPSG:2180", 19.0, 52.0),
    ("Swiss LV95", "EPSG:2056", 7.5, 46.8),
    ("Swiss LV03", "EPSG:21781", 7.5, 46.8),
    ("Hungary EOV", "EPSG:23700", 19.0, 47.0),
    ("Malaysia RSO", "EPSG:3375", 102.0, 4.0),
    ("Netherlands RD", "EPSG:28992", 5.5, 52.0),
    ("Krovak East North", "EPSG:5514", 15.0, 50.0),
    ("Lambert-93", "EPSG:2154", 3.0, 46.5),
    ("Belgian Lambert 72", "EPSG:31370", 4.5, 50.5),
    ("NTF (Paris) / Lambert zone II", "EPSG:27572", 2.5, 46.5),
    ("Estonia", "EPSG:3301", 25.0, 58.5),
    ("LAEA Europe", "EPSG:3035", 10.0, 52.0),
    ("Conus Albers", "EPSG:5070", -96.0, 38.0),
    ("Alaska Albers", "EPSG:3338", -152.0, 64.0),
    ("Conus Albers, ESRI", "ESRI:102003", -96.0, 38.0),
    ("NSIDC north polar", "EPSG:3413", -40.0, 72.0),
    ("Arctic polar", "EPSG:3995", 20.0, 80.0),
    ("Antarctic polar", "EPSG:3031", 30.0, -75.0),
    ("UPS South", "EPSG:32761", 30.0, -85.0),
    ("EASE-Grid 2.0 North", "EPSG:6931", 20.0, 70.0),
    ("EASE-Grid 2.0 Global", "EPSG:6933", 20.0, 40.0),
    ("World Mercator", "EPSG:3395", 11.0, 47.0),
    ("Web Mercator", "EPSG:3857", 11.0, 47.0),
    ("Plate Carrée", "EPSG:32662", 11.0, 47.0),
    ("Mollweide", "ESRI:54009", 30.0, 30.0),
    ("Robinson", "ESRI:54030", 30.0, 30.0),
    ("Sinusoidal, ESRI", "ESRI:54008", 30.0, 30.0),
    ("Goode homolosine", "+proj=igh +datum=WGS84", 30.0, 30.0),
    ("New York, US feet", "EPSG:2263", -74.0, 40.7),
    ("California 3, US feet", "EPSG:2227", -121.0, 37.5),
    ("Montana, feet", "EPSG:2256", -110.0, 46.5),
    ("UTM 17N, heights NAVD88", "EPSG:26917+5703", -81.5, 40.0),
    ("UTM 17N, heights in US feet", "EPSG:26917+6360", -81.5, 40.0),
    ("Montana, heights in feet", "EPSG:2256+8228", -110.0, 46.5),
    ("New York, heights in US feet", "EPSG:2263+6360", -74.0, 40.7),
    ("UTM 32N, heights EGM96", "EPSG:32632+5773", 8.5, 46.5),
    ("WGS 84", "EPSG:4326", 8.5, 46.5),
    ("WGS 84, heights EGM2008", "EPSG:4326+3855", 8.5, 46.5),
    ("WGS 84, ellipsoidal heights", "EPSG:4979", 8.5, 46.5),
    ("NAD27", "EPSG:4267", -96.0, 38.0),
    ("ETRS89", "EPSG:4258", 8.5, 51.5),
    ("NTF (Paris), grads", "EPSG:4807", 2.5, 46.5),
    ("own LAEA", "+proj=laea +lat_0=47 +lon_0=11 +x_0=100000 +y_0=50000 +ellps=GRS80", 11.2, 47.2),
    ("own LCC, two parallels", "+proj=lcc +lat_1=46 +lat_2=48 +lat_0=47 +lon_0=11 +datum=WGS84", 11.2, 47.2),
    ("own LCC, one parallel", "+proj=lcc +lat_1=47 +lat_0=47 +lon_0=11 +k_0=0.9998 +ellps=intl", 11.2, 47.2),
    ("own transverse Mercator, feet", "+proj=tmerc +lat_0=40 +lon_0=-75 +k=0.99995 +datum=NAD83 +units=us-ft", -75.2, 40.2),
    ("own stereographic", "+proj=sterea +lat_0=52 +lon_0=20 +k=0.9999 +ellps=krass", 20.1, 52.1),
    ("own azimuthal equidistant", "+proj=aeqd +lat_0=47 +lon_0=11 +datum=WGS84", 11.2, 47.2),
    ("own oblique Mercator", "+proj=omerc +lat_0=4 +lonc=102 +alpha=36.9 +gamma=36.9 +k=0.9998 +ellps=evrst30", 102.1, 4.1),
    ("own orthographic", "+proj=ortho +lat_0=47 +lon_0=11 +R=6371000", 11.2, 47.2),
    ("own equidistant conic", "+proj=eqdc +lat_1=46 +lat_2=48 +lat_0=47 +lon_0=11 +datum=WGS84", 11.2, 47.2),
    ("Mars, equirectangular", "+proj=eqc +lat_ts=0 +lon_0=0 +R=3396190", 137.4, -4.6),
    ("Mars, sinusoidal", "+proj=sinu +lon_0=137 +R=3396190", 137.4, -4.6),
    ("Mars, south polar", "+proj=stere +lat_0=-90 +lon_0=0 +a=3396190 +b=3376200", 30.0, -85.0),
    ("Mars, degrees", "IAU_2015:49900", 137.4, -4.6),
    ("Mars, IAU equirectangular", "IAU_2015:49910", 137.4, -4.6),
    ("Moon, degrees", "IAU_2015:30100", 20.0, 10.0),
    ("degrees on an own datum", 'GEOGCS["GCS_Tachikawa",DATUM["D_Tachikawa",SPHEROID["Bessel_1841",6377397.155,'
     '299.1528128]],PRIMEM["Greenwich",0],UNIT["Degree",0.0174532925199433]]', 139.4, 35.7),
    ("Titan, oblique cylinder", "+proj=ob_tran +o_proj=eqc +o_lon_p=-10 +o_lat_p=150 +lon_0=20 +R=2575000", 25.0, -55.0),
    ("Titan, perspective", "+proj=nsper +h=30000000 +lat_0=20 +lon_0=20 +R=2575000", 25.0, 22.0),
    ("Moon, Mercator", "+proj=merc +lat_ts=20 +lon_0=0 +R=1737400", 20.0, 10.0),
]

COLUMNS, ROWS = 20, 12


def create(driver, options=(), kind=gdal.GDT_Int16):
    def make(path, system, transform):
        memory = gdal.GetDriverByName("MEM").Create("", COLUMNS, ROWS, 1, kind)
        memory.SetProjection(system.ExportToWkt(["FORMAT=WKT2_2019"]))
        memory.SetGeoTransform(transform)
        band = memory.GetRasterBand(1)
        band.WriteRaster(0, 0, COLUMNS, ROWS, b"".join((100 + 7 * i % 90).to_bytes(2, "little") for i in range(240)),
                         buf_type=gdal.GDT_Int16)
        gdal.GetDriverByName(driver).CreateCopy(path, memory, options=list(options))
    return make


def virtual(path, system, transform):
    create("GTiff", ["PROFILE=BASELINE"])(path + ".tif", system, transform)
    dataset = gdal.Translate(path, path + ".tif", format="VRT")
    dataset.SetProjection(system.ExportToWkt(["FORMAT=WKT2_2019"]))
    dataset.SetGeoTransform(transform)


def of_other_bodies(driver):
    """Labels of planets name a body and its radii, no datum: of the Earth they say less than GDAL is given."""
    make = create(driver)

    def make_unless_earth(path, system, transform):
        if abs(system.GetSemiMajor() / 6378137.0 - 1.0) < 0.01:
            raise RuntimeError("is on the Earth")
        make(path, system, transform)
        pathlib.Path(path + ".aux.xml").unlink(missing_ok=True)  # what the label alone says
    return make_unless_earth


READERS = {
    "GeoTIFF 1.0": (".tif", create("GTiff", ["GEOTIFF_VERSION=1.0"])),
    "GeoTIFF 1.1": (".tif", create("GTiff", ["GEOTIFF_VERSION=1.1"])),
    "ESRI .prj": (".asc", create("AAIGrid", ["FORCE_CELLSIZE=YES"])),
    "VRT": (".vrt", virtual),
    "netCDF": (".nc", create("netCDF")),
    "EHdr": (".bil", create("EHdr")),
    "ENVI": (".dat", create("ENVI")),
    "PNG, .aux.xml": (".png", create("PNG", kind=gdal.GDT_UInt16)),
    "PDS4": (".xml", of_other_bodies("PDS4")),
    "ISIS3": (".cub", of_other_bodies("ISIS3")),
}
WRITERS = {"GeoTIFF": ".tif", "ASCII grid": ".asc", "GridFloat": ".flt", "PNG": ".png", "OpenEXR": ".exr"}


def system_of(definition):
    system = osr.SpatialReference()
    system.SetFromUserInput(definition)
    system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return system


def place_for(system, longitude, latitude):
    """Six numbers of a raster of square samples around a place."""
    flat = system.Clone()
    if flat.IsCompound():
        flat.StripVertical()
    geographic = flat.CloneGeogCS()
    geographic.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    if flat.IsGeographic():
        to_unit = math.pi / 180.0 / flat.GetAngularUnits()
        return (longitude * to_unit, 0.001, 0.0, latitude * to_unit, 0.0, -0.001)
    to_unit = math.pi / 180.0 / geographic.GetAngularUnits()
    x, y, _ = osr.CoordinateTransformation(geographic, flat).TransformPoint(longitude * to_unit, latitude * to_unit)
    step = 30.0 / flat.GetLinearUnits()
    grain = step / 4.0
    return (round(x / grain) * grain, step, 0.0, round(y / grain) * grain, 0.0, -step)


def heights_differ(first, second):
    """Whether heights are lost: their system (by code where both give one; names differ from dialect to dialect), unit."""
    if not first.IsCompound():
        return None
    if not second.IsCompound():
        return "no heights"
    codes = [system.GetAuthorityCode("COMPD_CS|VERT_CS") for system in (first, second)]
    if None not in codes and codes[0] != codes[1]:
        return f"heights EPSG:{codes[0]} -> EPSG:{codes[1]}"
    units = [system.GetTargetLinearUnits("VERT_CS") for system in (first, second)]
    return None if abs(units[0] - units[1]) < 1e-7 else f"unit of heights {units[0]} -> {units[1]}"


def datum_of(system):
    """Its name as every dialect has it: "D_My_datum", "My datum"; empty where it has none."""
    name = re.sub(r"[^a-z0-9]+", "", re.sub(r"^D_", "", system.GetAttrValue("DATUM") or "").lower())
    return "" if name in ("unknown", "unnamed") else name


def north_up(raster):
    """Its six numbers, from the North on, whichever way its rows run."""
    t = list(raster.GetGeoTransform())
    if t[5] > 0.0:
        t[3], t[5] = t[3] + raster.RasterYSize * t[5], -t[5]
    return t


def corners_differ(a, b, to_first):
    """Whether a size or a corner is another, by more than a hundredth of a sample."""
    height, width = a.RasterYSize, a.RasterXSize
    t, u = north_up(a), north_up(b)
    if (b.RasterXSize, b.RasterYSize) != (width, height):
        return ["size"]
    for column, row in ((0, 0), (width, 0), (0, height), (width, height)):
        x, y = t[0] + column * t[1], t[3] + row * t[5]
        v, w = u[0] + column * u[1], u[3] + row * u[5]
        if to_first:
            v, w, _ = to_first.TransformPoint(v, w)
        if not (abs(v - x) <= 0.01 * t[1] and abs(w - y) <= 0.01 * abs(t[5])):
            return [f"corner {column},{row}: {x:.10g} {y:.10g} -> {v:.10g} {w:.10g}"]
    return []


def differences(theirs, ours):
    """What the second file has lost of the first; empty: nothing."""
    a, b = gdal.Open(theirs), gdal.Open(ours)
    found = []
    first, second = a.GetSpatialRef(), b.GetSpatialRef()
    if (first is None) != (second is None):
        return ["no system" if first else "a system that GDAL finds nowhere"]
    if first is None:
        return corners_differ(a, b, None)
    flat = [first.Clone(), second.Clone()]
    for system in flat:
        if system.IsCompound():
            system.StripVertical()
        if system.IsGeographic() and system.GetAxesCount() == 3:
            system.DemoteTo2D("")
        system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    if flat[0].IsProjected() != flat[1].IsProjected() or flat[0].IsGeographic() != flat[1].IsGeographic():
        return ["another kind of system"]
    same = flat[0].IsSame(flat[1], ["CRITERION=EQUIVALENT", "IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES"])
    if not same:
        for name, of in (("semi-major axis", osr.SpatialReference.GetSemiMajor),
                         ("flattening", osr.SpatialReference.GetInvFlattening),
                         ("linear unit", osr.SpatialReference.GetLinearUnits),
                         ("angular unit", osr.SpatialReference.GetAngularUnits)):
            if abs(of(flat[0]) - of(flat[1])) > 1e-9 * abs(of(flat[0])):
                found.append(f"{name} {of(flat[0])} -> {of(flat[1])}")
    has_code = flat[0].GetAuthorityCode("GEOGCS") or flat[0].GetAuthorityCode("DATUM")
    if not has_code and datum_of(flat[0]) and datum_of(flat[1]) != datum_of(flat[0]):
        found.append(f"datum {flat[0].GetAttrValue('DATUM')} -> {flat[1].GetAttrValue('DATUM')}")
    found += corners_differ(a, b, None if same or found else osr.CoordinateTransformation(flat[1], flat[0]))
    if heights := heights_differ(first, second):
        found.append(heights)
    return found


def run(program, *arguments):
    done = subprocess.run([program, *arguments], capture_output=True, text=True)
    return done.returncode, (done.stderr.strip() or done.stdout.strip())


def cell_read(isohf, source, archive, restored, kept_source):
    """What becomes of a raster on its way through an archive: a word and a reason."""
    code, said = run(isohf, "convert", source, archive, "--quiet", "--to-crs", "none")
    if code != 0:
        return "refused", said
    code, warned = run(isohf, "export", archive, restored, "--quiet")
    if code != 0:
        return "refused", warned
    try:
        lost = differences(source, restored)
    except RuntimeError as error:  # GDAL reads a map that it cannot use
        lost = [str(error)]
    # Where GDAL reads less than it was given: its ENVI has other feet than its text.
    lost = differences(kept_source, restored) if lost and kept_source else lost
    if lost and "reference system is left out" in said:
        return "told", said.replace("warning: ", "")
    return ("lost", "; ".join(lost)) if lost else ("kept", said or warned)


def cells_of(isohf, folder, index, system, chosen):
    """The row of the table: a word and a reason for each reader and writer that is chosen."""
    name, definition, longitude, latitude = system
    row = {}
    kept_archive = kept_source = None
    reference = system_of(definition)
    transform = place_for(reference, longitude, latitude)
    for number, (reader, (ending, make)) in enumerate(READERS.items()):
        if reader not in chosen:
            continue
        source = str(folder / f"{index}_{number}{ending}")
        archive = str(folder / f"{index}_{number}.isohf")
        try:
            make(source, reference, transform)
            written = gdal.Open(source).GetSpatialRef()
            if written is None or not (written.IsProjected() or written.IsGeographic()):
                raise RuntimeError("has no system")
        except RuntimeError:
            row[reader] = ("-", "")  # GDAL does not write it
            continue
        row[reader] = cell_read(isohf, source, archive, str(folder / f"{index}_{number}_restored.tif"), kept_source)
        if kept_archive is None and row[reader][0] == "kept":
            kept_archive, kept_source = archive, source
    for number, (writer, ending) in enumerate(WRITERS.items()):
        if writer not in chosen:
            continue
        written = str(folder / f"{index}_w{number}{ending}")
        if kept_archive is None:
            row[writer] = ("-", "")
            continue
        code, said = run(isohf, "export", kept_archive, written, "--quiet", "--method", "hex")
        if code != 0:
            row[writer] = ("refused", said)
            continue
        if ending == ".exr":  # which GDAL does not read; what stands beside it, it does
            stand_in = str(folder / f"{index}_w{number}_beside.png")
            gdal.GetDriverByName("PNG").CreateCopy(stand_in, gdal.GetDriverByName("MEM").Create("", COLUMNS, ROWS))
            if os.path.exists(written + ".aux.xml"):
                shutil.copy(written + ".aux.xml", stand_in + ".aux.xml")
            written = stand_in
        lost = differences(kept_source, written)
        row[writer] = ("lost", "; ".join(lost)) if lost else ("kept", said)
    return name, definition, row


def has_place(raster):
    return raster.GetSpatialRef() is not None or raster.GetGeoTransform(can_return_null=True) is not None


def placed_from_nowhere(isohf, folder, name):
    """Of a raster that has no place for GDAL, or that it does not read: the place that it has in a GeoTIFF all the same;
    None where isohf does not read it either."""
    options = []
    if name.suffix == ".r16" and not os.path.exists(f"{name}.json"):
        side = math.isqrt(name.stat().st_size // 2)
        options = ["--raw", f"{side}x{side}:u16le"]
    archive, written = str(folder / (name.name + ".isohf")), str(folder / f"{name.name}.tif")
    code, said = run(isohf, "convert", str(name), archive, "--quiet", "--to-crs", "none", "--overwrite", *options)
    if code != 0:
        return None if len(said.splitlines()) == 1 else [said]
    code, said = run(isohf, "export", archive, written, "--quiet", "--overwrite")
    return [said] if code != 0 else ["a place that its file does not have"] if has_place(gdal.Open(written)) else []


def lost_by_real_files(isohf, folder, names):
    """Of rasters as they are: what is lost on the way into an archive and out again, by file."""
    found, without, refused = {}, {}, []
    for name in names:
        try:
            source = gdal.Open(str(name))
        except RuntimeError:
            source = None
        if source is None or not has_place(source):
            said = placed_from_nowhere(isohf, folder, name)
            refused.append(name.name) if said is None else without.update({name.name: said})
            continue
        archive = str(folder / (name.name + ".isohf"))
        code, said = run(isohf, "convert", str(name), archive, "--quiet", "--to-crs", "none", "--overwrite")
        found[name.name] = [said] if code != 0 else []
        for options in ([], ["--method", "hex"]) if code == 0 else ():
            written = str(folder / f"{name.name}_out.tif")
            code, said = run(isohf, "export", archive, written, "--quiet", "--overwrite", *options)
            found[name.name] += [f"export {options}: {what}" for what in ([said] if code != 0 else differences(str(name), written))]
    return found, without, refused


# Where the two differ on purpose.
KNOWN = {
    "besseggen_utm.dem": "is a USGS DEM, which isohf does not read",
    "ldem_4_cropped.img": "GDAL reads the label as samples; isohf refuses a single row",
    "megt90n000cb.img": "the label beside it, which GDAL wants to be given, places it",
    "megt90n000cb.lbl": "GDAL has metres of the map, isohf degrees of the label",
}
BEGIN, END = "<!-- reference_systems.py writes what follows -->", "<!-- end -->"


def table_of(rows):
    """Marks of all cells, of readers and of writers, and the reasons of those that are not kept."""
    lines, reasons = [], {}
    for title, columns in (("read", READERS), ("written", WRITERS)):
        given = " given as |" if columns is WRITERS else ""
        lines += [f"| {title} |{given} " + " | ".join(columns) + " |", "|---|" + "---|" * (len(columns) + len(given[:1]))]
        for name, definition, row in rows:
            for word, reason in (row[column] for column in columns):
                if word not in ("kept", "-"):
                    reasons.setdefault(re.sub(r"isohf: (/\S+: )?|/\S+/|\d+_\d+\S* ?", "", reason), []).append(name)
            given = f" `{definition}` |" if columns is WRITERS else ""
            lines.append(f"| {name} |{given} " + " | ".join("" if row[column][0] == "-" else row[column][0] for column in columns) + " |")
        lines.append("")
    lines += [f"{', '.join(dict.fromkeys(names))}: {reason}." for reason, names in reasons.items() if reason]
    return "\n".join(lines)


def check_real(isohf, folders):
    names = sorted(name for folder in folders for name in pathlib.Path(folder).rglob("*") if name.is_file())
    skipped = (".md", ".hdr", ".prj", ".xml", ".isohf", ".json")
    names = [name for name in names if not name.name.endswith(skipped)]
    with tempfile.TemporaryDirectory() as folder:
        found, without, refused = lost_by_real_files(isohf, pathlib.Path(folder), names)
    failed = {name: lost for name, lost in {**found, **without}.items() if lost and name not in KNOWN}
    for name, lost in failed.items():
        print(f"{name}: {lost}")
    print(f"{len(found)} rasters compared; {len(without)} have no place, and none in the GeoTIFF; {len(refused)} are "
          f"refused: {', '.join(refused) or '-'}")
    return 1 if failed or (found and len(found) < 3) else 0


def cells_in(text):
    """The words of the page's two tables, by system and by reader or writer."""
    cells, columns = {}, []
    for line in text.splitlines():
        parts = [part.strip() for part in line.strip("|").split("|")]
        if line.startswith(("| read |", "| written |")):
            columns = parts[1:]
        elif line.startswith("| ") and columns:
            cells.setdefault(parts[0], {}).update(zip(columns, parts[1:]))
    return cells


def sample_of(cells):
    """For each system GeoTIFF, another reader and a writer, of those that it has cells of; what is in none."""
    others, writers = list(READERS)[1:], list(WRITERS)
    sample, often = [], dict.fromkeys(others, 0)
    for index, (name, *_) in enumerate(SYSTEMS):
        there = [reader for reader in others if cells[name].get(reader)]
        chosen = {"GeoTIFF 1.0", writers[index % len(writers)]}
        if there:
            least = min(there, key=often.get)  # the one that had its turn least often
            often[least] += 1
            chosen.add(least)
        sample.append(chosen)
    missing = {*READERS, *WRITERS}.difference(*sample)
    return sample, [f"{column} is not in the sample" for column in sorted(missing)]


def differ_in_sample(isohf, folder, pool, text):
    """Cells of a part of the table that are not as the page has them."""
    cells = cells_in(text)
    if list(cells) != [name for name, *_ in SYSTEMS]:
        return ["the page has rows of other systems: --write writes them"]
    sample, wrong = sample_of(cells)
    for name, definition, row in pool.map(lambda item: cells_of(isohf, folder, *item),
                                          ((index, system, sample[index]) for index, system in enumerate(SYSTEMS))):
        for column, (word, reason) in row.items():
            if ("" if word == "-" else word) != cells[name].get(column) or word == "lost":
                wrong.append(f"{name} ({definition}): {column}: {cells[name].get(column)}, now {word}: {reason}")
    return wrong


def main():
    isohf = str(pathlib.Path(sys.argv[1]) / "isohf")
    if sys.argv[2] == "--real":
        return check_real(isohf, sys.argv[3:] + [name for name in [os.environ.get("ISOHF_REAL_DATA")] if name])
    page = pathlib.Path(sys.argv[2])
    text = page.read_text(encoding="utf-8")
    is_whole = "--write" in sys.argv or os.environ.get("ISOHF_REFERENCE_SYSTEMS") == "all"
    before, tables = text[:text.index(BEGIN) + len(BEGIN)], text[text.index(BEGIN):text.index(END)]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            if not is_whole:
                wrong = differ_in_sample(isohf, folder, pool, tables)
                print("\n".join(wrong or ["each system in GeoTIFF, one other reader and one writer: as the page says"]))
                return 1 if wrong else 0
            everything = {*READERS, *WRITERS}
            rows = list(pool.map(lambda item: cells_of(isohf, folder, *item, everything), enumerate(SYSTEMS)))
    for name, definition, row in rows:
        for what, (word, reason) in row.items():
            if word == "lost" or (word == "kept" and reason):
                print(f"{name} ({definition}): {what}: {word}: {reason}")
    wanted = f"{before}\n{table_of(rows)}\n{text[text.index(END):]}"
    if "--write" in sys.argv:
        page.write_text(wanted, encoding="utf-8")
    elif wanted != text:
        sys.stdout.writelines(difflib.unified_diff(text.splitlines(True), wanted.splitlines(True), str(page), "found"))
        return 1
    return 1 if any(cell[0] == "lost" for _, _, row in rows for cell in row.values()) else 0


sys.exit(main())
