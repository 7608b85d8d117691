"""`shade --kind hillshade` is Horn's formula on the surface's elevations in the middle of the pixels, and nothing else.

Its slopes were 0.33 degrees too gentle in the mean: of means over points that lay between rows, not on triangles. Here the
formula is applied to what `export --method barycentric` writes, as `gdaldem hillshade -compute_edges` does.
"""
from first_hour import *

FOOT = 0.3048


def horn(columns, rows, heights, pixel, azimuth=315.0, altitude=45.0):
    """Bytes of a hillshade. Beyond the edges the slope continues; a nodata neighbour is level with the pixel."""
    sine, cosine = math.sin(math.radians(altitude)), math.cos(math.radians(altitude))
    sun = (math.sin(math.radians(azimuth)) * cosine, -math.cos(math.radians(azimuth)) * cosine)  # East, South

    def beyond(values):
        return [2 * values[0] - values[1], *values, 2 * values[-1] - values[-2]]

    grid = [beyond(heights[row * columns:(row + 1) * columns]) for row in range(rows)]
    grid = [[2 * a - b for a, b in zip(grid[0], grid[1])], *grid, [2 * a - b for a, b in zip(grid[-1], grid[-2])]]
    pixels = []
    for row in range(1, rows + 1):
        for column in range(1, columns + 1):
            here = grid[row][column]
            if math.isnan(here):
                pixels.append(0)
                continue
            near_by = [[here if math.isnan(grid[row + j][column + i]) else grid[row + j][column + i] for i in (-1, 0, 1)]
                       for j in (-1, 0, 1)]
            (nw, n, ne), (w, _, e), (sw, s, se) = near_by
            east = ((ne - nw) + 2 * (e - w) + (se - sw)) / (8 * pixel[0])
            south = ((sw - nw) + 2 * (s - n) + (se - ne)) / (8 * pixel[1])
            share = (sine - east * sun[0] - south * sun[1]) / math.sqrt(1 + east * east + south * south)
            pixels.append(int(1.5 + 254 * max(0.0, share)))
    return pixels


def compare(archive, size, what, scale=(1.0, 1.0, 1.0), options=(), azimuth=315.0, altitude=45.0):
    """scale  metres in a unit of the world in x and z, and as drawn in one of elevation"""
    columns, rows = size
    isohf("export", archive, "grid.npy", "--overwrite", "--size", f"{columns}x{rows}", "--method", "barycentric", "--type",
          "f64")
    found_columns, found_rows, heights = read_npy("grid.npy")
    check((found_columns, found_rows) == size, f"{what}: the grid has {found_columns} x {found_rows} samples")
    valid = isohf("info", archive, "--json").json()["metadata"]["valid"]
    pixel = ((valid["x1"] - valid["x0"]) / columns * scale[0], (valid["z1"] - valid["z0"]) / rows * scale[1])
    wanted = horn(columns, rows, [height * scale[2] for height in heights], pixel, azimuth, altitude)
    isohf("shade", archive, "shade.png", "--overwrite", "--kind", "hillshade", "--size", f"{columns}x{rows}", *options)
    png_columns, png_rows, channels, pixels = read_png("shade.png")
    check((png_columns, png_rows, channels) == (columns, rows, 1), f"{what}: the picture has another size")
    nodata = sum((a == 0) != (b == 0) for a, b in zip(wanted, pixels))
    check(nodata == 0, f"{what}: {nodata} pixels have nodata on one side only")
    worst = max(abs(a - b) for a, b in zip(wanted, pixels))
    check(worst <= 1, f"{what}: a pixel is {worst} of 255 off, must be at most 1")
    levels = len(set(wanted))
    check(levels > 30, f"{what}: the terrain has {levels} shades only")


def hills(column, row):
    return 500 + 60 * math.sin(column * 0.7) * math.cos(row * 0.45) + 25 * math.sin(column * 1.9 + row * 1.3)


# The source's own grid, finer, coarser (some pixels for a triangle, and some triangles for a pixel), and not square.
write_asc("hills.asc", 120, 90, hills, spacing=30.0)
isohf("convert", "hills.asc", "hills.isohf", "--type", "f32")
for size in ((120, 90), (240, 180), (60, 45), (31, 17), (12, 90)):
    compare("hills.isohf", size, f"{size[0]} x {size[1]} pixels")
compare("hills.isohf", (120, 90), "another sun", options=("--sun", "100,20"), azimuth=100.0,
        altitude=20.0)
compare("hills.isohf", (120, 90), "--exaggeration 2.5", (1.0, 1.0, 2.5), ("--exaggeration", "2.5"))
isohf("convert", "hills.asc", "codes.isohf", "--type", "u16")
compare("codes.isohf", (120, 90), "16-bit codes")
for threads in (1, 5):
    isohf("shade", "hills.isohf", f"{threads}.png", "--kind", "hillshade", "-j", threads)
check((FOLDER / "1.png").read_bytes() == (FOLDER / "5.png").read_bytes(), "the picture depends on the threads")

# A plane of one in one to the East, and a sun that shines straight on it.
write_asc("plane.asc", 40, 30, lambda column, row: 10.0 * (40 - column), spacing=10.0)
isohf("convert", "plane.asc", "plane.isohf", "--type", "f32")
isohf("shade", "plane.isohf", "plane.png", "--kind", "hillshade", "--sun", "90,45")
check(set(read_png("plane.png")[3]) <= {254, 255}, "a plane that faces the sun isn't white, its edges included")

# Nodata: a hole, and a corner.
write_asc("hole.asc", 80, 60, lambda column, row: None if 30 < column < 40 and 20 < row < 33 or column + row < 15 else
          hills(column, row), spacing=30.0)
isohf("convert", "hole.asc", "hole.isohf", "--type", "f32")
for size in ((80, 60), (133, 100), (40, 30)):
    compare("hole.isohf", size, f"beside nodata, {size[0]} x {size[1]} pixels")

# Heights in feet over metres.
write_tiff("feet.tif", 80, 60, lambda column, row: hills(column, row) / FOOT, "d", west=500000.0, north=5000000.0,
           spacing=30.0, epsg=32632,
           metadata='<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">ft</Item></GDALMetadata>')
isohf("convert", "feet.tif", "feet.isohf", "--type", "f32")
compare("feet.isohf", (80, 60), "heights in feet", (1.0, 1.0, FOOT))

# Laid out in degrees, at 60 degrees North: a degree of longitude is half as long.
spacing = 30.0 / 111319.49
write_tiff("degrees.tif", 80, 60, hills, "d", west=10.0, north=60.0 + 30 * spacing, spacing=spacing, epsg=4326)
isohf("convert", "degrees.tif", "degrees.isohf", "--type", "f32", "--to-crs", "none")
compare("degrees.isohf", (80, 60), "laid out in degrees", (111319.4908 / 2, 111319.4908, 1.0))

# What goes with a coarse plane for pictures is read in full.
write_asc("wide.asc", 600, 400, hills, spacing=30.0)
isohf("convert", "wide.asc", "wide.isohf", "--type", "f32")
compare("wide.isohf", (75, 50), "8 samples for a pixel")

# A real one, on its own map.
if (mountains := real("srtm_bigtujunga30m_utm11.tif")) is not None:
    isohf("convert", mountains, "mountains.isohf")
    compare("mountains.isohf", (399, 214), "real mountains")
