// SPDX-License-Identifier: Apache-2.0
#include "share.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string_view>
#include <utility>

namespace symrig::mpi {
namespace {

/// Of a scene that is left in its file, one part at a time is in memory.
Result<void> add_leaves(const TransportTensor& whole, LeafRange range, TensorBuilder& builder) {
  builder.pack_leaves();
  std::size_t k = 0;
  return whole.visit_leaves([&](const Leaf& leaf, std::span<const float> factors) {
    if (k >= range.begin && k < range.end)
      builder.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level,
                       factors);
    ++k;
  });
}

void add_rest(const TransportTensor& whole, TensorBuilder& builder) {
  const std::size_t channels = whole.channels();
  const std::vector<float> values = whole.scalar_values();
  const std::vector<ScalarLeaf> scalars = whole.scalars();
  for (std::size_t k = 0; k < scalars.size(); ++k)
    builder.add_scalar(scalars[k].row, scalars[k].col, std::span(values).subspan(k * channels, channels));
  for (const BandLeaf& band : whole.bands()) builder.add_band(band.radius, band.values);
  for (const SparseColumn& column : whole.columns()) {
    const auto first = static_cast<std::size_t>(column.first);
    const auto size = static_cast<std::size_t>(column.last - column.first);
    builder.add_column(column.col_begin, column.col_end, whole.column_rows().subspan(first, size),
                       whole.column_values().subspan(first * channels, size * channels));
  }
}

/// FNV-1a.
class Digest {
 public:
  void add_bytes(std::string_view bytes) {
    for (const char c : bytes) value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  }
  template <class T>
  void add_value(const T& value) {
    add_bytes(std::string_view(reinterpret_cast<const char*>(&value), sizeof value));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace

/// Two captures differ in their text: it holds their time. Two fits differ in their leaves.
std::uint64_t identity_of(const StoredScene& scene) {
  Digest digest;
  digest.add_bytes(scene.capture_json);
  for (const Leaf& leaf : scene.tensor.leaves()) digest.add_value(leaf);
  digest.add_value(scene.tensor.bytes());
  digest.add_value(scene.tensor.scalar_count());
  return digest.value();
}

std::vector<LeafRange> deal(std::span<const std::int64_t> costs, std::int64_t first, int count) {
  const auto whole = static_cast<double>(std::accumulate(costs.begin(), costs.end(), first));
  std::vector<LeafRange> ranges(static_cast<std::size_t>(count));
  auto before = static_cast<double>(first);  // cost of all that comes before the next leaf
  std::size_t next = 0;
  for (std::size_t rank = 0; rank < ranges.size(); ++rank) {
    const double until = whole * static_cast<double>(rank + 1) / count;
    ranges[rank].begin = next;
    const bool last = rank + 1 == ranges.size();
    // A leaf belongs to the rank that its middle falls to.
    for (; next < costs.size() && (last || before + static_cast<double>(costs[next]) / 2 < until); ++next)
      before += static_cast<double>(costs[next]);
    ranges[rank].end = next;
  }
  return ranges;
}

std::vector<std::int64_t> costs_of(const TransportTensor& tensor) {
  std::vector<std::int64_t> costs;
  costs.reserve(tensor.leaves().size());
  constexpr std::int64_t kHalf = 2, kColumn = std::int64_t{4} * 64;
  for (const Leaf& leaf : tensor.leaves())
    costs.push_back(kHalf * static_cast<std::int64_t>(leaf.values(tensor.channels())) +
                    kColumn * static_cast<std::int64_t>(leaf.columns(tensor.channels())));
  return costs;
}

Result<TransportTensor> part_of(const TransportTensor& whole, LeafRange leaves, bool rest) {
  TensorBuilder builder = whole.symmetric()
                              ? TensorBuilder(whole.camera_tree(), whole.channels())
                              : TensorBuilder(whole.camera_tree(), whole.projector_tree(), whole.channels());
  SYMRIG_CHECK(add_leaves(whole, leaves, builder));
  if (rest) add_rest(whole, builder);
  return std::move(builder).finish();
}

Result<Share> read_share(const std::filesystem::path& path, int rank, int count) {
  // A rank never holds more than its share.
  SYMRIG_TRY(StoredScene scene, load_scene(path, {.memory = 1}));
  Share share{std::move(scene), 0};
  share.identity = identity_of(share.scene);
  const TransportTensor& whole = share.scene.tensor;
  const std::vector<std::int64_t> costs = costs_of(whole);
  std::int64_t rest = whole.bytes();
  for (const Leaf& leaf : whole.leaves())
    rest -= 2 * static_cast<std::int64_t>(leaf.values(whole.channels()));
  const std::vector<LeafRange> ranges = deal(costs, rest, count);
  SYMRIG_TRY(TransportTensor part, part_of(whole, ranges[static_cast<std::size_t>(rank)], rank == 0));
  share.scene.tensor = std::move(part);
  if (rank != 0) share.scene.held_out.clear();
  return share;
}

}  // namespace symrig::mpi
