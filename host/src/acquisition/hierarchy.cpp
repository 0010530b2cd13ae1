// SPDX-License-Identifier: Apache-2.0
#include "acquisition/hierarchy.hpp"

#include "acquisition/conflict_graph.hpp"
#include "acquisition/node.hpp"
#include "acquisition/photographer.hpp"
#include "acquisition/rank_test.hpp"

#include <chrono>
#include <cmath>
#include <string>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// The blocks of one colour and which of their (up to four) children this pattern lights.
struct Shot {
  std::vector<std::int32_t> blocks;
  int slot;
};

class Hierarchy {
 public:
  Hierarchy(Probe& probe, const CaptureOptions& options)
      : options_(options),
        tree_(probe.grid()),
        channels_(probe.channels()),
        photographer_(probe, tree_, options.progress),
        builder_(tree_, channels_) {}

  /// The algorithm, line by line as [Garg06 §5.2] tells it.
  Result<CaptureResult> run() {
    const auto start = std::chrono::steady_clock::now();
    SYMRIG_TRY(NodeLevel unknown, photograph_flood());
    while (!unknown.nodes().empty()) {
      const std::vector<Shot> shots = schedule(unknown);
      SYMRIG_CHECK(photograph(unknown, shots));
      unknown = settle(unknown, judge(unknown));
    }
    const double total = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return CaptureResult{std::move(builder_).finish(), photographer_.taken(), std::move(patterns_per_level_),
                         total - photographer_.measure_seconds()};
  }

 private:
  Result<NodeLevel> photograph_flood();
  std::vector<Shot> schedule(const NodeLevel& unknown);
  Result<void> photograph(NodeLevel& unknown, const std::vector<Shot>& shots);
  std::vector<char> judge(const NodeLevel& unknown) const;
  NodeLevel settle(const NodeLevel& unknown, const std::vector<char>& leaf);

  void add_leaf(const NodeLevel& level, const Node& node);
  void add_child(const NodeLevel& parent, const Node& node, int a, int b, NodeLevel& next);
  void place(NodeLevel& into, std::int32_t row, std::int32_t col, std::span<const float> c,
             std::span<const float> r, std::span<const PairNoise> c_noise,
             std::span<const PairNoise> r_noise);
  void add_pixel(std::int32_t row, std::int32_t col, std::span<const float> c, std::span<const float> r,
                 std::span<const PairNoise> c_noise, std::span<const PairNoise> r_noise);

  const CaptureOptions& options_;
  BlockTree tree_;
  int channels_;
  Photographer photographer_;
  TensorBuilder builder_;
  std::vector<double> flood_squared_;  ///< F² of each channel
  std::vector<std::int64_t> patterns_per_level_;
  std::vector<std::vector<std::int32_t>>
      nodes_of_block_;               ///< nodes (by index) that each block of the level is part of
  std::vector<float> leaf_factors_;  // scratch
};

/// The flood-lit photograph is the root's estimate: c = r = T 1. F is its RMS, the signal that tolerances
/// refer to.
Result<NodeLevel> Hierarchy::photograph_flood() {
  const auto pixels = static_cast<std::size_t>(tree_.grid().size());
  TreePhotograph flood;
  const std::vector<LitBlocks> pattern{{{0, static_cast<std::int32_t>(pixels)}}};
  SYMRIG_CHECK(photographer_.take("flood-lit", pattern,
                                  [&](std::size_t, TreePhotograph& p) { flood = std::move(p); }));
  patterns_per_level_.push_back(1);
  std::vector<PairNoise> noise(static_cast<std::size_t>(channels_));
  bool any = false;
  for (std::size_t channel = 0; channel < noise.size(); ++channel) {
    double squares = 0;
    for (std::size_t t = channel * pixels; t < (channel + 1) * pixels; ++t) {
      if (flood.valid[t] == 0) continue;
      squares += static_cast<double>(flood.mean[t]) * static_cast<double>(flood.mean[t]);
      noise[channel].variance += flood.variance[t];
      ++noise[channel].valid;
    }
    any = any || noise[channel].valid > 0;
    flood_squared_.push_back(noise[channel].valid > 0 ? squares / noise[channel].valid : 0);
  }
  if (!any)
    return Error{ErrorCode::bad_value, "every pixel of the flood-lit photograph is invalid",
                 "shorten the exposures or look for a cap on the lens"};
  NodeLevel root(tree_, 0, channels_);
  place(root, 0, 0, flood.mean, {}, noise, noise);
  return root;
}

