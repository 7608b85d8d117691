#include "formats/write/raster_sink.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>

#include "formats/io/raw_file.h"
#include "formats/readers.h"
#include "formats/write/encoders.h"
#include "isohf/base/file.h"
#include "isohf/base/output_file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

struct Writer {
  Format format;
  std::unique_ptr<RasterEncoder> (*encode)(OutputFile& out, const RasterSpec& spec);
  double (*least_bytes)(const RasterSpec& spec);  ///< of a sample in the file
  std::vector<SampleType> types;                  ///< that it holds, the usual one first; empty: all
  RasterTraits traits = {};
  bool has_signature = false;  ///< by which its files are known; others begin in any way
};

double plain_bytes(const RasterSpec& spec) {
  return static_cast<double>(size_bytes(spec.sample_type));
}
/// A digit and a blank.
double text_bytes(const RasterSpec& /*spec*/) {
  return 2.0;
}
/// Deflate's longest match of 258 bytes takes 2 bits.
double deflated_bytes(const RasterSpec& spec) {
  return plain_bytes(spec) * 2.0 / (8.0 * 258.0);
}
double packed_bytes(const RasterSpec& spec) {
  return spec.compress ? deflated_bytes(spec) : plain_bytes(spec);
}

const std::vector<Writer>& writers() {
  using enum SampleType;
  static const RasterTraits kStatesScale = {.states_scale = true};
  static const RasterTraits kBare = {.states_scale = true, .is_bare = true};
  static const RasterTraits kGrid = {.has_place = true};
  static const std::vector<Writer> table = {
      {{"GeoTIFF", {".tif", ".tiff"}, kTiffFormat.library, "samples of any type"},
       encode_tiff,
       packed_bytes,
       {},
       kStatesScale,
       true},
      {{"OpenEXR", {".exr"}, kExrFormat.library, "float16, float32, uint32"},
       encode_exr,
       packed_bytes,
       {kFloat32, kFloat16, kUint32},
       {.voids_are_nan = true},
       true},
      {{"PNG", {".png"}, kPngFormat.library, "uint8, uint16"},
       encode_png,
       deflated_bytes,
       {kUint16, kUint8},
       kBare,
       true},
      {{"SRTM HGT", {".hgt"}, nullptr, "int16; 1201x1201, 3601x3601 or 1801x3601"},
       encode_hgt,
       plain_bytes,
       {kInt16},
       {.is_srtm = true}},
      {{"ESRI ASCII grid", {".asc"}, nullptr, "samples of any type"},
       encode_asc,
       text_bytes,
       {},
       {.has_place = true, .is_text = true},
       true},
      {{"GridFloat", {".flt"}, nullptr, "float32; with .hdr"}, encode_flt, plain_bytes, {kFloat32}, kGrid},
      {{"raw 16 bit", {".r16", ".raw"}, nullptr, "uint16; with .json"}, encode_r16, plain_bytes, {kUint16}, kBare},
      {{"raw 32 bit", {".r32"}, nullptr, "float32; with .json"}, encode_r32, plain_bytes, {kFloat32}, kBare},
      {{"NumPy", {".npy"}, nullptr, "samples of any type"}, encode_npy, plain_bytes, {}, {}, true},
  };
  return table;
}

/// What `action` returns; its errors name the path.
template <typename Action>
auto naming(const std::string& path, const Action& action) {
  try {
    return action();
  } catch (const Error& error) {
    throw error.within(path);
  }
}

const Writer& writer_for(const std::string& path) {
  if (path == "-") static_cast<void>(output_place(path, true));  // says why before the extension is looked at
  const std::string extension = extension_of(path);
  for (const Writer& writer : writers()) {
    if (std::ranges::count(writer.format.extensions, extension) > 0) return writer;
  }
  throw Error(ErrorCode::kInvalidArgument, fmt::format("no writer for the extension \"{}\"; there are {}", extension,
                                                       fmt::join(writable_extensions(), " ")));
}

void check(const RasterSpec& spec) {
  constexpr std::int64_t kMaxSide = std::numeric_limits<std::int32_t>::max();
  if (spec.width < 1 || spec.height < 1 || spec.width > kMaxSide || spec.height > kMaxSide) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("a raster of {} x {} samples, must be 1...{} on each side",
                                                         spec.width, spec.height, kMaxSide));
  }
  if (spec.channels != 1 && spec.channels != 3 && spec.channels != 4) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} channels, must be 1, 3 or 4", spec.channels));
  }
}

