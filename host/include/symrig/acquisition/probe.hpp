// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/bracket_plan.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// What a Probe has spent so far.
struct ProbeCost {
  std::int64_t photographs = 0;  ///< answered patterns
  std::int64_t frames = 0;       ///< single exposures behind them (black frames included)
  double rig_seconds = 0;        ///< time on the rig's clock (simulated or real)
  double simulate_seconds = 0;   ///< host time spent on pretending to be a scene (0 on a real rig)
  double merge_seconds = 0;      ///< host time spent on merging frames
};

inline ProbeCost operator+(const ProbeCost& a, const ProbeCost& b) {
  return {a.photographs + b.photographs, a.frames + b.frames, a.rig_seconds + b.rig_seconds,
          a.simulate_seconds + b.simulate_seconds, a.merge_seconds + b.merge_seconds};
}
inline ProbeCost operator-(const ProbeCost& a, const ProbeCost& b) {
  return {a.photographs - b.photographs, a.frames - b.frames, a.rig_seconds - b.rig_seconds,
          a.simulate_seconds - b.simulate_seconds, a.merge_seconds - b.merge_seconds};
}

/// The one interface that everything meets at: a simulated scene, a real rig, a recorded capture and a remote
/// rig all are a Probe.
class Probe {
 public:
  Probe() = default;
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  virtual ~Probe() = default;

  /// The grid of patterns, and of the tensor.
  virtual Grid grid() const = 0;
  /// The grid of photographs. It differs from grid() if the camera has pixels of its own. Such a rig needs a
  /// registration (RegisteredProbe); a capture refuses it.
  virtual Grid camera_grid() const { return grid(); }
  /// The coaxial views that tile the grid; one by default.
  virtual ViewLayout views() const { return {}; }
  /// Channels of each photograph (patterns always have one: white light).
  virtual int channels() const = 0;

  /// Shows each pattern and returns what the camera saw, as radiance per unit of projector light.
  /// patterns: one channel, values in [0,1] on grid(). Result: one Radiance a pattern, on camera_grid(),
  /// channels() channels. The noise of each photograph has the variance that it states. It is independent of
  /// that of other photographs and of other pixels. So black frames or lamp readings that several photographs
  /// share must be far more precise. Errors, rank tests and weights rely on it; noise that all photographs
  /// share is taken for light. A capture reports gross cases (NoiseCheck).
  /// fails: size_mismatch, bad_value, device errors. On failure no photograph is returned.
  virtual Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) = 0;

  /// How far off the pixels of photographs may look, rms along an axis [pixels]. It is the same in all
  /// photographs, so their variances do not contain it. A search spends no patterns on describing it.
  virtual double residual_shift() const { return 0; }

  /// True if the probe would choose its exposures for the next photographs by what is expected of them.
  virtual bool plans_exposures(std::size_t /*photographs*/) const { return false; }
  /// As measure(), with what is expected of each photograph: a hint that saves exposures and changes nothing
  /// else. The exposures of a photograph follow from its pattern and its expectation alone.
  /// fails: also size_mismatch (not one expectation a pattern, or of another grid).
  virtual Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                         std::span<const Expectation> /*expected*/) {
    return measure(patterns);
  }

  /// True if a budget of seconds, and not the wanted noise, ended the exposures of a photograph in the last
  /// measure_expected(), or those of the dark projector that it relies on.
  virtual bool held_short() const { return false; }

  /// Photographs that are worth asking for at once where each is logged. More than one pays where photographs
  /// are computed in parallel, or where patterns share pictures (bit planes). A rig loses as many when the
  /// process dies (docs/photograph-log.md).
  virtual std::size_t together() const { return 1; }
  /// true: photographs keep the processors of this computer busy. false: a capture works on the photographs
  /// before while this rig takes the next ones.
  virtual bool computes() const { return together() > 1; }

  /// Called while a measure() runs, when it has taken so many further photographs. false: measure() ends with
  /// `interrupted` as soon as it can. What is in a log by then stays there.
  using TakenSome = std::function<bool(std::size_t photographs)>;
  /// Whom to tell from now on; empty: nobody. A probe that has all photographs of a call at once tells
  /// nothing.
  virtual void tell(const TakenSome& /*taken*/) {}

  virtual ProbeCost cost() const = 0;
  /// The cost that a capture which begins now has not caused: none of a rig that has only been opened.
  ProbeCost cost_before() const { return cost().photographs > 0 ? cost() : ProbeCost{}; }

  /// Called once, before the first measure(), if this capture was begun in another session that has spent
  /// this much. A real rig has nothing to do. A simulated one goes on from there with its noise and its
  /// drift. So the n-th photograph is the same whether or not the capture was broken off. cost() does not
  /// change.
  virtual Result<void> continue_after(const ProbeCost& /*spent*/) { return {}; }

  /// One line for reports: "sim:vgroove-textured?size=64x64".
  virtual std::string describe() const = 0;
  /// One line with everything that photographs depend on. A log continues only on a rig with the same line.
  virtual std::string identity() const { return describe(); }
};

/// Whether patterns and photographs of a probe have one grid.
/// fails: size_mismatch (the rig needs a registration).
Result<void> check_aligned(const Probe& probe);

/// Whether a probe may show these patterns: one channel, on its grid, values from 0 to 1. Every Probe refuses
/// others before it shows the first one.
/// fails: size_mismatch, bad_value.
Result<void> check_patterns(const Probe& probe, std::span<const Pattern> patterns);

/// A probe in front of another one: it asks that one everything. Derive from it to look at the photographs.
class ForwardingProbe : public Probe {
 public:
  /// inner must outlive this.
  explicit ForwardingProbe(Probe& inner) : inner_(inner) {}

  Grid grid() const override { return inner_.grid(); }
  Grid camera_grid() const override { return inner_.camera_grid(); }
  ViewLayout views() const override { return inner_.views(); }
  int channels() const override { return inner_.channels(); }
  double residual_shift() const override { return inner_.residual_shift(); }
  bool plans_exposures(std::size_t photographs) const override { return inner_.plans_exposures(photographs); }
  bool held_short() const override { return inner_.held_short(); }
  std::size_t together() const override { return inner_.together(); }
  bool computes() const override { return inner_.computes(); }
  void tell(const TakenSome& taken) override { inner_.tell(taken); }
  ProbeCost cost() const override { return inner_.cost(); }
  Result<void> continue_after(const ProbeCost& spent) override { return inner_.continue_after(spent); }
  std::string describe() const override { return inner_.describe(); }
  std::string identity() const override { return inner_.identity(); }

  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return seen(patterns, inner_.measure(patterns));
  }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    return seen(patterns, inner_.measure_expected(patterns, expected));
  }

 private:
  /// The answer of the inner probe, to be looked at and passed on.
  virtual Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                             Result<std::vector<Radiance>> photographs) = 0;

  Probe& inner_;
};

}  // namespace symrig
