// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/brute_force_rest.hpp"

#include "acquisition/tree/tree_photograph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

using Matrix = Eigen::MatrixXd;
using Eigen::Index;

constexpr float kUnmeasured = std::numeric_limits<float>::quiet_NaN();
constexpr std::int64_t kColumnOperations = 8;  // of an entry, for Work
constexpr double kRounding = 1e-6;             // of a photograph's RMS: it is a float sum of many terms

std::size_t pixel(const std::vector<std::int32_t>& list, Index n) {
  return static_cast<std::size_t>(list[n]);
}

double square(double x) {
  return x * x;
}

Result<std::vector<TreePhotograph>> photographs_of(const Photographer& photographer,
                                                   const std::vector<LogRange>& ranges) {
  std::vector<TreePhotograph> all;
  for (const LogRange& range : ranges)
    SYMRIG_CHECK(photographer.read(range.first, range.last - range.first,
                                   [&](std::int64_t, std::span<TreePhotograph> some) {
                                     all.insert(all.end(), some.begin(), some.end());
                                   }));
  return all;
}

/// [photograph × pixel]
Matrix patterns_of(const std::vector<TreePhotograph>& photographs, std::size_t pixels) {
  Matrix patterns(std::ssize(photographs), static_cast<Index>(pixels));
  for (std::size_t k = 0; k < photographs.size(); ++k)
    for (std::size_t t = 0; t < pixels; ++t)
      patterns(static_cast<Index>(k), static_cast<Index>(t)) = static_cast<double>(photographs[k].pattern[t]);
  return patterns;
}

/// As many pixels as patterns: those that the patterns separate best, the pivots of their QR.
std::vector<std::int32_t> separable_pixels(const Matrix& patterns) {
  const Eigen::ColPivHouseholderQR<Matrix> qr(patterns);
  std::vector<std::int32_t> pixels;
  for (Index k = 0; k < patterns.rows(); ++k)
    pixels.push_back(static_cast<std::int32_t>(qr.colsPermutation().indices()(k)));
  std::sort(pixels.begin(), pixels.end());
  return pixels;
}

/// min Σ w (P E − R)² + Σ q E² over symmetric E, by conjugate gradients on the normal equations, scaled by
/// their diagonal.
class Symmetric {
 public:
  Symmetric(const Matrix& p, const Matrix& weight, const Matrix& prior, const Work& work)
      : work_(work),
        p_(p),
        weight_(weight),
        prior_(prior),
        diagonal_(half(p.cwiseProduct(p).transpose() * weight) + prior) {}

  Matrix solve(const Matrix& right) const {
    // Photographs without noise weigh 10⁸ times the prior and more: then many steps are needed, as long as
    // they are cheap.
    constexpr double kEnough = 1e-12, kOperations = 2e10, kFewestSteps = 200, kMostSteps = 20'000;
    const double each = 4.0 * static_cast<double>(p_.rows()) * square(static_cast<double>(p_.cols()));
    const auto most = static_cast<int>(std::clamp(kOperations / each, kFewestSteps, kMostSteps));
    Matrix e = Matrix::Zero(prior_.rows(), prior_.cols());
    Matrix r = half(p_.transpose() * weight_.cwiseProduct(right));
    Matrix d = r.cwiseQuotient(diagonal_);
    double rz = dot(r, d);
    const double enough = square(kEnough) * rz;
    for (int k = 0; k < most && rz > enough; ++k) {
      work_.add(static_cast<std::int64_t>(each) / 2);
      const Matrix ad = apply(d);
      const double step = rz / dot(d, ad);
      e += step * d;
      r -= step * ad;
      const Matrix z = r.cwiseQuotient(diagonal_);
      const double next = dot(r, z);
      d = z + (next / rz) * d;
      rz = next;
    }
    return e;
  }

 private:
  static double dot(const Matrix& a, const Matrix& b) { return a.cwiseProduct(b).sum(); }
  static Matrix half(const Matrix& m) { return (m + m.transpose()) / 2; }
  Matrix apply(const Matrix& e) const {
    return half(p_.transpose() * weight_.cwiseProduct(p_ * e)) + prior_.cwiseProduct(e);
  }

  const Work& work_;
  const Matrix& p_;
  const Matrix& weight_;
  const Matrix& prior_;
  Matrix diagonal_;
};

/// An entry of T as one photograph shows it, or two.
struct EntryReading {
  double value = 0, variance = 0;
  bool measured = false;
};

/// Two readings of one entry: their mean weighted by inverse variance.
EntryReading both(const EntryReading& a, const EntryReading& b) {
  if (!a.measured || !b.measured) return a.measured ? a : b;
  const double sum = a.variance + b.variance;
  const double weight = sum > 0 ? b.variance / sum : 0.5;
  return {weight * a.value + (1 - weight) * b.value,
          square(weight) * a.variance + square(1 - weight) * b.variance, true};
}

}  // namespace