/// What a file is that is to be replaced; empty where it is of the writer's kind, or empty.
std::string other_kind(const std::string& path, const Writer& writer) {
  constexpr std::size_t kHeadBytes = 512;
  const std::vector<std::byte> head = head_of_file(path, kHeadBytes);
  if (head.empty()) return {};
  if (text_of(head).starts_with("PK\x03\x04")) return "a ZIP archive, as .isohf files are";
  const Format* const found = format_of_head(head);
  if (found == nullptr) return writer.has_signature ? fmt::format("no {}", writer.format.name) : "";
  const bool same = std::ranges::any_of(found->extensions, [&](std::string_view extension) {
    return std::ranges::count(writer.format.extensions, extension) > 0;
  });
  return same ? "" : fmt::format("of the kind {}", found->name);
}

/// Throws, without the path, what OutputFile will throw, and where another kind of file stands there.
void check_target(const std::string& path, const Writer& writer, bool overwrite) {
  const std::string kind = other_kind(output_place(path, true), writer);
  if (kind.empty()) return static_cast<void>(output_place(path, overwrite));
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("exists and is {}; a {} replaces only a file of its own kind, remove it first or choose "
                          "another name",
                          kind, writer.format.name));
}

void check_room(const std::string& path, const Writer& writer, const RasterSpec& spec, std::int64_t count) {
  const double samples = static_cast<double>(spec.width) * static_cast<double>(spec.height) * spec.channels;
  require_room(path, static_cast<double>(count) * samples * writer.least_bytes(spec));
}

/// Whether the file is there already, as it would be written: rasters of one name may share a .prj.
bool holds(const Sidecar& sidecar) {
  const std::vector<std::byte> found = head_of_file(sidecar.path, sidecar.text.size() + 1);
  return std::ranges::equal(found, std::as_bytes(std::span(sidecar.text)));
}

std::vector<std::unique_ptr<OutputFile>> begin_sidecars(const std::string& path, const RasterSpec& spec) {
  std::vector<std::unique_ptr<OutputFile>> files;
  for (const Sidecar& sidecar : sidecars_of(path, spec)) {
    naming(sidecar.path, [&] {
      if (holds(sidecar)) return;
      check_sidecar_target(sidecar.path);
      files.push_back(std::make_unique<OutputFile>(sidecar.path, OutputFile::Options{spec.overwrite}));
      files.back()->append(sidecar.text);
      files.back()->flush();
    });
  }
  return files;
}

/// Gives the parts of a raster and of what stands beside it their names. All is on the disk before anything gets its
/// name, and what the raster's name stands for is complete when it appears: whoever ends the program in between finds
/// no raster, never old samples with a new description.
void give_names(const std::string& path, const RasterSpec& spec, const std::function<void()>& name_samples) {
  std::string named = path;
  std::string place;
  bool keeps_part = false;
  try {
    place = output_place(path, true);
    const bool replaces = std::filesystem::exists(place);
    if (replaces && !spec.overwrite) {
      keeps_part = true;
      throw Error(ErrorCode::kIo, "was made by another program meanwhile");
    }
    std::vector<Sidecar> sidecars = sidecars_of(path, spec);
    std::erase_if(sidecars, holds);
    if (replaces && !sidecars.empty()) {
      keeps_part = remove_file(place);
      if (!keeps_part) throw Error(ErrorCode::kIo, "cannot be replaced");
    }
    for (const Sidecar& sidecar : sidecars) name_part(named = sidecar.path, spec.overwrite);
    named = path;
    name_samples();
    if (!replaces) return;
    for (const std::string& stale : stale_sidecars(path, &spec)) remove_file(stale);
  } catch (const Error& error) {
    if (keeps_part) {
      throw Error(error.code(), fmt::format("{}: {}; the samples are complete in {}.part", named, error.what(), place));
    }
    drop_raster(path);
    throw error.within(named);
  }
}

}  // namespace

RasterSink::RasterSink(std::string path, const RasterSpec& spec, std::unique_ptr<OutputFile> file,
                       std::vector<std::unique_ptr<OutputFile>> sidecars, std::unique_ptr<RasterEncoder> encoder)
    : path_(std::move(path)),
      spec_(spec),
      file_(std::move(file)),
      sidecars_(std::move(sidecars)),
      encoder_(std::move(encoder)) {}

