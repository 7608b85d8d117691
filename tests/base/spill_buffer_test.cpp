#include "isohf/base/memory/spill_buffer.h"

#include <gtest/gtest.h>

#include <random>

#include "support/temporary_folder.h"

namespace isohf {
namespace {

TEST(SpillBuffer, GivesBackWhatWasAppendedFromFileMemoryAndAcrossTheTwo) {
  const test::TemporaryFolder folder;
  SpillBuffer buffer(folder / ".");
  std::mt19937 random(7);
  std::vector<std::byte> all;
  while (all.size() < 11U << 20U) {
    std::vector<std::byte> piece(random() % 200000);
    for (std::byte& byte : piece) byte = static_cast<std::byte>(random() & 255U);
    buffer.append(piece);
    all.insert(all.end(), piece.begin(), piece.end());
    ASSERT_EQ(buffer.size_bytes(), all.size());
  }
  for (int i = 0; i < 200; ++i) {
    const std::size_t at = random() % all.size();
    std::vector<std::byte> found(std::min<std::size_t>(random() % (6U << 20U), all.size() - at));
    buffer.read(at, found);
    ASSERT_TRUE(std::equal(found.begin(), found.end(), all.begin() + static_cast<std::ptrdiff_t>(at))) << at;
  }
  EXPECT_TRUE(folder.names().empty());  // the scratch file has no name
}

}  // namespace
}  // namespace isohf
