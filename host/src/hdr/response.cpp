// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/response.hpp"

#include "hdr/response_samples.hpp"
#include "hdr/toml_keys.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/json_reader.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kLeastStep = 1e-6;  // smallest step of a curve between codes, relative to its range

}  // namespace

double ResponseCurve::operator()(double code) const {
  const double last = static_cast<double>(light.size()) - 1;
  const double inside = std::clamp(code, 0.0, last);
  const auto below = static_cast<std::size_t>(inside);
  const std::size_t above = std::min(below + 1, light.size() - 1);
  return light[below] + (inside - static_cast<double>(below)) * (light[above] - light[below]);
}

double ResponseCurve::code_of(double share) const {
  const auto above = std::lower_bound(light.begin(), light.end(), share);
  if (above == light.begin()) return 0;
  if (above == light.end()) return static_cast<double>(light.size()) - 1;
  const double low = *(above - 1);
  return static_cast<double>(above - light.begin()) - 1 + (share - low) / (*above - low);
}

std::vector<double> isotonic(std::span<const double> values, std::span<const double> weights) {
  struct Pool {
    double sum, weight;
    std::size_t count;
    double mean() const { return sum / weight; }
  };
  std::vector<Pool> pools;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double w = std::max(weights[i], 1e-12);  // codes without samples follow their neighbours
    pools.push_back({w * values[i], w, 1});
    while (pools.size() > 1 && pools[pools.size() - 2].mean() > pools.back().mean()) {
      const Pool last = pools.back();
      pools.pop_back();
      pools.back().sum += last.sum;
      pools.back().weight += last.weight;
      pools.back().count += last.count;
    }
  }
  std::vector<double> fit;
  for (const Pool& pool : pools) fit.insert(fit.end(), pool.count, pool.mean());
  return fit;
}

namespace hdr {

/// Makes a curve over all codes from the ln light of the codes [first, last] that have samples.
ResponseCurve finish_curve(const std::vector<double>& log_light, const std::vector<double>& weights,
                           std::int64_t samples) {
  const auto codes = static_cast<std::ptrdiff_t>(log_light.size());
  std::ptrdiff_t first = 0, last = codes - 1;
  while (first < last && weights[first] <= 0) ++first;
  while (last > first && weights[last] <= 0) --last;
  const auto part = [&](const std::vector<double>& of) {
    return std::span(of).subspan(first, last - first + 1);
  };
  const std::vector<double> fit = isotonic(part(log_light), part(weights));
  ResponseCurve curve;
  curve.samples = samples;
  for (std::size_t k = 0; k < fit.size(); ++k)
    if (std::abs(fit[k] - part(log_light)[k]) > 1e-9) ++curve.repaired;
  const double top = std::exp(fit.back());
  for (const double v : fit) curve.light.push_back(std::exp(v) / top);
  // Below the codes with samples, light falls to 0 in a straight line. Above them it continues with its
  // slope.
  std::vector<double> all;
  for (std::ptrdiff_t c = 0; c < first; ++c)
    all.push_back(curve.light.front() * static_cast<double>(c) / static_cast<double>(first));
  all.insert(all.end(), curve.light.begin(), curve.light.end());
  const std::size_t reach = std::min<std::size_t>(all.size() - 1, std::max<std::size_t>(1, fit.size() / 16));
  const double slope = (all.back() - all[all.size() - 1 - reach]) / static_cast<double>(reach);
  for (std::ptrdiff_t c = last + 1; c < codes; ++c)
    all.push_back(curve.light.back() + slope * static_cast<double>(c - last));
  // Make it strictly rising from 0 to 1.
  const double origin = all.front();
  const double least = kLeastStep / static_cast<double>(codes);
  for (std::size_t c = 0; c < all.size(); ++c)
    all[c] = c == 0 ? 0 : std::max(all[c] - origin, all[c - 1] + least * std::max(1.0, all.back() - origin));
  const double full = all.back();
  for (double& v : all) v /= full;
  all.back() = 1;
  curve.light = std::move(all);
  return curve;
}

}  // namespace hdr

