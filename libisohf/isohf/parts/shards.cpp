#include "isohf/shards.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/base/arena.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/run_conversion.h"
#include "isohf/error.h"
#include "isohf/parts/assembly.h"
#include "isohf/parts/parts.h"
#include "isohf/parts/problems.h"

namespace isohf {
namespace {

/// The rows of tiles of all shards of a conversion, about equally many. They end with rows of the first coarse plane if
/// there are enough of these. Fewer than `count` if there are not so many rows.
std::vector<std::pair<std::int64_t, std::int64_t>> rows_of_shards(std::int64_t tile_rows, const PlaneInfo& planes,
                                                                  int count) {
  const std::int64_t stride = planes.count > 0 ? planes.stride : 1;
  const std::int64_t unit = (tile_rows + stride - 1) / stride >= count ? stride : 1;
  const std::int64_t units = (tile_rows + unit - 1) / unit;
  const std::int64_t shards = std::min<std::int64_t>(count, units);
  std::vector<std::pair<std::int64_t, std::int64_t>> rows;
  for (std::int64_t k = 0; k < shards; ++k)
    rows.emplace_back(units * k / shards * unit, std::min(units * (k + 1) / shards * unit, tile_rows));
  return rows;
}

/// Whether each row of the first plane is above tiles of one shard, which then has it.
bool holds_plane_rows(std::int64_t tile_rows, const PlaneInfo& planes,
                      const std::vector<std::pair<std::int64_t, std::int64_t>>& shards) {
  return planes.count > 0 && std::ranges::all_of(shards, [&](const auto& shard) {
           return shard.second % planes.stride == 0 || shard.second == tile_rows;
         });
}

/// SHA-256 of all that decides the bytes.
std::string job_of(const SourceInfo& info, const Plan& plan, const ConvertOptions& options) {
  const std::string job = job_fingerprint(info, plan, options) + (options.lossless ? " | lossless" : "");
  return hex(sha256(std::as_bytes(std::span<const char>(job))));
}

/// Throws Error{kInvalidArgument} if no shard can know what it needs.
void check_shard(const ConvertOptions& options, const ShardNumber& shard, std::size_t shards) {
  const auto refuse = [](const std::string& why) { throw Error(ErrorCode::kInvalidArgument, why); };
  if (options.max_error) refuse("`max_error` needs all of the source at once; leave it out for a shard");
  if (shard.number < 1 || shard.number > shard.count)
    refuse(fmt::format("there is no shard {} of {}", shard.number, shard.count));
  if (shards < static_cast<std::size_t>(shard.count))
    refuse(fmt::format("{} shards are too many: the rows of tiles make {} at most", shard.count, shards));
}

ShardWork work_of(const SourceInfo& info, const Plan& plan, const ConvertOptions& options, const ShardNumber& shard) {
  const PlaneInfo planes = options.planes ? planes_for(plan.grid) : PlaneInfo();
  const auto rows = rows_of_shards(plan.grid.tile_rows(), planes, shard.count);
  check_shard(options, shard, rows.size());
  const auto [first, end] = rows[static_cast<std::size_t>(shard.number - 1)];
  return {{job_of(info, plan, options), shard.number, shard.count, first, end, {}},
          holds_plane_rows(plan.grid.tile_rows(), planes, rows)};
}

/// Compares an archive's bytes with the CRC that it states.
void check_data(const ArchiveReader& archive) {
  for (const auto& [name, stated] : archive.metadata().extensions) {
    if (name != kDataCrcName) continue;
    if (const std::string found = fmt::format("\"{:08x}\"", data_crc32(archive.source(), archive.path()));
        found != stated) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: its members' data have the CRC-32 {}, {} is stated", archive.path(), found, stated));
    }
  }
}

/// A shard that is whole.
struct CheckedShard {
  std::string path;
  ShardRecord record;
  Statistics statistics;
};

/// Opens and checks files that should be shards of one conversion, all of their bytes. Those that are, by number; what
/// is wrong with the others goes to `problems`. `metadata` becomes that of one of them. Stage "check".
std::vector<std::optional<CheckedShard>> check_shards(const std::vector<std::string>& files, Problems& problems,
                                                      std::optional<Metadata>& metadata, const Job& job) {
  std::vector<std::optional<Error>> failed(files.size());
  std::vector<std::optional<CheckedShard>> checked(files.size());
  std::int64_t done = 0;
  std::mutex mutex;
  Arena(job).execute([&] {
    oneapi::tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
      if (job.cancel != nullptr && job.cancel->load()) return;
      try {
        const ArchiveReader reader(files[i], ArchiveReader::Shards::kRead);
        auto record = shard_record(reader.metadata());
        if (!record) throw Error(ErrorCode::kInvalidArgument, files[i] + ": is an archive, not a shard");
        require_copyable(reader);
        check_data(reader);
        const std::lock_guard lock(mutex);
        if (!metadata) metadata = reader.metadata();
        checked[i] = {files[i], std::move(*record), reader.metadata().statistics};
      } catch (const Error& error) {
        failed[i] = error;
      }
      const std::lock_guard lock(mutex);
      job.report({"check", "archives", ++done, static_cast<std::int64_t>(files.size())});
    });
  });
  job.throw_if_cancelled();
  std::vector<std::optional<CheckedShard>> shards;
  const CheckedShard* first = nullptr;
  bool has_strangers = std::ranges::none_of(checked, [](const auto& shard) { return shard.has_value(); });
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (failed[i]) problems.add(*failed[i]);
    if (!checked[i]) continue;
    const ShardRecord& record = checked[i]->record;
    if (first == nullptr) {
      first = &*checked[i];
      shards.resize(static_cast<std::size_t>(record.count));
    }
    if (record.job != first->record.job) {
      problems.add(fmt::format("{}: is a shard of another conversion than {}", files[i], first->path));
      has_strangers = true;
      continue;
    }
    if (record.count != first->record.count) {
      problems.add(fmt::format("{}: is shard {} of {}, {} is one of {}", files[i], record.number, record.count,
                               first->path, first->record.count));
      continue;
    }
    std::optional<CheckedShard>& place = shards[static_cast<std::size_t>(record.number - 1)];
    if (place) problems.add(fmt::format("{}: is shard {}, as {} is", files[i], record.number, place->path));
    if (!place) place = checked[i];
  }
  if (has_strangers)
    problems.set_remedy("merge joins the shards of one conversion; convert the rasters together instead");
  return shards;
}

