// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/node.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace symrig::acquisition {
namespace {

double sum(std::span<const float> v) {
  return std::accumulate(v.begin(), v.end(), 0.0);
}
double energy(std::span<const float> v) {
  return std::inner_product(v.begin(), v.end(), v.begin(), 0.0, std::plus<>(),
                            [](float a, float b) { return static_cast<double>(a) * static_cast<double>(b); });
}

struct NodeSamples {
  std::span<const float> residual, variance;
  std::span<const std::uint8_t> valid;
};

/// Copies samples; one that is not valid takes the estimate's value. Sums go in lanes, so that one does not
/// wait for the other.
PairNoise keep_samples(const NodeSamples& from, float gain, std::span<const float> estimate, float* to) {
  constexpr std::size_t kLanes = 8;
  std::array<float, kLanes> variance{};
  std::int32_t valid = 0;
  const std::size_t size = estimate.size();
  const auto keep = [&](std::size_t t, std::size_t lane) {
    const bool ok = from.valid[t] != 0;
    to[t] = ok ? from.residual[t] : gain * estimate[t];
    variance[lane] += ok ? from.variance[t] : 0;
    valid += ok ? 1 : 0;
  };
  std::size_t t = 0;
  for (; t + kLanes <= size; t += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) keep(t + lane, lane);
  for (; t < size; ++t) keep(t, 0);
  return {std::accumulate(variance.begin(), variance.end(), 0.0F), valid};
}

std::span<const float> part(std::span<const float> whole, const Block& of, const Block& child) {
  return whole.subspan(child.begin - of.begin, static_cast<std::size_t>(child.size()));
}

}  // namespace

void NodeLevel::add(std::int32_t row, std::int32_t col, std::span<const float> c, std::span<const float> r,
                    std::span<const PairNoise> c_noise, std::span<const PairNoise> r_noise,
                    double undecayed) {
  Node node{row, col, static_cast<std::int64_t>(estimates_.size())};
  node.undecayed = undecayed;
  const std::size_t rows = block(row).size();
  const std::size_t cols = block(col).size();
  for (int channel = 0; channel < channels_; ++channel) {
    const std::size_t at = channel;
    const auto c_of = c.subspan(at * rows, rows);
    const auto r_of = node.diagonal() ? c_of : r.subspan(at * cols, cols);
    estimates_.append(c_of.begin(), c_of.end());
    if (!node.diagonal()) estimates_.append(r_of.begin(), r_of.end());
    const double s = 0.5 * (light(c_of, block(row)) + light(r_of, block(col)));
    const double floor = std::sqrt(std::max(energy(c_of), energy(r_of)));
    sums_.push_back({std::max(s, floor), c_noise[at].variance, r_noise[at].variance});
  }
  nodes_.push_back(node);
}

double NodeLevel::light(std::span<const float> image, const Block& of) const {
  if (of.children == 0) return std::abs(sum(image));
  double light = 0;
  for (int k = 0; k < of.children; ++k) light += std::abs(sum(part(image, of, child(of, k))));
  return light;
}

std::int64_t NodeLevel::evidence_size(const Node& node) const {
  const Block& i = block(node.row);
  const Block& j = block(node.col);
  const std::int64_t y = std::int64_t{j.children} * i.size();
  return node.diagonal() ? y : y + std::int64_t{i.children} * j.size();
}

std::int64_t NodeLevel::pair_count(const Node& node) const {
  const std::int64_t pairs = std::int64_t{block(node.row).children} * block(node.col).children;
  return node.diagonal() ? pairs : 2 * pairs;
}

std::int64_t NodeLevel::room(std::span<const std::int32_t> tested) const {
  auto bytes =
      static_cast<std::int64_t>(evidence_.size() * sizeof(float) + pairs_.size() * sizeof(PairNoise));
  for (const std::int32_t n : tested) {
    const Node& node = nodes_[n];
    bytes += channels_ * (evidence_size(node) * static_cast<std::int64_t>(sizeof(float)) +
                          pair_count(node) * static_cast<std::int64_t>(sizeof(PairNoise)));
  }
  return bytes;
}

void NodeLevel::make_room(std::span<const std::int32_t> tested) {
  auto floats = static_cast<std::int64_t>(evidence_.size());
  auto pairs = static_cast<std::int64_t>(pairs_.size());
  for (const std::int32_t n : tested) {
    Node& node = nodes_[n];
    node.evidence = floats;
    node.pairs = pairs;
    floats += channels_ * evidence_size(node);
    pairs += channels_ * pair_count(node);
  }
  evidence_.resize(floats);
  pairs_.resize(pairs);
}

std::span<const float> NodeLevel::c(const Node& node, int channel) const {
  const std::size_t rows = block(node.row).size();
  const std::size_t stride = node.diagonal() ? rows : rows + static_cast<std::size_t>(block(node.col).size());
  return std::span(estimates_)
      .subspan(static_cast<std::size_t>(node.estimate) + static_cast<std::size_t>(channel) * stride, rows);
}

