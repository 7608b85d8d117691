"""One terrain in every format that isohf reads, for the section readers."""

import gzip
import shutil
import struct
import zipfile
from dataclasses import dataclass, field

from harness import Bench

DEGREE = ["-a_srs", "EPSG:4326", "-a_ullr"]
FRACTIONS = ["-ot", "Float32", "-scale", "0", "1000", "0", "313.7"]
INT16 = "<i2"
PDS3 = """PDS_VERSION_ID = PDS3\r
RECORD_TYPE = FIXED_LENGTH\r
RECORD_BYTES = {row_bytes}\r
FILE_RECORDS = {records}\r
LABEL_RECORDS = 1\r
^IMAGE = 2\r
OBJECT = IMAGE\r
 LINES = {rows}\r
 LINE_SAMPLES = {columns}\r
 SAMPLE_TYPE = LSB_INTEGER\r
 SAMPLE_BITS = 16\r
END_OBJECT = IMAGE\r
END\r
"""
RAW_VRT = """<VRTDataset rasterXSize="{columns}" rasterYSize="{rows}">
<VRTRasterBand dataType="UInt16" band="1" subClass="VRTRawRasterBand">
<SourceFilename relativeToVRT="1">{name}</SourceFilename>
<ByteOrder>LSB</ByteOrder>
</VRTRasterBand>
</VRTDataset>
"""


@dataclass
class Input:
    path: object
    samples: tuple  # columns, rows
    peer: str = "GDAL"
    peer_path: object = None  # what the peer is given, where it is not the path
    options: list = field(default_factory=list)  # of isohf