/// Colours the blocks of the level so that no two in one colour share a block whose transport with both is
/// unknown, and lights the children of each colour one after another.
std::vector<Shot> Hierarchy::schedule(const NodeLevel& unknown) {
  nodes_of_block_.assign(static_cast<std::size_t>(unknown.block_count()), {});
  std::vector<std::pair<std::int32_t, std::int32_t>> edges;
  for (std::size_t n = 0; n < unknown.nodes().size(); ++n) {
    const Node& node = unknown.nodes()[n];
    edges.emplace_back(node.row, node.col);
    nodes_of_block_[static_cast<std::size_t>(node.row)].push_back(static_cast<std::int32_t>(n));
    if (!node.diagonal())
      nodes_of_block_[static_cast<std::size_t>(node.col)].push_back(static_cast<std::int32_t>(n));
  }
  const ConflictGraph graph(unknown.block_count(), edges);
  std::vector<Shot> shots;
  for (const auto& colour : graph.colour()) {
    for (int slot = 0; slot < 4; ++slot) {
      Shot shot{{}, slot};
      for (const std::int32_t b : colour)
        if (slot < unknown.block(b).children) shot.blocks.push_back(b);
      if (!shot.blocks.empty()) shots.push_back(std::move(shot));
    }
  }
  return shots;
}

Result<void> Hierarchy::photograph(NodeLevel& unknown, const std::vector<Shot>& shots) {
  if (unknown.evidence_bytes() > options_.memory_limit)
    return Error{ErrorCode::limit,
                 "level " + std::to_string(unknown.level()) + " would need " +
                     std::to_string(unknown.evidence_bytes() >> 20) + " MiB for " +
                     std::to_string(unknown.nodes().size()) + " unknown nodes",
                 "raise the tolerance or use a smaller grid; the scene may not be data-sparse"};
  unknown.make_room();
  std::vector<LitBlocks> patterns;
  for (const Shot& shot : shots) {
    LitBlocks lit;
    for (const std::int32_t b : shot.blocks) {
      const Block& child = unknown.child(unknown.block(b), shot.slot);
      lit.push_back({child.begin, child.end});
    }
    patterns.push_back(std::move(lit));
  }
  const TransportTensor& known = builder_.current();
  patterns_per_level_.push_back(std::ssize(shots));
  return photographer_.take(
      "level " + std::to_string(unknown.level()), patterns, [&](std::size_t k, TreePhotograph& photograph) {
        subtract_known(photograph, known, channels_);
        for (const std::int32_t b : shots[k].blocks) {
          for (const std::int32_t n : nodes_of_block_[static_cast<std::size_t>(b)]) {
            const Node& node = unknown.nodes()[static_cast<std::size_t>(n)];
            const auto side = node.col == b ? NodeLevel::Side::col : NodeLevel::Side::row;
            unknown.record(node, side, shots[k].slot, photograph.mean, photograph.variance, photograph.valid);
          }
        }
      });
}

std::vector<char> Hierarchy::judge(const NodeLevel& unknown) const {
  std::vector<char> leaf(unknown.nodes().size());
  tbb::parallel_for(std::size_t{0}, leaf.size(), [&](std::size_t n) {
    leaf[n] = is_leaf(unknown.evidence(unknown.nodes()[n], flood_squared_), options_.rule) ? 1 : 0;
  });
  return leaf;
}

NodeLevel Hierarchy::settle(const NodeLevel& unknown, const std::vector<char>& leaf) {
  NodeLevel next(tree_, unknown.level() + 1, channels_);
  for (std::size_t n = 0; n < leaf.size(); ++n) {
    const Node& node = unknown.nodes()[n];
    if (leaf[n] != 0) {
      add_leaf(unknown, node);
      continue;
    }
    for (int a = 0; a < unknown.block(node.row).children; ++a)
      for (int b = 0; b < (node.diagonal() ? a + 1 : unknown.block(node.col).children); ++b)
        add_child(unknown, node, a, b, next);
  }
  return next;
}

/// T_IJ ≈ (c/√s)(r/√s)'.
void Hierarchy::add_leaf(const NodeLevel& level, const Node& node) {
  leaf_factors_.clear();
  for (int channel = 0; channel < channels_; ++channel) {
    const double s = level.sums(node, channel).s;
    const auto scale = s > 0 ? static_cast<float>(1 / std::sqrt(s)) : 0.0F;
    for (const float v : level.c(node, channel)) leaf_factors_.push_back(scale * v);
    for (const float v : level.r(node, channel)) leaf_factors_.push_back(scale * v);
  }
  const Block& i = level.block(node.row);
  const Block& j = level.block(node.col);
  builder_.add_leaf(i.begin, i.end, j.begin, j.end, 1, level.level(), leaf_factors_);
}

