#include "commands/convert_each.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <variant>

#include "formats/io/text.h"
#include "input/input_files.h"
#include "isohf/base/file.h"
#include "options/describe.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

/// What a conversion of a small file is given at least; more run side by side only where there is as much for each.
constexpr std::uint64_t kLeastShareBytes = 48'000'000;
/// Files of more bytes are not tried on one thread first.
constexpr std::uint64_t kLargeFileBytes = std::uint64_t{32} << 20U;

/// "N44E006" of a/N44E006.hgt.zip: without the extension, and that of what is packed.
std::string archive_name(const std::string& input) {
  const fs::path name = fs::path(input).filename();
  const std::string ending = lower_case(name.extension().string());
  const fs::path bare = name.stem();
  return ((ending == ".gz" || ending == ".zip") && has_raster_name(bare.string()) ? bare.stem() : bare).string();
}

/// Whether the disk takes no archive any more: nor will it take the next one.
bool is_disk_full(const EachFile& file, const Error& error) {
  const std::string what = error.what();
  return error.code() == ErrorCode::kIo && what.starts_with(file.output) &&
         std::ranges::any_of(std::array{ENOSPC, EDQUOT, EROFS},
                             [&](int code) { return what.find(reason(code)) != std::string::npos; });
}

/// Lets many in side by side, or one alone, who need not wait for more than those that are in.
class Gate {
 public:
  void enter(bool alone) {
    std::unique_lock lock(mutex_);
    waiting_ += alone ? 1 : 0;
    changed_.wait(lock, [&] { return alone ? inside_ == 0 : !closed_ && waiting_ == 0; });
    waiting_ -= alone ? 1 : 0;
    closed_ = alone;
    ++inside_;
  }
  void leave() {
    const std::lock_guard lock(mutex_);
    closed_ = false;
    --inside_;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int inside_ = 0;
  int waiting_ = 0;
  bool closed_ = false;
};

/// Hands out files, and tells of them in their order.
class Batch {
 public:
  Batch(const std::vector<EachFile>& files, bool keep_going, const WorkOptions& work, const Common& common)
      : files_(files), keep_going_(keep_going), common_(common), display_(common, work.progress), out_(common) {}

  using Outcome = std::variant<EachResult, Error, std::exception_ptr>;

  /// The next file's number; nullopt: there is none, or no more is to be begun.
  std::optional<std::size_t> next() {
    const std::lock_guard lock(mutex_);
    return stopped_ || next_ == files_.size() ? std::nullopt : std::optional(next_++);
  }

  void finished(std::size_t number, Outcome outcome) {
    const std::lock_guard lock(mutex_);
    if (const auto* error = std::get_if<Error>(&outcome); error != nullptr) {
      if (!keep_going_ && error->code() != ErrorCode::kNoElevation) stopped_ = true;
      if (error->code() == ErrorCode::kCancelled) stopped_ = interrupted_ = true;
      if (is_disk_full(files_[number], *error)) stopped_ = true;
    }
    if (std::holds_alternative<std::exception_ptr>(outcome)) {
      stopped_ = true;
      if (!fault_) fault_ = std::get<std::exception_ptr>(outcome);
    }
    waiting_.emplace(number, std::move(outcome));
    try {
      for (auto first = waiting_.begin(); !fault_ && first != waiting_.end() && first->first == told_;
           first = waiting_.erase(first), ++told_) {
        tell(files_[told_], first->second);
      }
    } catch (...) {  // standard output has gone
      stopped_ = true;
      fault_ = std::current_exception();
    }
    display_.update("files", "files", static_cast<std::int64_t>(told_), static_cast<std::int64_t>(files_.size()));
  }

  int finish() {
    if (fault_) std::rethrow_exception(fault_);
    display_.clear();
    const std::size_t begun = converted_ + complete_ + empty_ + failed_.size();
    const double seconds = std::chrono::duration<double>(Clock::now() - started_).count();
    if (common_.json) {
      out_.write(json_line({{"summary",
                             {{"files", files_.size()},
                              {"converted", converted_},
                              {"complete", complete_},
                              {"nodata", empty_},
                              {"failed", failed_.size()},
                              {"not_done", files_.size() - begun},
                              {"seconds", seconds}}}}));
    } else if (!common_.quiet) {
      const auto number = [](std::size_t count) { return describe_count(static_cast<std::int64_t>(count)); };
      std::string text = fmt::format("{} files: {} converted", number(files_.size()), number(converted_));
      const auto add = [&](std::size_t count, const char* what) {
        if (count > 0) text += fmt::format(", {} {}", number(count), what);
      };
      add(complete_, "complete before");
      add(empty_, "of nodata alone");
      add(failed_.size(), "failed");
      add(files_.size() - begun, "not done");
      out_.write(text + " in " + describe_seconds(seconds) + "\n");
    }
    out_.finish();
    if (interrupted_) {
      throw Error(ErrorCode::kCancelled,
                  {"", fmt::format("interrupted: {} of {} archives are done", begun - failed_.size(), files_.size()),
                   "", "the same command with --resume goes on"});
    }
    if (failed_.empty()) return kExitDone;
    return keep_going_ ? static_cast<int>(kExitFailed) : exit_code_for(failed_.front().code());
  }

