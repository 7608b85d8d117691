// Any bytes are the records of a journal, their checksums put right: what is damaged ends it, and nothing is read twice.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/journal.h"
#include "support/temporary_folder.h"

namespace {

constexpr std::size_t kNameSizeAt = 4;
constexpr std::size_t kFixedBytes = 56 + 32 + 7 * 8;

/// The bytes as records: behind each as long as its name says a checksum of it.
std::vector<std::byte> repaired(std::span<const std::byte> bytes) {
  std::vector<std::byte> out;
  while (bytes.size() >= kFixedBytes) {
    std::uint32_t name_bytes = 0;
    std::memcpy(&name_bytes, bytes.data() + kNameSizeAt, sizeof name_bytes);
    if (name_bytes > bytes.size() - kFixedBytes) break;
    const auto record = bytes.first(kFixedBytes + name_bytes);
    const std::uint32_t crc = isohf::crc32(record);
    const auto crc_bytes = std::as_bytes(std::span(&crc, 1));
    out.insert(out.end(), record.begin(), record.end());
    out.insert(out.end(), crc_bytes.begin(), crc_bytes.end());
    bytes = bytes.subspan(record.size());
  }
  out.insert(out.end(), bytes.begin(), bytes.end());
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const isohf::test::TemporaryFolder folder("/dev/shm");
  const std::string path = folder / "journal";
  const isohf::Digest job{};
  { auto started = isohf::Journal::start(path, job); }
  std::string file = isohf::test::read_file(path);
  const std::vector<std::byte> records = repaired(std::as_bytes(std::span(data, size)));
  file.append(reinterpret_cast<const char*>(records.data()), records.size());
  isohf::test::write_file(path, file);
  auto opened = isohf::Journal::open(path, job);
  if (!opened.matches || opened.records.size() != opened.ends.size()) std::abort();
  std::uint64_t end = opened.header_bytes;
  for (std::size_t i = 0; i < opened.ends.size(); end = opened.ends[i++]) {
    if (opened.ends[i] != end + kFixedBytes + 4 + opened.records[i].member.name.size()) std::abort();
  }
  if (end > file.size()) std::abort();
  // Written again it is the same.
  opened.journal.truncate(opened.header_bytes);
  for (const isohf::JournalRecord& record : opened.records) opened.journal.add(record);
  opened.journal.flush();
  if (isohf::Journal::open(path, job).ends != opened.ends) std::abort();
  return 0;
}
