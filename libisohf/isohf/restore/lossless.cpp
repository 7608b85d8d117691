#include "isohf/restore/lossless.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "isohf/archive/container/content_hash.h"
#include "isohf/base/arena.h"
#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::pair<SamplePrediction, const char*>, 5> kPredictions = {
    {{SamplePrediction::kSpline, "spline"},
     {SamplePrediction::kTriangles, "triangles"},
     {SamplePrediction::kHex, "hex"},
     {SamplePrediction::kBarycentric, "barycentric"},
     {SamplePrediction::kPlaces, "places"}}};

const char* name_of(SamplePrediction prediction) {
  return std::find_if(kPredictions.begin(), kPredictions.end(),
                      [&](const auto& entry) { return entry.first == prediction; })
      ->second;
}

SamplePrediction prediction_from(const std::string& name) {
  for (const auto& [prediction, its_name] : kPredictions) {
    if (name == its_name) return prediction;
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("the prediction \"{}\" is not known to this build", name));
}

bool is_in_integers(SamplePrediction prediction) {
  return prediction == SamplePrediction::kSpline || prediction == SamplePrediction::kTriangles;
}

/// JSON has no numbers that are not finite.
Json json_from(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : (value > 0.0 ? "inf" : "-inf");
}

double number_from(const Json& json) {
  if (!json.is_string()) return json.get<double>();
  const auto text = json.get<std::string>();
  if (text == "nan") return std::nan("");
  if (text == "inf" || text == "-inf") return text == "inf" ? HUGE_VAL : -HUGE_VAL;
  throw Error(ErrorCode::kCorrupt, "metadata: lossless: \"" + text + "\" is no number");
}

void check(const LosslessRecord& record, const Metadata& metadata) {
  const bool fits =
      record.width == metadata.source.width && record.height == metadata.source.height && record.width >= 1 &&
      record.height >= 1 && record.rows_per_member >= 1 &&
      record.rows_per_member <= (std::int64_t{1} << 26U) / record.width + 16 &&
      std::isfinite(record.mapping.z_offset) && std::isfinite(record.mapping.z_scale) &&
      record.mapping.z_scale != 0.0 &&
      (!is_in_integers(record.prediction) || FixedHeights::are_valid(metadata.quantisation, record.fraction_bits));
  if (!fits) throw Error(ErrorCode::kCorrupt, "metadata: lossless does not fit the source's record");
}

/// A residual member holds every sample of its rows in as many bytes as the sample has: what the record claims is held
/// against that before anything is made as large.
void check_members(const ArchiveReader& archive, const LosslessRecord& record) {
  const std::string name = residual_name(0);
  const auto first = archive.find_member(name);
  const auto samples = static_cast<std::uint64_t>(record.width) *
                       static_cast<std::uint64_t>(std::min(record.rows_per_member, record.height));
  if (!first) throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" is missing", archive.path(), name));
  if (first->bytes / size_bytes(record.mapping.type) < samples) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" has {} bytes, too few for {} samples",
                                                 archive.path(), name, first->bytes, samples));
  }
}

/// Where the reader's rows are: a member's samples, predictions, payload and packed bytes, and what its caller makes of
/// the samples, beside what predicts them.
ScratchFolder scratch_of(const ArchiveReader& archive, const LosslessRecord& record, const Job& job) {
  const Metadata& metadata = archive.metadata();
  const int threads = threads_of(job);
  const auto rows = static_cast<double>(std::min(record.rows_per_member, record.height));
  const auto sample = static_cast<double>(size_bytes(record.mapping.type));
  const auto bytes = [&](bool in_scratch) {
    const double lattice_rows = rows * metadata.source.spacing_z / archive.grid().sigma_z();
    return reading_bytes(job, static_cast<double>(archive.grid().shape().stored_vertex_count())) +
           rows * static_cast<double>(record.width) * (8.0 + 4.0 * sample) +
           static_cast<double>(SplinePredictor::kept_bytes(record.width, in_scratch)) +
           SplinePredictor::lines_bytes(archive.grid(), threads, in_scratch) +
           SplinePredictor::rows_bytes(archive.grid(), record.width, lattice_rows, threads, in_scratch);
  };
  return scratch_for(job, bytes(false), bytes(true), "restoring the source");
}

