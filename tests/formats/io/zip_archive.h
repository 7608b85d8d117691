#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/bytes.h"

namespace isohf::test {

struct ZipEntry {
  std::string name;
  std::vector<std::byte> contents;
};

inline std::vector<std::byte> raw_deflated(const std::vector<std::byte>& contents) {
  std::vector<std::byte> packed(compressBound(contents.size()));
  z_stream stream = {};
  deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(contents.data()));
  stream.avail_in = static_cast<uInt>(contents.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// A zip archive of deflated or stored members. `zip64`: every size and offset is in the Zip64 records alone, as of
/// files beyond 4 GiB; another extra field comes before.
inline std::vector<std::byte> zip_archive(const std::vector<ZipEntry>& entries, bool deflated, bool zip64 = false) {
  constexpr std::uint32_t kElsewhere = 0xFFFFFFFF;
  std::vector<std::byte> zip;
  std::vector<std::byte> directory;
  ByteWriter out(zip);
  ByteWriter list(directory);
  for (const ZipEntry& entry : entries) {
    const std::vector<std::byte> packed = deflated ? raw_deflated(entry.contents) : entry.contents;
    const auto offset = static_cast<std::uint32_t>(zip.size());
    const auto common = [&](ByteWriter& to, std::uint16_t extra_bytes) {
      to.write<std::uint16_t>(20);
      to.write<std::uint16_t>(0);
      to.write<std::uint16_t>(deflated ? 8 : 0);
      to.write<std::uint32_t>(0);
      to.write(static_cast<std::uint32_t>(
          crc32_z(0, reinterpret_cast<const Bytef*>(entry.contents.data()), entry.contents.size())));
      to.write(zip64 ? kElsewhere : static_cast<std::uint32_t>(packed.size()));
      to.write(zip64 ? kElsewhere : static_cast<std::uint32_t>(entry.contents.size()));
      to.write(static_cast<std::uint16_t>(entry.name.size()));
      to.write(extra_bytes);
    };
    const auto extra = [&](ByteWriter& to, bool with_offset) {
      if (!zip64) return;
      for (const int word : {0x5455, 1}) to.write(static_cast<std::uint16_t>(word));  // a time stamp, of one byte
      to.write<std::uint8_t>(0);
      for (const int word : {1, with_offset ? 24 : 16}) to.write(static_cast<std::uint16_t>(word));
      to.write<std::uint64_t>(entry.contents.size());
      to.write<std::uint64_t>(packed.size());
      if (with_offset) to.write<std::uint64_t>(offset);
    };
    const auto text = std::as_bytes(std::span(entry.name));
    out.write<std::uint32_t>(0x04034B50);
    common(out, zip64 ? 25 : 0);
    out.write_bytes(text);
    extra(out, false);
    out.write_bytes(packed);
    list.write<std::uint32_t>(0x02014B50);
    list.write<std::uint16_t>(20);
    common(list, zip64 ? 33 : 0);
    for (int i = 0; i < 5; ++i) list.write<std::uint16_t>(0);
    list.write(zip64 ? kElsewhere : offset);
    list.write_bytes(text);
    extra(list, true);
  }
  const auto directory_offset = static_cast<std::uint32_t>(zip.size());
  out.write_bytes(directory);
  if (zip64) {
    const std::uint64_t end_offset = zip.size();
    out.write<std::uint32_t>(0x06064B50);
    out.write<std::uint64_t>(44);
    for (int i = 0; i < 2; ++i) out.write<std::uint16_t>(45);  // versions
    out.write<std::uint64_t>(0);                               // disks
    for (int i = 0; i < 2; ++i) out.write<std::uint64_t>(entries.size());
    out.write<std::uint64_t>(directory.size());
    out.write<std::uint64_t>(directory_offset);
    out.write<std::uint32_t>(0x07064B50);
    out.write<std::uint32_t>(0);
    out.write(end_offset);
    out.write<std::uint32_t>(1);
  }
  out.write<std::uint32_t>(0x06054B50);
  out.write<std::uint32_t>(0);
  const auto count = static_cast<std::uint16_t>(zip64 ? 0xFFFF : entries.size());
  for (int i = 0; i < 2; ++i) out.write(count);
  out.write(zip64 ? kElsewhere : static_cast<std::uint32_t>(directory.size()));
  out.write(zip64 ? kElsewhere : directory_offset);
  out.write<std::uint16_t>(0);
  return zip;
}

}  // namespace isohf::test
