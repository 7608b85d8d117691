#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/bytes.h"

namespace isohf::testing {

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

/// A zip archive of deflated or stored members.
inline std::vector<std::byte> zip_archive(const std::vector<ZipEntry>& entries, bool deflated) {
  std::vector<std::byte> zip;
  std::vector<std::byte> directory;
  ByteWriter out(zip);
  ByteWriter list(directory);
  for (const ZipEntry& entry : entries) {
    const std::vector<std::byte> packed = deflated ? raw_deflated(entry.contents) : entry.contents;
    const auto offset = static_cast<std::uint32_t>(zip.size());
    const auto common = [&](ByteWriter& to) {
      to.write<std::uint16_t>(20);
      to.write<std::uint16_t>(0);
      to.write<std::uint16_t>(deflated ? 8 : 0);
      to.write<std::uint32_t>(0);
      to.write(static_cast<std::uint32_t>(
          crc32_z(0, reinterpret_cast<const Bytef*>(entry.contents.data()), entry.contents.size())));
      to.write(static_cast<std::uint32_t>(packed.size()));
      to.write(static_cast<std::uint32_t>(entry.contents.size()));
      to.write(static_cast<std::uint16_t>(entry.name.size()));
      to.write<std::uint16_t>(0);
    };
    const auto text = std::as_bytes(std::span(entry.name));
    out.write<std::uint32_t>(0x04034B50);
    common(out);
    out.write_bytes(text);
    out.write_bytes(packed);
    list.write<std::uint32_t>(0x02014B50);
    list.write<std::uint16_t>(20);
    common(list);
    for (int i = 0; i < 5; ++i) list.write<std::uint16_t>(0);
    list.write(offset);
    list.write_bytes(text);
  }
  const auto directory_offset = static_cast<std::uint32_t>(zip.size());
  out.write_bytes(directory);
  out.write<std::uint32_t>(0x06054B50);
  out.write<std::uint32_t>(0);
  out.write(static_cast<std::uint16_t>(entries.size()));
  out.write(static_cast<std::uint16_t>(entries.size()));
  out.write(static_cast<std::uint32_t>(directory.size()));
  out.write(directory_offset);
  out.write<std::uint16_t>(0);
  return zip;
}

}  // namespace isohf::testing
