// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace isohf {

/// Bytes that can be read in ranges: a file, a buffer, an object in a store, a resource on a web server. Derive from it
/// to give ArchiveReader access to any of these. All functions are called from any number of threads at once.
class ByteSource {
 public:
  ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  virtual ~ByteSource() = default;

  /// Size of the whole; must stay the same.
  [[nodiscard]] virtual std::uint64_t size_bytes() const = 0;

  /// Copies bytes from `offset_bytes` on into `out` and returns how many: all that fit, or fewer, at least one, where
  /// the source delivers in pieces: the rest is then asked for again. 0 says that the source ends before `offset_bytes`,
  /// which its reader takes for an error. Never asked for bytes beyond size_bytes(), nor for none. Throws Error{kIo}
  /// where reading fails; other exceptions reach whoever called ArchiveReader as they are.
  [[nodiscard]] virtual std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const = 0;

  /// The same bytes without a copy, for a source that holds them in memory, unchanged, until it is destroyed. Empty
  /// where they must be read.
  [[nodiscard]] virtual std::span<const std::byte> view(std::uint64_t offset_bytes, std::size_t size_bytes) const {
    static_cast<void>(offset_bytes), static_cast<void>(size_bytes);
    return {};
  }
};

/// A file. Throws Error{kIo} naming it where it cannot be opened; its read() throws Error{kIo} where another program has
/// cut the file since.
[[nodiscard]] std::shared_ptr<const ByteSource> open_file_source(const std::string& path);

/// A buffer, which the source keeps.
[[nodiscard]] std::shared_ptr<const ByteSource> memory_source(std::vector<std::byte> bytes);

}  // namespace isohf
