// SPDX-License-Identifier: Apache-2.0

#include "sim/light/exchange.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace symrig::sim {

Groove::Groove(Grid grid_) : grid(grid_), crease(0.47 * grid_.cols) {
  for (int col = 0; col < grid.cols; ++col) {
    const double x = col + 0.5;
    if (x < crease) ++left_cols;
    distance.push_back(std::abs(x - crease));
  }
}

double point_form_factor(double s, double t, double dy) {
  const double r2 = 2 * s * s + 2 * t * t + dy * dy;
  return r2 > 0 ? kFormFactorScale * s * t / (r2 * r2) : 0;
}

namespace {

constexpr double kStep = 0.54;
/// Replacing the tail by one term has an error of (τ u)⁴/72 of 1/u², where τ is the lowest rate kept: 1e-7
/// here.
constexpr double kFirstExponent = 0.05;
/// Dropping higher rates has an error of (1 + x) e^−x with x = τ u: 4e-8 here.
constexpr double kLastExponent = 20;

/// Adds the terms h τ₀² e^{2hk}, k < 0, as one term with their total weight at their mean rate (geometric
/// series).
void add_lower_tail(GaussianSum& sum, double first_rate) {
  const auto series = [](double power) { return std::exp(-power * kStep) / (1 - std::exp(-power * kStep)); };
  const double weight = kStep * first_rate * first_rate * series(2);
  sum.weight.push_back(weight);
  sum.rate.push_back(kStep * std::pow(first_rate, 3) * series(3) / weight);
}

}  // namespace

GaussianSum inverse_square(double lowest, double highest) {
  GaussianSum sum;
  const double first = kFirstExponent / highest;
  add_lower_tail(sum, first);
  const int terms = 1 + static_cast<int>(std::ceil(std::log(kLastExponent / lowest / first) / kStep));
  for (int k = 0; k < terms; ++k) {
    const double rate = first * std::exp(kStep * k);
    sum.weight.push_back(kStep * rate * rate);
    sum.rate.push_back(rate);
  }
  return sum;
}

namespace {

// Terms are processed in packs of kLanes and rows in strips of kStrip. The sums of one pack and strip stay in
// registers. Every loop over lanes is element-wise, so the compiler makes SIMD of it without reordering a
// sum.
constexpr int kLanes = 8;
constexpr int kStrip = 4;
using Pack = std::array<float, kLanes>;

/// The columns of one plane that a pack of terms needs. Column first + i has the weights weight[i].
struct PackedColumns {
  int first = 0;
  std::vector<Pack> weight;
};

/// kLanes terms of the sum.
struct TermPack {
  PackedColumns side[2];
  int reach = 0;           ///< rows beyond which the blur is negligible
  std::vector<Pack> blur;  ///< blur[reach + dy], dy = −reach..reach
};

double weight_at(double distance, double rate) {
  const double exponent = 2 * rate * distance * distance;
  return exponent > kNegligibleExponent ? 0 : distance * std::exp(-exponent);
}

PackedColumns pack_columns(const Groove& groove, int begin, int end, std::span<const double> rates) {
  PackedColumns packed;
  packed.first = begin;
  for (int col = begin; col < end; ++col) {
    const double distance = groove.distance[col];
    if (2 * rates[0] * distance * distance > kNegligibleExponent) {
      if (packed.weight.empty()) packed.first = col + 1;  // in the left plane, far columns come first
      continue;
    }
    Pack& weight = packed.weight.emplace_back(Pack{});
    for (std::size_t k = 0; k < rates.size(); ++k)
      weight[k] = static_cast<float>(weight_at(distance, rates[k]));
  }
  return packed;
}

std::vector<Pack> pack_blur(int reach, std::span<const double> weights, std::span<const double> rates) {
  std::vector<Pack> blur(2 * static_cast<std::size_t>(reach) + 1, Pack{});
  for (int dy = -reach; dy <= reach; ++dy)
    for (std::size_t k = 0; k < rates.size(); ++k)
      blur[std::int64_t{reach} + dy][k] =
          static_cast<float>(kFormFactorScale * weights[k] * std::exp(-rates[k] * dy * dy));
  return blur;
}

using Column = std::vector<Pack>;  // one value per row and term

class OpenExchange final : public Exchange {
 public:
  explicit OpenExchange(const Groove& groove);
  void apply(std::span<const float> in, std::span<float> out) const override;

 private:
  void gather(const PackedColumns& columns, std::span<const float> in, Column& sum) const;
  void blur(const TermPack& pack, const Column& in, Column& out) const;
  void spread(const PackedColumns& columns, const Column& column, std::span<float> out) const;

