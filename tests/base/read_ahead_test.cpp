#include "isohf/base/memory/read_ahead.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <vector>

#include "isohf/byte_source.h"
#include "isohf/error.h"
#include "support/error_of.h"

namespace isohf {
namespace {

TEST(ReadAhead, MakesNoRoomForWhatTheSourceCannotHold) {
  std::vector<std::byte> bytes(1000);
  bytes[400] = std::byte{7};
  const auto source = memory_source(std::move(bytes));
  ReadAhead ahead;
  for (const std::uint64_t size : {std::uint64_t{991}, std::uint64_t{0xffffffff}, std::uint64_t{1} << 62U,
                                   std::numeric_limits<std::uint64_t>::max()}) {
    const Error error = test::error_of([&] { (void)ahead.bytes(*source, 10, size); });
    EXPECT_EQ(error.code(), ErrorCode::kIo) << size;
    EXPECT_THAT(error.what(), testing::HasSubstr("ends at byte 1000"));
  }
  EXPECT_EQ(ahead.bytes(*source, 400, 600).front(), std::byte{7});
  // Nor is anything there already of which only sums, taken modulo 2^64, lie within what was read.
  const std::uint64_t far = std::numeric_limits<std::uint64_t>::max() - 9;
  EXPECT_THROW((void)ahead.bytes(*source, far, 500), Error);
}

}  // namespace
}  // namespace isohf