std::span<const float> NodeLevel::r(const Node& node, int channel) const {
  const auto c_of = c(node, channel);
  return node.diagonal()
             ? c_of
             : std::span(c_of.data() + c_of.size(), static_cast<std::size_t>(block(node.col).size()));
}

const EstimateSums& NodeLevel::sums(const Node& node, int channel) const {
  const std::size_t index = &node - nodes_.data();
  return sums_[index * static_cast<std::size_t>(channels_) + static_cast<std::size_t>(channel)];
}

std::size_t NodeLevel::y_offset(const Node& node, int slot, int channel) const {
  return static_cast<std::size_t>(node.evidence + channel * evidence_size(node) +
                                  std::int64_t{slot} * block(node.row).size());
}

std::size_t NodeLevel::z_offset(const Node& node, int slot, int channel) const {
  if (node.diagonal()) return y_offset(node, slot, channel);
  return y_offset(node, block(node.col).children, channel) +
         static_cast<std::size_t>(slot * block(node.col).size());
}

std::size_t NodeLevel::pair_offset(const Node& node, Side lit, int slot, int channel) const {
  const std::int64_t rows = block(node.row).children;
  const std::int64_t cols = block(node.col).children;
  const std::int64_t base = node.pairs + channel * pair_count(node);
  if (lit == Side::col || node.diagonal()) return static_cast<std::size_t>(base + slot * rows);
  return static_cast<std::size_t>(base + rows * cols + slot * cols);
}

std::span<const float> NodeLevel::y(const Node& node, int slot, int channel) const {
  return std::span(evidence_).subspan(y_offset(node, slot, channel),
                                      static_cast<std::size_t>(block(node.row).size()));
}

std::span<const float> NodeLevel::z(const Node& node, int slot, int channel) const {
  return std::span(evidence_).subspan(z_offset(node, slot, channel),
                                      static_cast<std::size_t>(block(node.col).size()));
}

const PairNoise& NodeLevel::y_noise(const Node& node, int b, int a, int channel) const {
  return pairs_[pair_offset(node, Side::col, b, channel) + static_cast<std::size_t>(a)];
}

const PairNoise& NodeLevel::z_noise(const Node& node, int a, int b, int channel) const {
  return pairs_[pair_offset(node, Side::row, a, channel) + static_cast<std::size_t>(b)];
}

/// What the estimate says that a lit child adds to the seen block, as a share of its estimate.
float NodeLevel::gain(const Node& node, Side lit, int slot, int channel) const {
  const Block& shone = block(lit == Side::col ? node.col : node.row);
  const auto estimate = lit == Side::col ? r(node, channel) : c(node, channel);
  const double s = sums(node, channel).s;
  return s > 0 ? static_cast<float>(sum(part(estimate, shone, child(shone, slot))) / s) : 0.0F;
}

void NodeLevel::add_estimate(const Node& node, Side lit, int slot, float beside,
                             std::span<float> light) const {
  const Block& seen = block(lit == Side::col ? node.row : node.col);
  const std::size_t pixels = light.size() / static_cast<std::size_t>(channels_);
  for (int channel = 0; channel < channels_; ++channel) {
    const auto estimate = lit == Side::col ? c(node, channel) : r(node, channel);
    const float gain = this->gain(node, lit, slot, channel);
    float* const out = light.data() + static_cast<std::size_t>(channel) * pixels + seen.begin;
    for (int a = 0; a < seen.children; ++a) {
      const Block& of = child(seen, a);
      const float share = !node.diagonal() ? gain : a == slot ? 1 : beside;
      for (std::int32_t t = of.begin - seen.begin; t < of.end - seen.begin; ++t)
        out[t] += share * estimate[t];
    }
  }
}

NodeLevel::DiagonalLight NodeLevel::diagonal_light(std::span<const std::int32_t> tested) const {
  DiagonalLight light;
  for (const std::int32_t n : tested) {
    const Node& node = nodes_[n];
    if (!node.diagonal() || node.evidence < 0) continue;
    const Block& of = block(node.row);
    for (int channel = 0; channel < channels_; ++channel)
      for (int slot = 0; slot < of.children; ++slot) {
        const auto seen = y(node, slot, channel);
        const double lit = sum(part(seen, of, child(of, slot)));
        light.lit += lit;
        if (of.children > 1) light.beside += (sum(seen) - lit) / (of.children - 1);
      }
  }
  return light;
}

void NodeLevel::drop_evidence() {
  for (Node& node : nodes_) node.evidence = node.pairs = -1;
  evidence_ = {};
  pairs_ = {};
}

