// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/planes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector {
namespace {

Result<void> check_pattern_grid(const Pattern& pattern, Grid grid, std::size_t number) {
  if (pattern.grid() == grid && pattern.channels() == 1) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("pattern {} is {} with {} channels, but the projector shows {} with 1", number,
                           to_string(pattern.grid()), pattern.channels(), to_string(grid)),
               "give patterns on the projector's grid"};
}

Error bad_pixel(const Pattern& pattern, std::size_t number, std::size_t at, std::string_view legal) {
  const int cols = pattern.grid().cols, pixel = static_cast<int>(at);
  return {ErrorCode::bad_value,
          fmt::format("pattern {} is {} at row {}, column {}", number, pattern.values()[at], pixel / cols,
                      pixel % cols),
          std::string(legal)};
}

Result<void> check_binary(const Pattern& pattern, std::size_t number) {
  const auto values = pattern.values();
  for (std::size_t i = 0; i < values.size(); ++i)
    if (values[i] != 0 && values[i] != 1)
      return bad_pixel(pattern, number, i, "a bit plane shows only 0 and 1");
  return {};
}

void add_plane(Image<std::uint32_t>& picture, const Pattern& pattern, int bit) {
  const std::uint32_t mask = 1U << static_cast<unsigned>(bit);
  for (std::size_t i = 0; i < picture.values().size(); ++i)
    if (pattern.values()[i] != 0) picture.values()[i] |= mask;
}

}  // namespace

