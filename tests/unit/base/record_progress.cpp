// SPDX-License-Identifier: Apache-2.0
// Captures a simulated scene and prints what a progress line would be told: seconds on this computer, units
// done, expected in the stage, and to come at least and at most; the stage. The last line is the end of the
// capture.
#include "symrig/acquisition/capture.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

int main(int argc, char** argv) try {
  using Clock = std::chrono::steady_clock;
  if (argc < 2) return 2;
  auto rig = symrig::open_virtual_rig(argv[1]);
  const auto algorithm = symrig::parse_algorithm(argc > 2 ? argv[2] : "symrig");
  if (!rig || !algorithm) return 2;
  symrig::CaptureOptions options;
  options.algorithm = *algorithm;
  options.rule = symrig::default_rule(*algorithm);
  options.economy = symrig::default_economy(*algorithm);
  const auto start = Clock::now();
  const auto seconds = [start] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  options.progress = [&](const symrig::ProgressEvent& event) {
    std::printf("%.4f %lld %lld %lld %lld %s\n", seconds(), static_cast<long long>(event.done),
                static_cast<long long>(event.expected), static_cast<long long>(event.later.least),
                static_cast<long long>(event.later.most), std::string(event.stage).c_str());
    return true;
  };
  const auto result = symrig::capture(**rig, options);
  if (!result) return 5;
  std::printf("%.4f %lld 0 0 -1 end\n", seconds(), static_cast<long long>(result->patterns));
  return 0;
} catch (const std::exception& error) {
  (void)std::fprintf(stderr, "record_progress: %s\n", error.what());
  return 1;
}
