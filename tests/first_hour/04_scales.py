"""--z-scale and --z-offset act on top of what a file states: elevation = (raw x scale + offset) x z_scale + z_offset."""
import re

from first_hour import *

WIDTH, HEIGHT = 48, 40


def raw(column, row):
    """A plane, of which every resampling keeps the elevations."""
    return 200 + 3 * column - 2 * row


def gdal_scale(scale, offset, unit=None):
    items = f'<Item name="SCALE" sample="0" role="scale">{scale}</Item>'
    items += f'<Item name="OFFSET" sample="0" role="offset">{offset}</Item>'
    if unit:
        items += f'<Item name="UNITTYPE" sample="0" role="unittype">{unit}</Item>'
    return f"<GDALMetadata>{items}</GDALMetadata>"


def tiff(name, **more):
    return write_tiff(name, WIDTH, HEIGHT, raw, west=600000.0, north=5000000.0, spacing=30.0, epsg=32632, **more)


def write_pds3(name, scale, offset):
    """A label of the Moon with its samples behind it."""
    label = f"""PDS_VERSION_ID = PDS3
RECORD_TYPE = FIXED_LENGTH
RECORD_BYTES = {2 * WIDTH}
^IMAGE = 20
TARGET_NAME = MOON
OBJECT = IMAGE
 LINES = {HEIGHT}
 LINE_SAMPLES = {WIDTH}
 SAMPLE_TYPE = LSB_INTEGER
 SAMPLE_BITS = 16
 UNIT = METER
 SCALING_FACTOR = {scale}
 OFFSET = {offset}
END_OBJECT = IMAGE
END
""".replace("\n", "\r\n").encode()
    samples = struct.pack(f"<{WIDTH * HEIGHT}h", *(raw(x, y) for y in range(HEIGHT) for x in range(WIDTH)))
    (FOLDER / name).write_bytes(label.ljust(19 * 2 * WIDTH) + samples)
    return FOLDER / name


def write_vrt(name, of, scale, offset):
    (FOLDER / name).write_text(f"""<VRTDataset rasterXSize="{WIDTH}" rasterYSize="{HEIGHT}">
<GeoTransform>600000, 30, 0, 5000000, 0, -30</GeoTransform>
<VRTRasterBand dataType="Int16" band="1"><Scale>{scale}</Scale><Offset>{offset}</Offset>
<SimpleSource><SourceFilename relativeToVRT="1">{of}</SourceFilename><SourceBand>1</SourceBand></SimpleSource>
</VRTRasterBand></VRTDataset>
""")
    return FOLDER / name


def write_described(name, of, scale, offset):
    """The raw samples that `of` exports, described by a .json beside them."""
    isohf("convert", of, "r.isohf", "--overwrite", "-q", "--lossless", "--to-crs", "none")
    isohf("export", "r.isohf", name, "-q", "--type", "u16")
    description = FOLDER / (name + ".json")
    text = json.loads(description.read_text())
    text.update(z_scale=scale, z_offset=offset)
    description.write_text(json.dumps(text))
    return FOLDER / name


# Files, and the scale and offset that each of them states.
FILES = [
    (tiff("plain.tif"), 1.0, 0.0),
    (tiff("scaled.tif", metadata=gdal_scale(0.1, 1000)), 0.1, 1000.0),
    (tiff("offset.tif", metadata=gdal_scale(1, -50)), 1.0, -50.0),
    (write_netcdf("scaled.nc", WIDTH, HEIGHT, raw, 8.0, 46.0, 0.01,
                  attributes=[("scale_factor", 0.5), ("add_offset", 10.0), ("units", "m")]), 0.5, 10.0),
    (write_netcdf("depths.nc", WIDTH, HEIGHT, raw, 8.0, 46.0, 0.01,
                  attributes=[("positive", "down"), ("add_offset", 10.0), ("units", "m")]), -1.0, -10.0),
    (write_pds3("moon.img", 0.5, 1737400.0), 0.5, 1737400.0),
    (write_vrt("scaled.vrt", "plain.tif", 2.0, 7.0), 2.0, 7.0),
    (write_described("described.r16", "plain.tif", 0.25, -3.0), 0.25, -3.0),
]
OPTIONS = [(None, None), (0.3048, None), (None, -1000.0), (0.5, -20.0), (-1.0, 5.0)]


def words(scale, offset):
    return ([f"--z-scale={scale}"] if scale is not None else []) + ([f"--z-offset={offset}"] if offset is not None else [])


def check_elevations(archive, scale, offset, what):
    """Of samples by their places in the world, and of what is recorded."""
    metadata = isohf("info", archive, "--json").json()["metadata"]
    source = metadata["source"]
    near(source["z_scale"], scale, 1e-12 * abs(scale), f"{what}: the recorded scale")
    near(source["z_offset"], offset, 1e-9 * max(1.0, abs(offset)), f"{what}: the recorded offset")
    places = [(5, 7), (20, 30), (40, 11)]
    first, spacing = source["first_sample"], source["spacing"]
    world = [(first["x"] + x * spacing["x"], first["z"] + y * spacing["z"]) for x, y in places]
    for (x, y), found in zip(places, sample(archive, world)):
        near(found, raw(x, y) * scale + offset, 0.51 * abs(scale), f"{what}: the elevation of sample {x}, {y}")


