#include "formats/reader_cases.h"

#include <fmt/format.h>
#include <zlib.h>

#include "formats/geotiff/tiff_bytes.h"
#include "formats/grids/dted_cell.h"
#include "formats/io/packed_bytes.h"
#include "formats/netcdf/netcdf_bytes.h"
#include "formats/planetary/pds4_label.h"
#include "formats/readers.h"
#include "formats/write/raster_sink.h"
#include "isohf/raster.h"
#include "support/rasters/place_at.h"
#include "support/rasters/raster.h"
#include "support/temporary_folder.h"

namespace isohf::test {
namespace {

/// `count` numbers of `size` bytes, little-endian, rising.
std::string counting(int count, int size) {
  std::string bytes;
  for (int i = 0; i < count; ++i) {
    for (int b = 0; b < size; ++b) bytes += b == 0 ? static_cast<char>(i + 1) : '\0';
  }
  return bytes;
}

/// Written by isohf's own writer.
std::string written(const TemporaryFolder& folder, const std::string& name, std::int64_t width, std::int64_t height,
                    SampleType type, int channels = 1) {
  RasterSpec spec = raster_spec(width, height, type, channels);
  spec.overwrite = true;
  spec.describe = name == "described.png";
  spec.georeference = place_at(Registration::kArea, HorizontalUnit::kMetre, 5e5, 4e6, 10.0, 32632);
  spec.georeference->system.name = "WGS 84 / UTM zone 32N";
  if (!is_floating(type)) spec.void_value = 0.0;
  std::vector<std::byte> samples(static_cast<std::size_t>(width * height * channels) * size_bytes(type));
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::byte>(i * 37 % 61);
  write_raster(folder / name, spec, samples);
  return read_file(folder / name);
}

/// 8 x 6 int16 in strips of two rows. Tags come first, so that mutations of the beginning meet them.
TiffBytes striped_tiff(bool big_endian) {
  TiffBytes tiff(big_endian);
  tiff.image(8, 6, 16, 2, 2);
  for (int strip = 0; strip < 3; ++strip) tiff.block(counting(48, 2).substr(static_cast<std::size_t>(strip) * 32, 32));
  return tiff;
}

/// 20 x 18 bytes in four tiles of 16 x 16, deflated, with the horizontal predictor.
TiffBytes tiled_tiff() {
  std::string tile(std::size_t{16} * 16, '\0');
  for (std::size_t i = 0; i < tile.size(); ++i) tile[i] = static_cast<char>(i * 37 % 61);
  uLongf size = compressBound(static_cast<uLong>(tile.size()));
  std::string packed(size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(tile.data()),
           static_cast<uLong>(tile.size()));
  packed.resize(size);
  TiffBytes tiff;
  tiff.image(20, 18, 8, 1, 16, 8).tiles(16, 16).shorts(317, {2});
  for (int i = 0; i < 4; ++i) tiff.block(packed);
  return tiff;
}

/// With a transparency mask of bits.
TiffBytes masked_tiff() {
  TiffBytes mask;
  mask.image(8, 6, 1, 1, 6).longs(254, {4}).shorts(262, {4}).block("\x7e\xff\x81\x3c\xf0\x0f");
  return striped_tiff(false).next(mask);
}

std::string pds3() {
  std::string label =
      "PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 512\r\n^IMAGE = 3\r\nTARGET_NAME = MARS\r\nOBJECT = IMAGE\r\n"
      " LINES = 3\r\n LINE_SAMPLES = 4\r\n SAMPLE_TYPE = MSB_INTEGER\r\n SAMPLE_BITS = 16\r\n BANDS = 1\r\n"
      " SCALING_FACTOR = 0.5\r\n OFFSET = 3396000.0 <m>\r\n MISSING_CONSTANT = -32768\r\nEND_OBJECT = IMAGE\r\n"
      "OBJECT = IMAGE_MAP_PROJECTION\r\n MAP_PROJECTION_TYPE = \"SIMPLE CYLINDRICAL\"\r\n A_AXIS_RADIUS = 3396.0 "
      "<KM>\r\n"
      " MAP_RESOLUTION = 4 <PIXEL/DEG>\r\n MAXIMUM_LATITUDE = 1\r\n MINIMUM_LATITUDE = 0.25\r\n"
      " WESTERNMOST_LONGITUDE = 0\r\n EASTERNMOST_LONGITUDE = 1\r\n LINE_PROJECTION_OFFSET = 4\r\n"
      " SAMPLE_PROJECTION_OFFSET = 0\r\nEND_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n";
  label.resize(1024, ' ');
  return label + counting(12, 2);
}

std::string isis3_label(const std::string& more) {
  return fmt::format(
      "Object = IsisCube\n  Object = Core\n    {}StartByte = {}\n    Format = Tile\n    TileSamples = 3\n    TileLines "
      "= 2\n"
      "    Group = Dimensions\n      Samples = 5\n      Lines = 4\n      Bands = 1\n    End_Group\n    Group = Pixels\n"
      "      Type = SignedWord\n      ByteOrder = Lsb\n      Base = 0.0\n      Multiplier = 0.5\n    End_Group\n"
      "  End_Object\n  Group = Mapping\n    ProjectionName = SimpleCylindrical\n    TargetName = Moon\n"
      "    EquatorialRadius = 1737400.0 <meters>\n    UpperLeftCornerX = -100.0 <meters>\n    UpperLeftCornerY = "
      "200.0\n"
      "    PixelResolution = 10.0 <meters/pixel>\n  End_Group\nEnd_Object\nEnd\n",
      more, more.empty() ? 1025 : 1);
}

std::string isis3() {
  std::string label = isis3_label("");
  label.resize(1024, '\0');
  return label + counting(24, 2);
}

std::string npy() {
  std::string text = "{'descr': '<i2', 'fortran_order': True, 'shape': (3, 4), }";
  text.resize(117, ' ');
  return std::string("\x93NUMPY\1\0\x76\0", 10) + text + "\n" + counting(12, 2);
}

const char* const kEhdr =
    "BYTEORDER M\nLAYOUT BIL\nNROWS 3\nNCOLS 4\nNBANDS 1\nNBITS 16\nBANDROWBYTES 8\nTOTALROWBYTES 8\nBANDGAPBYTES 0\n"
    "PIXELTYPE SIGNEDINT\nNODATA -9999\nULXMAP 100.5\nULYMAP 200.5\nXDIM 0.5\nYDIM 0.5\n";
const char* const kWkt =
    R"(PROJCS["WGS_1984_UTM_Zone_11N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.25]],)"
    R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PARAMETER["Central_Meridian",-117],UNIT["Meter",1.0]])";