class Maker:
    """Writes files where they are not there already, by way of GDAL where it can."""

    def __init__(self, bench: Bench):
        self.bench = bench
        small = bench.options.smoke
        # 64 MiB of samples where the format lets us, and of whole degrees the largest tile there is; texts are some
        # tens of MB, as GDAL takes its time for them.
        self.integers = (1201, 1201) if small else (8192, 4096)
        self.floats = (1201, 1201) if small else (4096, 4096)
        self.text = (1201, 1201) if small else (2401, 2401)
        self.degree = (1201, 1201) if small else (3601, 3601)
        self.folder = bench.work / ("readers_small" if small else "readers")
        self.folder.mkdir(exist_ok=True)
        self.inputs = {}

    def land(self, samples):
        return self.bench.terrain(f"{samples[0]}x{samples[1]}")

    def gdal(self, file, samples, *options):
        """A file as GDAL writes it, without its statistics beside it."""
        path = self.folder / file
        if not path.exists():
            self.bench.run("gdal_translate", "-q", *options, self.land(samples), path)
        path.with_name(file + ".aux.xml").unlink(missing_ok=True)
        return path

    def add(self, name, file, samples, *options):
        self.inputs[name] = Input(self.gdal(file, samples, *options), samples)

    def behind(self, file, header, samples):
        """Samples without a header, then the same behind one."""
        path = self.folder / file
        path.write_bytes(header + samples.read_bytes())
        return path

    def with_georeference(self):
        side = self.degree[0]
        half = 0.5 / (side - 1)
        posts = [*DEGREE, 6 - half, 46 + half, 7 + half, 45 - half]
        self.add("ESRI ASCII grid, whole numbers", "whole.asc", self.text, "-of", "AAIGrid")
        self.add("ESRI ASCII grid, fractions", "fractions.asc", self.text, "-of", "AAIGrid", "-co", "DECIMAL_PRECISION=3",
                 *FRACTIONS)
        self.add("DTED", "n45_e006.dt1" if side == 1201 else "n45_e006.dt2", self.degree, "-of", "DTED", *posts)
        self.add("SRTM HGT", "N45E006.hgt", self.degree, "-of", "SRTMHGT", *posts)

    def compressed(self):
        plain = self.inputs["SRTM HGT"].path
        gzipped, zipped = self.folder / "N45E006.hgt.gz", self.folder / "N45E006.hgt.zip"
        if not gzipped.exists():
            with open(plain, "rb") as source, gzip.open(gzipped, "wb", 6) as target:
                shutil.copyfileobj(source, target)
        if not zipped.exists():
            with zipfile.ZipFile(zipped, "w", zipfile.ZIP_DEFLATED) as target:
                target.write(plain, plain.name)
        self.inputs["SRTM HGT, gzip"] = Input(gzipped, self.degree, peer_path=f"/vsigzip/{gzipped}")
        self.inputs["SRTM HGT, zip"] = Input(zipped, self.degree, peer_path=f"/vsizip/{zipped}/{plain.name}")

    def plain(self):
        self.add("GridFloat", "floats.flt", self.floats, "-of", "EHdr", *FRACTIONS)
        self.add("EHdr .bil", "land.bil", self.integers, "-of", "EHdr")
        self.add("ISIS3 cube", "land.cub", self.integers, "-of", "ISIS3")
        samples = self.gdal("samples.bin", self.integers, "-of", "ENVI")
        columns, rows = self.integers
        label = PDS3.format(row_bytes=2 * columns, records=rows + 1, columns=columns, rows=rows).encode()
        self.inputs["PDS3"] = Input(self.behind("land.img", label.ljust(2 * columns), samples), self.integers)
        raw = self.behind("land.r16", b"", self.gdal("unsigned.bin", self.integers, "-of", "ENVI", "-ot", "UInt16"))
        header = raw.with_suffix(".vrt")
        header.write_text(RAW_VRT.format(columns=columns, rows=rows, name=raw.name))
        self.inputs["raw .r16"] = Input(raw, self.integers, peer_path=header,
                                        options=["--raw", f"{columns}x{rows}:u16le"])
        text = f"{{'descr': '{INT16}', 'fortran_order': False, 'shape': ({rows}, {columns}), }}".ljust(117) + "\n"
        npy = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()
        self.inputs["NumPy .npy"] = Input(self.behind("land.npy", npy, samples), self.integers, peer="numpy")

    def described(self):
        """Formats whose samples a header or a label describes."""
        self.add("ENVI", "land.dat", self.integers, "-of", "ENVI")
        self.add("PDS4", "land.xml", self.integers, "-of", "PDS4")
        self.add("netCDF classic", "classic.nc", self.integers, "-of", "netCDF")
        self.add("netCDF-4, Deflate", "deflated.nc", self.integers, "-of", "netCDF", "-co", "FORMAT=NC4", "-co",
                 "COMPRESS=DEFLATE")
        self.add("VRT of a GeoTIFF", "land_tif.vrt", self.integers, "-of", "VRT")
        self.add("XYZ text", "land.xyz", self.text, "-of", "XYZ")

    def pictures(self):
        self.add("WebP", "land.webp", self.text, "-of", "WEBP", "-ot", "Byte", "-scale", *("-b", "1") * 3, "-co", "LOSSLESS=YES")
        self.inputs["WebP"].options = ["--encoding", "mapbox"]
        self.add("PNG, 16 bits", "land.png", self.integers, "-of", "PNG", "-ot", "UInt16")
        deflate = ["-co", "COMPRESS=DEFLATE"]
        self.add("GeoTIFF, tiles, Deflate", "tiles.tif", self.integers, "-co", "TILED=YES", *deflate, "-co", "PREDICTOR=2")
        self.add("GeoTIFF, strips, Deflate", "strips.tif", self.integers, *deflate, "-co", "PREDICTOR=2")
        self.add("GeoTIFF, strips, Deflate, floats", "deflated.tif", self.floats, *deflate, "-co", "PREDICTOR=3", *FRACTIONS)
        self.add("GeoTIFF, strips, plain", "plain.tif", self.integers)
        if self.bench.has("readers", "oiiotool", "openimageio-tools"):
            source = self.gdal("floats.tif", self.floats, *FRACTIONS)
            for name, file, depth, compression in (("OpenEXR, ZIP, floats", "zip.exr", "float", "zip"),
                                                   ("OpenEXR, PIZ, halves", "piz.exr", "half", "piz")):
                path = self.folder / file
                if not path.exists():
                    self.bench.run("oiiotool", source, "-d", depth, "--compression", compression, "-o", path)
                self.inputs[name] = Input(path, self.floats, peer="oiiotool")


def make_inputs(bench):
    """Inputs by the name of the format."""
    maker = Maker(bench)
    maker.with_georeference()
    maker.compressed()
    maker.plain()
    maker.described()
    maker.pictures()
    return maker.inputs
