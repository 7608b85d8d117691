#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "isohf/raster.h"

namespace isohf::test {

/// A small valid file of one format, and the reader that must survive whatever becomes of it.
struct ReaderCase {
  std::string name;       ///< of the test
  std::string file_name;  ///< of the file that is damaged
  std::string bytes;
  std::unique_ptr<HeightSource> (*open)(const std::string& path, const OpenOptions& options) = nullptr;
  OpenOptions options;
  /// What is opened, where it is not the damaged file, and what it holds: a grid whose header is damaged, say.
  std::string opened = {};
  std::vector<std::pair<std::string, std::string>> beside = {};  ///< name, bytes
  /// Shorter ones may open: what follows is padding, or is not needed.
  std::size_t shortest_valid = 0;  ///< 0: all of it is needed; 1: nobody knows
  bool text = false;               ///< mutations put in digits and signs as well
  int share = 1;                   ///< one in so many truncations and mutations: opening one takes a process
};

/// A file for every native reader and every way of storing that it tells apart. Makes them in an empty folder of its
/// own, which is removed again.
[[nodiscard]] std::vector<ReaderCase> reader_cases();

}  // namespace isohf::test
