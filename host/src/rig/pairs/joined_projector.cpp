// SPDX-License-Identifier: Apache-2.0
#include "rig/pairs/each_pair.hpp"
#include "symrig/rig/pairs.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using Projectors = std::vector<std::unique_ptr<Projector>>;

class JoinedProjector final : public Projector {
 public:
  JoinedProjector(Projectors projectors, PairLayout layout)
      : projectors_(std::move(projectors)), layout_(layout) {}

  Grid grid() const override { return layout_.cells; }
  Pacing pacing() const override { return projectors_.front()->pacing(); }
  Nanoseconds refresh_period() const override {
    Nanoseconds longest{0};
    for (const auto& one : projectors_) longest = std::max(longest, one->refresh_period());
    return longest;
  }

  Result<void> load(std::span<const Pattern> patterns) override {
    for (const Pattern& pattern : patterns)
      if (pattern.grid() != layout_.cells || pattern.channels() != 1)
        return Error{ErrorCode::size_mismatch,
                     fmt::format("a pattern is {} with {} channels, but all pairs show {} with 1",
                                 to_string(pattern.grid()), pattern.channels(), to_string(layout_.cells)),
                     "give patterns on the grid of all pairs"};
    return rig::for_each_pair(projectors_.size(), [&](std::size_t k) -> Result<void> {
      std::vector<Pattern> parts;
      parts.reserve(patterns.size());
      for (const Pattern& pattern : patterns) parts.push_back(cut(pattern, layout_.tile(k)));
      return projectors_[k]->load(parts);
    });
  }

  /// The pattern is there when the last projector shows it. A screen that did not go on stops the count, so
  /// that the rig notices.
  Result<Shown> show(std::size_t index) override {
    std::vector<Shown> now(projectors_.size());
    SYMRIG_CHECK(rig::for_each_pair(projectors_.size(), [&](std::size_t k) -> Result<void> {
      SYMRIG_TRY(now[k], projectors_[k]->show(index));
      return {};
    }));
    bool all_went_on = true;
    for (std::size_t k = 0; k < now.size() && !before_.empty(); ++k)
      all_went_on = all_went_on && now[k].refresh > before_[k].refresh && now[k].since > before_[k].since;
    before_ = now;
    shown_ += all_went_on ? 1 : 0;
    const auto last = std::ranges::max_element(now, {}, &Shown::since);
    return Shown{shown_, last->since, false};
  }

  std::vector<std::string> warnings() const override {
    std::vector<std::string> all;
    for (std::size_t k = 0; k < projectors_.size(); ++k)
      for (const std::string& warning : projectors_[k]->warnings())
        all.push_back(fmt::format("pair {}: {}", k + 1, warning));
    return all;
  }
  Result<void> check() override {
    return rig::for_each_pair(projectors_.size(), [&](std::size_t k) { return projectors_[k]->check(); });
  }
  std::string describe() const override {
    std::string text = fmt::format("{} projectors", projectors_.size());
    for (const auto& one : projectors_) text += (&one == projectors_.data() ? ": " : "; ") + one->describe();
    return text;
  }

 private:
  Projectors projectors_;
  PairLayout layout_;
  std::vector<Shown> before_;
  std::uint64_t shown_ = 0;
};

}  // namespace

Result<std::unique_ptr<Projector>> join_projectors(Projectors projectors, const PairLayout& layout) {
  for (std::size_t k = 0; k < projectors.size(); ++k) {
    const Projector& one = *projectors[k];
    if (one.grid() != layout.tile(k).grid)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("pair {}: its projector shows {}, but its cells are {}", k + 1,
                               to_string(one.grid()), to_string(layout.tile(k).grid)),
                   "connect the projector that the capture began with"};
    if (one.planes().planes > 0)
      return Error{ErrorCode::bad_argument, fmt::format("pair {}: its projector shows bit planes", k + 1),
                   "several pairs need projectors that show whole pictures"};
    if (one.pacing() != projectors.front()->pacing())
      return Error{ErrorCode::bad_argument,
                   fmt::format("pair {}: its projector is not paced as that of pair 1", k + 1),
                   "give each pair a screen, or each a projector with a trigger line"};
  }
  return std::unique_ptr<Projector>(std::make_unique<JoinedProjector>(std::move(projectors), layout));
}

}  // namespace symrig