std::vector<int> missing_in(const std::vector<std::optional<CheckedShard>>& shards) {
  std::vector<int> missing;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    if (!shards[i]) missing.push_back(static_cast<int>(i) + 1);
  }
  return missing;
}

/// The statistics of all shards, in order.
Statistics joined_statistics(const std::vector<std::optional<CheckedShard>>& shards) {
  TileStatistics all;
  for (const auto& shard : shards) {
    const Statistics& one = shard->statistics;
    all.vertices += one.vertices;
    all.voids += one.voids;
    all.clamped += one.clamped;
    all.worst_rounding = std::max(all.worst_rounding, one.worst_rounding);
    if (one.min) all.min = std::min(all.min, *one.min);
    if (one.max) all.max = std::max(all.max, *one.max);
    for (const double sum : shard->record.row_sums) all.sum += sum;
  }
  return total_statistics(all);
}

}  // namespace

ShardNumber shard_number_from_string(const std::string& text) {
  ShardNumber shard;
  const char* const end = text.data() + text.size();
  const auto [slash, error] = std::from_chars(text.data(), end, shard.number);
  const bool is_pair = error == std::errc() && slash != end && *slash == '/';
  const auto [rest, count_error] = std::from_chars(is_pair ? slash + 1 : end, end, shard.count);
  if (!is_pair || count_error != std::errc() || rest != end || shard.number < 1 || shard.count > kMostShards) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("found '{}', must be K/N, as in 3/16", text));
  }
  return shard;
}

std::optional<ShardRange> shard_range(HeightSource& source, const ShardNumber& shard, const ConvertOptions& options,
                                      const Job& job) {
  (void)work_of(source.info(), plan_conversion(source.info(), options), options, shard);
  if (options.code_type == CodeType::kF32) return std::nullopt;
  return find_shard_range(source, options, job);
}