/// What is expected of T_UU before the photographs of patterns are looked at: mean squares.
struct BruteForceRest::Prior {
  bool known = false;                     ///< around what the search knew; otherwise around 0
  double around = 0;                      ///< beside the diagonal
  double direct = 0, direct_scatter = 0;  ///< the diagonal: its mean, and around that

  /// Too few pixels were lit alone to tell: all is expected as the search found it, the diagonal too.
  bool only_search = false;
  void read(const Matrix& p, const Matrix& left, const Matrix& weight);
};

/// Photographs of patterns.
struct BruteForceRest::Others {
  std::vector<TreePhotograph> photographs;
  Matrix patterns;
};

std::int64_t BruteForceRest::bytes(std::int64_t pixels, int channels) {
  // Each channel twice (as measured and as solved), and the finished columns.
  constexpr auto kEach = static_cast<std::int64_t>(4 * sizeof(float) + sizeof(float) + sizeof(std::int32_t));
  return pixels * pixels * kEach * channels;
}

Result<BruteForceRest> BruteForceRest::take(const SearchFacts& facts, Photographer& photographer,
                                            const TransportTensor& known) {
  BruteForceRest all;
  all.pixels_ = facts.tree.order().size();
  const std::int64_t begin = photographer.taken();
  SYMRIG_TRY(const std::vector<TreePhotograph> taken, photographs_of(photographer, {{0, begin}}));
  all.rest_ = separable_pixels(patterns_of(taken, all.pixels_));
  std::vector<LitBlocks> single;
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(all.pixels_); ++t) {
    if (std::binary_search(all.rest_.begin(), all.rest_.end(), t)) continue;
    all.alone_.push_back(t);
    single.push_back({{t, t + 1}});
  }
  const std::size_t entries = all.pixels_ * all.pixels_;
  all.channels_.assign(facts.channels,
                       {std::vector<float>(entries), std::vector<float>(entries, kUnmeasured)});
  all.keep_known(known);
  photographer.expect_later(kNoneToCome);
  SYMRIG_CHECK(photographer.take(
      "brute force", single, [&](std::int64_t first, std::span<TreePhotograph> photographs) {
        for (std::size_t k = 0; k < photographs.size(); ++k)
          all.keep(pixel(all.alone_, first - begin + static_cast<Index>(k)), photographs[k]);
      }));
  return all;
}

/// The photograph of one lit pixel is a column of T.
void BruteForceRest::keep(std::size_t col, const TreePhotograph& photograph) {
  for (std::size_t channel = 0; channel < channels_.size(); ++channel)
    for (std::size_t row = 0; row < pixels_; ++row) {
      const std::size_t t = channel * pixels_ + row;
      if (photograph.valid[t] == 0) continue;
      channels_[channel].value[at(row, col)] = photograph.mean[t];
      channels_[channel].variance[at(row, col)] = photograph.variance[t];
    }
}

/// The columns of pixels that are not lit alone, and their mirror images.
void BruteForceRest::keep_known(const TransportTensor& known) {
  std::vector<float> lit(pixels_), seen(pixels_);
  for (const std::int32_t u : rest_) {
    const std::size_t col = u;
    lit[col] = 1;
    for (std::size_t channel = 0; channel < channels_.size(); ++channel) {
      std::fill(seen.begin(), seen.end(), 0.0F);
      known.apply_tree(lit, seen, static_cast<int>(channel), false);
      for (std::size_t row = 0; row < pixels_; ++row)
        channels_[channel].value[at(row, col)] = channels_[channel].value[col * pixels_ + row] = seen[row];
    }
    lit[col] = 0;
  }
}

Scatter BruteForceRest::mirrored() const {
  Scatter scatter;
  for (const Channel& channel : channels_)
    for (std::size_t i = 0; i < pixels_; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const auto variance =
            static_cast<double>(channel.variance[at(i, j)]) + static_cast<double>(channel.variance[at(j, i)]);
        if (!std::isnan(variance))
          scatter.add(
              static_cast<double>(channel.value[at(i, j)]) - static_cast<double>(channel.value[at(j, i)]),
              variance);
      }
  return scatter;
}

