#pragma once

#include <archive.h>
#include <archive_entry.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace isohf::test {

/// A file that is to be packed.
struct PackedEntry {
  std::string name;
  std::string contents;
  unsigned type = AE_IFREG;
  std::string link = {};        ///< what a symbolic link leads to
  std::string hard_link = {};   ///< the file in the archive that it is
  std::int64_t hole_bytes = 0;  ///< before the contents, in tars that have holes
};

/// Files as libarchive packs them: `format` is "zip", "7zip", "pax", "gnutar", "ustar" or, for one file, "raw"; `filter`
/// "gzip", "bzip2", "xz" or "zstd"; `options` those of archive_write_set_options(3).
inline std::string packed(const std::vector<PackedEntry>& files, const char* format, const char* filter = nullptr,
                          const char* options = nullptr) {
  archive* const out = archive_write_new();
  EXPECT_EQ(archive_write_set_format_by_name(out, format), ARCHIVE_OK);
  if (filter != nullptr) archive_write_add_filter_by_name(out, filter);
  EXPECT_EQ(archive_write_set_options(out, options), ARCHIVE_OK) << archive_error_string(out);
  archive_write_set_passphrase(out, "secret");
  archive_write_set_bytes_in_last_block(out, 1);
  std::string bytes;
  const auto append = [](archive*, void* to, const void* block, std::size_t size) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(block), size);
    return static_cast<la_ssize_t>(size);
  };
  EXPECT_EQ(archive_write_open2(out, &bytes, nullptr, append, nullptr, nullptr), ARCHIVE_OK);
  for (const PackedEntry& file : files) {
    archive_entry* const entry = archive_entry_new();
    archive_entry_set_pathname(entry, file.name.c_str());
    archive_entry_set_filetype(entry, file.type);
    archive_entry_set_perm(entry, 0644);
    const auto size = static_cast<la_int64_t>(file.contents.size());
    archive_entry_set_size(entry, file.hole_bytes + size);
    if (file.hole_bytes > 0) archive_entry_sparse_add_entry(entry, file.hole_bytes, size);
    if (!file.link.empty()) archive_entry_set_symlink(entry, file.link.c_str());
    if (!file.hard_link.empty()) archive_entry_set_hardlink(entry, file.hard_link.c_str());
    EXPECT_EQ(archive_write_header(out, entry), ARCHIVE_OK) << archive_error_string(out);
    const std::string contents = std::string(static_cast<std::size_t>(file.hole_bytes), '\0') + file.contents;
    EXPECT_EQ(archive_write_data(out, contents.data(), contents.size()), static_cast<la_ssize_t>(contents.size()));
    archive_entry_free(entry);
  }
  EXPECT_EQ(archive_write_free(out), ARCHIVE_OK);
  return bytes;
}

inline std::string gzipped(const std::string& contents) {
  return packed({{"", contents}}, "raw", "gzip");
}

}  // namespace isohf::test
