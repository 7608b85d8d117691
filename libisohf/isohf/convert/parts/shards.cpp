#include "isohf/shards.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/metadata/json_members.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/parts/parts.h"
#include "isohf/convert/run_conversion.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kPlanVersion = 1;

void plan_members(JsonMembers& json, ShardPlan& plan) {
  constexpr JsonRule kAbsent{.presence = JsonRule::kAbsent};
  Quantisation& codes = plan.quantisation;
  std::string format = "isohf-plan";
  int version = kPlanVersion;
  json.all("format", format, "version", version);
  if (format != "isohf-plan") json.refuse("format", fmt::format("is \"{}\", must be \"isohf-plan\"", format));
  if (version != kPlanVersion) {
    throw Error(ErrorCode::kUnsupported, fmt::format("is a plan of version {}, {} is read", version, kPlanVersion));
  }
  json.all("arguments", plan.arguments, "job", plan.job);
  json.object("tiles", "columns", plan.tile_columns, "rows", plan.tile_rows);
  json.object("codes", [&](JsonMembers& members) {
    members.name("type", codes.type, code_type_from_string);
    members("offset", codes.offset);
    members("scale", codes.scale, {.least = 0.0, .above_least = true});
    members.all("datum", plan.datum, "height_error", plan.height_error);
  });
  json("source_voids", plan.source_voids, kAbsent);
  // The rows that shards end before.
  std::vector<double> ends;
  for (const auto& [first, end] : plan.shards) ends.push_back(static_cast<double>(end));
  json("shard_ends", ends);
  if (!json.reads()) return;
  plan.shards.clear();
  for (const double end : ends) {
    const std::int64_t first = plan.shards.empty() ? 0 : plan.shards.back().second;
    if (!(end > static_cast<double>(first) && end <= static_cast<double>(plan.tile_rows) && end == std::floor(end)))
      json.refuse("shard_ends", "do not ascend to the rows of tiles");
    plan.shards.emplace_back(first, static_cast<std::int64_t>(end));
  }
  if (plan.shards.empty() || plan.shards.back().second != plan.tile_rows || plan.tile_columns < 1)
    json.refuse("shard_ends", "do not end with the last row of tiles");
}

/// Of all that decides the bytes.
std::string digest_of(ShardPlan plan) {
  plan.arguments.clear();
  const std::string text = format_shard_plan(plan);
  return hex(sha256(std::as_bytes(std::span<const char>(text))));
}

void refuse_what_needs_all(const ConvertOptions& options) {
  const auto refuse = [](const char* what) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{} needs all of the source at once, which shards are not; "
                                                         "leave it out, or convert without a plan",
                                                         what));
  };
  if (options.lossless) refuse("`lossless`");
  if (options.max_error) refuse("`max_error`");
  if (options.measure) refuse("measuring");
}

TileRange tiles_of_shard(const ShardPlan& plan, int number) {
  const auto [first, end] = plan.shards[static_cast<std::size_t>(number - 1)];
  return {{0, first}, {plan.tile_columns, end}};
}

/// Why an archive is none of the plan's shards; empty where it is, and which.
std::string why_foreign(const Metadata& metadata, const ShardPlan& plan, const std::string& digest, int& number) {
  const auto part = part_record(metadata);
  if (!part || !part->shard) return "is no shard of a plan";
  number = part->shard->number;
  if (part->shard->plan != digest) return "is a shard of another plan";
  if (number > static_cast<int>(plan.shards.size()) || part->tiles != tiles_of_shard(plan, number))
    return fmt::format("holds other rows of tiles than shard {}", number);
  return {};
}

/// The statistics of all shards, in order.
Statistics joined_statistics(const std::vector<const ArchiveReader*>& shards) {
  TileStatistics all;
  for (const ArchiveReader* const shard : shards) {
    const Statistics& one = shard->metadata().statistics;
    all.vertices += one.vertices;
    all.voids += one.voids;
    all.clamped += one.clamped;
    all.worst_rounding = std::max(all.worst_rounding, one.worst_rounding);
    if (one.min) all.min = std::min(all.min, *one.min);
    if (one.max) all.max = std::max(all.max, *one.max);
    const auto part = part_record(shard->metadata());
    for (const double sum : part->shard->row_sums) all.sum += sum;
  }
  return total_statistics(all);
}

}  // namespace

ShardPlan plan_shards(HeightSource& source, const ConvertOptions& options, int shards, const Job& job) {
  refuse_what_needs_all(options);
  if (shards < 1) throw Error(ErrorCode::kInvalidArgument, fmt::format("{} shards are asked for, at least 1", shards));
  const Plan plan = make_plan(source.info(), options.plan);
  const FoundCodes codes = find_codes(source, plan, options, job);
  ShardPlan found;
  found.job = job_fingerprint(source.info(), plan, options);
  found.tile_columns = plan.grid.tile_columns();
  found.tile_rows = plan.grid.tile_rows();
  found.quantisation = codes.quantisation;
  found.datum = codes.datum;
  found.height_error = codes.height_error;
  found.source_voids = codes.source_voids;
  const PlaneInfo planes = options.planes ? planes_for(plan.grid) : PlaneInfo();
  const std::int64_t stride = planes.count > 0 ? planes.stride : 1;
  const std::int64_t unit = found.tile_rows / stride >= shards ? stride : 1;
  const std::int64_t units = (found.tile_rows + unit - 1) / unit;
  const std::int64_t count = std::min<std::int64_t>(shards, units);
  for (std::int64_t k = 0; k < count; ++k) {
    found.shards.emplace_back(units * k / count * unit, std::min(units * (k + 1) / count * unit, found.tile_rows));
  }
  return found;
}