for path, own_scale, own_offset in FILES:
    for z_scale, z_offset in OPTIONS:
        options = words(z_scale, z_offset)
        what = f"{path.name} {' '.join(options)}"
        scale = own_scale * (1.0 if z_scale is None else z_scale)
        offset = own_offset * (1.0 if z_scale is None else z_scale) + (z_offset or 0.0)
        isohf("convert", path, "a.isohf", "--overwrite", "-q", "--lossless", "--to-crs", "none", *options)
        check_elevations("a.isohf", scale, offset, what)
        # Read again as it was read, the source is the same; its own numbers come back.
        isohf("verify", "a.isohf", "--against", path, "-q")
        isohf("export", "a.isohf", "raw.npy", "--overwrite", "-q")
        columns, rows, samples = read_npy("raw.npy")
        check((columns, rows) == (WIDTH, HEIGHT) and samples == [raw(x, y) for y in range(rows) for x in range(columns)],
              f"{what}: export gives other samples than the file's")
        # So they are in a raster that states scale and offset as the archive has them.
        if path.suffix == ".tif":
            isohf("export", "a.isohf", "back.tif", "--overwrite", "-q")
            isohf("verify", "a.isohf", "--against", "back.tif", "-q")
        source = isohf("info", "a.isohf", "--json").json()["metadata"]["source"]
        for option in options:
            name, value = option[2:].split("=")
            check(float(source["options"][name]) == float(value), f"{what}: the archive does not record {option}")
        near(source["z_scale"], scale, 1e-12 * abs(scale), f"{what}: scale")
        near(source["z_offset"], offset, 1e-9 * (1.0 + abs(offset)), f"{what}: offset")

# A mosaic: of each file its own first.
left = tiff("left.tif", metadata=gdal_scale(0.1, 1000))
right = write_tiff("right.tif", WIDTH, HEIGHT, lambda x, y: raw(x + WIDTH, y), west=600000.0 + 30 * WIDTH, north=5000000.0,
                   spacing=30.0, epsg=32632)
isohf("convert", left, right, "m.isohf", "-q", "--z-scale", "2", "--z-offset", "1")
for (x, y), expected in zip([(10, 10), (WIDTH + 10, 10)],
                            [(raw(10, 10) * 0.1 + 1000) * 2 + 1, raw(WIDTH + 10, 10) * 2 + 1]):
    near(sample("m.isohf", [(30 * x + 15, 30 * y + 15)])[0], expected, 1.0, f"the mosaic at {x}, {y}")

# Feet: the advice, run. Elevations of 200 feet are 60.96 m.
feet = write_tiff("feet.tif", WIDTH, HEIGHT, raw, west=1000000.0, north=200000.0, spacing=100.0, epsg=2263,
                  metadata=gdal_scale(0.1, 1000))
advice = isohf("plan", feet).err
scale = re.search(r"--z-scale ([0-9.]+)", advice)
system = re.search(r"--crs (\S+)", advice)
check(scale and system, f"no advice for feet:\n{advice}")
isohf("convert", feet, "f.isohf", "-q", "--z-scale", scale[1])
in_metres = (raw(24, 20) * 0.1 + 1000) * 1200 / 3937
near(sample("f.isohf", [(24.5 * 100 * 1200 / 3937, 20.5 * 100 * 1200 / 3937)])[0], in_metres, 0.05, "feet in metres")
isohf("convert", feet, "f.isohf", "-q", "--overwrite", "--crs", system[1])
check(isohf("info", "f.isohf", "--json").json()["metadata"]["units"]["vertical"] == "US survey foot", "no feet by --crs")

# A file that states feet: --z-scale of the foot makes metres, whatever scale the file has.
stated = tiff("stated.tif", metadata=gdal_scale(0.1, 1000, "ft"))
isohf("convert", stated, "s.isohf", "--z-scale", "0.3048")
check_elevations("s.isohf", 0.03048, 304.8, "stated.tif in metres")
check(isohf("info", "s.isohf", "--json").json()["metadata"]["units"]["vertical"] == "metre", "no metres of stated feet")
advice = refuses("plan", stated, "--crs", "EPSG:32632+5773", words=["--z-scale"], code=2).err
scale = re.search(r"--z-scale ([0-9.]+)", advice)[1]
isohf("convert", stated, "s.isohf", "--overwrite", "--crs", "EPSG:32632+5773", "--z-scale", scale)
check_elevations("s.isohf", 0.03048, 304.8, "stated.tif above EGM96")

# Radii of the Moon, as heights above its sphere.
cube = real("ldem_4_reduced.cub")
if cube:
    isohf("convert", cube, "l.isohf", "-q", "--z-offset", "-1737400")
    statistics = isohf("info", "l.isohf", "--json").json()["metadata"]["statistics"]
    near(statistics["min"], -7800, 300, "the lowest place of the Moon")
    near(statistics["max"], 9139, 300, "the highest place of the Moon")
