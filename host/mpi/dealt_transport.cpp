// SPDX-License-Identifier: Apache-2.0

#include "dealt_transport.hpp"

#include "polish.hpp"
#include "ranks.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

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
  SYMRIG_TRY(StoredScene scene, load_scene(path, {.memory = 1, .camera = false}));
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

namespace {

/// So many patterns go to the other ranks at once: T is read once for as many.
constexpr std::size_t kTogether = 16;

// Pictures go one by one. All in one message would need memory of their own and copies, and leave the caches
// (docs/research/machines.md, "What the exchanges cost").

/// On the first rank.
void send(const Ranks& ranks, std::span<const Image<float>> pictures) {
  for (const Image<float>& picture : pictures) ranks.send(picture.values());
}

/// On the others.
void receive(const Ranks& ranks, std::span<Image<float>> pictures) {
  for (Image<float>& picture : pictures) ranks.broadcast(picture.values());
}

/// The sum over the ranks, on the first one.
void add_up(const Ranks& ranks, std::span<Image<float>> pictures) {
  for (Image<float>& picture : pictures) ranks.add_up(picture.values());
}

Result<std::vector<Image<float>>> photographs(const TransportTensor& share,
                                              std::span<const Image<float>> patterns) {
  if (patterns.size() != 1) return share.apply_batch(patterns);
  SYMRIG_TRY(Image<float> photograph, share.apply(patterns[0]));
  std::vector<Image<float>> one;
  one.push_back(std::move(photograph));
  return one;
}

/// Every rank with its own share.
Result<Share> open_share(const Ranks& ranks, std::string& path) {
  ranks.broadcast_text(path);
  Result<Share> mine = read_share(path, ranks.rank(), ranks.count());
  SYMRIG_CHECK(ranks.all(mine ? Result<void>() : Result<void>(mine.error())));
  const std::vector<std::uint64_t> identities = ranks.gather(mine->identity);
  Result<void> same;
  if (std::set(identities.begin(), identities.end()).size() > 1)
    same = Error{ErrorCode::bad_value,
                 fmt::format("{}: the machines have different scenes under this name", path),
                 "give a path on a file system that they share, or copy the file again"};
  SYMRIG_CHECK(ranks.all(same));
  return mine;
}

/// One rank that helps.
class Helper {
 public:
  Helper(const Ranks& ranks, TransportTensor share) : ranks_(ranks), tensor_(std::move(share)) {}

  /// False if it cannot.
  bool does(const Request& request) {
    switch (request.kind) {
      case Request::open:
        return open();
      case Request::photographs:
        return photographs_of(static_cast<std::size_t>(request.number)).ok();
      case Request::adjoint:
        return adjoint().ok();
      case Request::refit:
        help_polish(ranks_);
        return true;  // the first rank reports what failed
      case Request::end:
        return true;
    }
    return false;
  }

 private:
  /// The first rank reports what failed.
  bool open() {
    std::string path;
    const Result<Share> share = open_share(ranks_, path);
    if (share) tensor_ = share->scene.tensor;
    return true;
  }

  Result<void> photographs_of(std::size_t count) {
    const Grid grid = tensor_.projector_grid();
    if (patterns_.size() < count || patterns_[0].grid() != grid) patterns_.assign(count, Image<float>(grid));
    const auto patterns = std::span(patterns_).first(count);
    receive(ranks_, patterns);
    SYMRIG_TRY(std::vector<Image<float>> mine, photographs(tensor_, patterns));
    add_up(ranks_, mine);
    return {};
  }

  Result<void> adjoint() const {
    Image<float> picture(tensor_.camera_grid(), tensor_.channels());
    receive(ranks_, {&picture, 1});
    SYMRIG_TRY(Image<float> mine, tensor_.adjoint(picture));
    add_up(ranks_, std::span(&mine, 1));
    return {};
  }

  Ranks ranks_;
  TransportTensor tensor_;
  std::vector<Image<float>> patterns_;  ///< the memory of those that came last
};

}  // namespace

Result<std::shared_ptr<const DealtTransport>> DealtTransport::open(const Ranks& ranks,
                                                                   const std::filesystem::path& path) {
  std::string name = path.string();
  Together opening(ranks, {Request::open});
  Result<Share> share = open_share(ranks, name);
  opening.done();
  if (!share) return share.error();
  return std::make_shared<const DealtTransport>(ranks, *std::move(share));
}

Result<Image<float>> DealtTransport::apply(const Image<float>& pattern) const {
  SYMRIG_TRY(std::vector<Image<float>> one, apply_batch(std::span(&pattern, 1)));
  return std::move(one[0]);
}

Result<std::vector<Image<float>>> DealtTransport::apply_batch(std::span<const Image<float>> patterns) const {
  const Image<float> right(projector_grid());
  for (const Image<float>& pattern : patterns)
    if (pattern.grid() != right.grid() || pattern.channels() != 1)
      return share_.scene.tensor.apply_batch(patterns);  // its error
  std::vector<Image<float>> all;
  all.reserve(patterns.size());
  for (std::size_t first = 0; first < patterns.size(); first += kTogether) {
    const auto batch = patterns.subspan(first, std::min(kTogether, patterns.size() - first));
    Together product(ranks_, {Request::photographs, static_cast<std::int32_t>(batch.size())});
    send(ranks_, batch);
    SYMRIG_TRY(std::vector<Image<float>> mine, photographs(share_.scene.tensor, batch));
    add_up(ranks_, mine);
    product.done();
    std::move(mine.begin(), mine.end(), std::back_inserter(all));
  }
  return all;
}

Result<Image<float>> DealtTransport::adjoint(const Image<float>& picture) const {
  if (picture.grid() != camera_grid() || picture.channels() != channels())
    return share_.scene.tensor.adjoint(picture);  // its error
  Together product(ranks_, {Request::adjoint});
  send(ranks_, {&picture, 1});
  SYMRIG_TRY(Image<float> light, share_.scene.tensor.adjoint(picture));
  add_up(ranks_, std::span(&light, 1));
  product.done();
  return light;
}

int help(const Ranks& ranks, TransportTensor share) {
  Helper helper(ranks, std::move(share));
  while (true) {
    Request request{};
    ranks.broadcast_value(request);
    if (request.kind == Request::end) return request.number;
    Together work;
    if (helper.does(request)) work.done();
  }
}

void release(const Ranks& ranks, int exit_code) {
  Request end{Request::end, exit_code};
  ranks.broadcast_value(end);
}

}  // namespace symrig::mpi
