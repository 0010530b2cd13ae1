// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/rig.hpp"

#include "rig/lamp.hpp"
#include "rig/metering.hpp"
#include "symrig/device/frame_ledger.hpp"
#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {

namespace {

/// A camera that has sent nothing for so long after a run will send nothing more.
constexpr Nanoseconds kPatience{2'000'000'000};
/// A frame belongs to a mark if its strobe rises at most this long after it.
constexpr Nanoseconds kStrobeTolerance{1'000'000};

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Nanoseconds total(std::span<const Nanoseconds> times) {
  Nanoseconds sum{0};
  for (const Nanoseconds t : times) sum += t;
  return sum;
}

/// A photograph from a camera without noise: what it saw, with nothing to doubt.
Radiance exact_radiance(const Image<float>& seen, double lamp, const Image<std::uint8_t>* dead) {
  Radiance radiance{seen, Image<float>(seen.grid(), seen.channels()),
                    Image<std::uint8_t>(seen.grid(), seen.channels(), 1)};
  for (float& value : radiance.mean.values()) value *= static_cast<float>(1 / lamp);
  if (dead == nullptr) return radiance;
  for (int c = 0; c < seen.channels(); ++c) {
    for (std::size_t i = 0; i < dead->values().size(); ++i) {
      if (dead->values()[i] == 0) continue;
      radiance.mean.plane(c)[i] = 0;
      radiance.valid.plane(c)[i] = 0;
    }
  }
  return radiance;
}

Result<void> check_values(const Pattern& pattern, std::size_t number) {
  const auto values = pattern.values();
  const auto bad = std::find_if(values.begin(), values.end(), [](float v) { return !(v >= 0 && v <= 1); });
  if (bad == values.end()) return {};
  const auto at = static_cast<std::int64_t>(bad - values.begin());
  return Error{ErrorCode::bad_value,
               fmt::format("pattern {} is {} at row {}, column {}", number, *bad, at / pattern.grid().cols,
                           at % pattern.grid().cols),
               "give values from 0 to 1"};
}

}  // namespace

struct Rig::Shots {
  std::size_t per_photograph = 0;
  std::vector<CameraFrame> frames;
  std::vector<Nanoseconds> exposures;  // of each frame, measured
};

Rig::Rig(device::Board board, std::unique_ptr<Projector> projector, std::unique_ptr<Camera> camera,
         RigOptions options)
    : board_(std::move(board)),
      projector_(std::move(projector)),
      camera_(std::move(camera)),
      options_(std::move(options)) {}

Rig::~Rig() = default;

Result<std::unique_ptr<Rig>> Rig::open(device::Board board, std::unique_ptr<Projector> projector,
                                       std::unique_ptr<Camera> camera, RigOptions options) {
  if (projector->grid() != camera->grid())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the projector is {}, the camera {}", to_string(projector->grid()),
                             to_string(camera->grid())),
                 "a coaxial rig needs one grid: calibrate first"};
  if (!options.views.fits(camera->grid()))
    return Error{
        ErrorCode::bad_argument,
        fmt::format("views {} do not tile a grid of {}", to_string(options.views), to_string(camera->grid())),
        "give the rows x columns of views that the picture shows"};
  std::unique_ptr<Rig> rig(
      new Rig(std::move(board), std::move(projector), std::move(camera), std::move(options)));
  SYMRIG_CHECK(rig->configure());
  SYMRIG_CHECK(rig->meter());
  SYMRIG_CHECK(rig->photograph_black());
  rig->shown_ = 0;
  const RigOptions& set = rig->options_;
  if (set.reference_every > 0) rig->lamp_ = std::make_unique<LampLog>(set.reference_every, set.lamp_drift);
  return rig;
}

Result<void> Rig::configure() {
  const device::RigProfile& profile = options_.profile;
  device::LineConfig strobe;
  strobe.line = options_.strobe_line;
  strobe.capture = true;
  device::LineConfig projector;
  projector.line = profile.projector_line;
  device::LineConfig camera;
  camera.line = profile.camera_line;
  const device::LineConfig lines[] = {projector, camera, strobe};
  return board_.configure(lines);
}