Result<std::vector<Image<std::uint32_t>>> pack_planes(std::span<const Pattern> patterns,
                                                      std::span<const PlanePlan> plans, Grid grid,
                                                      std::span<const int> bits) {
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    SYMRIG_CHECK(check_pattern_grid(patterns[k], grid, k));
    SYMRIG_CHECK(check_binary(patterns[k], k));
  }
  std::vector<Image<std::uint32_t>> pictures;
  for (const PlanePlan& plan : plans) {
    Image<std::uint32_t> picture(grid);
    for (std::size_t k = 0; k < plan.size(); ++k) {
      if (plan[k] == kBlackPlane) continue;
      if (k >= bits.size() || plan[k] < 0 || static_cast<std::size_t>(plan[k]) >= patterns.size())
        return Error{ErrorCode::bad_argument,
                     fmt::format("plane {} of {} shall show pattern {} of {}", k, bits.size(), plan[k],
                                 patterns.size()),
                     "plan planes and patterns that exist"};
      add_plane(picture, patterns[static_cast<std::size_t>(plan[k])], bits[k]);
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

Result<std::vector<Image<std::uint32_t>>> spread_over_planes(std::span<const Pattern> patterns, Grid grid,
                                                             std::span<const int> bits) {
  std::vector<std::uint32_t> word_of{0};  // by the number of bright planes
  for (const int bit : bits) word_of.push_back(word_of.back() | 1U << static_cast<unsigned>(bit));
  std::vector<Image<std::uint32_t>> pictures;
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    SYMRIG_CHECK(check_pattern_grid(patterns[k], grid, k));
    Image<std::uint32_t> picture(grid);
    const auto values = patterns[k].values();
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!(values[i] >= 0 && values[i] <= 1)) return bad_pixel(patterns[k], k, i, "give values from 0 to 1");
      const auto bright = std::lround(static_cast<double>(values[i]) * static_cast<double>(bits.size()));
      picture.values()[i] = word_of[static_cast<std::size_t>(bright)];
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

}  // namespace symrig::projector

namespace symrig::projector::dlp {
namespace {

constexpr int kBits = 8;  // of each colour

int lowest_bit(char colour) {
  return colour == 'R' ? 16 : colour == 'G' ? 8 : 0;
}

std::vector<PlaneOrder> all_orders() {
  std::vector<PlaneOrder> all;
  std::array<char, 3> colours{'B', 'G', 'R'};
  do {
    all.push_back({colours, false});
    all.push_back({colours, true});
  } while (std::ranges::next_permutation(colours).found);
  return all;
}

}  // namespace

std::vector<int> PlaneOrder::bits(int planes) const {
  std::vector<int> all;
  for (int k = 0; k < planes; ++k) {
    const int place = k % kBits;
    all.push_back(lowest_bit(colours[static_cast<std::size_t>(k / kBits)]) +
                  (highest_first ? kBits - 1 - place : place));
  }
  return all;
}

std::string to_string(const PlaneOrder& order) {
  return fmt::format("{}{}{}{}", order.colours[0], order.colours[1], order.colours[2],
                     order.highest_first ? " highest first" : "");
}

std::optional<PlaneOrder> parse_plane_order(std::string_view text) {
  for (const PlaneOrder& order : all_orders())
    if (to_string(order) == text) return order;
  return std::nullopt;
}

std::optional<PlaneOrder> order_of_bits(std::span<const int> bits) {
  for (const PlaneOrder& order : all_orders())
    if (std::ranges::equal(order.bits(static_cast<int>(bits.size())), bits)) return order;
  return std::nullopt;
}

std::string order_setting(std::span<const int> bits, std::span<const int> seen) {
  std::vector<int> wanted;
  for (const int plane : seen) {
    if (plane < 0 || static_cast<std::size_t>(plane) >= bits.size()) return {};
    wanted.push_back(bits[static_cast<std::size_t>(plane)]);
  }
  const auto order = order_of_bits(wanted);
  return order ? fmt::format("projector.plane_order = \"{}\"", to_string(*order)) : std::string();
}

namespace {

/// A source may be this much faster than its mode says.
constexpr double kFastSource = 1e-3;

}  // namespace

Result<std::uint32_t> longest_period(int planes, Nanoseconds refresh, const PlaneLimits& limits) {
  const double room = 1e-3 * static_cast<double>(refresh.count()) * (1 - kFastSource) - limits.load;
  const double period = std::floor(room / planes);
  if (period >= limits.exposure) return static_cast<std::uint32_t>(period);
  return Error{ErrorCode::limit,
               fmt::format("{} planes do not fit into a refresh of {:.3f} ms: each takes {} us at least",
                           planes, 1e3 * seconds(refresh), limits.exposure),
               fmt::format("give at most {} planes, or a slower mode",
                           std::max(0, static_cast<int>(room / limits.exposure)))};
}

Result<void> check_sequence(const Sequence& sequence, Nanoseconds refresh, const PlaneLimits& limits) {
  if (sequence.planes < 1 || sequence.planes > kMostPlanes)
    return Error{ErrorCode::bad_argument, fmt::format("a picture has no {} planes", sequence.planes),
                 fmt::format("give 1 to {}", kMostPlanes)};
  if ((sequence.leds & kAllLeds) == 0)
    return Error{ErrorCode::bad_argument, "no LED is selected", "select red, green or blue"};
  if (sequence.exposure_us < limits.exposure)
    return Error{ErrorCode::limit,
                 fmt::format("a plane of {} us is too short for the controller", sequence.exposure_us),
                 fmt::format("give at least {} us", limits.exposure)};
  const bool whole = sequence.exposure_us == sequence.period_us;
  if (!whole && sequence.period_us < sequence.exposure_us + limits.load)
    return Error{ErrorCode::limit,
                 fmt::format("a plane of {} us every {} us leaves no time to load the next one",
                             sequence.exposure_us, sequence.period_us),
                 fmt::format("give a period of {} us, or of {} us and more", sequence.exposure_us,
                             sequence.exposure_us + limits.load)};
  SYMRIG_TRY(const std::uint32_t most, longest_period(sequence.planes, refresh, limits));
  if (sequence.period_us <= most) return {};
  return Error{ErrorCode::limit,
               fmt::format("{} planes of {} us do not fit into a refresh of {:.3f} ms", sequence.planes,
                           sequence.period_us, 1e3 * seconds(refresh)),
               fmt::format("give a period of at most {} us", most)};
}

Result<Sequence> sequence_of(const PlaneOptions& options, Nanoseconds refresh, const PlaneLimits& limits) {
  Sequence sequence{options.planes, 0, 0, options.leds};
  if (options.period_us) {
    sequence.period_us = *options.period_us;
  } else if (options.planes >= 1 && options.planes <= kMostPlanes) {
    SYMRIG_TRY(sequence.period_us, longest_period(options.planes, refresh, limits));
  }
  sequence.exposure_us = options.exposure_us.value_or(sequence.period_us);
  SYMRIG_CHECK(check_sequence(sequence, refresh, limits));
  return sequence;
}

Result<std::unique_ptr<PlaneProjector>> PlaneProjector::open(std::unique_ptr<DrmProjector> screen,
                                                             const PlaneProjectorOptions& options,
                                                             const Begin& begin) {
  if (!screen->counts_refreshes())
    return Error{ErrorCode::device_refused,
                 "the screen does not count refreshes, so no picture can be tied to its bit planes",
                 "connect the controller to another graphics card"};
  SYMRIG_TRY(auto sequence, begin({screen->screen(), screen->refresh_period()}));
  return std::unique_ptr<PlaneProjector>(new PlaneProjector(std::move(screen), std::move(sequence), options));
}

PlaneProjector::PlaneProjector(std::unique_ptr<DrmProjector> screen, std::unique_ptr<PlaneSequence> sequence,
                               const PlaneProjectorOptions& options)
    : screen_(std::move(screen)),
      sequence_(std::move(sequence)),
      options_(options),
      bits_(options.order.bits(sequence_->sequence().planes)) {}

Result<void> PlaneProjector::load(std::span<const Pattern> patterns) {
  SYMRIG_TRY(auto pictures, spread_over_planes(patterns, grid(), bits_));
  return screen_->load_words(std::move(pictures));
}

PlaneTiming PlaneProjector::planes() const {
  const Sequence& sequence = sequence_->sequence();
  return {sequence.planes, Nanoseconds{1000 * std::int64_t{sequence.period_us}},
          Nanoseconds{1000 * std::int64_t{sequence.exposure_us}}, options_.frame_lead, options_.latency};
}

Result<void> PlaneProjector::load_planes(std::span<const Pattern> patterns,
                                         std::span<const PlanePlan> plans) {
  SYMRIG_TRY(auto pictures, pack_planes(patterns, plans, grid(), bits_));
  return screen_->load_words(std::move(pictures));
}

std::vector<std::string> PlaneProjector::warnings() const {
  std::vector<std::string> all = screen_->warnings();
  std::ranges::copy(sequence_->warnings(), std::back_inserter(all));
  return all;
}

std::string PlaneProjector::describe() const {
  const Sequence& sequence = sequence_->sequence();
  return fmt::format("{} with firmware {}, {} planes of {} us, on {}", sequence_->name(),
                     to_string(sequence_->version()), sequence.planes, sequence.period_us,
                     screen_->describe());
}

}  // namespace symrig::projector::dlp
