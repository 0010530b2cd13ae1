// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/gain_mismatch.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

constexpr std::size_t kFewestBlocks = 16, kMostBlocks = 256;
/// Both sums must be this many standard deviations above nothing.
constexpr double kBright = 10;
/// Fewer pairs do not determine the shape.
constexpr std::size_t kFewestPairs = 24;
/// A priori standard deviations: of log g at the corner by each shape, and of the veil.
constexpr double kPriorShape = 0.5, kPriorVeil = 0.02;
/// Other light in the photographs of a node: the least relative error of a sum.
constexpr double kLeastMisfit = 1e-3;
constexpr int kRounds = 8;

using Unknowns = Eigen::Matrix<double, kGainShapes + 1, 1>;
using Square = Eigen::Matrix<double, kGainShapes + 1, kGainShapes + 1>;

Square scatter(std::span<const Unknowns> scores) {
  Square sum = Square::Zero();
  for (const Unknowns& one : scores) sum += one * one.transpose();
  return sum;
}

double sum(std::span<const float> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

bool touch(const Block& a, const Block& b) {
  return a.row <= b.row + b.rows && b.row <= a.row + a.rows && a.col <= b.col + b.cols &&
         b.col <= a.col + a.cols;
}

}  // namespace

GainEvidence::GainEvidence(const BlockTree& tree) : tree_(tree) {}

GainShapes GainEvidence::mean_shape(std::span<const float> light, const Block& block, double sum) const {
  GainShapes mean{};
  for (std::size_t t = 0; t < light.size(); ++t)
    for (int s = 0; s < kGainShapes; ++s)
      mean[s] += static_cast<double>(light[t]) * shapes_[static_cast<std::size_t>(block.begin) + t][s];
  for (double& one : mean) one /= sum;
  return mean;
}

/// own: light of each block on itself; 0 where not known.
bool GainEvidence::pair_of(const NodeLevel& level, const Node& node, int channel, std::span<const double> own,
                           Pair& pair) const {
  const Block &i = level.block(node.row), &j = level.block(node.col);
  if (node.diagonal() || touch(i, j)) return false;
  const auto c = level.c(node, channel), r = level.r(node, channel);
  const double on_i = sum(c), on_j = sum(r);
  const EstimateSums& sums = level.sums(node, channel);
  const auto bright = [](double light, float noise) {
    return light > 0 && light > kBright * std::sqrt(static_cast<double>(noise));
  };
  if (!bright(on_i, sums.c_noise) || !bright(on_j, sums.r_noise)) return false;
  const GainShapes at_i = mean_shape(c, i, on_i), at_j = mean_shape(r, j, on_j);
  for (int s = 0; s < kGainShapes; ++s) pair.slope[s] = at_i[s] - at_j[s];
  const auto pixels = static_cast<double>(shapes_.size());
  pair.slope[kGainShapes] = (own[static_cast<std::size_t>(node.col)] * i.size() / on_i -
                             own[static_cast<std::size_t>(node.row)] * j.size() / on_j) /
                            pixels;
  pair.log_ratio = std::log(on_i / on_j);
  pair.variance =
      static_cast<double>(sums.c_noise) / (on_i * on_i) + static_cast<double>(sums.r_noise) / (on_j * on_j);
  return true;
}

void GainEvidence::add(const NodeLevel& level) {
  const auto blocks = static_cast<std::size_t>(level.block_count());
  if (blocks < kFewestBlocks || blocks > kMostBlocks) return;
  if (shapes_.empty()) {
    const std::vector<GainShapes> raster = gain_shapes(tree_.grid());
    for (const std::int32_t at : tree_.order()) shapes_.push_back(raster[static_cast<std::size_t>(at)]);
  }
  const auto nodes = level.nodes();
  for (int channel = 0; channel < level.channels(); ++channel) {
    std::vector<double> own(blocks);
    for (const Node& node : nodes)
      if (node.diagonal())
        own[static_cast<std::size_t>(node.row)] = std::max(0.0, sum(level.c(node, channel)));
    std::vector<Pair> pairs(nodes.size());
    std::vector<std::uint8_t> good(nodes.size());
    tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t n) {
      good[n] = pair_of(level, nodes[n], channel, own, pairs[n]) ? 1 : 0;
    });
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (good[n] == 0) continue;
      pairs[n].node = nodes_ + n;
      pairs[n].blocks = {blocks_ + static_cast<std::size_t>(nodes[n].row),
                         blocks_ + static_cast<std::size_t>(nodes[n].col)};
      pairs_.push_back(pairs[n]);
    }
  }
  nodes_ += nodes.size();
  blocks_ += blocks;
}