template <typename Mesh>
Mesh read_mesh(const SamplePredictor::ReadMember& read_member, const char* name, const LosslessRecord& record) {
  const auto bytes = read_member(name);
  const std::string where = fmt::format("member \"{}\"", name);
  if (!bytes) throw Error(ErrorCode::kCorrupt, where + " is missing");
  try {
    if constexpr (std::is_same_v<Mesh, PlaceMesh>)
      return PlaceMesh(record.width, record.height, *bytes);
    else
      return positions_from_bytes(record.width, record.height, *bytes);
  } catch (const Error& error) {
    throw error.within(where);
  }
}

}  // namespace

std::string format_lossless(const LosslessRecord& record) {
  Json voids = Json::array();
  for (const double value : record.void_values) voids.push_back(json_from(value));
  Json json = {{"sample_type", to_string(record.mapping.type)},
               {"width", record.width},
               {"height", record.height},
               {"z_scale", record.mapping.z_scale},
               {"z_offset", record.mapping.z_offset},
               {"void_values", voids},
               {"prediction", name_of(record.prediction)},
               {"fraction_bits", record.fraction_bits},
               {"rows_per_member", record.rows_per_member},
               {"residual_bytes", record.residual_bytes},
               {"sha256", record.sha256}};
  return json.dump();
}

namespace {

std::optional<LosslessRecord> record_named(const char* name, const Metadata& metadata) {
  const auto found = std::find_if(metadata.extensions.begin(), metadata.extensions.end(),
                                  [&](const auto& extension) { return extension.first == name; });
  if (found == metadata.extensions.end()) return std::nullopt;
  LosslessRecord record;
  try {
    const Json json = Json::parse(found->second);
    record.mapping = {sample_type_from_string(json.at("sample_type").get<std::string>()),
                      json.at("z_scale").get<double>(), json.at("z_offset").get<double>()};
    record.width = json.at("width").get<std::int64_t>();
    record.height = json.at("height").get<std::int64_t>();
    for (const Json& value : json.at("void_values")) record.void_values.push_back(number_from(value));
    record.prediction = prediction_from(json.at("prediction").get<std::string>());
    if (is_in_integers(record.prediction)) record.fraction_bits = json.at("fraction_bits").get<int>();
    record.rows_per_member = json.at("rows_per_member").get<std::int64_t>();
    record.residual_bytes = json.at("residual_bytes").get<std::uint64_t>();
    record.sha256 = json.at("sha256").get<std::string>();
  } catch (const nlohmann::json::exception&) {
    throw Error(ErrorCode::kCorrupt, "metadata: lossless: a member is missing, or is of another type than it must be");
  } catch (const Error& error) {
    throw error.within("metadata: lossless");
  }
  if (metadata.source.raw_range) record.valid = *metadata.source.raw_range;
  check(record, metadata);
  return record;
}

}  // namespace

bool LosslessRecord::is_void(double raw) const {
  return !std::isfinite(raw) || raw < valid.first || raw > valid.second ||
         std::find(void_values.begin(), void_values.end(), raw) != void_values.end();
}

std::optional<LosslessRecord> lossless_record(const Metadata& metadata) {
  return record_named(kLosslessName, metadata);
}

std::optional<LosslessRecord> part_lossless_record(const Metadata& metadata) {
  return record_named(kPartLosslessName, metadata);
}

