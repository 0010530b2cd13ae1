// SPDX-License-Identifier: Apache-2.0
#include "registration_job.hpp"

#include "console.hpp"
#include "files.hpp"
#include "invocation.hpp"
#include "meter.hpp"
#include "symrig/calibration/registration_file.hpp"
#include "symrig/report/registration_summary.hpp"

#include <optional>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

std::string next_step(const std::string& output) {
  if (output.empty()) return "nothing was kept: give -o registration.h5\n";
  return fmt::format("wrote {}; `symrig capture --registration {}` uses it\n", output, output);
}

}  // namespace

Result<void> register_rig(Probe& rig, const RegistrationJob& job) {
  std::optional<Meter> meter(std::in_place, "calibrate", "photographs");
  RegistrationOptions options;
  options.progress = meter->progress();
  SYMRIG_TRY(const Registration found, register_camera(rig, options));
  meter.reset();
  SYMRIG_TRY(const CellWeights weights, found.weights());
  const RegistrationSummary summary{found, weights, rig.cost().rig_seconds, made_now(), rig.views()};
  if (!job.output.empty()) SYMRIG_CHECK(save_registration(job.output, found));
  if (!job.report.empty()) {
    SYMRIG_TRY(const std::string page, registration_page(summary));
    SYMRIG_CHECK(write_text(job.report, page));
  }
  SYMRIG_CHECK(write_text(job.json, registration_json(summary)));
  if (is_standard_output(job.json)) return {};
  return print(registration_text(summary) + next_step(job.output));
}

}  // namespace symrig::apps
