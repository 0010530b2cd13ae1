// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/frame_faults.hpp"

#include "sim/hash.hpp"
#include "sim/variates.hpp"

#include <array>
#include <cmath>
#include <utility>

namespace symrig::bench_vm {

namespace {

constexpr std::uint64_t kFaultKey = 0xfa017;
constexpr std::uint64_t kJitterKey = 0x177e4;
constexpr std::uint64_t kTriggerKey = 0x7219;

double draw(std::uint64_t stream, const FaultRates& rates, std::uint64_t frame) {
  return sim::unit_double(sim::combine(sim::combine(stream, rates.seed), frame));
}

}  // namespace

std::string_view name(FrameFault fault) {
  constexpr std::array<std::string_view, 6> kNames{"none", "drop", "duplicate", "late", "swap", "damage"};
  return kNames[static_cast<std::size_t>(fault)];
}

bool FaultRates::valid() const {
  const std::array shares{drop, duplicate, late, swap, damage};
  double sum = 0;
  for (const double share : shares) {
    if (!(share >= 0 && share <= 1)) return false;
    sum += share;
  }
  return sum <= 1 && drop_trigger >= 0 && drop_trigger <= 1 && late_by.count() >= 0 && jitter.count() >= 0;
}

FrameFault fault_of(const FaultRates& rates, std::uint64_t frame) {
  if (rates.drop_frame == frame) return FrameFault::drop;
  const std::array<std::pair<FrameFault, double>, 5> kinds{{{FrameFault::drop, rates.drop},
                                                            {FrameFault::duplicate, rates.duplicate},
                                                            {FrameFault::late, rates.late},
                                                            {FrameFault::swap, rates.swap},
                                                            {FrameFault::damage, rates.damage}}};
  double u = draw(kFaultKey, rates, frame);
  for (const auto& [fault, share] : kinds) {
    if (u < share) return fault;
    u -= share;
  }
  return FrameFault::none;
}

bool sees_trigger(const FaultRates& rates, std::uint64_t number) {
  return draw(kTriggerKey, rates, number) >= rates.drop_trigger;
}

Nanoseconds jitter_of(const FaultRates& rates, std::uint64_t frame) {
  if (rates.jitter.count() == 0) return Nanoseconds{0};
  constexpr double kEdge = 0x1p-54;  // keeps u inside (0, 1)
  const double z = sim::normal_quantile(draw(kJitterKey, rates, frame) * (1 - 2 * kEdge) + kEdge);
  return Nanoseconds{std::llround(z * static_cast<double>(rates.jitter.count()))};
}

}  // namespace symrig::bench_vm
