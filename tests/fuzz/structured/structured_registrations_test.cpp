// SPDX-License-Identifier: Apache-2.0
// Registration files with other values, shapes and types in them: refused in one line, or read as the
// registration that they now are, with which everything that commands do works.
#include "campaign.hpp"
#include "scene_mutator.hpp"
#include "scratch.hpp"
#include "symrig/calibration/registration_file.hpp"
#include "symrig/report/registration_summary.hpp"
#include "unit/calibration/small_registration.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace symrig::structured::structured_registrations_test {
namespace {

namespace fs = std::filesystem;

/// All that capture, evaluate and calibrate do with a registration.
void use_as_commands_do(const Registration& registration) {
  const auto weights = registration.weights();
  if (!weights) {  // maps that fold, or look away from all cells, give weights or one line
    EXPECT_EQ(weights.error().line().find('\n'), std::string::npos);
    return;
  }
  const auto cells = weights->gather(registration.flood);
  ASSERT_TRUE(cells.ok()) << cells.error().line();
  for (const float v : cells->variance.values()) ASSERT_GE(v, 0);
  const RegistrationSummary summary{registration, *weights, 1, {}};
  EXPECT_FALSE(registration_json(summary).empty());
  EXPECT_FALSE(registration_text(summary).empty());
  EXPECT_TRUE(registration_page(summary).ok());
  const int channels = registration.flood.mean.channels();
  const Grid camera = registration.camera();
  const Radiance stripe{Image<float>(camera, channels, 0.5F), Image<float>(camera, channels, 1e-4F),
                        Image<std::uint8_t>(camera, channels, std::uint8_t{1})};
  const std::vector<Radiance> now(2, stripe);
  const auto motion = registration.watch().compare(now);
  EXPECT_TRUE(motion.ok() || motion.error().code == ErrorCode::bad_value) << motion.error().line();
}

TEST(StructuredRegistrations, are_refused_in_one_line_or_work) {
  const test::Scratch folder;
  const fs::path original = folder / "whole.h5", file = folder / "mutated.h5";
  Registration shared = tests::small_registration();
  shared.ghost.found = true;
  shared.ghost.share = 0.01, shared.ghost.place = {1.5, -2};
  ASSERT_TRUE(save_registration(original, shared).ok());
  int refused = 0, read = 0;
  campaign([&](std::uint64_t number) {
    Random random(number);
    fs::copy_file(original, file, fs::copy_options::overwrite_existing);
    SCOPED_TRACE(mutate_scene(file, random));
    const auto registration = load_registration(file);
    registration.ok() ? ++read : ++refused;
    if (registration.ok()) return use_as_commands_do(*registration);
    EXPECT_EQ(exit_code(registration.error().code), 4) << registration.error().line();
    EXPECT_EQ(registration.error().line().find('\n'), std::string::npos);
    EXPECT_NE(registration.error().line().find("mutated.h5"), std::string::npos)
        << registration.error().line();
  });
  if (std::getenv("SYMRIG_CASE") == nullptr) {
    EXPECT_GT(refused, read / 10);
    EXPECT_GT(read, refused / 100);
  }
}

}  // namespace
}  // namespace symrig::structured::structured_registrations_test
