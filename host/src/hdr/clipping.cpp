// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/internal/clipping.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>

#include <fmt/format.h>

namespace symrig::hdr {
namespace {

constexpr std::ptrdiff_t kFewestPiled = 50;
constexpr double kReadNoises = 3;  // to each side of a pile
constexpr double kLonger = 1.2;    // a ratio of exposures that tells something

/// A linear camera: the codes where the shorter exposure expects more.
std::optional<int> linear_clipping(const Frame& shorter, const Frame& longer, const LinearCodes& of) {
  constexpr double kBeyond = 1.02, kShare = 0.6;
  const double ratio = seconds(longer.exposure) / seconds(shorter.exposure);
  const double top = brightest(longer.raw), within = std::max(0.5, kReadNoises * of.read_noise);
  std::vector<double> stay;
  for (std::size_t i = 0; i < longer.raw.size(); ++i)
    if ((shorter.raw[i] - of.pedestal) * ratio > kBeyond * (top - of.pedestal)) stay.push_back(longer.raw[i]);
  const auto pile = piled_up(std::move(stay), within, kShare);
  if (!pile || *pile < top - 2 * within) return {};
  return static_cast<int>(std::lround(*pile));
}

/// Where the longer exposure stays although the shorter one rises.
struct Plateau {
  std::vector<double> codes;  ///< of the longer exposure, in the brighter half of it
  double least, most;         ///< codes of the shorter exposure
};

/// One deviation of codes that may be cut at the largest code, from those below the median.
double spread_below(std::vector<double> codes) {
  constexpr double kOneSigma = 0.1587;
  return median(codes) - quantile(codes, kOneSigma);
}

/// The brightest pixels of the shorter exposure, as far down as the longer one has the same code. Sorted by
/// the shorter one, in groups that double in number.
std::optional<Plateau> plateau_of(const Frame& shorter, const Frame& longer) {
  constexpr std::size_t kPixels = 400'000;
  constexpr double kOneCode = 1, kErrors = 4, kMedianError = 1.25;
  std::vector<std::pair<std::uint16_t, std::uint16_t>> both;
  for (std::size_t i = 0; i < shorter.raw.size(); i += shorter.raw.size() / kPixels | std::size_t{1})
    both.emplace_back(shorter.raw[i], longer.raw[i]);
  std::ranges::stable_sort(both, std::greater<>{}, [](const auto& pixel) { return pixel.first; });
  if (std::ssize(both) < kFewestPiled) return {};
  const auto codes_of = [&](std::size_t from, std::size_t to) {
    std::vector<double> codes;
    for (std::size_t k = from; k < to; ++k) codes.push_back(both[k].second);
    return codes;
  };
  std::size_t end = kFewestPiled;
  const auto middle_of = [&both](std::size_t from, std::size_t to) {
    const std::size_t at = (from + to) / 2;
    return static_cast<double>(both[at].first);
  };
  Plateau found{codes_of(0, end), 0, middle_of(0, end)};
  const double middle = median(found.codes);
  const double error = kMedianError * spread_below(found.codes) / std::sqrt(kFewestPiled);
  for (std::size_t begin = end; begin < both.size(); begin = end) {
    end = std::min(both.size(), 2 * begin);
    std::vector<double> next = codes_of(begin, end);
    if (std::abs(median(next) - middle) > kOneCode + kErrors * error) break;
    found.codes = codes_of(0, begin);  // the last group may hold others, too
    found.least = middle_of(begin, end);
  }
  return found.least > 0 ? std::optional(std::move(found)) : std::nullopt;
}

/// A camera that may be curved, whose white may scatter (noise after the clipping, or compression): the end
/// of what is not white. Even light has noise, too, so the shorter exposure must rise by more than that.
std::optional<int> curved_clipping(const Frame& shorter, const Frame& longer) {
  constexpr double kRise = 0.1, kNoise = 10, kSigmas = 5, kFarthest = 0.1;
  auto plateau = plateau_of(shorter, longer);
  if (!plateau) return {};
  const double white = median(plateau->codes), sigma = spread_below(plateau->codes);
  const double rise = plateau->most - plateau->least;
  if (rise < kRise * white || rise < kNoise * sigma || kSigmas * sigma > kFarthest * white) return {};
  return static_cast<int>(std::floor(white - kSigmas * sigma));
}

}  // namespace

std::optional<double> piled_up(std::vector<double> values, double within, double share) {
  constexpr double kLowest = 0.01;
  if (std::ssize(values) < kFewestPiled) return {};
  const double middle = median(values);
  const auto last =
      std::partition(values.begin(), values.end(), [&](double v) { return std::abs(v - middle) <= within; });
  const auto inside = static_cast<double>(std::distance(values.begin(), last));
  if (inside < share * static_cast<double>(values.size())) return {};
  values.erase(last, values.end());
  return quantile(values, kLowest);
}

int brightest(Codes codes) {
  std::vector<std::ptrdiff_t> count(std::size_t{1} << 16);
  for (const std::uint16_t code : codes) count[code] += 1;
  std::ptrdiff_t above = std::max(kFewestPiled, std::ssize(codes) / 2000);
  int code = static_cast<int>(count.size()) - 1;
  while (code > 0 && (above -= count[code]) >= 0) --code;
  return code;
}

std::optional<int> clipping_of_bracket(std::span<const Frame> frames,
                                       const std::optional<LinearCodes>& codes) {
  std::vector<const Frame*> sorted;
  for (const Frame& frame : frames) sorted.push_back(&frame);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Frame* a, const Frame* b) { return a->exposure < b->exposure; });
  std::optional<int> clipping;
  const Frame* shorter = nullptr;  // of the exposure before
  for (std::size_t k = 0; k < sorted.size(); ++k) {
    const bool of_new_level =
        k == 0 || seconds(sorted[k]->exposure) > kLonger * seconds(sorted[k - 1]->exposure);
    if (!of_new_level) continue;
    if (shorter != nullptr)
      if (const auto found =
              codes ? linear_clipping(*shorter, *sorted[k], *codes) : curved_clipping(*shorter, *sorted[k]))
        clipping = std::min(clipping.value_or(*found), *found);
    shorter = sorted[k];
  }
  return clipping;
}