RowRange residual_rows_at(const LosslessRecord& record, std::int64_t all_tile_rows, const RowRange& tile_rows) {
  const std::int64_t members = (record.height + record.rows_per_member - 1) / record.rows_per_member;
  // Member k belongs to row k * all_tile_rows / members.
  const auto first_at = [&](std::int64_t row) {
    return std::min((row * members + all_tile_rows - 1) / all_tile_rows * record.rows_per_member, record.height);
  };
  return {first_at(tile_rows.first), first_at(tile_rows.last + 1) - 1};
}

std::string residual_name(std::int64_t first_row) {
  return fmt::format("residual/{:08}", first_row);
}

bool is_residual(const std::string& name) {
  return name.starts_with("residual/") && name != kNodesName && name != kPositionsName;
}

PositionMesh positions_from_bytes(std::int64_t width, std::int64_t height, std::span<const std::byte> bytes) {
  const std::size_t count = PositionMesh::value_count(width, height);
  if (bytes.size() != count * sizeof(double)) {
    throw Error(ErrorCode::kCorrupt, fmt::format("has {} bytes, must have {}", bytes.size(), count * sizeof(double)));
  }
  ByteReader reader(bytes);
  std::vector<double> values(count);
  for (double& value : values) value = reader.read<double>();
  return {width, height, std::move(values)};
}

SamplePredictor::SamplePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation,
                                 ReadTiles read_tiles, const SampleGrid& samples, const LosslessRecord& record,
                                 const ReadMember& read_member, const ScratchFolder& scratch)
    : width_(record.width), grid_(grid), heights_(quantisation, record.fraction_bits) {
  switch (record.prediction) {
    case SamplePrediction::kSpline:
      spline_.emplace(grid, wraps_x, quantisation, record.fraction_bits, std::move(read_tiles), samples, scratch);
      return;
    case SamplePrediction::kHex:
    case SamplePrediction::kBarycentric:
      rows_.emplace(grid, wraps_x, quantisation, std::move(read_tiles), samples,
                    record.prediction == SamplePrediction::kHex ? RestoreMethod::kHex : RestoreMethod::kBarycentric,
                    false, std::nullopt, scratch);
      return;
    case SamplePrediction::kTriangles:
      nodes_ = read_mesh<PlaceMesh>(read_member, kNodesName, record);
      break;
    case SamplePrediction::kPlaces:
      positions_ = read_mesh<PositionMesh>(read_member, kPositionsName, record);
      break;
  }
  points_.emplace(grid, quantisation, std::move(read_tiles), kTileBytes / 2, false);  // as much again is in hand
}

template <typename Mesh, typename Place>
std::vector<Place> SamplePredictor::places(const Mesh& mesh, std::int64_t first, std::int64_t rows) const {
  std::vector<Place> found(static_cast<std::size_t>(rows * width_));
  const auto width = static_cast<std::size_t>(width_);
  oneapi::tbb::parallel_for(std::int64_t{0}, rows, [&](std::int64_t row) {
    mesh.row(first + row, std::span(found).subspan(static_cast<std::size_t>(row) * width, width));
  });
  return found;
}

RowRange SamplePredictor::tile_rows_needed(std::int64_t first, std::int64_t rows) const {
  if (spline_) return spline_->tile_rows_needed(first, rows);
  ISOHF_ASSERT(nodes_.has_value());  // what is written today
  RowRange needed{grid_.tile_rows(), -1};
  std::vector<FixedPlace> places(static_cast<std::size_t>(width_));
  for (std::int64_t row = first; row < first + rows; ++row) {
    nodes_->row(row, places);
    for (const FixedPlace& place : places) {
      FixedTilePlace found{};
      if (place.x == FixedPlace::kNone || !locate(grid_, place, found)) continue;
      needed = {std::min(needed.first, found.tile.row), std::max(needed.last, found.tile.row)};
    }
  }
  return needed;
}