  Grid grid_;
  std::vector<TermPack> packs_;
};

double highest_squared_distance(const Groove& groove) {
  const double s = groove.distance.front();
  const double t = groove.distance.back();
  const double dy = groove.grid.rows - 1;
  return 2 * s * s + 2 * t * t + dy * dy;
}

OpenExchange::OpenExchange(const Groove& groove) : grid_(groove.grid) {
  if (groove.left_cols == 0 || groove.right_cols() == 0) return;  // a plane does not see itself
  const double lowest = 0.99;  // pixel centres of the two planes are at least one pixel apart
  const GaussianSum sum = inverse_square(lowest, std::max(1.0, highest_squared_distance(groove)));
  for (std::size_t first = 0; first < sum.rate.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, sum.rate.size() - first);
    const auto rates = std::span(sum.rate).subspan(first, count);
    const auto weights = std::span(sum.weight).subspan(first, count);
    TermPack& pack = packs_.emplace_back();
    pack.side[0] = pack_columns(groove, 0, groove.left_cols, rates);
    pack.side[1] = pack_columns(groove, groove.left_cols, grid_.cols, rates);
    pack.reach =
        static_cast<int>(std::min<double>(grid_.rows - 1, std::sqrt(kNegligibleExponent / rates[0])));
    pack.blur = pack_blur(pack.reach, weights, rates);
  }
}

/// Processes kStrip rows at once, which share each load of the weights.
template <int Rows>
void gather_rows(const PackedColumns& columns, const float* in, std::ptrdiff_t stride, Pack* sum) {
  float acc[Rows][kLanes] = {};
  for (std::size_t i = 0; i < columns.weight.size(); ++i) {
    const Pack& weight = columns.weight[i];
    for (int r = 0; r < Rows; ++r) {
      const float value = in[r * stride + columns.first + static_cast<std::ptrdiff_t>(i)];
      for (std::size_t k = 0; k < kLanes; ++k) acc[r][k] += weight[k] * value;
    }
  }
  for (int r = 0; r < Rows; ++r) std::copy_n(acc[r], kLanes, sum[r].begin());
}

void OpenExchange::gather(const PackedColumns& columns, std::span<const float> in, Column& sum) const {
  int row = 0;
  for (; row + kStrip <= grid_.rows; row += kStrip)
    gather_rows<kStrip>(columns, &in[static_cast<std::size_t>(row) * grid_.cols], grid_.cols, &sum[row]);
  for (; row < grid_.rows; ++row)
    gather_rows<1>(columns, &in[static_cast<std::size_t>(row) * grid_.cols], grid_.cols, &sum[row]);
}

void OpenExchange::blur(const TermPack& pack, const Column& in, Column& out) const {
  for (int row = 0; row < grid_.rows; ++row) {
    Pack acc{};
    const int begin = std::max(0, row - pack.reach);
    const int end = std::min(grid_.rows, row + pack.reach + 1);
    const Pack* kernel = &pack.blur[pack.reach + begin - row];
    for (int y = begin; y < end; ++y, ++kernel)
      for (std::size_t k = 0; k < kLanes; ++k) acc[k] += (*kernel)[k] * in[y][k];
    out[row] = acc;
  }
}

void OpenExchange::spread(const PackedColumns& columns, const Column& column, std::span<float> out) const {
  for (int row = 0; row < grid_.rows; ++row) {
    const Pack value = column[row];
    // This pointer may be one past the end if a side has no columns. An index may not.
    float* target = out.data() + static_cast<std::size_t>(row) * grid_.cols + columns.first;
    for (std::size_t i = 0; i < columns.weight.size(); ++i) {
      float sum = 0;
      for (std::size_t k = 0; k < kLanes; ++k) sum += columns.weight[i][k] * value[k];
      target[i] += sum;
    }
  }
}

void OpenExchange::apply(std::span<const float> in, std::span<float> out) const {
  std::fill(out.begin(), out.end(), 0.F);
  Column gathered(static_cast<std::size_t>(grid_.rows));
  Column blurred(static_cast<std::size_t>(grid_.rows));
  for (const TermPack& pack : packs_) {
    for (int from = 0; from < 2; ++from) {
      gather(pack.side[from], in, gathered);
      blur(pack, gathered, blurred);
      spread(pack.side[1 - from], blurred, out);
    }
  }
}

}  // namespace

std::unique_ptr<Exchange> open_exchange(const Groove& groove) {
  return std::make_unique<OpenExchange>(groove);
}

GrooveTransport::GrooveTransport(std::shared_ptr<const Exchange> exchange, std::vector<float> albedo,
                                 double indirect)
    : exchange_(std::move(exchange)), albedo_(std::move(albedo)), indirect_(static_cast<float>(indirect)) {}

void GrooveTransport::apply(std::span<const float> x, std::span<float> y) const {
  const std::size_t n = albedo_.size();
  std::vector<float> leaving(n);  // (R F)^k R x
  std::vector<float> arriving(n);
  for (std::size_t i = 0; i < n; ++i) leaving[i] = static_cast<float>(kForeshortening) * albedo_[i] * x[i];
  std::copy(leaving.begin(), leaving.end(), y.begin());
  for (int bounce = 0; bounce < kBounces && indirect_ > 0; ++bounce) {
    exchange_->apply(leaving, arriving);
    for (std::size_t i = 0; i < n; ++i) {
      leaving[i] = albedo_[i] * arriving[i];
      y[i] += indirect_ * leaving[i];
    }
  }
}

}  // namespace symrig::sim