/// Each entry and its mirror image become what the photographs of both say together.
void BruteForceRest::mirror(Channel& channel) const {
  const auto reading = [&channel](std::size_t at) {
    const float variance = channel.variance[at];
    const bool measured = !std::isnan(variance);
    return EntryReading{static_cast<double>(channel.value[at]), measured ? static_cast<double>(variance) : 0,
                        measured};
  };
  for (std::size_t i = 0; i < pixels_; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      const EntryReading entry = both(reading(at(i, j)), reading(at(j, i)));
      if (!entry.measured) continue;
      channel.value[at(i, j)] = channel.value[at(j, i)] = static_cast<float>(entry.value);
      channel.variance[at(i, j)] = channel.variance[at(j, i)] = static_cast<float>(entry.variance);
    }
}

/// channel: as measured, not mirrored: what the search knew of T_LU stands in the columns of U.
BruteForceRest::Prior BruteForceRest::prior_of(const Channel& channel) const {
  constexpr std::int64_t kFewest = 8;
  if (std::ssize(alone_) < kFewest) return {.known = true, .only_search = true};
  double known = 0, nothing = 0, entries = 0;
  double direct = 0, direct_squares = 0, direct_entries = 0;
  for (const std::int32_t lit : alone_) {
    const std::size_t l = lit;
    for (const std::int32_t dark : rest_) {
      const std::size_t u = dark;
      if (std::isnan(channel.variance[at(u, l)])) continue;
      const auto seen = static_cast<double>(channel.value[at(u, l)]);
      known += square(seen - static_cast<double>(channel.value[at(l, u)])) -
               static_cast<double>(channel.variance[at(u, l)]);
      nothing += square(seen) - static_cast<double>(channel.variance[at(u, l)]);
      ++entries;
    }
    if (std::isnan(channel.variance[at(l, l)])) continue;
    direct += static_cast<double>(channel.value[at(l, l)]);
    direct_squares += square(static_cast<double>(channel.value[at(l, l)]));
    ++direct_entries;
  }
  Prior prior{.known = known < nothing};
  if (entries > 0) prior.around = std::max(0.0, prior.known ? known : nothing) / entries;
  if (direct_entries == 0) return prior;
  prior.direct = direct / direct_entries;
  prior.direct_scatter = prior.around + std::max(0.0, direct_squares / direct_entries - square(prior.direct));
  return prior;
}

/// How far T_UU lies from what the search found, by what the photographs of patterns leave: the diagonal
/// counts only where a pixel is lit. left: [photograph × pixel], less what the search foretells.
void BruteForceRest::Prior::read(const Matrix& p, const Matrix& left, const Matrix& weight) {
  double dark = 0, dark_share = 0, lit = 0, lit_share = 0, lit_beside = 0;
  for (Index k = 0; k < p.rows(); ++k) {
    const double all = p.row(k).squaredNorm();
    for (Index u = 0; u < p.cols(); ++u) {
      if (weight(k, u) == 0) continue;
      const double own = square(p(k, u)), excess = square(left(k, u)) - 1 / weight(k, u);
      const double sure = square(weight(k, u));  // the square of an error of variance v scatters by √2 v
      if (own == 0)
        dark += sure * excess, dark_share += sure * all;
      else
        lit += sure * excess, lit_share += sure * own, lit_beside += sure * (all - own);
    }
  }
  around = dark_share > 0 ? std::max(0.0, dark / dark_share) : 0;
  direct_scatter = std::max(around, lit_share > 0 ? (lit - around * lit_beside) / lit_share : 0);
}

