#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/metadata/part_record.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/base/arena.h"
#include "isohf/convert/parts/parts.h"
#include "isohf/convert/parts/problems.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Rectangles of `all` that none of `parts` covers.
std::vector<TileRange> gaps_in(const TileRange& all, const std::vector<AssemblyInput>& parts) {
  std::set<std::int64_t> cuts = {all.first.row, all.end.row};
  for (const AssemblyInput& part : parts) cuts.insert({part.tiles.first.row, part.tiles.end.row});
  std::vector<TileRange> gaps;
  for (auto cut = cuts.begin(); std::next(cut) != cuts.end(); ++cut) {
    std::vector<std::pair<std::int64_t, std::int64_t>> covered;
    for (const AssemblyInput& part : parts) {
      if (*cut >= part.tiles.first.row && *cut < part.tiles.end.row)
        covered.emplace_back(part.tiles.first.column, part.tiles.end.column);
    }
    std::sort(covered.begin(), covered.end());
    covered.emplace_back(all.end.column, all.end.column);
    std::int64_t column = all.first.column;
    for (const auto& [first, end] : covered) {
      if (first > column) gaps.push_back({{column, *cut}, {first, *std::next(cut)}});
      column = std::max(column, end);
    }
  }
  return gaps;
}

/// What lies beside the tiles of one archive and cannot be joined to the other's; empty where all can.
std::string why_other_extras(const Metadata& one, const Metadata& other) {
  const auto seeds = [](const Metadata& metadata) {
    auto info = shadow_seed_info(metadata);
    if (info) info->members = 0, info->bytes = 0;
    return info ? format_shadow_seed_info(*info) : std::string();
  };
  const auto textures = [](const Metadata& metadata) {
    const auto info = texture_info(metadata);
    return info ? fmt::format("{} {} {} {}", static_cast<int>(info->format), info->channels, info->size, info->levels)
                : std::string();
  };
  if (seeds(one) != seeds(other)) return "shadow seeds";
  if (textures(one) != textures(other)) return "textures";
  return {};
}

/// An archive's bytes against the CRC that it states.
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

}  // namespace

void check_parts(const std::vector<std::string>& archives, const std::string& output, Problems& problems,
                 const Job& job, const std::function<void(std::size_t, std::unique_ptr<ArchiveReader>)>& take) {
  std::vector<std::optional<Error>> failed(archives.size());
  std::int64_t checked = 0;
  std::mutex mutex;
  Arena(job).execute([&] {
    oneapi::tbb::parallel_for(std::size_t{0}, archives.size(), [&](std::size_t i) {
      if (job.cancel != nullptr && job.cancel->load()) return;
      try {
        auto reader = std::make_unique<ArchiveReader>(archives[i]);
        require_copyable(*reader);
        (void)tiles_here(*reader);
        check_data(*reader);
        const std::lock_guard lock(mutex);
        take(i, std::move(reader));
      } catch (const Error& error) {
        failed[i] = error;
      }
      const std::lock_guard lock(mutex);
      job.report({"check", "archives", ++checked, static_cast<std::int64_t>(archives.size())});
    });
  });
  job.throw_if_cancelled();
  for (std::size_t i = 0; i < archives.size(); ++i) {
    std::error_code none;
    if (failed[i]) problems.add(*failed[i]);
    if (std::filesystem::equivalent(archives[i], output, none))
      problems.add(output + ": is the output and one of the archives to join");
  }
}

PartSummary merge_archives(const std::vector<std::string>& archives, const std::string& output,
                           const PartOptions& options, const Job& job) {
  if (archives.empty()) throw Error(ErrorCode::kInvalidArgument, "there is no archive to join");
  Problems problems;
  std::vector<std::shared_ptr<const ArchiveReader>> readers(archives.size());
  check_parts(archives, output, problems, job, [&](std::size_t i, auto reader) { readers[i] = std::move(reader); });
  problems.throw_if_any();

  std::vector<AssemblyInput> inputs;
  std::vector<PartOrigin> origins;
  for (const auto& reader : readers) {
    const std::string why = why_other_lattice(readers.front()->metadata(), reader->metadata());
    if (!why.empty()) {
      problems.add(fmt::format("{}: {} as {} has", reader->path(), why, readers.front()->path()));
    }
    if (const std::string other = why_other_extras(readers.front()->metadata(), reader->metadata()); !other.empty()) {
      problems.add(fmt::format("{}: has other {} than {}", reader->path(), other, readers.front()->path()));
    }
    inputs.push_back({std::make_shared<PartFile>(reader), tiles_here(*reader)});
    origins.push_back(origin_of(*reader));
    if (origins.back().is_shard) {
      problems.add(reader->path() + ": is a shard; name its plan first, isohf merge PLAN PART...");
    }
  }
  problems.throw_if_any();
  TileRange all = inputs.front().tiles;
  for (const AssemblyInput& input : inputs) all = around(all, input.tiles);
  for (const TileRange& gap : gaps_in(all, inputs)) {
    problems.add(fmt::format("tiles of {} are in none of the archives, which together reach over {}", text_of(gap),
                             text_of(all)));
  }
  problems.throw_if_any();
  const PartOrigin& first = origins.front();
  const bool one_origin = std::all_of(origins.begin(), origins.end(), [&](const PartOrigin& origin) {
    return origin.id == first.id && origin.whole_json == first.whole_json;
  });
  Metadata metadata = readers.front()->metadata();
  for (const auto& reader : readers) {
    Statistics& most = metadata.statistics;
    const Statistics& statistics = reader->metadata().statistics;
    most.worst_rounding = std::max(most.worst_rounding, statistics.worst_rounding);
    most.clamped = std::max(most.clamped, statistics.clamped);
  }
  return write_parts({std::move(inputs), all, std::move(metadata), one_origin ? origins.front().whole_json : "",
                      one_origin, false, std::nullopt},
                     output, options, job);
}

}  // namespace isohf
