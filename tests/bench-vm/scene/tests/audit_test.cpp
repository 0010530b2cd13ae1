// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/audit.hpp"

#include "assert_ok.hpp"
#include "bench-vm/scene/tests/looped_rig.hpp"
#include "bench-vm/scene/truth_log.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::bench_vm::audit_test {
namespace {

constexpr std::size_t kPhotographs = 24;

/// Tampers only with the first complete bracket.
std::function<void(std::vector<CameraFrame>&)> once(std::function<void(std::vector<CameraFrame>&)> tamper) {
  return [tamper = std::move(tamper), done = false](std::vector<CameraFrame>& frames) mutable {
    if (frames.size() != 4 || std::exchange(done, true)) return;
    tamper(frames);
  };
}

/// A session of photographs of random patterns, with a log. In the run of photograph `from`, frames are
/// tampered with.
struct Session {
  LoopedRig rig{"sim:vgroove-textured?size=20x24"};
  std::unique_ptr<PhotographLog> log = make_memory_log({20, 24}, 1, rig.formation().camera());
  double lamp_error = 0;  // alternating error of the rig's lamp estimate

  Result<void> capture(std::size_t from, std::function<void(std::vector<CameraFrame>&)> tamper) {
    SYMRIG_TRY(const auto opened, rig.open());
    for (std::size_t i = 0; i < kPhotographs; ++i) {
      const Pattern pattern = drawn_pattern({20, 24}, i);
      if (i == from) rig.tamper = once(std::exchange(tamper, {}));
      SYMRIG_TRY(auto photographs, opened->measure({&pattern, 1}));
      const auto lamp = static_cast<float>(1 + lamp_error * std::sin(static_cast<double>(i)));
      for (float& value : photographs[0].mean.values()) value /= lamp;
      if (i == from) rig.tamper = [](auto&) {};
      SYMRIG_CHECK(log->append(pattern, photographs[0], opened->cost()));
    }
    return {};
  }
  Result<Audit> audited(const AuditOptions& options = {}) const {
    return audit(*log, rig.truth, rig.formation(), options);
  }
};

constexpr auto kOwnPixels =
    "sim:vgroove-textured?size=20x24&fine=4&camera=60x72&turn=1.5&zoom=0.85&distortion=0.02&vignetting=0.2,0."
    "35";

// Here the exposures are known exactly, so the limit is strict.
TEST(Audit, finds_every_photograph_of_a_clean_capture_right) {
  Session session;
  ASSERT_OK(session.capture(0, [](auto&) {}));
  AuditOptions strict;
  strict.limit = 0.05;
  const auto audit = session.audited(strict);
  ASSERT_OK(audit);
  ASSERT_EQ(audit->photographs.size(), kPhotographs);
  EXPECT_EQ(audit->wrong, 0);
  EXPECT_EQ(audit->unseen, 0);
  EXPECT_LT(audit->farthest_right, 0.02);
  EXPECT_GT(audit->planted, 90);
  // A few change the photograph by between a tenth of the limit and the limit.
  EXPECT_LE(audit->planted - audit->found - audit->harmless, 3);
  EXPECT_GT(audit->found, audit->planted * 3 / 4);
}

// Two frames of a bracket are exchanged, or one replaces another. Numbers and stamps are correct, only the
// pixels are wrong. One code is changed, else the rig would detect the copy.
TEST(Audit, finds_frames_in_the_wrong_place) {
  const std::vector<std::function<void(std::vector<CameraFrame>&)>> tampers{
      [](auto& frames) { std::swap(frames[1].raw, frames[2].raw); },
      [](auto& frames) {
        frames[3].raw = frames[2].raw;
        frames[3].raw[0] ^= 1;
      }};
  for (const auto& tamper : tampers) {
    Session session;
    ASSERT_OK(session.capture(11, tamper));
    const auto audit = session.audited();
    ASSERT_OK(audit);
    EXPECT_EQ(audit->wrong, 1);
    EXPECT_GT(audit->photographs[11].distance, 0.2);
    EXPECT_LT(audit->photographs[12].distance, 0.02);
  }
}

// The log holds what the camera saw on its own pixels.
TEST(Audit, finds_every_photograph_of_a_registered_camera_right) {
  Session session{.rig = LoopedRig(kOwnPixels)};
  ASSERT_OK(session.capture(0, [](auto&) {}));
  AuditOptions strict;
  strict.limit = 0.1;
  const auto audit = session.audited(strict);
  ASSERT_OK(audit);
  EXPECT_EQ(audit->wrong, 0);
  EXPECT_EQ(audit->unseen, 0);
  EXPECT_LT(audit->farthest_right, 0.02);
  EXPECT_GT(audit->found, audit->planted * 3 / 4);
}

TEST(Audit, finds_frames_of_a_registered_camera_in_the_wrong_place) {
  Session session{.rig = LoopedRig(kOwnPixels)};
  ASSERT_OK(session.capture(11, [](auto& frames) { std::swap(frames[1].raw, frames[2].raw); }));
  const auto audit = session.audited();
  ASSERT_OK(audit);
  EXPECT_EQ(audit->wrong, 1);
  EXPECT_GT(audit->photographs[11].distance, 0.2);
  EXPECT_LT(audit->photographs[12].distance, 0.02);
}

TEST(Audit, refuses_a_log_of_another_grid) {
  Session session{.rig = LoopedRig(kOwnPixels)};
  ASSERT_OK(session.capture(0, [](auto&) {}));
  const auto audit = symrig::bench_vm::audit(*session.log, session.rig.truth,
                                             LoopedRig("sim:vgroove-textured?size=20x24").formation(), {});
  ASSERT_FALSE(audit.ok());
  EXPECT_EQ(audit.error().code, ErrorCode::size_mismatch);
}

// A lamp estimate that is wrong by thousandths makes no frame wrong, and hides no wrong frame.
TEST(Audit, finds_a_frame_in_the_wrong_place_beside_errors_of_the_lamp) {
  Session session;
  session.lamp_error = 0.005;
  ASSERT_OK(session.capture(11, [](auto& frames) { std::swap(frames[1].raw, frames[2].raw); }));
  const auto audit = session.audited();
  ASSERT_OK(audit);
  EXPECT_EQ(audit->wrong, 1);
  EXPECT_GT(audit->photographs[11].distance, 0.2);
  EXPECT_LT(audit->farthest_right, 0.1);
  EXPECT_GT(audit->found, audit->planted * 3 / 4);
}

TEST(Audit, finds_another_shot_of_the_same_pattern) {
  Session session;
  const Session* seen = &session;
  ASSERT_OK(session.capture(11, [seen](auto& frames) {
    const auto light = seen->rig.formation().light_of(drawn_pattern({20, 24}, 11), 0);
    frames[2].raw = seen->rig.formation().expose(*light, seconds(seen->rig.truth.back().open) / 8,
                                                 frames[2].sequence + 1);
  }));
  const auto audit = session.audited();
  ASSERT_OK(audit);
  EXPECT_EQ(audit->wrong, 1);
  EXPECT_GT(audit->photographs[11].distance, 0.2);
}

// A rig with bit planes takes single frames again: here the second one of a photograph, after all others.
TEST(Audit, finds_the_frames_of_a_photograph_that_do_not_follow_each_other) {
  Session session;
  ASSERT_OK(session.capture(0, [](auto&) {}));
  auto& truth = session.rig.truth;
  const std::uint64_t picture = picture_key(drawn_pattern({20, 24}, 11));
  const auto first =
      std::ranges::find_if(truth, [picture](const TrueExposure& one) { return one.picture == picture; });
  ASSERT_NE(first, truth.end());
  std::rotate(first + 1, first + 2, truth.end());
  const auto in_a_row = session.audited();
  ASSERT_OK(in_a_row);
  EXPECT_EQ(in_a_row->unseen, 1);
  AuditOptions options;
  options.scattered = true;
  const auto audit = session.audited(options);
  ASSERT_OK(audit);
  EXPECT_EQ(audit->unseen, 0);
  EXPECT_EQ(audit->wrong, 0);
  EXPECT_LT(audit->farthest_right, 0.02);
  EXPECT_GT(audit->found, audit->planted * 3 / 4);
}

// A resumed capture meters again: then the exposures of the second session are others.
TEST(Audit, finds_scattered_frames_of_a_capture_that_was_resumed) {
  Session session, resumed;
  resumed.rig.headroom *= 1.2;
  ASSERT_OK(session.capture(0, [](auto&) {}));
  ASSERT_OK(resumed.capture(0, [](auto&) {}));
  ASSERT_GT(std::abs(seconds(resumed.rig.truth.back().open) / seconds(session.rig.truth.back().open) - 1),
            0.05);
  for (std::int64_t k = 0; k < resumed.log->size(); ++k)
    ASSERT_OK(session.log->append(*resumed.log->pattern(k), *resumed.log->photograph(k), {}));
  auto& truth = session.rig.truth;
  truth.insert(truth.end(), resumed.rig.truth.begin(), resumed.rig.truth.end());
  AuditOptions options;
  options.scattered = true;
  const auto audit = session.audited(options);
  ASSERT_OK(audit);
  EXPECT_EQ(audit->photographs.size(), 2 * kPhotographs);
  EXPECT_EQ(audit->unseen, 0);
  EXPECT_EQ(audit->wrong, 0);
  EXPECT_LT(audit->farthest_right, 0.02);
  EXPECT_GT(audit->found, audit->planted * 3 / 4);
}

TEST(Audit, finds_a_frame_in_the_wrong_place_among_scattered_ones) {
  Session session;
  ASSERT_OK(session.capture(11, [](auto& frames) { std::swap(frames[1].raw, frames[2].raw); }));
  AuditOptions options;
  options.scattered = true;
  const auto audit = session.audited(options);
  ASSERT_OK(audit);
  EXPECT_EQ(audit->wrong, 1);
  EXPECT_GT(audit->photographs[11].distance, 0.2);
}

TEST(Audit, finds_a_pattern_that_was_never_shown) {
  Session session;
  ASSERT_OK(session.capture(0, [](auto&) {}));
  Radiance black{Image<float>({20, 24}, 1), Image<float>({20, 24}, 1, 1.F),
                 Image<std::uint8_t>({20, 24}, 1, 1)};
  ASSERT_OK(session.log->append(drawn_pattern({20, 24}, 999), black, {}));
  const auto audit = session.audited();
  ASSERT_OK(audit);
  EXPECT_EQ(audit->unseen, 1);
  EXPECT_EQ(audit->wrong, 0);
}

using namespace std::chrono_literals;

/// The exposure of a line with these lit pictures.
TrueExposure exposure_with(const std::string& lit) {
  const auto path = std::filesystem::temp_directory_path() / ("truth-" + std::to_string(::getpid()));
  std::ofstream(path) << R"({"exposed":7,"begin":1000,"end":2001000,"doubt":0,"lit":[)" << lit << "]}\n";
  const auto exposures = read_true_exposures(path.string());
  std::filesystem::remove(path);
  EXPECT_TRUE(exposures.ok());
  EXPECT_EQ(exposures->size(), 1U);
  return exposures->front();
}

TEST(TruthFile, knows_an_exposure_of_one_picture) {
  const TrueExposure seen = exposure_with(R"({"picture":3,"key":"91c2","share":1})");
  EXPECT_EQ(seen.frame, 7U);
  EXPECT_EQ(seen.open, 2ms);
  EXPECT_TRUE(seen.pure);
  EXPECT_EQ(seen.picture, 0x91c2U);
  EXPECT_EQ(seen.lit(), 2ms);
}

TEST(TruthFile, knows_an_exposure_that_goes_on_after_the_dark_time_between_refreshes) {
  const TrueExposure seen =
      exposure_with(R"({"picture":3,"key":"a","share":0.5},{"picture":4,"key":"d","share":0.05,"dark":true},)"
                    R"({"picture":5,"key":"a","share":0.45})");
  EXPECT_TRUE(seen.pure);
  EXPECT_EQ(seen.picture, 0xaU);
  EXPECT_EQ(seen.open, 2ms);
  EXPECT_EQ(seen.lit(), 1900us);
}

TEST(TruthFile, a_dark_exposure_is_one_of_a_dark_picture) {
  const TrueExposure seen = exposure_with(R"({"picture":4,"key":"d","share":1,"dark":true})");
  EXPECT_TRUE(seen.pure);
  EXPECT_EQ(seen.picture, 0xdU);
  EXPECT_EQ(seen.lit(), 2ms);
}

TEST(TruthFile, an_exposure_of_two_pictures_or_mostly_in_the_dark_is_not_pure) {
  EXPECT_FALSE(
      exposure_with(R"({"picture":3,"key":"a","share":0.99},{"picture":4,"key":"b","share":0.01})").pure);
  EXPECT_FALSE(
      exposure_with(R"({"picture":3,"key":"a","share":0.6},{"picture":4,"key":"d","share":0.4,"dark":true})")
          .pure);
  EXPECT_FALSE(exposure_with(R"({"picture":3,"key":"a","share":0.95})").pure) << "no picture for a while";
}

}  // namespace
}  // namespace symrig::bench_vm::audit_test