/// 4 x 3 shorts named z on evenly spaced x and y, degrees, in netCDF's first format; by columns: longitudes first.
std::string netcdf(bool by_columns = false) {
  NetcdfBytes file;
  file.dimension("y", 3).dimension("x", 4);
  file.variable("y", {0}, 6, big_endian<double>({10.0, 10.5, 11.0}), {{"units", "degrees_north"}});
  file.variable("x", {1}, 6, big_endian<double>({20.0, 20.5, 21.0, 21.5}), {{"units", "degrees_east"}});
  const std::vector<std::uint32_t> dimensions =
      by_columns ? std::vector<std::uint32_t>{1, 0} : std::vector<std::uint32_t>{0, 1};
  file.variable("z", dimensions, 3, counting(12, 2), {{"units", "m"}});
  return file.bytes();
}

constexpr const char* kVrt =
    R"(<VRTDataset rasterXSize="8" rasterYSize="4"><SRS>GEOGCS["WGS 84",)"
    R"(DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
    R"(UNIT["degree",0.0174532925199433]]</SRS><GeoTransform>10, 0.5, 0, 5e1, 0, -0.5</GeoTransform>)"
    R"(<VRTRasterBand dataType="Int32" band="1"><NoDataValue>-9</NoDataValue><SimpleSource><SourceFilename relativeToVRT="1">)"
    R"(a.npy</SourceFilename><SourceBand>1</SourceBand><SrcRect xOff="0" yOff="0" xSize="4" ySize="3"/><DstRect xOff="0" )"
    R"(yOff="0" xSize="4" ySize="3"/></SimpleSource><ComplexSource><SourceFilename relativeToVRT="1">a.npy</SourceFilename>)"
    R"(<SourceBand>1</SourceBand><SrcRect xOff="0" yOff="0" xSize="4" ySize="3"/><DstRect xOff="3" yOff="1" xSize="4" )"
    R"(ySize="3"/><NODATA>5</NODATA></ComplexSource></VRTRasterBand>)"
    R"(</VRTDataset>)";
constexpr const char* kEnvi =
    "ENVI\nsamples = 4\nlines = 3\nbands = 2\nheader offset = 2\ndata type = 2\ninterleave = bip\nbyte order = 1\n"
    "map info = {UTM, 1, 1, 500000, 4000000, 30, 30, 32, North, WGS-84}\ndata ignore value = 5\n";
}  // namespace

