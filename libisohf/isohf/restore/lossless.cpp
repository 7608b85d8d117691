#include "isohf/restore/lossless.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "isohf/archive/container/content_hash.h"
#include "isohf/base/arena.h"
#include "isohf/base/assert.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"

namespace isohf {
namespace {

using Json = nlohmann::ordered_json;

const char* name_of(SamplePrediction prediction) {
  return prediction == SamplePrediction::kSpline ? "spline" : "triangles";
}

SamplePrediction prediction_from(const std::string& name) {
  for (const SamplePrediction prediction : {SamplePrediction::kSpline, SamplePrediction::kTriangles}) {
    if (name == name_of(prediction)) return prediction;
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("the prediction \"{}\" is not known to this build", name));
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
  const bool fits = record.width == metadata.source.width && record.height == metadata.source.height &&
                    record.width >= 1 && record.height >= 1 && record.rows_per_member >= 1 &&
                    record.rows_per_member <= (std::int64_t{1} << 26U) / record.width + 16 &&
                    std::isfinite(record.mapping.z_offset) && std::isfinite(record.mapping.z_scale) &&
                    record.mapping.z_scale != 0.0 &&
                    FixedHeights::are_valid(metadata.quantisation, record.fraction_bits);
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

PlaceMesh read_nodes(const SamplePredictor::ReadNodes& read, const LosslessRecord& record) {
  const auto bytes = read();
  const std::string where = fmt::format("member \"{}\"", kNodesName);
  if (!bytes) throw Error(ErrorCode::kCorrupt, where + " is missing");
  try {
    return {record.width, record.height, *bytes};
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
    record.fraction_bits = json.at("fraction_bits").get<int>();
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
  return name.starts_with("residual/") && name != kNodesName;
}

SamplePredictor::SamplePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation,
                                 ReadTile read_tile, const SampleGrid& samples, const LosslessRecord& record,
                                 const ReadNodes& read, const ScratchFolder& scratch)
    : width_(record.width), grid_(grid), heights_(quantisation, record.fraction_bits) {
  if (record.prediction == SamplePrediction::kSpline) {
    spline_.emplace(grid, wraps_x, quantisation, record.fraction_bits, std::move(read_tile), samples, scratch);
    return;
  }
  nodes_ = read_nodes(read, record);
  points_.emplace(grid, quantisation, std::move(read_tile), kTileBytes / 2);  // as much again is in hand
}

std::vector<FixedPlace> SamplePredictor::places(std::int64_t first, std::int64_t rows) const {
  std::vector<FixedPlace> found(static_cast<std::size_t>(rows * width_));
  const auto width = static_cast<std::size_t>(width_);
  oneapi::tbb::parallel_for(std::int64_t{0}, rows, [&](std::int64_t row) {
    nodes_->row(first + row, std::span(found).subspan(static_cast<std::size_t>(row) * width, width));
  });
  return found;
}

RowRange SamplePredictor::tile_rows_needed(std::int64_t first, std::int64_t rows) const {
  if (spline_) return spline_->tile_rows_needed(first, rows);
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
  points_->sample(places(first, rows), heights_, predicted);
}

struct SourceRowReader::State {
  State(const ArchiveReader& its_archive, LosslessRecord its_record, Job its_job)
      : archive(its_archive),
        record(std::move(its_record)),
        job(std::move(its_job)),
        surface(
            archive.grid(), archive.metadata().wraps_x, archive.metadata().quantisation, tiles_of(archive),
            source_grid(archive.metadata().source), record, [&] { return node_bytes(); },
            scratch_of(archive, record, job)) {}

  /// Of the nodes' member, which takes eight bytes a value; nullopt where there is none.
  [[nodiscard]] std::optional<std::vector<std::byte>> node_bytes() const {
    const auto found = archive.find_member(kNodesName);
    if (!found) return std::nullopt;
    if (found->bytes != 8 * PlaceMesh::value_count(record.width, record.height))
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" has {} bytes, not those of so many places",
                                                   archive.path(), kNodesName, found->bytes));
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
  state.hash.add(raw);
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