/// Brackets the flood-lit scene widely, and sets the exposures by its brightest pixel.
Result<void> Rig::meter() {
  const CameraTiming timing = camera_->timing();
  const double span = std::max(1.0, 0.1 * timing.max_exposure / timing.min_exposure);
  const int count = 1 + static_cast<int>(std::log(span) / std::log(6.0));
  SYMRIG_TRY(const auto trial, plan_exposures(timing.min_exposure, count, 6, timing));
  const Pattern flood(projector_->grid(), 1, 1.F);
  SYMRIG_TRY(const Shots shots, expose({&flood, 1}, trial));
  const auto rate = brightest_rate(shots.frames, shots.exposures, *camera_, options_.scale);
  if (!rate)
    return Error{ErrorCode::limit,
                 fmt::format("the flood-lit scene saturates the camera in {:.3g} ms, its shortest exposure",
                             1e3 * seconds(timing.min_exposure)),
                 "use less light or close the aperture"};
  SYMRIG_TRY(exposures_, plan_exposures(exposure_for(*rate, options_.headroom, camera_->noise()),
                                        options_.exposures, options_.ratio, timing));
  return {};
}

Result<void> Rig::photograph_black() {
  if (options_.black_photographs <= 0) return {};
  const std::vector<Pattern> dark(static_cast<std::size_t>(options_.black_photographs),
                                  Pattern(projector_->grid()));
  SYMRIG_TRY(const auto photographs, photograph(dark, nullptr));
  SYMRIG_TRY(black_, average(photographs));
  return {};
}

Result<void> Rig::check(std::span<const Pattern> patterns) const {
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (patterns[i].grid() != grid() || patterns[i].channels() != 1)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("pattern {} is {} with {} channels; this rig has {} with 1", i,
                               to_string(patterns[i].grid()), patterns[i].channels(), to_string(grid())),
                   "make patterns on the rig's grid"};
    SYMRIG_CHECK(check_values(patterns[i], i));
  }
  return {};
}

Result<std::vector<Radiance>> Rig::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(check(patterns));
  std::vector<Radiance> photographs;
  photographs.reserve(patterns.size());
  while (photographs.size() < patterns.size()) {
    std::size_t count = std::min(options_.batch, patterns.size() - photographs.size());
    if (lamp_ && lamp_->until_due(shown_) == 0) SYMRIG_CHECK(refer());
    if (lamp_) count = std::min(count, static_cast<std::size_t>(lamp_->until_due(shown_)));
    SYMRIG_TRY(auto measured, photograph(patterns.subspan(photographs.size(), count), lamp_.get()));
    std::move(measured.begin(), measured.end(), std::back_inserter(photographs));
    cost_.photographs += static_cast<std::int64_t>(count);
  }
  return photographs;
}

/// One more reference, as it was seen.
Result<void> Rig::refer() {
  const Pattern flood(projector_->grid(), 1, 1.F);
  const std::int64_t shown = shown_;
  SYMRIG_TRY(const auto reference, photograph({&flood, 1}, nullptr));
  if (lamp_->observe(shown, reference.front())) return {};
  return Error{ErrorCode::device_lost,
               "the lamp went out: the flood-lit scene is dark, and it was not at first",
               "check the projector's lamp and shutter"};
}

Result<void> Rig::pass_over(std::int64_t photographs, const std::function<void(std::int64_t)>& passed) {
  while (photographs > 0) {
    if (lamp_ && lamp_->until_due(shown_) == 0) SYMRIG_CHECK(refer());
    const std::int64_t count = lamp_ ? std::min(photographs, lamp_->until_due(shown_)) : photographs;
    passed(count);
    shown_ += count;
    photographs -= count;
  }
  return {};
}

LampLevel Rig::lamp() const {
  return lamp_ ? lamp_->level_at(shown_) : LampLevel{};
}

/// lamp: what the light is divided by; nullptr: nothing.
Result<std::vector<Radiance>> Rig::photograph(std::span<const Pattern> patterns, const LampLog* lamp) {
  SYMRIG_TRY(const Shots shots, expose(patterns, exposures_));
  SYMRIG_TRY(auto photographs, merge_all(shots, lamp));
  shown_ += static_cast<std::int64_t>(patterns.size());
  return photographs;
}

