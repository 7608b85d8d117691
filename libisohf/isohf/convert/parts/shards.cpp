#include "isohf/shards.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/metadata/json_members.h"
#include "isohf/archive/metadata/part_record.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/base/handed_in.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/parts/parts.h"
#include "isohf/convert/run_conversion.h"
#include "isohf/convert/stages/residual_stage.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kPlanVersion = 2;

void codes_members(JsonMembers& json, ShardPlan::Codes& codes) {
  json.name("type", codes.quantisation.type, code_type_from_string);
  json("offset", codes.quantisation.offset);
  json("scale", codes.quantisation.scale, {.least = 0.0, .above_least = true});
  json.all("datum", codes.datum, "height_error", codes.height_error, "largest", codes.largest);
}

void plan_members(JsonMembers& json, ShardPlan& plan) {
  std::string format = "isohf-plan";
  int version = kPlanVersion;
  json.all("format", format, "version", version);
  if (format != "isohf-plan") json.refuse("format", fmt::format("is \"{}\", must be \"isohf-plan\"", format));
  if (version != kPlanVersion) {
    throw Error(ErrorCode::kUnsupported, fmt::format("is a plan of version {}, {} is read", version, kPlanVersion));
  }
  json.all("arguments", plan.arguments, "job", plan.job);
  json.object("tiles", "columns", plan.tile_columns, "rows", plan.tile_rows);
  json.object("codes", plan.codes, codes_members);
  json("samples_sha256", plan.samples_sha256, {.presence = JsonRule::kAbsent});
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
  if (options.max_error) refuse("`max_error`");
  if (options.measure) refuse("measuring");
}

/// What shards must agree on, beside the plan's own members.
std::string job_of(const SourceInfo& info, const Plan& plan, const ConvertOptions& options) {
  return job_fingerprint(info, plan, options) + (options.lossless ? " | lossless" : "");
}

TileRange tiles_of_shard(const ShardPlan& plan, int number) {
  const auto [first, end] = plan.shards[static_cast<std::size_t>(number - 1)];
  return {{0, first}, {plan.tile_columns, end}};
}

/// The conversion that a plan is of. Throws Error{kInvalidArgument} where there is no such shard, or source and options
/// are no longer what was planned.
Plan planned(const HeightSource& source, const ShardPlan& plan, int number, const ConvertOptions& options) {
  refuse_what_needs_all(options);
  // Whoever hands in a plan may have put it together himself: it is held to what one from a file is.
  if (parse_shard_plan(format_shard_plan(plan)).shards != plan.shards)
    throw Error(ErrorCode::kInvalidArgument,
                "plan: its shards do not follow each other from the first row of tiles on");
  require_known("plan: its codes' type", plan.codes.quantisation.type, CodeType::kF32);
  const int count = static_cast<int>(plan.shards.size());
  if (number < 1 || number > count) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("there is no shard {}: the plan has 1 to {}", number, count));
  }
  Plan whole = plan_conversion(source.info(), options);
  const std::string found = job_of(source.info(), whole, options);
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
  if (options.lossless && !plan.samples_sha256)
    throw Error(ErrorCode::kCorrupt, "plan: samples_sha256: is missing, of a lossless conversion");
  return whole;
}

/// Reads what formatted() wrote. The table of members serves metadata, of which none is here.
template <typename T>
T parsed(const std::string& json, void (*members)(JsonMembers&, T&), const char* what) {
  if (!json.starts_with('{')) throw Error(ErrorCode::kCorrupt, fmt::format("is no {} of a conversion", what));
  T value;
  try {
    nlohmann::ordered_json object = parse_json(json);
    JsonMembers reader(JsonMembers::Pass::kRead, object, "");
    members(reader, value);
  } catch (const Error& error) {
    const std::string text = error.what();
    const std::string prefix = "metadata: ";
    throw Error(error.code(),
                text.starts_with(prefix) ? fmt::format("{}: {}", what, text.substr(prefix.size())) : text);
  }
  return value;
}

template <typename T>
std::string formatted(T value, void (*members)(JsonMembers&, T&)) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  JsonMembers writer(JsonMembers::Pass::kWrite, object, "");
  members(writer, value);
  return text_of(object, 1) + "\n";
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

/// What is kept of a shard that was looked at.
struct CheckedShard {
  std::string path;
  Statistics statistics;
  std::vector<double> row_sums;
  bool has_loose_members = false;
};

/// The statistics of all shards, in order.
Statistics joined_statistics(const std::vector<CheckedShard>& shards) {
  TileStatistics all;
  for (const CheckedShard& shard : shards) {
    const Statistics& one = shard.statistics;
    all.vertices += one.vertices;
    all.voids += one.voids;
    all.clamped += one.clamped;
    all.worst_rounding = std::max(all.worst_rounding, one.worst_rounding);
    if (one.min) all.min = std::min(all.min, *one.min);
    if (one.max) all.max = std::max(all.max, *one.max);
    for (const double sum : shard.row_sums) all.sum += sum;
  }
  return total_statistics(all);
}

/// Whether each row of the first plane is above tiles of one shard, which then has it.
bool holds_plane_rows(const ShardPlan& plan, const PlaneInfo& planes) {
  return planes.count > 0 && std::all_of(plan.shards.begin(), plan.shards.end(), [&](const auto& shard) {
           return shard.second % planes.stride == 0 || shard.second == plan.tile_rows;
         });
}

}  // namespace

