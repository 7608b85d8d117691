#include "isohf/archive/deflate/deflate.h"

#include <gtest/gtest.h>

#include <random>

#include "isohf/error.h"

namespace isohf {
namespace {

TEST(Inflate, WantsExactlyTheStatedSizes) {
  std::mt19937 random(1);
  std::vector<std::byte> bytes(1000);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random() % 40);
  std::vector<std::byte> deflated = deflate_bytes(bytes);
  std::vector<std::byte> out(1000);
  inflate_exactly(deflated, out);
  EXPECT_EQ(out, bytes);
  out.resize(999);
  EXPECT_THROW(inflate_exactly(deflated, out), Error);
  out.resize(1001);
  EXPECT_THROW(inflate_exactly(deflated, out), Error);
  out.resize(1000);
  for (std::size_t size = 0; size < deflated.size(); ++size) {
    EXPECT_THROW(inflate_exactly(std::span<const std::byte>(deflated).first(size), out), Error);
  }
  deflated.push_back(std::byte{0});
  EXPECT_THROW(inflate_exactly(deflated, out), Error);
}

}  // namespace
}  // namespace isohf