 private:
  void tell(const EachFile& file, const Outcome& outcome) {
    ordered_json document = {{"input", file.input}, {"output", file.output}};
    if (const auto* result = std::get_if<EachResult>(&outcome); result != nullptr) {
      (result->is_converted ? converted_ : complete_) += 1;
      if (!result->warnings.empty() || !result->note.empty()) display_.clear();
      if (!result->note.empty() && !common_.quiet) print_note(common_, result->note);
      for (const Warning& warning : result->warnings) {
        const bool names_it = warning.find(file.input) != std::string::npos;
        print_warning(common_, names_it ? warning : warning.reworded(file.input + ": " + warning));
      }
      document.update(ordered_json::parse(result->document));
    } else if (const Error& error = std::get<Error>(outcome); error.code() == ErrorCode::kNoElevation) {
      ++empty_;
      display_.clear();
      if (!common_.quiet) print_note(common_, error.what());
      document["status"] = "nodata";
    } else {
      if (error.code() == ErrorCode::kCancelled) return;
      // Those that were being made beside the first one that found no room are told of by its line.
      const bool is_full = is_disk_full(file, error);
      if (is_full && disk_full_) return;
      disk_full_ = disk_full_ || is_full;
      display_.clear();
      failed_.push_back(error);
      print_error_line(common_, error);
      document["status"] = "failed";
      document["error"] = json_from(error, exit_code_for(error.code()));
    }
    if (!common_.json) return;
    out_.write(json_line(document));
    out_.flush();
  }

  const std::vector<EachFile>& files_;
  bool keep_going_;
  const Common& common_;
  ProgressDisplay display_;
  StandardOutput out_;
  const Clock::time_point started_ = Clock::now();
  std::mutex mutex_;
  std::size_t next_ = 0;
  std::size_t told_ = 0;
  std::map<std::size_t, Outcome> waiting_;  ///< for those before them
  std::size_t converted_ = 0;
  std::size_t complete_ = 0;
  std::size_t empty_ = 0;  ///< of nodata alone
  std::vector<Error> failed_;
  bool stopped_ = false;
  bool interrupted_ = false;
  bool disk_full_ = false;  ///< and told
  std::exception_ptr fault_;
};

}  // namespace

std::vector<EachFile> files_of_each(const std::vector<std::string>& inputs, bool recursive, const std::string& folder) {
  std::vector<EachFile> files;
  std::map<std::string, std::string> input_of;
  for (const InputFile& found : expand_input_files(inputs, recursive)) {
    const std::string output = (fs::path(folder) / found.below / (archive_name(found.path) + ".isohf")).string();
    const auto [other, is_new] = input_of.emplace(output, found.path);
    if (!is_new) {
      throw Error(ErrorCode::kInvalidArgument,
                  {output, fmt::format("{} and {} would both be this archive", other->second, found.path), "",
                   "leave one of them out, or name folders of their own"});
    }
    files.push_back({found.path, output});
  }
  return files;
}

int convert_each(const std::vector<EachFile>& files, bool keep_going, const WorkOptions& work, const Common& common,
                 const ConvertOneFile& convert_one, const std::atomic<bool>& cancel) {
  const Job whole = job_from(work);
  const auto threads = work.threads > 0 ? static_cast<std::size_t>(work.threads)
                                        : std::max<std::size_t>(1, std::thread::hardware_concurrency());
  std::size_t workers = std::min(threads, files.size());
  if (const std::uint64_t bound = whole.bound_bytes(); bound != 0)
    workers = std::clamp<std::size_t>(bound / kLeastShareBytes, 1, workers);
  const EachShare part{1, whole.memory_bytes / workers, whole.machine_bytes / workers, false};
  const EachShare all{static_cast<int>(threads), whole.memory_bytes, whole.machine_bytes, true};

  Gate gate;
  Batch batch(files, keep_going, work, common);
  const auto convert_in = [&](const EachFile& file, const EachShare& share) {
    gate.enter(share.alone);
    struct Leave {
      Gate& gate;
      ~Leave() { gate.leave(); }
    } const leave{gate};
    if (cancel) throw Error(ErrorCode::kCancelled, "interrupted");
    return convert_one(file, share);
  };
  const auto run = [&] {
    while (const std::optional<std::size_t> number = batch.next()) {
      const EachFile& file = files[*number];
      try {
        std::error_code unknown;
        const std::uintmax_t bytes = fs::file_size(file.input, unknown);
        std::optional<EachResult> result;
        if (unknown || bytes <= kLargeFileBytes) result = convert_in(file, part);
        if (!result) result = convert_in(file, all);
        batch.finished(*number, std::move(*result));
      } catch (const Error& error) {
        batch.finished(*number, error);
      } catch (const std::bad_alloc&) {
        batch.finished(*number, Error(ErrorCode::kOutOfMemory, {file.input, "out of memory", "", ""}));
      } catch (...) {
        batch.finished(*number, std::current_exception());
      }
    }
  };
  std::vector<std::thread> others;
  try {
    others.reserve(workers);
    for (std::size_t i = 1; i < workers; ++i) others.emplace_back(run);
  } catch (const std::system_error&) {
    // No more threads to be had: those that there are do it all.
  }
  run();
  for (std::thread& other : others) other.join();
  return batch.finish();
}

}  // namespace isohf::cli