// Each pair says log(Σc / Σr) = slope · x + error, x: the shapes and the veil (GainEvidence). x minimises
//
//   Σ_pairs ρ((log ratio − slope · x) / σ) + Σ_unknowns (x / prior)²,   σ² = variance + misfit²
//
// ρ: Tukey's biweight [Beaton74], by iterated least squares. The prior keeps what no pair tells at 0.
//
// 1. What is left of each pair at x. Its robust spread is the misfit: the light that a leaf's photographs
//    hold beside the pair's own. It is never below kLeastMisfit.
// 2. Weights w = biweight / σ². Normal equations N = Σ w slope slope' + prior, right side Σ w left slope.
// 3. x moves by N⁻¹ right; eight rounds are enough.
// 4. Covariance of x: 2 N⁻¹ M N⁻¹. M is not the stated variance but the scatter of the nodes' scores
//    g = Σ_channels w left slope. Other light is in all pairs of its block, so nodes with a block in common
//    do not err independently: M = Σ_blocks (Σ g)(Σ g)' − Σ_nodes g g' [Aronow15]. That need not be
//    positive: the larger of it and Σ_nodes g g' counts. Twice: parents and children show the same light.
// 5. The mismatch is the rms of shape · x over the pixels, its sigma that of the covariance in the same
//    sum. The veil is fitted, so that it is not taken for a shape; it is no part of the mismatch.
GainMismatch GainEvidence::fit() const {
  if (pairs_.size() < kFewestPairs) return {};
  Unknowns found = Unknowns::Zero();
  Square independent, clustered;
  std::vector<double> off(pairs_.size());
  std::vector<Unknowns> of_node(nodes_), of_block(blocks_);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      off[k] = pairs_[k].log_ratio - found.dot(Unknowns(pairs_[k].slope.data()));
    const double misfit = std::max(kLeastMisfit, robust_sigma(off, 0));
    Square normal = Square::Zero();
    std::fill(of_node.begin(), of_node.end(), Unknowns(Unknowns::Zero()));
    std::fill(of_block.begin(), of_block.end(), Unknowns(Unknowns::Zero()));
    for (int s = 0; s < kGainShapes; ++s) normal(s, s) = 1 / (kPriorShape * kPriorShape);
    normal(kGainShapes, kGainShapes) = 1 / (kPriorVeil * kPriorVeil);
    Unknowns right = -normal * found;
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const double variance = pairs_[k].variance + misfit * misfit;
      const double weight = tukey_weight(off[k] / std::sqrt(variance)) / variance;
      const Unknowns slope(pairs_[k].slope.data()), score = weight * off[k] * slope;
      normal += weight * slope * slope.transpose();
      right += score;
      of_node[pairs_[k].node] += score;
      for (const std::size_t block : pairs_[k].blocks) of_block[block] += score;
    }
    const Square inverse = normal.inverse(), alone = scatter(of_node);
    found += inverse * right;
    // Parents and children show the same light in photographs of their own; so a pair counts about twice.
    independent = 2 * inverse * alone * inverse;
    clustered = 2 * inverse * (scatter(of_block) - alone) * inverse;
  }
  GainMismatch mismatch;
  double square = 0, variance = 0, shared = 0;
  for (const GainShapes& one : shapes_) {
    const Eigen::Map<const Eigen::Matrix<double, kGainShapes, 1>> shape(one.data());
    square += std::pow(shape.dot(found.head<kGainShapes>()), 2);
    variance += shape.dot(independent.topLeftCorner<kGainShapes, kGainShapes>() * shape);
    shared += shape.dot(clustered.topLeftCorner<kGainShapes, kGainShapes>() * shape);
  }
  const auto pixels = static_cast<double>(shapes_.size());
  std::copy_n(found.data(), kGainShapes, mismatch.shape.begin());
  mismatch.rms = std::sqrt(square / pixels);
  mismatch.sigma = std::sqrt(std::max(variance, shared) / pixels);
  mismatch.found = mismatch.sigma > 0 && mismatch.rms > GainMismatch::sigmas * mismatch.sigma;
  return mismatch;
}

namespace {

/// ε of each pixel, in tree order.
std::vector<double> gain_of(const BlockTree& tree, const GainShapes& weights) {
  const std::vector<GainShapes> shapes = gain_shapes(tree.grid());
  std::vector<double> gain;
  gain.reserve(shapes.size());
  for (const std::int32_t raster : tree.order()) {
    const GainShapes& shape = shapes[static_cast<std::size_t>(raster)];
    gain.push_back(std::inner_product(shape.begin(), shape.end(), weights.begin(), 0.0));
  }
  return gain;
}

std::vector<float> applied(const TransportTensor& tensor, std::span<const float> pattern, int channel) {
  std::vector<float> seen(pattern.size());
  tensor.apply_tree(pattern, seen, channel, false);
  return seen;
}

std::vector<float> times(std::span<const float> pattern, std::span<const double> factor) {
  std::vector<float> product(pattern.size());
  for (std::size_t t = 0; t < pattern.size(); ++t)
    product[t] = static_cast<float>(static_cast<double>(pattern[t]) * factor[t]);
  return product;
}

}  // namespace

GainError::GainError(const TransportTensor& tensor, std::span<const TreePhotograph* const> photographs,
                     const GainMismatch& mismatch) {
  if (!mismatch.found) return;
  doubt_ = 2 * mismatch.sigma / mismatch.rms;
  const std::vector<double> gain = gain_of(tensor.camera_tree(), mismatch.shape);
  for (const TreePhotograph* const one : photographs) {
    Seen& seen = seen_.emplace_back();
    for (int channel = 0; channel < tensor.channels(); ++channel) {
      const auto here = times(applied(tensor, one->pattern, channel), gain);
      const auto there = applied(tensor, times(one->pattern, gain), channel);
      seen.here.append(here.begin(), here.end());
      seen.there.append(there.begin(), there.end());
    }
  }
}

GainLight GainError::light(std::span<const WeightedCheck> sum, std::size_t at) const {
  GainLight light;
  if (seen_.empty()) return light;
  for (const WeightedCheck& one : sum) {
    light.here += one.weight * static_cast<double>(seen_[one.photograph].here[at]);
    light.there += one.weight * static_cast<double>(seen_[one.photograph].there[at]);
  }
  return light;
}

}  // namespace symrig::acquisition
