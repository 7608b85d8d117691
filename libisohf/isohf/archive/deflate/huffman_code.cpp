#include "isohf/archive/deflate/huffman_code.h"

#include <algorithm>
#include <vector>

namespace isohf {
namespace {

std::uint16_t reverse_bits(unsigned code, unsigned length) {
  unsigned reversed = 0;
  for (unsigned bit = 0; bit < length; ++bit) reversed |= ((code >> bit) & 1U) << (length - 1 - bit);
  return static_cast<std::uint16_t>(reversed);
}

}  // namespace

// Four tables: one alone would wait for its own counts where bytes repeat.
ByteCounts count_bytes(std::span<const std::byte> bytes) {
  std::array<ByteCounts, 4> counts{};
  const auto count = [&](std::size_t lane, std::size_t i) { ++counts[lane][std::to_integer<std::size_t>(bytes[i])]; };
  std::size_t i = 0;
  for (; i + 4 <= bytes.size(); i += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) count(lane, i + lane);
  }
  for (; i < bytes.size(); ++i) count(0, i);
  for (std::size_t byte = 0; byte < 256; ++byte) {
    counts[0][byte] += counts[1][byte] + counts[2][byte] + counts[3][byte];
  }
  return counts[0];
}

void build_code_lengths(std::span<const std::uint32_t> frequencies, unsigned limit, std::span<std::uint8_t> lengths) {
  struct Node {
    std::uint64_t weight;
    std::uint32_t symbol;  // of a leaf; a parent's depth is kept in `depth`
    std::uint32_t parent;
    std::uint32_t depth;
  };
  std::fill(lengths.begin(), lengths.end(), std::uint8_t{0});
  std::vector<Node> nodes;
  nodes.reserve(2 * frequencies.size());
  for (std::size_t symbol = 0; symbol < frequencies.size(); ++symbol) {
    if (frequencies[symbol] != 0) nodes.push_back({frequencies[symbol], static_cast<std::uint32_t>(symbol), 0, 0});
  }
  const std::size_t leaves = nodes.size();
  if (leaves == 0) return;
  if (leaves == 1) {
    lengths[nodes[0].symbol] = 1;
    return;
  }
  std::sort(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) {
    return a.weight != b.weight ? a.weight < b.weight : a.symbol < b.symbol;
  });
  // Huffman's two queues: the sorted leaves, and the parents, which are made in order of weight.
  std::size_t leaf = 0;
  std::size_t parent = leaves;
  const auto take_lightest = [&] {
    const bool from_leaves = parent == nodes.size() || (leaf < leaves && nodes[leaf].weight <= nodes[parent].weight);
    return from_leaves ? leaf++ : parent++;
  };
  while (nodes.size() < 2 * leaves - 1) {
    const std::size_t a = take_lightest();
    const std::size_t b = take_lightest();
    const auto index = static_cast<std::uint32_t>(nodes.size());
    nodes[a].parent = index;
    nodes[b].parent = index;
    nodes.push_back({nodes[a].weight + nodes[b].weight, 0, 0, 0});
  }
  std::array<std::uint32_t, 64> of_length{};
  for (std::size_t i = nodes.size() - 1; i-- > 0;) {
    nodes[i].depth = nodes[nodes[i].parent].depth + 1;
    if (i < leaves) ++of_length[std::min<std::size_t>(nodes[i].depth, limit)];
  }
  // Codes cut to the limit overfill the code space; lengthening shorter ones makes room.
  std::uint64_t filled = 0;
  for (unsigned length = 1; length <= limit; ++length) filled += std::uint64_t{of_length[length]} << (limit - length);
  while (filled > std::uint64_t{1} << limit) {
    unsigned length = limit - 1;
    while (of_length[length] == 0) --length;
    --of_length[length];
    of_length[length + 1] += 2;
    --of_length[limit];
    --filled;
  }
  std::size_t next = 0;  // the rarest symbols get the longest codes
  for (unsigned length = limit; length >= 1; --length) {
    for (std::uint32_t i = 0; i < of_length[length]; ++i)
      lengths[nodes[next++].symbol] = static_cast<std::uint8_t>(length);
  }
}

void assign_codes(std::span<const std::uint8_t> lengths, std::span<std::uint16_t> codes) {
  std::array<unsigned, 16> of_length{};
  for (const unsigned length : lengths) ++of_length[length];
  of_length[0] = 0;
  std::array<unsigned, 16> next{};
  for (std::size_t length = 1; length < next.size(); ++length) {
    next[length] = (next[length - 1] + of_length[length - 1]) << 1U;
  }
  for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol) {
    const unsigned length = lengths[symbol];
    if (length != 0) codes[symbol] = reverse_bits(next[length]++, length);
  }
}

}  // namespace isohf
