#include "commands/convert_each.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "input/input_files.h"
#include "interrupt.h"
#include "isohf/base/output_file.h"
#include "options/describe.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// Larger files are not tried on one thread first.
constexpr std::uint64_t kLargeFileBytes = std::uint64_t{32} << 20U;

/// Whether the archive's folder takes no file any more, and will not take the next one.
bool is_folder_at_fault(const EachFile& file, const Error& error) {
  return error.code() == ErrorCode::kIo && std::string_view(error.what()).starts_with(file.output);
}

/// Inputs and archives: DIR/NAME.isohf, in the folders that --recursive found the input in. Makes these folders. Throws
/// Error if two inputs have one archive, or if archives exist and may not.
std::vector<EachFile> files_of(const ConvertCommandOptions& options) {
  std::vector<EachFile> files;
  std::map<std::string, std::string> input_of;
  std::vector<std::string> existing;
  std::set<fs::path> folders;
  std::error_code none;
  for (const InputFile& found : find_inputs(options.inputs.names, options.inputs.recursive)) {
    const fs::path output = fs::path(options.out_dir) / found.below / (bare_name(found.path) + ".isohf");
    const auto [other, is_new] = input_of.emplace(output.string(), found.path);
    if (!is_new) {
      throw Error(ErrorCode::kInvalidArgument,
                  {output.string(), fmt::format("{} and {} would both be this archive", other->second, found.path), "",
                   "leave one of them out, or name folders that contain them"});
    }
    files.push_back({found.path, output.string()});
    folders.insert(output.parent_path());
    if (fs::exists(fs::symlink_status(output, none))) existing.push_back(output.string());
  }
  if (!existing.empty() && !options.convert.overwrite && !options.convert.resume) {
    const std::size_t more = existing.size() - 1;
    throw Error(ErrorCode::kInvalidArgument,
                {existing.front(), more == 0 ? "exists" : fmt::format("exists, and {} more", more), "",
                 "--resume skips those that are complete, --overwrite replaces them"});
  }
  for (const fs::path& folder : folders) {
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure && !fs::exists(folder, none)) {
      throw Error(ErrorCode::kIo, fmt::format("cannot make the folder {}: {}", folder.string(), failure.message()));
    }
    require_writable_folder(folder.string());
  }
  return files;
}

/// Prints what became of the files, and counts it.
class Tally {
 public:
  Tally(const Common& common, const WorkOptions& work) : common_(common), display_(common, work.progress) {}

  void add(const EachFile& file, const EachResult& result) {
    const ordered_json& json = result.report.json();
    counts_[json.at("status").get<std::string>()] += 1;
    if (!result.warnings.empty() || !result.note.empty()) display_.clear();
    if (!result.note.empty() && !common_.quiet) print_note(common_, result.note);
    for (const Warning& warning : result.warnings) {
      const bool names_it = warning.find(file.input) != std::string::npos;
      print_warning(common_, names_it ? warning : warning.reworded(file.input + ": " + warning));
    }
    Report line;
    line.line(json.at("status").get<std::string>(),
              fmt::format("{}: {}", file.output, describe_bytes(json.at("archive_bytes").get<std::uint64_t>())));
    display_.clear();
    (common_.json ? result.report : line).print(common_, true);
  }

  void add(const EachFile& file, const Error& error) {
    if (error.code() == ErrorCode::kCancelled) return;
    // Files that were being converted when the disk was full have the same error.
    if (is_folder_at_fault(file, error) && std::exchange(folder_failed_, true)) return;
    Report line;
    line.add("input", file.input);
    line.add("output", file.output);
    display_.clear();
    if (error.code() == ErrorCode::kNoElevation) {
      counts_["nodata"] += 1;
      line.add("status", "nodata");
      if (!common_.quiet) print_note(common_, error.what());
    } else {
      const int code = exit_code_for(error.code());
      counts_["failed"] += 1;
      line.add("status", "failed");
      line.add("error", json_from(error, code));
      worst_ = worse_code(worst_, code);
      print_error_line(common_, error);
    }
    if (common_.json) line.print(common_, true);
  }

  void update(std::size_t done, std::size_t total) {
    display_.update("files", "files", static_cast<std::int64_t>(done), static_cast<std::int64_t>(total));
  }

  /// Returns the exit code.
  int finish(std::size_t files, double seconds, bool is_interrupted) {
    display_.clear();
    std::size_t begun = 0;
    for (const auto& [status, count] : counts_) begun += count;
    counts_["not_done"] = files - begun;
    ordered_json members = {{"files", files}};
    std::string words;
    for (const auto& [status, text] : {std::pair{"converted", "converted"},
                                       {"complete", "complete before"},
                                       {"nodata", "of nodata alone"},
                                       {"failed", "failed"},
                                       {"not_done", "not done"}}) {
      members[status] = counts_[status];
      if (counts_[status] > 0 || words.empty())
        words += fmt::format("{}{} {}", words.empty() ? "" : ", ", counts_[status], text);
    }
    members["seconds"] = seconds;
    Report report;
    report.add("summary", members, "files", fmt::format("{}: {} in {}", files, words, describe_seconds(seconds)));
    report.print(common_, true);
    if (!is_interrupted || counts_["not_done"] == 0) return worst_;
    throw Error(
        ErrorCode::kCancelled,
        {"", fmt::format("interrupted: {} of {} archives are done", counts_["converted"] + counts_["complete"], files),
         "", "the same command with --resume continues"});
  }

 private:
  const Common& common_;
  ProgressDisplay display_;
  std::map<std::string, std::size_t> counts_;  ///< by status
  int worst_ = kExitDone;
  bool folder_failed_ = false;
};

}  // namespace

int convert_each(const ConvertCommandOptions& options, const ConvertOneFile& convert_one) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<EachFile> files = files_of(options);
  const std::atomic<bool>& cancel = watch_interrupts();
  Tally tally(options.common, options.work);
  std::vector<std::optional<EachResult>> results(files.size());
  std::vector<std::optional<Error>> errors(files.size());
  const auto failed = [&](std::size_t number, const Error& error) {
    errors[number] = error;
    const bool is_stop = error.code() == ErrorCode::kCancelled || is_folder_at_fault(files[number], error) ||
                         (!options.keep_going && error.code() != ErrorCode::kNoElevation);
    return is_stop ? Batch::Outcome::kStop : Batch::Outcome::kDone;
  };
  Batch batch;
  batch.count = files.size();
  batch.is_small = [&](std::size_t number) {
    std::error_code unknown;
    const std::uintmax_t bytes = fs::file_size(files[number].input, unknown);
    return unknown || bytes <= kLargeFileBytes;
  };
  batch.run = [&](std::size_t number, const Batch::Share& share) {
    try {
      if (cancel) throw Error(ErrorCode::kCancelled, "interrupted");
      results[number] = convert_one(files[number], share);
      return results[number] ? Batch::Outcome::kDone : Batch::Outcome::kTooLarge;
    } catch (const Error& error) {
      return failed(number, error);
    } catch (const std::bad_alloc&) {
      return failed(number, Error(ErrorCode::kOutOfMemory, {files[number].input, "out of memory", "", ""}));
    }
  };
  batch.report = [&](std::size_t number) {
    errors[number] ? tally.add(files[number], *errors[number]) : tally.add(files[number], *results[number]);
    results[number].reset();
    tally.update(number + 1, files.size());
  };
  run_batch(batch, job_from(options.work));
  return tally.finish(files.size(), std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
                      cancel);
}

}  // namespace isohf::cli