std::string format_shard_plan(const ShardPlan& plan) {
  ShardPlan copy = plan;
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  JsonMembers members(JsonMembers::Pass::kWrite, object, "");
  plan_members(members, copy);
  return text_of(object, 1) + "\n";
}

ShardPlan parse_shard_plan(const std::string& json) {
  ShardPlan plan;
  if (!json.starts_with('{')) throw Error(ErrorCode::kCorrupt, "is no plan of a conversion");
  try {
    nlohmann::ordered_json object = parse_json(json);
    JsonMembers members(JsonMembers::Pass::kRead, object, "");
    plan_members(members, plan);
  } catch (const Error& error) {
    // The table of members serves metadata.
    const std::string what = error.what();
    const std::string prefix = "metadata: ";
    throw Error(error.code(), what.starts_with(prefix) ? "plan: " + what.substr(prefix.size()) : what);
  }
  return plan;
}

ConvertSummary convert_shard(HeightSource& source, const ShardPlan& plan, int number, const std::string& output,
                             const ConvertOptions& options, const Job& job) {
  refuse_what_needs_all(options);
  const int count = static_cast<int>(plan.shards.size());
  if (number < 1 || number > count) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("there is no shard {}: the plan has 1 to {}", number, count));
  }
  const Plan whole = make_plan(source.info(), options.plan);
  const std::string found = job_fingerprint(source.info(), whole, options);
  if (found != plan.job) {
    const auto at = std::mismatch(found.begin(), found.end(), plan.job.begin(), plan.job.end());
    const auto around = [](const std::string& text, std::ptrdiff_t place) {
      const std::size_t from = text.rfind(" | ", static_cast<std::size_t>(place));
      const std::size_t first = from == std::string::npos ? 0 : from + 3;
      return text.substr(first, std::min<std::size_t>(text.find(" | ", first + 1) - first, 160));
    };
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("{}: source, options or program are not those that were planned: \"{}\", planned was \"{}\"",
                    source.info().path, around(found, at.first - found.begin()),
                    around(plan.job, at.second - plan.job.begin())));
  }
  const auto [first, end] = plan.shards[static_cast<std::size_t>(number - 1)];
  const ShardWork work{
      first, end, plan.quantisation, plan.datum, plan.height_error, {digest_of(plan), number, count, {}}};
  return run_conversion(source, whole, output, options, job, false, &work).summary;
}

bool is_shard(const std::string& archive, const ShardPlan& plan, int number) {
  Problems none;
  const auto reader = std::move(open_parts({archive}, {}, none, {}).front());
  int found = 0;
  return reader != nullptr && why_foreign(reader->metadata(), plan, digest_of(plan), found).empty() && found == number;
}

std::vector<int> missing_shards(const ShardPlan& plan, const std::vector<std::string>& files, const Job& job) {
  Problems none;
  std::vector<bool> is_there(plan.shards.size(), false);
  const std::string digest = digest_of(plan);
  for (const auto& reader : open_parts(files, {}, none, job)) {
    int number = 0;
    if (reader != nullptr && why_foreign(reader->metadata(), plan, digest, number).empty())
      is_there[static_cast<std::size_t>(number - 1)] = true;
  }
  std::vector<int> missing;
  for (std::size_t i = 0; i < is_there.size(); ++i) {
    if (!is_there[i]) missing.push_back(static_cast<int>(i) + 1);
  }
  return missing;
}

PartSummary merge_shards(const ShardPlan& plan, const std::vector<std::string>& files, const std::string& output,
                         const PartOptions& options, const Job& job) {
  Problems problems;
  const std::vector<std::unique_ptr<ArchiveReader>> readers = open_parts(files, output, problems, job);
  const std::string digest = digest_of(plan);
  std::vector<const ArchiveReader*> shards(plan.shards.size());
  for (const auto& reader : readers) {
    if (reader == nullptr) continue;
    int number = 0;
    if (const std::string why = why_foreign(reader->metadata(), plan, digest, number); !why.empty()) {
      problems.add(fmt::format("{}: {}", reader->path(), why));
      continue;
    }
    const ArchiveReader*& place = shards[static_cast<std::size_t>(number - 1)];
    if (place != nullptr) problems.add(fmt::format("{}: is shard {}, as {} is", reader->path(), number, place->path()));
    place = reader.get();
  }
  std::vector<int> missing;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    if (shards[i] == nullptr) missing.push_back(static_cast<int>(i) + 1);
  }
  if (!missing.empty())
    problems.add(fmt::format("of the plan's {} shards these are missing: {}", shards.size(), fmt::join(missing, ",")));
  problems.throw_if_any();
  PartsJob parts{{},   all_tiles(shards.front()->grid()), shards.front()->metadata(), {},
                 true, joined_statistics(shards)};
  for (std::size_t i = 0; i < shards.size(); ++i)
    parts.inputs.push_back({shards[i], tiles_of_shard(plan, static_cast<int>(i) + 1)});
  return write_parts(std::move(parts), output, options, job);
}

}  // namespace isohf
