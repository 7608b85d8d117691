#include "isohf/archive/tile/residuals/residual_streams.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

/// Whatever has few bits besides its highest: ends of octaves and of their eighths, and their neighbours.
template <typename Zigzagged>
std::vector<Zigzagged> residuals_at_all_ends() {
  constexpr auto kMost = std::uint64_t{std::numeric_limits<Zigzagged>::max()};
  std::vector<Zigzagged> residuals;
  const auto add = [&](std::uint64_t value) {
    if (value <= kMost) residuals.push_back(static_cast<Zigzagged>(value));
  };
  for (unsigned octave = 3; octave <= 32; ++octave) {
    for (std::uint64_t eighth = 8; eighth < 16; ++eighth) {
      const std::uint64_t start = (eighth << octave) >> 3U;
      for (unsigned bit = 0; bit <= octave; ++bit) {
        add(start - 1 - (std::uint64_t{1} << bit >> 1U));
        add(start + (std::uint64_t{1} << bit >> 1U));
      }
    }
  }
  for (std::uint64_t value = 0; value < 70000; ++value) add(value);
  std::shuffle(residuals.begin(), residuals.end(), std::mt19937(1));
  return residuals;
}

template <typename Zigzagged>
void expect_read_again(const std::vector<Zigzagged>& values) {
  Residuals<Zigzagged> residuals(values.size(), false);
  std::copy(values.begin(), values.end(), residuals.zigzagged.data());
  std::fill_n(residuals.energies.data(), values.size(), std::uint16_t{0});  // so all are of one context
  CodingEffort effort = coding_effort(Effort::kDefault);
  effort.streams.has_pairs = false;
  PayloadHeader header;
  const Streams streams = make_streams(residuals, effort.streams, header);
  ASSERT_EQ(streams.symbols.size(), 1U);
  BitReader extra(streams.extra);
  std::vector<Zigzagged> back;
  for (const std::byte byte : streams.symbols[0]) {
    const auto symbol = std::to_integer<unsigned>(byte);
    back.push_back(static_cast<Zigzagged>(zigzagged_from(symbol, extra.take(extra_bits_of_symbol(symbol)))));
  }
  EXPECT_TRUE(extra.is_used_up());
  EXPECT_EQ(back, values);
}

class ResidualStreams : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override { set_simd(GetParam()); }
  void TearDown() override { set_simd(true); }
};

TEST_P(ResidualStreams, HoldEveryResidual) {
  for (const std::size_t dropped : {std::size_t{0}, std::size_t{1}}) {  // even and odd numbers of them
    auto of_codes = residuals_at_all_ends<std::uint16_t>();
    auto of_floats = residuals_at_all_ends<std::uint32_t>();
    of_codes.resize(of_codes.size() - dropped);
    of_floats.resize(of_floats.size() - dropped);
    expect_read_again(of_codes);
    expect_read_again(of_floats);
  }
}

INSTANTIATE_TEST_SUITE_P(Twins, ResidualStreams, testing::Bool());

}  // namespace
}  // namespace isohf