std::vector<ReaderCase> reader_cases() {
  const TemporaryFolder folder;
  const std::string esri = "ncols 4\nnrows 3\nxllcorner 100\nyllcorner 200.5\ncellsize 10\nNODATA_value -9999\n";
  const std::string numbers = "1 2.5 3 4\n5 -9999 7e1 8\n9 10 nan 12\n";
  const std::string data = std::string(ISOHF_SOURCE_DIR) + "/tests/formats/data/";
  OpenOptions packed;
  packed.encoding = "terrarium";
  std::vector<ReaderCase> cases = {
      {"ExrScanLines", "a.exr", written(folder, "a.exr", 5, 4, SampleType::kFloat32), kExrFormat.open, {}},
      {"ExrChannels", "a.exr", written(folder, "a.exr", 4, 3, SampleType::kFloat16, 4), kExrFormat.open, {}},
      {"TiffTagsFirst", "a.tif", striped_tiff(false).build(), kTiffFormat.open, {}},
      {"TiffBigEndian", "a.tif", striped_tiff(true).build(), kTiffFormat.open, {}},
      {"TiffStripsDeflated", "a.tif", written(folder, "a.tif", 9, 7, SampleType::kInt16), kTiffFormat.open, {}},
      {"TiffTiles", "a.tif", tiled_tiff().build(), kTiffFormat.open, {}},
      {"TiffMasked", "a.tif", masked_tiff().build(), kTiffFormat.open, {}},
      {"PngGray16", "a.png", written(folder, "a.png", 6, 5, SampleType::kUint16), kPngFormat.open, {}},
      {"PngPacked", "a.png", written(folder, "a.png", 6, 5, SampleType::kUint8, 3), kPngFormat.open, packed},
      {"EsriAsciiGrid", "a.asc", esri + numbers, kAsciiGridFormat.open, {}},
      {"EhdrHeader", "a.hdr", kEhdr, kHeaderGridFormat.open, {}},
      {"EhdrWorldFile", "a.blw", "0.5\n0\n0\n-0.5\n100.5\n200.5\n", kHeaderGridFormat.open, {}},
      {"EhdrProjection", "a.prj", kWkt, kHeaderGridFormat.open, {}},
      {"GridFloatSamples", "a.flt", counting(12, 4), kHeaderGridFormat.open, {}},
      {"Pds3", "a.img", pds3(), kPds3Format.open, {}},
      {"Isis3", "a.cub", isis3(), kIsis3Format.open, {}},
      {"Isis3Label", "a.lbl", isis3_label("^Core = core.cub\n    "), kIsis3Format.open, {}},
      {"Npy", "a.npy", npy(), kNpyFormat.open, {}},
      {"Dted", "a.dt0", dted_cell(3, 4, [](int c, int p) { return 256 + 10 * c + p; }), kDtedFormat.open, {}},
      {"Hgt", "N10E010.hgt", counting(25, 2), kHgtFormat.open, {}},
      {"Vrt", "a.vrt", kVrt, kVrtFormat.open, {}},
      {"EnviHeader", "a.hdr", kEnvi, kEnviFormat.open, {}},
      {"EnviSamples", "a.dat", "  " + counting(24, 2), kEnviFormat.open, {}},
      {"NetcdfClassic", "a.nc", netcdf(), kNetcdfFormat.open, {}},
      {"NetcdfByColumns", "a.nc", netcdf(true), kNetcdfFormat.open, {}},
      {"XyzText", "a.xyz", "x y z\n0 0 1\n1 0 2.5\n0 1 3\n1 1 4\n", kXyzFormat.open, {}},
      {"Pds4Label", "a.xml", pds4_label("a.dat"), kPds4Format.open, {}},
      {"Pds4Samples", "a.dat", counting(7, 2), kPds4Format.open, {}},
      {"GzipOfGrid", "a.asc.gz", gzipped(esri + numbers), kPackedFormat.open, {}},
      {"XzOfGrid", "a.asc.xz", test::packed({{"", esri + numbers}}, "raw", "xz"), kPackedFormat.open, {}},
      {"ZipOfHgt", "a.zip", test::packed({{"d/N10E010.hgt", counting(25, 2)}}, "zip"), kPackedFormat.open, {}},
      {"SevenZipOfGrid", "a.7z", test::packed({{"d/a.asc", esri + numbers}}, "7zip"), kPackedFormat.open, {}},
      {"TarOfGrid", "a.tar", test::packed({{"d/a.asc", esri + numbers}}, "ustar"), kPackedFormat.open, {}},
      {"Webp", "a.webp", read_file(data + "small.webp"), kWebpFormat.open, packed},
      {"Pmtiles", "a.pmtiles", read_file(data + "small.pmtiles"), kPmtilesFormat.open, {}},
      {"PngDescription", "described.png.json", "", kPngFormat.open, {}},
      {"RawDescription", "a.r16.json", "", kRawFormat.open, {}},
  };
  cases.push_back({"Netcdf4", "a.nc", read_file(data + "lat_lon.nc"), kNetcdfFormat.open, {}});
  cases.back().share = 100;
  const auto find = [&](const char* name) -> ReaderCase& {
    for (ReaderCase& each : cases) {
      if (each.name == name) return each;
    }
    throw std::logic_error(name);
  };
  for (const char* name : {"EhdrHeader", "EhdrWorldFile", "EhdrProjection"}) {
    ReaderCase& each = find(name);
    each.opened = "a.bil";
    each.text = true;
    each.beside = {{"a.bil", counting(12, 2)}, {"a.hdr", kEhdr}};
    if (each.name == "EhdrHeader") each.beside.pop_back();
  }
  find("Vrt").beside = {{"a.npy", npy()}};
  ReaderCase& header = find("EnviHeader");
  header.text = true;
  header.shortest_valid = 1;  // what is left out is taken for granted, or asked for
  header.opened = find("EnviSamples").file_name;
  header.beside = {{header.opened, find("EnviSamples").bytes}};
  find("EnviSamples").beside = {{header.file_name, kEnvi}};
  find("Pds4Label").beside = {{"a.dat", counting(7, 2)}};
  find("Pds4Label").shortest_valid = find("Pds4Label").bytes.size() - 1;
  find("Pds4Samples").beside = {{"a.xml", pds4_label("a.dat")}};
  find("EnviSamples").shortest_valid = find("EnviSamples").bytes.size() - 2;  // those of the other band
  find("GridFloatSamples").beside = {{"a.hdr", esri + "byteorder LSBFIRST\n"}};
  find("Isis3Label").beside = {{"core.cub", counting(24, 2)}};
  ReaderCase& raw = find("RawDescription");
  (void)written(folder, "a.r16", 4, 3, SampleType::kUint16);
  raw.bytes = read_file(folder / "a.r16.json");
  raw.opened = "a.r16";
  raw.beside = {{"a.r16", counting(12, 2)}};
  ReaderCase& picture = find("PngDescription");
  picture.opened = "described.png";
  picture.beside = {{picture.opened, written(folder, picture.opened, 6, 5, SampleType::kUint16)}};
  picture.bytes = read_file(folder / picture.file_name);
  for (const char* name : {"EsriAsciiGrid", "Pds3", "Isis3", "Isis3Label", "Dted", "PngDescription", "RawDescription",
                           "Npy", "Vrt", "Pds4Label", "XyzText"}) {
    find(name).text = true;
  }
  // The last digits of a text can be missing without trace; a world file, a .prj and a label's last words are not
  // needed.
  find("EsriAsciiGrid").shortest_valid = find("EsriAsciiGrid").bytes.size() - 2;
  find("EhdrHeader").shortest_valid = 1;
  find("EhdrWorldFile").shortest_valid = 1;
  find("EhdrProjection").shortest_valid = 1;
  find("Isis3Label").shortest_valid = find("Isis3Label").bytes.size() - 1;
  find("XyzText").shortest_valid = find("XyzText").bytes.size() - 1;
  find("PngDescription").shortest_valid = find("PngDescription").bytes.size() - 1;
  find("RawDescription").shortest_valid = find("RawDescription").bytes.size() - 1;
  find("TiffStripsDeflated").shortest_valid = 1;  // the tags that isohf writes come last, and not all are needed
  find("TiffMasked").shortest_valid = 1;          // the mask's directory, without which the image opens with a warning
  for (const char* name : {"GzipOfGrid", "XzOfGrid", "ZipOfHgt", "SevenZipOfGrid", "TarOfGrid"}) find(name).share = 4;
  find("TarOfGrid").shortest_valid = 1024;  // header and contents, without the zeros behind them
  find("Hgt").shortest_valid = 1;           // another square
  return cases;
}

}  // namespace isohf::test
