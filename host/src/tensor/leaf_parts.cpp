// SPDX-License-Identifier: Apache-2.0
#include "tensor/leaf_parts.hpp"

#include <array>
#include <atomic>
#include <future>
#include <utility>

namespace symrig::tensor {
namespace {

constexpr std::size_t kUsualPart = std::size_t{1} << 24;

std::atomic<std::size_t>& most_of_part() {
  static std::atomic<std::size_t> most = kUsualPart;
  return most;
}

}  // namespace

std::size_t part_values() {
  return most_of_part();
}

SmallParts::SmallParts(std::size_t values) {
  most_of_part() = values;
}

SmallParts::~SmallParts() {
  most_of_part() = kUsualPart;
}

bool PartRange::add(const Leaf& leaf, int channels) {
  const std::size_t more = leaf.values(channels);
  if (last > first && values + more > part_values()) return false;
  ++last;
  values += more;
  columns += leaf.columns(channels);
  return true;
}

std::vector<PartRange> parts_of(std::span<const Leaf> leaves, int channels) {
  std::vector<PartRange> parts(1);
  for (const Leaf& leaf : leaves) {
    if (parts.back().add(leaf, channels)) continue;
    parts.push_back(parts.back().next());
    parts.back().add(leaf, channels);
  }
  return parts;
}

LeafParts::LeafParts(std::span<const Leaf> leaves, std::span<const float> factors,
                     const LowRank::Shape& shape)
    : shape_(shape), ranges_(parts_of(leaves, shape.channels)) {
  kept_.reserve(ranges_.size());
  for (std::size_t part = 0; part < ranges_.size(); ++part)
    kept_.emplace_back(leaves_of(leaves, part),
                       factors.subspan(ranges_[part].first_value, ranges_[part].values), shape_);
}

LeafParts::LeafParts(std::span<const Leaf> leaves, ReadPart read, const LowRank::Shape& shape)
    : shape_(shape), ranges_(parts_of(leaves, shape.channels)), read_(std::move(read)) {}

Result<LeafParts> LeafParts::kept(std::span<const Leaf> leaves, const ReadPart& read,
                                  const LowRank::Shape& shape) {
  LeafParts parts;
  parts.shape_ = shape;
  parts.ranges_ = parts_of(leaves, shape.channels);
  parts.kept_.resize(parts.size());
  PartValues values;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const auto of_part = parts.leaves_of(leaves, part);
    SYMRIG_CHECK(read(parts.ranges_[part], of_part, values));
    parts.kept_[part].assign(of_part, values, shape);
  }
  return parts;
}

Result<void> LeafParts::read(std::span<const Leaf> leaves, std::size_t part, Place& to) const {
  const auto of_part = leaves_of(leaves, part);
  SYMRIG_CHECK(read_(ranges_[part], of_part, to.values));
  to.part.assign(of_part, to.values, shape_);
  return {};
}

Result<void> LeafParts::visit(std::span<const Leaf> leaves, const Use& use) const {
  if (in_memory()) {
    for (const LowRank& one : kept_) use(one);
    return {};
  }
  std::array<Place, 2> places;
  const auto begin = [&](std::size_t part) {
    return std::async(std::launch::async,
                      [&, part] { return read(leaves, part, places[part % places.size()]); });
  };
  std::future<Result<void>> next = begin(0);
  for (std::size_t part = 0; part < size(); ++part) {
    SYMRIG_CHECK(next.get());
    if (part + 1 < size()) next = begin(part + 1);
    use(places[part % places.size()].part);
  }
  return {};
}

Result<void> LeafParts::visit_factors(std::span<const Leaf> leaves, const UseFactors& use) const {
  Place place;
  for (std::size_t part = 0; part < size(); ++part) {
    const auto of_part = leaves_of(leaves, part);
    if (!in_memory()) SYMRIG_CHECK(read(leaves, part, place));
    const std::vector<float> factors = (in_memory() ? kept_[part] : place.part).factors(of_part);
    std::size_t at = 0;
    for (const Leaf& leaf : of_part) {
      const std::size_t size =
          static_cast<std::size_t>(shape_.channels) *
          static_cast<std::size_t>(std::int64_t{leaf.rank} * (std::int64_t{leaf.rows()} + leaf.cols()));
      use(leaf, std::span(factors).subspan(at, size));
      at += size;
    }
  }
  return {};
}

void LeafPacking::add(const Leaf& leaf, std::span<const float> factors) {
  if (!range_.add(leaf, parts_.shape_.channels)) {
    pack();
    range_ = range_.next();
    range_.add(leaf, parts_.shape_.channels);
  }
  leaves_.push_back(leaf);
  factors_.append(factors.begin(), factors.end());
}

void LeafPacking::pack() {
  parts_.ranges_.push_back(range_);
  parts_.kept_.emplace_back(leaves_, factors_, parts_.shape_);
  leaves_.clear();
  factors_.clear();
}

LeafParts LeafPacking::finish() && {
  pack();
  return std::move(parts_);
}

std::int64_t LeafParts::bytes() const {
  std::int64_t total = 0;
  if (!in_memory())
    for (const PartRange& part : ranges_)
      total += static_cast<std::int64_t>(part.values * sizeof(Half) + part.columns / 2 * sizeof(float));
  for (const LowRank& one : kept_) total += one.bytes();
  return total;
}

}  // namespace symrig::tensor