void SamplePredictor::read(std::int64_t first, std::int64_t rows, std::span<double> predicted) {
  if (spline_) return spline_->read(first, rows, predicted);
  if (rows_) return rows_->read(first, rows, predicted);
  if (nodes_) return points_->sample(places<PlaceMesh, FixedPlace>(*nodes_, first, rows), heights_, predicted);
  points_->sample(places<PositionMesh, WorldPoint>(*positions_, first, rows), predicted);
}

struct SourceRowReader::State {
  State(const ArchiveReader& its_archive, LosslessRecord its_record, Job its_job)
      : archive(its_archive),
        record(std::move(its_record)),
        job(std::move(its_job)),
        surface(
            archive.grid(), archive.metadata().wraps_x, archive.metadata().quantisation, tiles_of(archive),
            source_grid(archive.metadata().source), record, [&](const char* name) { return mesh_bytes(name); },
            scratch_of(archive, record, job)) {}

  /// Of the places' member, which takes eight bytes a value; nullopt where there is none.
  [[nodiscard]] std::optional<std::vector<std::byte>> mesh_bytes(const char* name) const {
    const auto found = archive.find_member(name);
    if (!found) return std::nullopt;
    if (found->bytes != 8 * PositionMesh::value_count(record.width, record.height))
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" has {} bytes, not those of so many places",
                                                   archive.path(), name, found->bytes));
    return archive.read_member(*found);
  }

  const ArchiveReader& archive;
  LosslessRecord record;
  Job job;
  SamplePredictor surface;
  std::int64_t next_row = 0;
  Sha256 hash;
};

SourceRowReader::SourceRowReader(const ArchiveReader& archive, Job job) {
  std::optional<LosslessRecord> record = lossless_record(archive.metadata());
  if (!record) {
    throw Error(ErrorCode::kInvalidArgument,
                archive.path() + ": keeps no residuals, so that the source's own samples cannot be had from it");
  }
  check_members(archive, *record);
  state_ = std::make_unique<State>(archive, std::move(*record), std::move(job));
}

SourceRowReader::~SourceRowReader() = default;

const LosslessRecord& SourceRowReader::record() const {
  return state_->record;
}

bool SourceRowReader::at_end() const {
  return state_->next_row == state_->record.height;
}

std::vector<std::byte> SourceRowReader::read_next() {
  State& state = *state_;
  const LosslessRecord& record = state.record;
  state.job.throw_if_cancelled();
  if (at_end()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: all {} rows have been read; see at_end()", state.archive.path(), record.height));
  }
  const std::int64_t rows = std::min(record.rows_per_member, record.height - state.next_row);
  const std::string name = residual_name(state.next_row);
  const auto found = state.archive.find_member(name);
  if (!found) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" is missing", state.archive.path(), name));
  }
  std::vector<double> predicted(static_cast<std::size_t>(rows * record.width));
  // Every sample in as many bytes as it has, a mask of bits, and counts.
  if (found->bytes > predicted.size() * size_bytes(record.mapping.type) + predicted.size() / 8 + 1024) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" has {} bytes, too many for {} samples",
                                                 state.archive.path(), name, found->bytes, predicted.size()));
  }
  const std::vector<std::byte> payload = state.archive.read_member(*found);
  Arena(state.job).execute([&] { state.surface.read(state.next_row, rows, predicted); });
  std::vector<std::byte> raw(predicted.size() * size_bytes(record.mapping.type));
  try {
    decode_residuals(record.mapping, record.width, payload, predicted, raw);
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: member \"{}\"", state.archive.path(), name));
  }
  state.hash.add_numbers(raw, size_bytes(record.mapping.type));
  state.next_row += rows;
  state.job.report({"rows", "rows", state.next_row, record.height});
  if (!at_end()) return raw;
  if (const std::string sum = hex(state.hash.finish()); sum != record.sha256) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: the restored samples have the SHA-256 {}, the source's is {}",
                                                 state.archive.path(), sum, record.sha256));
  }
  return raw;
}

}  // namespace isohf
