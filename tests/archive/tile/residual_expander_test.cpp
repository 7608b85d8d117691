#include "isohf/archive/tile/simd/residual_expander.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/base/simd.h"

namespace isohf {
namespace {

struct Streams {
  std::vector<std::byte> symbols;
  std::vector<std::byte> extra;  ///< with the slack behind it
  std::size_t extra_bytes = 0;
  std::vector<std::uint16_t> zigzagged;
  std::uint64_t bits = 0;

  [[nodiscard]] std::uint64_t expand(std::uint64_t position, std::uint16_t* to) const {
    return expand_residuals(symbols, std::span(extra).first(extra_bytes), position, to);
  }
};

/// Residuals with as many octaves as `range` has, and where their bits go: bit by bit.
Streams make_streams(std::size_t count, std::uint32_t range, std::uint64_t position, std::uint32_t seed) {
  std::mt19937 random(seed);
  Streams streams;
  streams.extra.resize(count * 2 + kExpanderSlack + 16);
  streams.bits = position;
  for (std::size_t i = 0; i < count; ++i) {
    const auto zigzagged = static_cast<std::uint16_t>((random() & 0xffffU) >> (random() % (range + 1)));
    const unsigned symbol = symbol_of(zigzagged);
    streams.zigzagged.push_back(zigzagged);
    streams.symbols.push_back(static_cast<std::byte>(symbol));
    for (unsigned bit = 0; bit < extra_bits_of_symbol(symbol); ++bit, ++streams.bits) {
      streams.extra[streams.bits / 8] |= static_cast<std::byte>((zigzagged >> bit & 1U) << streams.bits % 8);
    }
  }
  streams.extra_bytes = static_cast<std::size_t>((streams.bits + 7) / 8);
  return streams;
}

class ResidualExpander : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override { set_simd(GetParam()); }
  void TearDown() override { set_simd(true); }
};

TEST_P(ResidualExpander, PutsExtraBitsToSymbols) {
  for (const std::uint32_t range : {0U, 4U, 16U}) {
    for (std::size_t count = 0; count < 70; ++count) {
      for (const std::uint64_t position : {std::uint64_t{0}, std::uint64_t{5}, std::uint64_t{8}}) {
        const Streams streams = make_streams(count, range, position, static_cast<std::uint32_t>(count));
        std::vector<std::uint16_t> zigzagged(count);
        ASSERT_EQ(streams.expand(position, zigzagged.data()), streams.bits) << range << ", " << count;
        ASSERT_EQ(zigzagged, streams.zigzagged);
      }
    }
  }
}

TEST_P(ResidualExpander, ReadsEveryResidual) {
  Streams streams;
  std::vector<std::uint16_t> zigzagged(65536);
  for (std::uint32_t first = 0; first < 65536; first += 65536 / 64) {
    streams = make_streams(1000, 0, 0, first);
    ASSERT_EQ(streams.expand(0, zigzagged.data()), streams.bits);
    ASSERT_TRUE(std::equal(streams.zigzagged.begin(), streams.zigzagged.end(), zigzagged.begin()));
  }
}

TEST_P(ResidualExpander, RefusesSymbolsThatDoNotExist) {
  for (const unsigned symbol : {112U, 113U, 127U, 128U, 239U, 255U}) {
    for (std::size_t at = 0; at < 40; ++at) {
      Streams streams = make_streams(40, 16, 0, 1);
      streams.symbols[at] = static_cast<std::byte>(symbol);
      std::vector<std::uint16_t> zigzagged(40);
      EXPECT_EQ(streams.expand(0, zigzagged.data()), kNotExpanded) << symbol << " at " << at;
    }
  }
}

TEST_P(ResidualExpander, RefusesTooFewExtraBits) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{16}, std::size_t{47}, std::size_t{200}}) {
    Streams streams = make_streams(count, 0, 0, 9);
    std::vector<std::uint16_t> zigzagged(count);
    while (streams.extra_bytes-- > 0) {
      // The slack alone behind what is left, so that the sanitizers see a read too far.
      streams.extra.assign(streams.extra.begin(),
                           streams.extra.begin() + static_cast<std::ptrdiff_t>(streams.extra_bytes + kExpanderSlack));
      ASSERT_EQ(streams.expand(0, zigzagged.data()), kNotExpanded) << streams.extra_bytes;
      if (streams.extra_bytes == 0) break;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Twins, ResidualExpander, testing::Bool());

}  // namespace
}  // namespace isohf