/// Child pair (a, b): c = the photograph of lit child b seen on child a, r = that of lit child a seen on
/// child b.
void Hierarchy::add_child(const NodeLevel& parent, const Node& node, int a, int b, NodeLevel& next) {
  const Block& i = parent.block(node.row);
  const Block& j = parent.block(node.col);
  const Block& child_i = parent.child(i, a);
  const Block& child_j = parent.child(j, b);
  const bool diagonal = node.diagonal() && a == b;
  std::vector<float> c, r;
  std::vector<PairNoise> c_noise, r_noise;
  for (int channel = 0; channel < channels_; ++channel) {
    const auto on_i = parent.y(node, b, channel)
                          .subspan(static_cast<std::size_t>(child_i.begin - i.begin),
                                   static_cast<std::size_t>(child_i.size()));
    const auto on_j = parent.z(node, a, channel)
                          .subspan(static_cast<std::size_t>(child_j.begin - j.begin),
                                   static_cast<std::size_t>(child_j.size()));
    c.insert(c.end(), on_i.begin(), on_i.end());
    if (!diagonal) r.insert(r.end(), on_j.begin(), on_j.end());
    c_noise.push_back(parent.y_noise(node, b, a, channel));
    r_noise.push_back(parent.z_noise(node, a, b, channel));
  }
  place(next, i.first_child + a, j.first_child + b, c, r, c_noise, r_noise);
}

/// A new node is stored as empty, stored as a scalar, or goes into the next level.
void Hierarchy::place(NodeLevel& into, std::int32_t row, std::int32_t col, std::span<const float> c,
                      std::span<const float> r, std::span<const PairNoise> c_noise,
                      std::span<const PairNoise> r_noise) {
  const Block& i = into.block(row);
  const Block& j = into.block(col);
  const bool diagonal = row == col;
  Energy energy;
  for (std::size_t channel = 0; channel < c_noise.size(); ++channel) {
    if (flood_squared_[channel] <= 0) continue;
    const auto add = [&](std::span<const float> image, std::size_t size, const PairNoise& noise) {
      double signal = 0;
      for (const float v : image.subspan(channel * size, size))
        signal += static_cast<double>(v) * static_cast<double>(v);
      energy.signal += signal / flood_squared_[channel];
      energy.noise += static_cast<double>(noise.variance) / flood_squared_[channel];
      energy.samples += noise.valid;
    };
    add(c, static_cast<std::size_t>(i.size()), c_noise[channel]);
    if (!diagonal) add(r, static_cast<std::size_t>(j.size()), r_noise[channel]);
  }
  if (is_empty(energy, options_.rule)) {
    builder_.add_empty(into.level(), row, col);
  } else if (i.single_pixel() && j.single_pixel()) {
    add_pixel(i.begin, j.begin, c, diagonal ? c : r, c_noise, r_noise);
  } else {
    into.add(row, col, c, r, c_noise, r_noise);
  }
}

/// One entry of T, measured from both sides: their mean weighted by inverse variance; a side without a valid
/// sample does not count.
void Hierarchy::add_pixel(std::int32_t row, std::int32_t col, std::span<const float> c,
                          std::span<const float> r, std::span<const PairNoise> c_noise,
                          std::span<const PairNoise> r_noise) {
  std::vector<float> value(c_noise.size());
  for (std::size_t channel = 0; channel < value.size(); ++channel) {
    const float vc = c_noise[channel].variance;
    const float vr = r_noise[channel].variance;
    float weight = vc + vr > 0 ? vr / (vc + vr) : 0.5F;
    if (c_noise[channel].valid == 0 && r_noise[channel].valid != 0) weight = 0;
    if (c_noise[channel].valid != 0 && r_noise[channel].valid == 0) weight = 1;
    value[channel] = weight * c[channel] + (1 - weight) * r[channel];
  }
  builder_.add_scalar(row, col, value);
}

}  // namespace

Result<CaptureResult> capture_hierarchy(Probe& probe, const CaptureOptions& options) {
  return Hierarchy(probe, options).run();
}

}  // namespace symrig::acquisition