ConvertSummary convert_shard(HeightSource& source, const ShardNumber& shard, const std::string& output,
                             const ConvertOptions& options, const Job& job) {
  const Plan plan = plan_conversion(source.info(), options);
  const ShardWork work = work_of(source.info(), plan, options, shard);
  if (!options.z_range && options.code_type != CodeType::kF32) {
    throw Error(ErrorCode::kInvalidArgument,
                "a shard needs `z_range`, or `code_type` f32, as it does not see all elevations");
  }
  return run_conversion(source, plan, output, options, job, false, &work).summary;
}

bool is_shard(const std::string& file, const HeightSource& source, const ShardNumber& shard,
              const ConvertOptions& options) {
  const Plan plan = plan_conversion(source.info(), options);
  const ShardRecord wanted = work_of(source.info(), plan, options, shard).record;
  Problems problems;
  std::optional<Metadata> metadata;
  const auto found = check_shards({file}, problems, metadata, {});
  return found.size() == static_cast<std::size_t>(wanted.count) &&
         found[static_cast<std::size_t>(wanted.number - 1)].has_value() &&
         found[static_cast<std::size_t>(wanted.number - 1)]->record.job == wanted.job;
}

std::string shard_list(const std::vector<int>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", numbers[i]);
    if (last > i) text += fmt::format("-{}", numbers[last]);
    i = last + 1;
  }
  return text;
}

MissingShards missing_shards(const std::vector<std::string>& files, const Job& job) {
  Problems problems;
  std::optional<Metadata> metadata;
  const auto shards = check_shards(files, problems, metadata, job);
  if (shards.empty()) problems.throw_if_any();
  return {missing_in(shards), static_cast<int>(shards.size())};
}

PartSummary merge_shards(const std::vector<std::string>& files, const std::string& output, const PartOptions& options,
                         const Job& job) {
  if (files.empty()) throw Error(ErrorCode::kInvalidArgument, "there is no shard to merge");
  Problems problems;
  for (const std::string& file : files) {
    std::error_code none;
    if (std::filesystem::equivalent(file, output, none)) problems.add(output + ": is the output and one of the shards");
  }
  std::optional<Metadata> metadata;
  const auto shards = check_shards(files, problems, metadata, job);
  if (const std::vector<int> missing = missing_in(shards); !missing.empty())
    problems.add(fmt::format("of {} shards these are missing: {}", shards.size(), shard_list(missing)));
  problems.throw_if_any();
  drop_extension(*metadata, kShardName);
  metadata->statistics = joined_statistics(shards);
  std::vector<AssemblyInput> inputs;
  std::vector<std::pair<std::int64_t, std::int64_t>> rows;
  for (const auto& shard : shards) {
    const ShardRecord& record = shard->record;
    if (record.first_row != (rows.empty() ? 0 : rows.back().second))
      throw Error(ErrorCode::kCorrupt, shard->path + ": has other rows of tiles than follow the shard before");
    rows.emplace_back(record.first_row, record.end_row);
    inputs.push_back({std::make_unique<PartFile>(shard->path), record.first_row, record.end_row});
  }
  const TileGrid grid = metadata->grid;
  if (rows.back().second != grid.tile_rows())
    throw Error(ErrorCode::kCorrupt, shards.back()->path + ": does not end with the last row of tiles");
  ArchiveWriter writer(output, grid, options_while_copying(*metadata, options));
  Arena(job).execute([&] {
    const std::unique_ptr<PlaneStage> planes = planes_while_copying(*metadata, writer, output);
    Assembly assembly(*metadata, writer, std::move(inputs), planes.get(),
                      holds_plane_rows(grid.tile_rows(), metadata->planes, rows), job);
    assembly.add_tiles();
    if (auto record = lossless_record(*metadata)) {
      record->residual_bytes = assembly.add_residuals(*record);
      set_extension(*metadata, kLosslessName, format_lossless(*record));
    }
  });
  PartSummary summary;
  finish_copy(writer, *metadata, summary);
  return summary;
}

}  // namespace isohf