ShardPlan plan_shards(HeightSource& source, const ConvertOptions& options, int shards, const Job& job) {
  refuse_what_needs_all(options);
  if (shards < 1) throw Error(ErrorCode::kInvalidArgument, fmt::format("{} shards are asked for, at least 1", shards));
  const Plan plan = plan_conversion(source.info(), options);
  ShardPlan found;
  found.job = job_of(source.info(), plan, options);
  found.tile_columns = plan.grid.tile_columns();
  found.tile_rows = plan.grid.tile_rows();
  const PlaneInfo planes = options.planes ? planes_for(plan.grid) : PlaneInfo();
  const std::int64_t stride = planes.count > 0 ? planes.stride : 1;
  const std::int64_t unit = (found.tile_rows + stride - 1) / stride >= shards ? stride : 1;
  const std::int64_t units = (found.tile_rows + unit - 1) / unit;
  const std::int64_t count = std::min<std::int64_t>(shards, units);
  for (std::int64_t k = 0; k < count; ++k) {
    found.shards.emplace_back(units * k / count * unit, std::min(units * (k + 1) / count * unit, found.tile_rows));
  }
  found.codes = find_codes(source, plan, options, job, found.warnings);
  if (options.lossless) found.samples_sha256 = hash_of_samples(source.as_stored(), job);
  return found;
}

std::string format_shard_plan(const ShardPlan& plan) {
  return formatted(plan, plan_members);
}

ShardPlan parse_shard_plan(const std::string& json) {
  return parsed(json, plan_members, "plan");
}

ConvertSummary convert_shard(HeightSource& source, const ShardPlan& plan, int number, const std::string& output,
                             const ConvertOptions& options, const Job& job) {
  const Plan whole = planned(source, plan, number, options);
  const int count = static_cast<int>(plan.shards.size());
  const auto [first, end] = plan.shards[static_cast<std::size_t>(number - 1)];
  const ShardWork work{first,
                       end,
                       plan.codes,
                       {digest_of(plan), number, count, {}},
                       plan.samples_sha256,
                       holds_plane_rows(plan, options.planes ? planes_for(whole.grid) : PlaneInfo())};
  return run_conversion(source, whole, output, options, job, false, &work).summary;
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

bool is_shard(const std::string& archive, const ShardPlan& plan, int number) {
  Problems none;
  bool is_it = false;
  check_parts({archive}, {}, none, {}, [&](std::size_t, const auto& reader) {
    int found = 0;
    is_it = why_foreign(reader->metadata(), plan, digest_of(plan), found).empty() && found == number;
  });
  return is_it;
}

std::vector<int> missing_shards(const ShardPlan& plan, const std::vector<std::string>& files, const Job& job) {
  Problems none;
  std::vector<bool> is_there(plan.shards.size(), false);
  const std::string digest = digest_of(plan);
  check_parts(files, {}, none, job, [&](std::size_t, const auto& reader) {
    int number = 0;
    if (why_foreign(reader->metadata(), plan, digest, number).empty())
      is_there[static_cast<std::size_t>(number - 1)] = true;
  });
  std::vector<int> missing;
  for (std::size_t i = 0; i < is_there.size(); ++i) {
    if (!is_there[i]) missing.push_back(static_cast<int>(i) + 1);
  }
  return missing;
}

PartSummary merge_shards(const ShardPlan& plan, const std::vector<std::string>& files, const std::string& output,
                         const PartOptions& options, const Job& job) {
  Problems problems;
  const std::string digest = digest_of(plan);
  std::vector<CheckedShard> shards(plan.shards.size());
  std::vector<int> numbers(files.size(), 0);
  std::vector<std::string> foreign(files.size());
  std::optional<Metadata> metadata;
  check_parts(files, output, problems, job, [&](std::size_t i, const auto& reader) {
    int number = 0;
    foreign[i] = why_foreign(reader->metadata(), plan, digest, number);
    if (!foreign[i].empty()) return;
    numbers[i] = number;
    const std::vector<MemberEntry>& loose = reader->loose_members();
    shards[static_cast<std::size_t>(number - 1)] = {
        files[i], reader->metadata().statistics, part_record(reader->metadata())->shard->row_sums,
        !std::all_of(loose.begin(), loose.end(), [](const auto& member) { return is_own_member(member.name); })};
    if (number == 1) metadata = reader->metadata();
  });
  std::vector<const std::string*> first(shards.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!foreign[i].empty()) problems.add(fmt::format("{}: {}", files[i], foreign[i]));
    if (numbers[i] == 0) continue;
    const std::string*& place = first[static_cast<std::size_t>(numbers[i] - 1)];
    if (place != nullptr) problems.add(fmt::format("{}: is shard {}, as {} is", files[i], numbers[i], *place));
    place = &files[i];
  }
  std::vector<int> missing;
  for (std::size_t i = 0; i < shards.size(); ++i) {
    if (first[i] == nullptr) missing.push_back(static_cast<int>(i) + 1);
  }
  if (!missing.empty())
    problems.add(fmt::format("of the plan's {} shards these are missing: {}", shards.size(), shard_list(missing)));
  problems.throw_if_any();
  PartsJob parts{{},
                 all_tiles(metadata->grid),
                 *metadata,
                 {},
                 true,
                 holds_plane_rows(plan, metadata->planes),
                 joined_statistics(shards)};
  for (std::size_t i = 0; i < shards.size(); ++i) {
    auto file = std::make_shared<PartFile>(shards[i].path);
    file->has_loose_members = shards[i].has_loose_members;
    parts.inputs.push_back({std::move(file), tiles_of_shard(plan, static_cast<int>(i) + 1)});
  }
  return write_parts(std::move(parts), output, options, job);
}

}  // namespace isohf
