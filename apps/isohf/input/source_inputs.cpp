#include "input/source_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>

#include "input/options_ground.h"
#include "input/options_source.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "options/option_values.h"
#include "work_arena.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kFilesNamed = 8;

std::string sha256_of(const std::string& text) {
  Sha256 hash;
  hash.add(std::as_bytes(std::span(text)));
  return hex(hash.finish());
}

std::string file_name(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

const char* to_string(OverlapRule rule) {
  return rule == OverlapRule::kLast ? "last" : "first";
}

/// The record does not depend on the order in which the files were named: finest first, by their places.
MosaicRecord record_of(const MosaicPlan& plan, OverlapRule rule) {
  MosaicRecord record;
  record.overlap = to_string(rule);
  std::string names;
  for (auto layer = plan.layers.rbegin(); layer != plan.layers.rend(); ++layer) {
    for (const MosaicMember& member : layer->members) {
      ++record.files;
      const std::string name = file_name(member.path);
      names += name + "\n";
      if (record.first_names.size() < kFilesNamed) record.first_names.push_back(name);
    }
  }
  record.names_sha256 = sha256_of(names);
  return record;
}

/// Two mosaics with the same fingerprint are made of the same files, named in the same order.
std::string fingerprint_of(const MosaicPlan& plan, OverlapRule rule) {
  std::vector<const MosaicMember*> members;
  for (const MosaicLayer& layer : plan.layers) {
    for (const MosaicMember& member : layer.members) members.push_back(&member);
  }
  std::sort(members.begin(), members.end(),
            [](const MosaicMember* a, const MosaicMember* b) { return a->order < b->order; });
  std::string text;
  for (const MosaicMember* member : members) {
    text += fmt::format("{} {} at {} {}\n", file_name(member->path), member->stamp.text(), member->column, member->row);
  }
  return fmt::format("mosaic {} {} files {}", to_string(rule), members.size(), sha256_of(text));
}

void take_box(const SourceInputs& inputs, OpenedInputs& opened) {
  if (!inputs.box) return;
  const BoundingBox& box = *inputs.box;
  opened.source = crop(std::move(opened.source), box);
  if (!opened.note.fingerprint.empty()) opened.note.fingerprint += " ";
  opened.note.fingerprint += fmt::format("bbox {} {} {} {}", box.west, box.south, box.east, box.north);
}

}  // namespace

void add_mosaic_options(CommandLine& line, SourceInputs& inputs) {
  line.option("--bbox", "W,S,E,N",
              "Only the part between these coordinates of the input's reference system, whole samples",
              [&](const std::string& text) { inputs.box = bounding_box_from_string(text); });
  line.group("Several inputs");
  line.option(
      "--overlap", "RULE",
      "Where inputs of one resolution overlap, the last (default) or the first named shows; finer ones always lie "
      "over coarser ones, and voids show what lies below",
      [&](const std::string& text) {
        inputs.overlap = parse_word(text, {"last", "first"}) == 0 ? OverlapRule::kLast : OverlapRule::kFirst;
      });
  line.flag("--recursive", "Look into the folders of a folder as well", inputs.recursive);
}

namespace {

/// ".05" and "0.050" are one number, and so are they in a list or a range: the same values, the same bytes.
std::string with_plain_numbers(const std::string& text) {
  std::string plain;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find_first_of(",:", from), text.size());
    const std::string word = text.substr(from, to - from);
    try {
      plain += fmt::format("{}", parse_number(word));
    } catch (const Error&) {  // "nan", or with a unit
      plain += word;
    }
    if (to < text.size()) plain += text[to];
    from = to + 1;
  }
  return plain;
}

bool takes_numbers(const std::string& option) {
  constexpr std::array kThese = {"--nodata",  "--valid-range", "--fill-distance",
                                 "--z-scale", "--z-offset",    "--sample-spacing"};
  return std::find(kThese.begin(), kThese.end(), option) != kThese.end();
}

}  // namespace

RecordedOptions recorded_options(const CommandLine& line) {
  RecordedOptions recorded;
  for (auto& [name, text] : line.texts_in({"Input", "Several inputs"})) {
    // Not what files are found by: the same samples, the same bytes. Nor a file that holds the text of a system.
    if (name != "--recursive") {
      recorded.emplace_back(name.substr(2), takes_numbers(name) ? with_plain_numbers(text)
                                            : name == "--crs"   ? system_from(text)
                                                                : text);
    }
  }
  for (auto& [name, text] : line.texts_in({"Ground"})) {
    if (name == "--geoid") recorded.emplace_back("geoid", file_name(text));
  }
  return recorded;
}

RecordedInput recorded_input(const RecordedOptions& recorded) {
  RecordedInput input;
  CommandLine line("the input's options", "");
  add_source_options(line, input.open);
  add_mosaic_options(line, input.inputs);
  add_geoid_option(line, input.geoid);
  // Nothing that an archive records names a file but the geoid, and that without a folder.
  RecordedOptions texts;
  for (const auto& [name, text] : recorded) {
    if (name == "crs") {
      input.open.reference_system = text;
    } else {
      texts.emplace_back(name, text);
    }
  }
  try {
    line.parse_recorded(texts);
    if (input.geoid.path != file_name(input.geoid.path)) {
      throw Error(ErrorCode::kInvalidArgument, {"geoid", "'" + input.geoid.path + "'", "a name without a folder", ""});
    }
  } catch (const Error& error) {
    throw Error(ErrorCode::kCorrupt, error.within("isohf.json: source.options").what());
  }
  return input;
}

OpenedInputs open_inputs(std::vector<std::string> files, const SourceInputs& inputs, const OpenOptions& options,
                         const WorkOptions& work) {
  OpenedInputs opened;
  const Job job = job_from(work);
  opened.note.options = inputs.as_given;
  if (files.size() == 1) {
    opened.source = with_voids_treated(open_raster(files.front(), options), options.voids, job);
    opened.files = std::move(files);
    take_box(inputs, opened);
    return opened;
  }
  const std::string name = fmt::format("mosaic of {} files", files.size());
  WorkArena arena(job.threads);
  MosaicPlan plan = arena.execute([&] { return plan_mosaic(files, options, inputs.box, inputs.onto); });
  opened.is_reprojected = plan.is_reprojected;
  opened.note.name = name;
  opened.note.mosaic = record_of(plan, inputs.overlap);
  opened.note.fingerprint = fingerprint_of(plan, inputs.overlap);
  // Voids are filled across the files' borders.
  opened.source = with_voids_treated(std::make_unique<MosaicSource>(name, std::move(plan), options, inputs.overlap),
                                     options.voids, job);
  opened.files = std::move(files);
  take_box(inputs, opened);
  return opened;
}

}  // namespace isohf::cli