std::optional<int> clipping_of_flat(Codes codes, double dark_noise) {
  constexpr std::size_t kWindows = 5;
  constexpr double kFuller = 4;
  if (codes.empty()) return {};
  const double width = 2 * std::round(kReadNoises * dark_noise) + 1, top = brightest(codes);
  std::array<double, kWindows> count{};
  std::vector<double> highest;
  for (const std::uint16_t code : codes) {
    const double below = std::floor((top - code) / width);
    if (below >= static_cast<double>(kWindows)) continue;
    count[static_cast<std::size_t>(std::max(below, 0.0))] += 1;
    if (below <= 0) highest.push_back(code);
  }
  const double fullest = *std::max_element(count.begin() + 1, count.end());
  if (count[0] < 2 * static_cast<double>(kFewestPiled) || count[0] <= kFuller * fullest) return {};
  return static_cast<int>(median(highest));
}

void DarkCodes::add(Codes codes) {
  for (const std::uint16_t code : codes) count_[code] += 1;
  all_ += static_cast<double>(codes.size());
}

/// A code is an even distribution between the middles to its neighbours.
double DarkCodes::quantile(double share) const {
  double below = 0;
  for (std::size_t code = 0; code < count_.size(); ++code) {
    if (below + count_[code] >= share * all_)
      return static_cast<double>(code) - 0.5 + (share * all_ - below) / std::max(count_[code], 1.0);
    below += count_[code];
  }
  return 0;
}

double DarkCodes::cut_share() const {
  constexpr double kSeen = 0.6, kUpper = 0.8413;  // one deviation above the median
  if (!(all_ > 0) || count_[0] == 0) return 0;
  double mean = 0, squares = 0;
  for (std::size_t code = 0; code < count_.size(); ++code) {
    const auto value = static_cast<double>(code);
    mean += value * count_[code] / all_;
    squares += value * value * count_[code] / all_;
  }
  const double middle = quantile(0.5), sigma = quantile(kUpper) - middle;
  if (!(sigma > 0) || squares - mean * mean < kSeen * kSeen) return 0;
  return std::erfc((middle + 0.5) / sigma / std::sqrt(2.0)) / 2;
}

Result<void> DarkCodes::check() const {
  constexpr double kMost = 0.02;
  const double cut = cut_share();
  if (cut <= kMost) return {};
  return Error{
      ErrorCode::bad_value,
      fmt::format("the dark frames are cut at code 0 in about {:.0f} % of their samples: black level and "
                  "read noise cannot be measured",
                  100 * cut),
      "raise the camera's black level (offset) until no dark sample is 0"};
}

}  // namespace symrig::hdr