void NodeLevel::record(const Node& node, Side lit, int slot, std::span<const float> residual,
                       std::span<const float> variance, std::span<const std::uint8_t> valid) {
  const Block& seen = block(lit == Side::col ? node.row : node.col);
  const std::size_t pixels = residual.size() / static_cast<std::size_t>(channels_);
  for (int channel = 0; channel < channels_; ++channel) {
    const auto seen_estimate = lit == Side::col ? c(node, channel) : r(node, channel);
    const float gain = this->gain(node, lit, slot, channel);
    float* out =
        evidence_.data() + (lit == Side::col ? y_offset(node, slot, channel) : z_offset(node, slot, channel));
    PairNoise* noise = pairs_.data() + pair_offset(node, lit, slot, channel);
    const std::size_t base = static_cast<std::size_t>(channel) * pixels;
    for (int a = 0; a < seen.children; ++a, ++noise) {
      const Block& seen_child = child(seen, a);
      const auto first = base + static_cast<std::size_t>(seen_child.begin);
      const std::size_t local = seen_child.begin - seen.begin;
      const std::size_t size = seen_child.size();
      *noise = keep_samples(
          {residual.subspan(first, size), variance.subspan(first, size), valid.subspan(first, size)}, gain,
          seen_estimate.subspan(local, size), out + local);
    }
  }
}

void NodeLevel::subtract_measured(const Node& node, Side lit, int slot, std::span<float> residual) const {
  const Block& seen = block(lit == Side::col ? node.row : node.col);
  const std::size_t pixels = residual.size() / static_cast<std::size_t>(channels_);
  for (int channel = 0; channel < channels_; ++channel) {
    const auto measured = lit == Side::col ? y(node, slot, channel) : z(node, slot, channel);
    float* const out = residual.data() + static_cast<std::size_t>(channel) * pixels + seen.begin;
    for (std::size_t t = 0; t < measured.size(); ++t) out[t] -= measured[t];
  }
}

void NodeLevel::add_side_evidence(const Node& node, Side lit, int channel, double scale,
                                  RankEvidence& into) const {
  const bool col_lit = lit == Side::col;
  const Block& seen = block(col_lit ? node.row : node.col);
  const Block& shone = block(col_lit ? node.col : node.row);
  const auto seen_estimate = col_lit ? c(node, channel) : r(node, channel);
  const auto lit_estimate = col_lit ? r(node, channel) : c(node, channel);
  const EstimateSums& estimate = sums(node, channel);
  for (int slot = 0; slot < shone.children; ++slot) {
    const double gain = estimate.s > 0 ? sum(part(lit_estimate, shone, child(shone, slot))) / estimate.s : 0;
    const auto measured = col_lit ? y(node, slot, channel) : z(node, slot, channel);
    const double estimate_noise = gain * gain *
                                  static_cast<double>(col_lit ? estimate.c_noise : estimate.r_noise) /
                                  static_cast<double>(seen.size());
    for (int k = 0; k < seen.children; ++k) {
      const Block& seen_child = child(seen, k);
      const auto measured_part = part(measured, seen, seen_child);
      const auto estimate_part = part(seen_estimate, seen, seen_child);
      const PairNoise& noise = col_lit ? y_noise(node, slot, k, channel) : z_noise(node, slot, k, channel);
      double misfit = 0;
      for (std::size_t t = 0; t < measured_part.size(); ++t) {
        const double error =
            static_cast<double>(measured_part[t]) - gain * static_cast<double>(estimate_part[t]);
        misfit += error * error;
      }
      (col_lit ? into.on_row[k][slot] : into.on_col[slot][k]) +=
          {scale * misfit, scale * energy(measured_part),
           scale * (static_cast<double>(noise.variance) + estimate_noise * seen_child.size()),
           static_cast<double>(noise.valid), scale * static_cast<double>(noise.variance)};
    }
  }
}

RankEvidence NodeLevel::evidence(const Node& node, std::span<const double> flood_squared) const {
  RankEvidence all;
  for (int channel = 0; channel < channels_; ++channel) {
    const double f = flood_squared[channel];
    if (f <= 0) continue;
    add_side_evidence(node, Side::col, channel, 1 / f, all);
    if (!node.diagonal()) add_side_evidence(node, Side::row, channel, 1 / f, all);
  }
  all.diagonal = node.diagonal();
  return all;
}

Result<FloodLit> FloodLit::read(const Photographer& photographer, int channels) {
  TreePhotograph photograph;
  SYMRIG_CHECK(photographer.read(
      0, 1, [&](std::int64_t, std::span<TreePhotograph> p) { photograph = std::move(p[0]); }));
  const std::size_t pixels = photograph.pattern.size();
  FloodLit flood;
  for (std::size_t channel = 0; channel < static_cast<std::size_t>(channels); ++channel) {
    double squares = 0;
    PairNoise noise;
    for (std::size_t t = channel * pixels; t < (channel + 1) * pixels; ++t) {
      if (photograph.valid[t] == 0) continue;
      squares += static_cast<double>(photograph.mean[t]) * static_cast<double>(photograph.mean[t]);
      noise.variance += photograph.variance[t];
      flood.noisy = flood.noisy || photograph.variance[t] > 0;
      ++noise.valid;
    }
    flood.noise.push_back(noise);
    flood.squared.push_back(noise.valid > 0 ? squares / noise.valid : 0);
  }
  if (std::all_of(flood.noise.begin(), flood.noise.end(), [](const PairNoise& n) { return n.valid == 0; }))
    return Error{ErrorCode::bad_value, "every pixel of the flood-lit photograph is invalid",
                 "shorten the exposures or look for a cap on the lens"};
  flood.image = std::move(photograph.mean);
  return flood;
}

}  // namespace symrig::acquisition