// T_UU of a channel, from photographs of patterns. number: of the channel. L: pixels that were lit alone,
// U: the others. Of T, only T_UU is not known, and each photograph y of a pattern p shows on U
//
//   y_U = T_UL p_L + T_UU p_U     so that, over all photographs,     P_U E = R − P_U X
//
// X: what is expected of T_UU (Prior), E: how far T_UU lies from it, R = Y_U − P_L T_LU.
//
// 1. X: what the search knew, or 0 where the pixels lit alone say that it knew nothing. The diagonal: the
//    mean of the direct light of L. With hardly a pixel in L, all is as the search knew it, and what R leaves
//    then tells how far T_UU lies from that.
// 2. R and its variance: that of y, that of the subtracted entries of T_LU, and the rounding of y.
// 3. Weights of prior: 1 over the mean square that T_LU lies from X, within what numbers can hold.
// 4. E minimises Σ (P_U E − R)² / Var + Σ E² / prior over symmetric E: conjugate gradients on the normal
//    equations (Symmetric). The prior decides what the patterns leave open: of rank r they leave
//    (m − r)(m − r + 1) / 2 numbers.
// 5. T_UU = X + E. Its entries count as sure as the surest sample, so that none is gated away as noise.
void BruteForceRest::fill(Channel& channel, std::size_t number, const Others& others,
                          const Work& work) const {
  Prior prior = prior_of(channels_[number]);
  const Index rest = std::ssize(rest_);
  const Index photographs = others.patterns.rows();
  Matrix p(photographs, rest), x(rest, rest);
  for (Index a = 0; a < rest; ++a) {
    p.col(a) = others.patterns.col(static_cast<Index>(pixel(rest_, a)));
    for (Index b = 0; b < rest; ++b)
      x(a, b) = prior.known ? static_cast<double>(channel.value[at(pixel(rest_, a), pixel(rest_, b))]) : 0;
    if (!prior.only_search) x(a, a) = prior.direct;
  }
  Matrix right(photographs, rest), weight(photographs, rest);
  tbb::parallel_for(Index{0}, photographs, [&](Index k) {
    const TreePhotograph& y = others.photographs[k];
    const auto seen = std::span(y.mean).subspan(number * pixels_, pixels_);
    double squares = 0;
    for (const float v : seen) squares += square(static_cast<double>(v));
    const double rounding = square(kRounding) * squares / static_cast<double>(pixels_);
    for (Index n = 0; n < rest; ++n) {
      const std::size_t u = pixel(rest_, n);
      auto left = static_cast<double>(seen[u]);
      double variance = static_cast<double>(y.variance[number * pixels_ + u]) + rounding;
      for (const std::int32_t lit : alone_) {
        const double share = others.patterns(k, lit);
        const std::size_t entry = at(u, static_cast<std::size_t>(lit));
        if (share == 0 || std::isnan(channel.variance[entry])) continue;
        left -= share * static_cast<double>(channel.value[entry]);
        variance += square(share) * static_cast<double>(channel.variance[entry]);
      }
      right(k, n) = left;
      weight(k, n) = y.valid[number * pixels_ + u] != 0 && variance > 0 ? 1 / variance : 0;
      work.add(static_cast<std::int64_t>(alone_.size()));
    }
  });
  right -= p * x;
  if (prior.only_search) prior.read(p, right, weight);
  const double surest = std::max(weight.size() > 0 ? weight.maxCoeff() : 0.0, 1e-300);
  // Never so wide that it does not count, nor so narrow that photographs do not.
  const auto inverse = [surest](double square) {
    return std::clamp(square > 0 ? 1 / square : surest, 1e-12 * surest, surest);
  };
  Matrix narrow = Matrix::Constant(rest, rest, inverse(prior.around));
  narrow.diagonal().setConstant(inverse(prior.direct_scatter));
  x += Symmetric(p, weight, narrow, work).solve(right);
  for (Index a = 0; a < rest; ++a)
    for (Index b = 0; b < rest; ++b) {
      const std::size_t entry = at(pixel(rest_, a), pixel(rest_, b));
      channel.value[entry] = static_cast<float>(x(a, b));
      channel.variance[entry] = static_cast<float>(1 / surest);
    }
}

/// Columns of what stands out of its noise.
TransportTensor BruteForceRest::packed(const BlockTree& tree, const std::vector<Channel>& channels,
                                       const Work& work) const {
  TensorBuilder builder(tree, tree, static_cast<int>(channels.size()));
  std::vector<std::int32_t> rows;
  std::vector<float> values;
  for (std::size_t col = 0; col < pixels_; ++col) {
    rows.clear();
    values.clear();
    work.add(kColumnOperations * static_cast<std::int64_t>(pixels_ * channels.size()));
    for (std::size_t row = 0; row < pixels_; ++row) {
      const std::size_t entry = at(row, col);
      const bool significant = std::any_of(channels.begin(), channels.end(), [entry](const Channel& c) {
        const double variance = std::isnan(c.variance[entry]) ? 0 : static_cast<double>(c.variance[entry]);
        return std::abs(static_cast<double>(c.value[entry])) >
               static_cast<double>(kGateSigmas) * std::sqrt(variance);
      });
      if (!significant) continue;
      rows.push_back(static_cast<std::int32_t>(row));
      for (const Channel& c : channels) values.push_back(c.value[entry]);
    }
    const auto begin = static_cast<std::int32_t>(col);
    builder.add_column(begin, begin + 1, rows, values);
  }
  return std::move(builder).finish();
}

Result<TransportTensor> BruteForceRest::tensor(const BlockTree& tree, const Photographer& photographer,
                                               const std::vector<LogRange>& others) const {
  photographer.work().begin("solving for the rest");
  Others shown;
  SYMRIG_TRY(shown.photographs, photographs_of(photographer, others));
  shown.patterns = patterns_of(shown.photographs, pixels_);
  std::vector<Channel> channels = channels_;
  for (std::size_t number = 0; number < channels.size(); ++number) {
    mirror(channels[number]);
    fill(channels[number], number, shown, photographer.work());
  }
  return packed(tree, channels, photographer.work());
}

}  // namespace symrig::acquisition