RasterSink::~RasterSink() = default;

std::vector<std::string> RasterSink::files() const {
  std::vector<std::string> all = {path_};
  for (const Sidecar& sidecar : sidecars_of(path_, spec_)) all.push_back(sidecar.path);
  return all;
}

void RasterSink::write_rows(std::span<const std::byte> rows) {
  const std::size_t one_row = row_bytes(spec_);
  const auto count = static_cast<std::int64_t>(rows.size() / one_row);
  if (rows.size() % one_row != 0 || count > spec_.height - rows_written_) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} bytes after row {} of {}, must be whole rows of {} bytes", path_, rows.size(),
                            rows_written_, spec_.height, one_row));
  }
  if (count == 0) return;
  naming(path_, [&] { encoder_->write(rows, count); });
  rows_written_ += count;
}

void RasterSink::close() {
  if (rows_written_ != spec_.height) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: finished after {} of {} rows", path_, rows_written_, spec_.height));
  }
  if (!encoder_) return;
  naming(path_, [&] {
    encoder_->close();
    encoder_.reset();
    file_->sync();
    for (const auto& sidecar : sidecars_) sidecar->sync();
  });
}

void RasterSink::complete() {
  close();
  for (const auto& sidecar : sidecars_) sidecar->complete();
  file_->complete();
}

void RasterSink::finish() {
  close();
  for (const auto& sidecar : sidecars_) sidecar->complete();
  file_->keep();
  give_names(path_, spec_, [this] { file_->commit(); });
}

void name_raster(const std::string& path, const RasterSpec& spec) {
  give_names(path, spec, [&] { name_part(path, spec.overwrite); });
}

void drop_raster(const std::string& path) noexcept {
  try {
    std::vector<std::string> files = sidecar_paths(path);
    files.push_back(path);
    for (const std::string& file : files) {
      std::error_code none;
      remove_file((std::filesystem::is_symlink(file, none) ? std::filesystem::canonical(file, none).string() : file) +
                  ".part");
    }
  } catch (const std::exception&) {  // no memory: they stay
  }
}

void remove_raster(const std::string& path) {
  const auto is_another = [&](const std::string& extension) {
    const std::string other = std::filesystem::path(path).replace_extension(extension).string();
    return other != path && std::filesystem::exists(other);
  };
  const bool is_alone = std::ranges::none_of(writable_extensions(), is_another);
  for (const std::string& beside : stale_sidecars(path, nullptr)) {
    if (is_alone || beside.starts_with(path)) remove_file(beside);
  }
  drop_raster(path);
  remove_file(path);
}

std::unique_ptr<RasterSink> create_raster(const std::string& path, const RasterSpec& spec) {
  return naming(path, [&] {
    const Writer& writer = writer_for(path);
    check(spec);
    check_target(path, writer, spec.overwrite);
    check_room(path, writer, spec, 1);
    auto file = std::make_unique<OutputFile>(path, OutputFile::Options{spec.overwrite});
    auto sidecars = begin_sidecars(path, spec);
    auto encoder = writer.encode(*file, spec);
    return std::make_unique<RasterSink>(path, spec, std::move(file), std::move(sidecars), std::move(encoder));
  });
}

RasterTraits raster_traits(const std::string& path) {
  return naming(path, [&] { return writer_for(path).traits; });
}

SampleType held_type(const std::string& path, SampleType wanted) {
  const std::vector<SampleType> types = naming(path, [&] { return writer_for(path).types; });
  return types.empty() || std::ranges::count(types, wanted) > 0 ? wanted : types.front();
}

void check_raster_target(const std::string& path, bool overwrite) {
  naming(path, [&] { check_target(path, writer_for(path), overwrite); });
}

void check_raster_room(const std::string& path, const RasterSpec& spec, std::int64_t count) {
  naming(path, [&] { check_room(path, writer_for(path), spec, count); });
}

const std::vector<std::string>& writable_extensions() {
  static const std::vector<std::string> extensions = [] {
    std::vector<std::string> list;
    for (const Format& format : writable_formats()) {
      list.insert(list.end(), format.extensions.begin(), format.extensions.end());
    }
    return list;
  }();
  return extensions;
}

const std::vector<Format>& writable_formats() {
  static const std::vector<Format> formats = [] {
    std::vector<Format> list;
    for (const Writer& writer : writers()) list.push_back(writer.format);
    return list;
  }();
  return formats;
}

}  // namespace isohf
