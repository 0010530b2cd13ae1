// SPDX-License-Identifier: Apache-2.0
#include "viewer/entry_sums.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace symrig::viewer {

void EntrySums::add(std::int32_t row, std::int32_t col, std::span<const float> values) {
  if (page_.symmetric && row == col) {
    add_to_diagonal(row, values);
    return;
  }
  if (page_.symmetric && row < col) std::swap(row, col);
  Entry entry{row, col, {}};
  std::copy(values.begin(), values.end(), entry.values.begin());
  entries_.push_back(entry);
}

void EntrySums::add(std::span<const ScalarLeaf> at, std::span<const float> values) {
  const std::size_t channels = page_.channels;
  for (std::size_t k = 0; k < at.size(); ++k)
    add(at[k].row, at[k].col, values.subspan(k * channels, channels));
}

void EntrySums::add_to_diagonal(std::int32_t pixel, std::span<const float> values) {
  const std::size_t pixels = page_.camera.order.size();
  page_.diagonal.resize(pixels * values.size());
  for (std::size_t channel = 0; channel < values.size(); ++channel)
    page_.diagonal[channel * pixels + pixel] += values[channel];
}

void EntrySums::finish() {
  const auto place = [](const Entry& entry) { return std::tuple(entry.row, entry.col); };
  // Stable: the order of the sums is that of the entries, so the page has the same bytes every time.
  std::stable_sort(entries_.begin(), entries_.end(),
                   [&](const Entry& a, const Entry& b) { return place(a) < place(b); });
  const std::size_t channels = page_.channels;
  for (std::size_t k = 0; k < entries_.size(); ++k) {
    const bool same = k > 0 && place(entries_[k]) == place(entries_[k - 1]);
    if (!same) {
      page_.entries.push_back({entries_[k].row, entries_[k].col});
      page_.entry_values.resize(page_.entry_values.size() + channels);
    }
    for (std::size_t channel = 0; channel < channels; ++channel)
      page_.entry_values[page_.entry_values.size() - channels + channel] += entries_[k].values[channel];
  }
}

}  // namespace symrig::viewer