Result<Linearity> test_linearity(std::span<const Frame> frames, const NoiseModel& noise) {
  SYMRIG_CHECK(hdr::check_frames(frames));
  constexpr std::size_t kBins = 16;
  struct Bin {
    double weight = 0, sum = 0, code = 0;
  };
  std::vector<Bin> bins(kBins);
  Linearity result;
  const double range = noise.saturation_code() - noise.pedestal();
  for (std::size_t a = 0; a < frames.size(); ++a)
    for (std::size_t b = 0; b < frames.size(); ++b) {
      const double ratio = seconds(frames[b].exposure) / seconds(frames[a].exposure);
      if (ratio < 1.2 || ratio > 20) continue;  // too similar to decide, or the shorter one is only noise
      for (std::size_t i = 0; i < frames[a].raw.size(); ++i) {
        const double low = frames[a].raw[i] - noise.pedestal(), high = frames[b].raw[i] - noise.pedestal();
        if (frames[a].raw[i] >= noise.saturation_code() || frames[b].raw[i] >= noise.saturation_code())
          continue;
        const double g = noise.gain();
        const double rough = std::max(0.0, (low + high) / (1 + ratio));
        const double of_low = g * g * noise.variance(rough / g),
                     of_high = g * g * noise.variance(ratio * rough / g);
        // Selected and binned by the best estimate of both, whose noise is independent of their difference.
        const double light = (low / of_low + ratio * high / of_high) / (1 / of_low + ratio * ratio / of_high);
        const double expected = ratio * light;
        if (light < 0.05 * range || expected > 0.9 * range) continue;
        const double variance = of_high + ratio * ratio * of_low;
        Bin& bin = bins[std::min(kBins - 1, static_cast<std::size_t>(expected / range * kBins))];
        bin.weight += 1 / variance;
        bin.sum += (high - ratio * low) / variance;
        bin.code += expected / variance;
        ++result.samples;
      }
    }
  if (result.samples == 0)
    return Error{ErrorCode::bad_value, "no pixel is well exposed in two of the frames",
                 "take exposures 1.5 to 4 times apart"};
  for (const Bin& bin : bins) {
    if (bin.weight <= 0) continue;
    const double off = std::abs(bin.sum / bin.weight) / range, sigma = 1 / std::sqrt(bin.weight) / range;
    if (off - 3 * sigma > result.worst - 3 * result.worst_sigma || result.worst_sigma == 0) {
      result.worst = off;
      result.worst_sigma = sigma;
      result.at_code = bin.code / bin.weight + noise.pedestal();
    }
  }
  return result;
}

namespace {

namespace fs = std::filesystem;

Error bad_table(const fs::path& path, std::uint32_t line, std::string_view what) {
  return {ErrorCode::bad_format, fmt::format("{}:{}: {}", path.string(), line, what),
          "write it with symrig calibrate --sensor DIR --response FILE"};
}

/// Reads light that must rise strictly from 0 to 1.
Result<std::vector<double>> light_of(const fs::path& path, const toml::array& list) {
  std::vector<double> light;
  for (const toml::node& item : list) {
    const std::optional<double> value = item.value<double>();
    const bool rises = value && (light.empty() ? *value == 0 : *value > light.back() && *value <= 1);
    if (!rises)
      return bad_table(path, item.source().begin.line,
                       fmt::format("response.light does not rise from 0 to 1 at code {}", light.size()));
    light.push_back(*value);
  }
  const bool codes = light.size() >= 2 && light.size() <= 65'536 && std::has_single_bit(light.size());
  if (codes && light.back() == 1) return light;
  return bad_table(path, list.source().begin.line,
                   codes ? std::string("response.light does not end at 1")
                         : fmt::format("response.light has {} codes, which no camera has", light.size()));
}

}  // namespace

Result<void> save_response(const fs::path& path, const ResponseCurve& curve) {
  std::string text = fmt::format(
      "# How a camera answers light: docs/sensor.md\n[response]\nsamples = {}\n"
      "light = [  # of each code, as a share of the largest code's\n",
      curve.samples);
  for (std::size_t code = 0; code < curve.light.size(); ++code)
    text += fmt::format("{}{},", code % 8 == 0 ? (code == 0 ? "  " : "\n  ") : " ", curve.light[code]);
  return write_file_atomically(path, text + "\n]\n");
}

Result<ResponseCurve> load_response(const fs::path& path) {
  constexpr std::uint64_t kMost = std::uint64_t{8} << 20;
  SYMRIG_TRY(const std::vector<std::byte> bytes, read_file(path, kMost));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_CHECK(check_toml_nesting(text, path.string()));
  const toml::parse_result parsed = toml::parse(text);
  if (!parsed) return bad_table(path, parsed.error().source().begin.line, parsed.error().description());
  constexpr std::array<std::string_view, 1> kTables{"response"};
  constexpr std::array<std::string_view, 2> kKeys{"samples", "light"};
  SYMRIG_CHECK(check_keys(path, parsed.table(), "", kTables));
  if (const toml::table* const table = parsed.table()["response"].as_table())
    SYMRIG_CHECK(check_keys(path, *table, "response.", kKeys));
  const toml::array* const list = parsed.table()["response"]["light"].as_array();
  if (list == nullptr) return bad_table(path, 1, "it has no table [response] with light");
  ResponseCurve curve;
  SYMRIG_TRY(curve.light, light_of(path, *list));
  curve.samples = parsed.table()["response"]["samples"].value_or(std::int64_t{0});
  return curve;
}

}  // namespace symrig