Result<Rig::Shots> Rig::expose(std::span<const Pattern> patterns, std::span<const Nanoseconds> exposures) {
  SYMRIG_CHECK(projector_->load(patterns));
  SYMRIG_TRY(const device::Receipt receipt, run(exposures, patterns.size()));
  const std::size_t expected = patterns.size() * exposures.size();
  Shots shots;
  shots.per_photograph = exposures.size();
  SYMRIG_TRY(shots.exposures, measured_exposures(receipt, expected));
  SYMRIG_TRY(shots.frames, camera_->take(expected, kPatience));
  if (shots.frames.size() != expected)
    return Error{
        ErrorCode::frame_missing,
        fmt::format("the camera handed over {} frames for {} exposures", shots.frames.size(), expected),
        "check the trigger line for extra edges"};
  cost_.frames += static_cast<std::int64_t>(expected);
  cost_.rig_seconds += seconds(receipt.duration());
  return shots;
}

Result<device::Receipt> Rig::run(std::span<const Nanoseconds> exposures, std::size_t photographs) {
  const device::RigProfile& profile = options_.profile;
  SYMRIG_TRY(const device::Program program, device::compile_bracket(board_.info(), profile, exposures,
                                                                    static_cast<std::uint32_t>(photographs)));
  const auto frames = static_cast<std::int64_t>(exposures.size());
  const Nanoseconds each = total(exposures) + frames * profile.readout + profile.settle +
                           profile.vsync_timeout + profile.advance_pulse;
  const Nanoseconds slack{5'000'000'000};
  SYMRIG_TRY(device::Receipt receipt,
             board_.run(program, static_cast<std::int64_t>(photographs) * each + slack));
  if (receipt.clean()) return receipt;
  const std::string cause = receipt.fault ? receipt.fault->name : std::string(name(receipt.end));
  return Error{ErrorCode::fault,
               fmt::format("the run did not end well: {}; {} late words, {} underruns, {} events lost", cause,
                           receipt.late, receipt.underruns, receipt.events_lost),
               receipt.fault ? receipt.fault->hint : "check the vsync and trigger lines"};
}

/// The width of each strobe pulse, after the ledger has tied each to its mark.
Result<std::vector<Nanoseconds>> Rig::measured_exposures(const device::Receipt& receipt,
                                                         std::size_t expected) const {
  const int strobe = board_.info().line(options_.strobe_line);
  const auto stamps = device::frames_from_strobe(receipt, strobe);
  SYMRIG_TRY(const auto ledger,
             device::FrameLedger::pair(receipt.marks, stamps, receipt.rate.ticks(kStrobeTolerance)));
  if (!ledger.complete() || ledger.entries().size() != expected)
    return Error{ErrorCode::frame_missing, ledger.summary(), "check the camera's trigger and strobe lines"};
  std::vector<Nanoseconds> exposures;
  device::Ticks begin;
  for (const device::CapturedEdge& edge : receipt.edges) {
    if (edge.line != strobe) continue;
    if (edge.level)
      begin = edge.tick;
    else
      exposures.push_back(receipt.rate.nanoseconds(edge.tick - begin));
  }
  if (exposures.size() != expected)
    return Error{ErrorCode::frame_missing,
                 fmt::format("the strobe fell {} times in {} exposures", exposures.size(), expected),
                 "check the strobe line"};
  return exposures;
}

Result<Radiance> Rig::merge_one(const Shots& shots, std::size_t photograph, double lamp) const {
  const std::size_t first = photograph * shots.per_photograph;
  if (shots.frames[first].ideal)
    return exact_radiance(*shots.frames[first + shots.per_photograph - 1].ideal, lamp, camera_->dead());
  std::vector<Frame> frames;
  for (std::size_t i = first; i < first + shots.per_photograph; ++i)
    frames.push_back({shots.frames[i].raw, shots.exposures[i]});
  MergeOptions options;
  options.scale = options_.scale / lamp;  // before black is taken off, which was seen at the first level
  options.black = black_ ? &*black_ : nullptr;
  options.dead = camera_->dead();
  return merge(frames, grid(), channels(), camera_->noise(), options);
}

Result<std::vector<Radiance>> Rig::merge_all(const Shots& shots, const LampLog* lamp) {
  const Stopwatch watch;
  const std::size_t count = shots.frames.size() / shots.per_photograph;
  std::vector<std::optional<Result<Radiance>>> merged(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const std::int64_t shown = shown_ + static_cast<std::int64_t>(i);
    merged[i] = merge_one(shots, i, lamp ? lamp->level_at(shown).value : 1);
  });
  std::vector<Radiance> photographs;
  for (auto& one : merged) {
    if (!one->ok()) return one->error();
    photographs.push_back(**std::move(one));
  }
  cost_.merge_seconds += watch.seconds();
  return photographs;
}

}  // namespace symrig
