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
#include "options/command_line.h"
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

void add_mosaic_options(CLI::App& line, SourceInputs& inputs) {
  option(line, "--bbox", "W,S,E,N", "Convert only this part, in the input's coordinates",
         [&inputs](const std::string& text) { inputs.box = bounding_box_from_string(text); });
  group(line, "Joining inputs");
  choice<OverlapRule>(line, "--on-top", {{"last", OverlapRule::kLast}, {"first", OverlapRule::kFirst}},
                      "Which of overlapping inputs shows. Finer inputs always do, and nodata shows what is below "
                      "[default: last]",
                      inputs.overlap);
  line.add_flag("--recursive", inputs.recursive, "Search folders of folders too");
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

bool takes_numbers(const std::string& name) {
  constexpr std::array kThese = {"nodata", "valid-range", "fill", "z-scale", "z-offset", "sample-spacing"};
  return std::find(kThese.begin(), kThese.end(), name) != kThese.end();
}

/// Declares the options of an input in a command line of its own.
void declare_input(CLI::App& line, RecordedInput& input) {
  line.set_help_flag();
  line.option_defaults()->take_last();
  add_source_options(line, input.open);
  add_mosaic_options(line, input.inputs);
  add_geoid_option(line, input.geoid);
}

}  // namespace

RecordedOptions recorded_options(const CLI::App& line) {
  RecordedInput unused;
  CLI::App input;
  declare_input(input, unused);
  RecordedOptions recorded;
  for (const CLI::Option* declared : input.get_options()) {
    const std::string option = long_name(*declared);
    const std::string name = option.substr(2);
    // Files are found by --recursive; the same samples are the same bytes.
    if (name == "recursive" || !given(line, option)) continue;
    const std::string text = line.get_option(option)->results().back();
    if (text == "false") continue;
    // Not the file that holds the text of a system, nor the folder of a geoid.
    recorded.emplace_back(name, takes_numbers(name) ? with_plain_numbers(text)
                                : name == "crs"     ? system_from(text)
                                : name == "geoid"   ? file_name(text)
                                                    : text);
  }
  return recorded;
}

RecordedInput recorded_input(const RecordedOptions& recorded) {
  RecordedInput input;
  CLI::App line;
  declare_input(line, input);
  // Nothing that an archive records names a file but the geoid, and that without a folder.
  std::vector<std::string> words;
  for (const auto& [name, text] : recorded) {
    if (name == "crs") {
      input.open.reference_system = text;
    } else {
      words.insert(words.begin(), "--" + name + "=" + text);  // CLI11 takes the last one first
    }
  }
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorCode::kCorrupt, "isohf.json: source.options: " + why);
  };
  try {
    line.parse(words);
  } catch (const BadValue& bad) {
    refuse(bad.error.within(bad.option.substr(2)).what());
  } catch (const CLI::ExtrasError&) {
    refuse(line.remaining().front().substr(2) + ": is not an option of an input");
  } catch (const CLI::ParseError& error) {
    refuse(error.what());
  }
  if (input.geoid.path != file_name(input.geoid.path)) refuse("geoid: must be a name without a folder");
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
