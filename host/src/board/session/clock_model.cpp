// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/clock_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <fmt/format.h>

namespace symrig::board {

/// A point of the plane of drift x and clock y.
struct DriftAndClock {
  double x, y;
};

/// A convex polygon in a fixed array, cut by half-planes one after another (Sutherland and Hodgman, CACM
/// 1974). Cuts: the largest number of cuts; each adds at most one corner.
template <std::size_t Cuts>
class ConvexPolygon {
 public:
  ConvexPolygon(double x_low, double x_high, double y_low, double y_high)
      : corners_{{{x_low, y_low}, {x_high, y_low}, {x_high, y_high}, {x_low, y_high}}} {
    if (x_low > x_high || y_low > y_high) count_ = 0;
  }

  /// Keeps the part where a x + b y <= c.
  void cut(double a, double b, double c) {
    const auto excess = [=](const DriftAndClock& p) { return a * p.x + b * p.y - c; };
    std::array<DriftAndClock, Cuts + 4> kept;
    std::size_t count = 0;
    for (std::size_t k = 0; k < count_; ++k) {
      const DriftAndClock& from = corners_[k];
      const DriftAndClock& to = corners_[(k + 1) % count_];
      const double begin = excess(from);
      const double end = excess(to);
      if (begin <= 0) kept[count++] = from;
      if ((begin < 0 && end > 0) || (begin > 0 && end < 0)) {
        const double share = begin / (begin - end);
        kept[count++] = {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)};
      }
    }
    corners_ = kept;
    count_ = count;
  }

  bool empty() const { return count_ == 0; }
  /// The lowest and the highest value of one coordinate. The polygon must not be empty.
  template <class Coordinate>
  std::pair<double, double> extent(Coordinate coordinate) const {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t k = 0; k < count_; ++k) {
      low = std::min(low, coordinate(corners_[k]));
      high = std::max(high, coordinate(corners_[k]));
    }
    return {low, high};
  }

 private:
  std::array<DriftAndClock, Cuts + 4> corners_;
  std::size_t count_ = 4;
};

}  // namespace symrig::board

namespace symrig {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kSlot = 1s;
/// Half a tick from rounding nominal spans to whole ticks, plus room for the polygon's corners, which are far
/// more exact.
constexpr double kRounding = 0.75;

/// a - b on a clock that may have wrapped round, for points less than 2^63 ticks apart.
double signed_ticks(BoardTime a, BoardTime b) {
  return static_cast<double>(static_cast<std::int64_t>((a - b).count));
}

/// Nominal ticks of a span that may be negative, modulo 2^64.
Ticks nominal_span(TickRate rate, Nanoseconds span) {
  return span.count() >= 0 ? rate.ticks(span) : Ticks{0} - rate.ticks(-span);
}

Error off_its_line(const ClockLimits& limits) {
  return {
      ErrorCode::limit,
      fmt::format("the board's clock deviates by more than {:.3g} ppm of drift allow", 1e6 * limits.drift),
      "connect again; if the error stays, one of the two clocks is broken or is being set"};
}

Error no_reading() {
  return {ErrorCode::bad_argument, "the clock model has no reading yet", "add a reading first"};
}

}  // namespace

void ClockModel::Window::take(const Side& side, int sign, double ticks_per_ns) {
  if (size_ > 0 && side.host - slot_begin_ < kSlot) {
    Side& kept = sides_[(first_ + size_ - 1) % kSlots];
    const double later = ticks_per_ns * static_cast<double>((side.host - kept.host).count());
    if (sign * (signed_ticks(side.board, kept.board) - later) < 0) kept = side;
    return;
  }
  slot_begin_ = side.host;
  if (size_ == kSlots)
    first_ = (first_ + 1) % kSlots;
  else
    ++size_;
  sides_[(first_ + size_ - 1) % kSlots] = side;
}

/// The board's clock if it ran at its nominal rate since the last reading. y counts from here.
BoardTime ClockModel::nominal(HostTime time) const {
  return last_->answered + nominal_span(rate_, time - last_->received);
}

