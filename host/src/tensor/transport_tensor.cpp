// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include "tensor/store.hpp"

#include <algorithm>

namespace symrig {

const tensor::Store& TransportTensor::store() const {
  static const tensor::Store nothing;
  return store_ ? *store_ : nothing;
}

std::span<const Leaf> TransportTensor::leaves() const& {
  return draft_ ? draft_->leaves : store().leaves;
}

bool TransportTensor::in_memory() const {
  return store().parts.in_memory();
}

Result<void> TransportTensor::visit_leaves(const UseLeaf& use) const {
  if (!draft_) return store().parts.visit_factors(store().leaves, use);
  std::size_t at = 0;
  for (const Leaf& leaf : draft_->leaves) {
    const std::size_t size = leaf.values(channels_);
    use(leaf, std::span(draft_->factors).subspan(at, size));
    at += size;
  }
  return {};
}

Result<std::vector<float>> TransportTensor::factors() const {
  std::vector<float> all;
  SYMRIG_CHECK(visit_leaves([&](const Leaf&, std::span<const float> factors) {
    all.insert(all.end(), factors.begin(), factors.end());
  }));
  return all;
}

std::vector<EmptyLeaf> TransportTensor::empties(int level) const {
  const std::size_t l = level;
  return draft_ ? draft_->empties[l] : store().empties[l].leaves();
}

std::int64_t TransportTensor::empty_count(int level) const {
  const std::size_t l = level;
  return draft_ ? std::ssize(draft_->empties[l]) : store().empties[l].size();
}

/// Symmetric tensors store an entry and its mirror image. Only the one below the diagonal is listed.
bool TransportTensor::listed(const ScalarLeaf& scalar) const {
  return !symmetric_ || scalar.row > scalar.col;
}

std::vector<ScalarLeaf> TransportTensor::scalars() const {
  if (draft_) return draft_->scalars;
  std::vector<ScalarLeaf> all;
  const tensor::Diagonal& diagonal = store().diagonal;
  if (!diagonal.empty())
    for (std::int32_t i = 0; i < camera_grid().size(); ++i)
      if (diagonal.holds(i)) all.push_back({i, i});
  for (std::size_t k = 0; k < store().entries[0].size(); ++k)
    if (listed(store().entries[0].at(k))) all.push_back(store().entries[0].at(k));
  return all;
}

std::int64_t TransportTensor::scalar_count() const {
  if (draft_) return std::ssize(draft_->scalars);
  return store().diagonal.size() +
         static_cast<std::int64_t>(store().entries[0].size()) / (symmetric_ ? 2 : 1);
}

std::vector<float> TransportTensor::scalar_values() const {
  if (draft_) return draft_->scalar_values;
  std::vector<float> all;
  const tensor::Diagonal& diagonal = store().diagonal;
  if (!diagonal.empty())
    for (std::int32_t i = 0; i < camera_grid().size(); ++i)
      for (int channel = 0; diagonal.holds(i) && channel < channels_; ++channel)
        all.push_back(diagonal.values(channel)[i]);
  const tensor::Entries& entries = store().entries[0];
  for (std::size_t k = 0; k < entries.size(); ++k)
    for (int channel = 0; listed(entries.at(k)) && channel < channels_; ++channel)
      all.push_back(entries.value(k, channel));
  return all;
}

std::vector<BandLeaf> TransportTensor::bands() const {
  if (draft_) return draft_->bands;
  std::vector<BandLeaf> all;
  for (const tensor::Band& band : store().bands) all.push_back({band.radius(), band.values()});
  return all;
}

std::span<const SparseColumn> TransportTensor::columns() const {
  return draft_ ? draft_->columns.ranges : store().columns.ranges;
}

std::span<const std::int32_t> TransportTensor::column_rows() const {
  return draft_ ? draft_->columns.rows : store().columns.rows;
}

std::span<const float> TransportTensor::column_values() const {
  return draft_ ? draft_->columns.values : store().columns.values;
}

int TransportTensor::levels() const {
  return static_cast<int>(draft_ ? draft_->empties.size() : store().empties.size());
}

int TransportTensor::scalar_level(const ScalarLeaf& scalar) const {
  return std::max(camera_.pixel_level(scalar.row), projector_tree().pixel_level(scalar.col));
}

std::vector<LeafCounts> TransportTensor::leaves_per_level() const {
  std::vector<LeafCounts> counts(levels());
  for (const Leaf& leaf : leaves()) {
    LeafCounts& at = counts[leaf.level];
    ++(leaf.rank == 1 ? at.rank1 : at.low_rank);
  }
  for (int l = 0; l < levels(); ++l) counts[l].empty = empty_count(l);
  for (const ScalarLeaf& scalar : scalars()) ++counts[scalar_level(scalar)].scalar;
  if (!column_rows().empty()) counts.back().scalar += std::ssize(column_rows());
  return counts;
}

std::int64_t TransportTensor::bytes() const {
  return store().bytes();
}

double TransportTensor::dense_bytes() const {
  return static_cast<double>(camera_grid().size()) * static_cast<double>(projector_grid().size()) *
         channels_ * sizeof(float);
}

}  // namespace symrig
