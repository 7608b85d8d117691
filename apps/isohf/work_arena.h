#pragma once

#include <optional>
#include <type_traits>
#include <utility>

#include "isohf/base/arena.h"

namespace isohf::cli {

/// An Arena of -j's threads, for work with a result; 0 threads are one a core.
class WorkArena {
 public:
  explicit WorkArena(int threads) : arena_(Job{.threads = threads}) {}

  template <typename Work>
  auto execute(Work work) {
    if constexpr (std::is_void_v<decltype(work())>) {
      arena_.execute(work);
    } else {
      std::optional<decltype(work())> result;
      arena_.execute([&] { result.emplace(work()); });
      return std::move(*result);
    }
  }

 private:
  Arena arena_;
};

}  // namespace isohf::cli