std::optional<ClockModel::Knowledge> ClockModel::knowledge(HostTime time) const {
  const BoardTime base = nominal(time);
  const auto hz = static_cast<double>(rate_.hz);
  const double drift = limits_.drift;
  // y of a side, as if the drift were 0 between it and `time`.
  const auto shifted = [&](const Side& side) {
    return signed_ticks(side.board, base + nominal_span(rate_, side.host - time));
  };
  const auto ticks_to = [&](const Side& side) {
    return 1e-9 * static_cast<double>((side.host - time).count()) * hz;
  };
  // Of the wander: hz ∫∫ δ' <= hz W d²/2.
  const auto wander = [&](double ticks) { return 0.5 * limits_.wander_per_second * ticks * ticks / hz; };

  double y_low = -std::numeric_limits<double>::infinity();
  double y_high = -y_low;
  for (std::size_t k = 0; k < above_.size(); ++k)
    y_high = std::min(y_high, shifted(above_[k]) + 1 + kRounding + drift * std::abs(ticks_to(above_[k])));
  for (std::size_t k = 0; k < below_.size(); ++k)
    y_low = std::max(y_low, shifted(below_[k]) - kRounding - drift * std::abs(ticks_to(below_[k])));

  board::ConvexPolygon<2 * kSlots> truth(-drift, drift, y_low, y_high);
  for (std::size_t k = 0; k < above_.size() && !truth.empty(); ++k) {
    const double d = ticks_to(above_[k]);
    truth.cut(d, 1, shifted(above_[k]) + 1 + kRounding + wander(d));
  }
  for (std::size_t k = 0; k < below_.size() && !truth.empty(); ++k) {
    const double d = ticks_to(below_[k]);
    truth.cut(-d, -1, -shifted(below_[k]) + kRounding + wander(d));
  }
  if (truth.empty()) return std::nullopt;
  const auto [x_min, x_max] = truth.extent([](const board::DriftAndClock& p) { return p.x; });
  const auto [y_min, y_max] = truth.extent([](const board::DriftAndClock& p) { return p.y; });
  return Knowledge{y_min, y_max, x_min, x_max};
}

Result<ClockModel::Knowledge> ClockModel::known(HostTime time) const {
  if (!last_) return no_reading();
  const auto found = knowledge(time);
  if (!found) return off_its_line(limits_);
  return *found;
}

void ClockModel::insert(const TimeReading& reading) {
  double ticks_per_ns = 1e-9 * static_cast<double>(rate_.hz);
  if (const auto before = last_ ? knowledge(last_->received) : std::nullopt)
    ticks_per_ns *= 1 + 0.5 * (before->x_low + before->x_high);
  last_ = reading;
  above_.take({reading.sent, reading.taken}, 1, ticks_per_ns);
  below_.take({reading.received, reading.answered}, -1, ticks_per_ns);
}

Result<void> ClockModel::add(const TimeReading& reading) {
  if (reading.received < reading.sent || signed_ticks(reading.answered, reading.taken) < 0 ||
      (last_ && reading.sent < last_->sent))
    return Error{ErrorCode::bad_argument, "a reading of the board's clock ends before it begins",
                 "give the readings in the order in which they were taken"};
  if (last_ && reading.sent >= last_->received && signed_ticks(reading.taken, last_->answered) < 0)
    return Error{ErrorCode::device_lost,
                 fmt::format("the board's clock went back from {} to {}: the board was restarted",
                             last_->answered.since.count, reading.taken.since.count),
                 "connect again"};
  ClockModel trial = *this;
  trial.insert(reading);
  if (!trial.knowledge(reading.received)) return off_its_line(limits_);
  *this = trial;
  return {};
}

void ClockModel::forget() {
  above_.clear();
  below_.clear();
  last_.reset();
}

Result<BoardEstimate> ClockModel::board_at(HostTime time) const {
  SYMRIG_TRY(const Knowledge now, known(time));
  const double middle = std::round(0.5 * (now.y_low + now.y_high));
  const double bound = std::max(now.y_high - middle, middle - now.y_low);
  return BoardEstimate{nominal(time) + Ticks{static_cast<std::uint64_t>(static_cast<std::int64_t>(middle))},
                       Ticks{static_cast<std::uint64_t>(std::ceil(bound))}};
}

Result<HostEstimate> ClockModel::host_at(BoardTime time) const {
  if (!last_) return no_reading();
  HostTime guess = last_->received;
  BoardEstimate there{};
  double rest = 0;
  const double ns_per_tick = 1e9 / static_cast<double>(rate_.hz);
  // Each step reduces the distance to the drift's share of it, 1e-4. Four steps reach a tick from 2^53 ticks.
  for (int step = 0; step < 4; ++step) {
    SYMRIG_TRY(there, board_at(guess));
    rest = signed_ticks(time, there.at) * ns_per_tick;
    guess = guess + Nanoseconds{std::llround(rest)};
  }
  SYMRIG_TRY(there, board_at(guess));
  rest = std::abs(signed_ticks(time, there.at));
  // B rises at least at (1 - drift) of its nominal rate. This converts an error in ticks to one in host time.
  const double bound =
      (rest + 1 + static_cast<double>(there.bound.count)) * ns_per_tick / (1 - limits_.drift);
  return HostEstimate{guess, Nanoseconds{std::llround(std::ceil(bound))}};
}

Result<DriftEstimate> ClockModel::drift_at(HostTime time) const {
  SYMRIG_TRY(const Knowledge now, known(time));
  return DriftEstimate{now.x_low, now.x_high};
}

}  // namespace symrig
