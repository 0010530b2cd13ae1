// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scanout/scanout.hpp"
#include "symrig/projector/internal/drm_projector.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm {

/// A display of the guest.
struct GuestDisplay {
  std::string card;       ///< "/dev/dri/card0"
  std::string connector;  ///< "card0-Virtual-1"
};

/// The display of a bench variable: BENCH_VKMS, BENCH_VGA. Fails the test if it does not exist.
GuestDisplay display_of(const char* variable);

/// Opens a projector or fails the test with the error's line.
std::unique_ptr<DrmProjector> open_projector(const DrmProjectorOptions& options);

/// Structured and random patterns, binary and grey. Deterministic.
inline constexpr std::size_t kPatterns = 24;
Pattern pattern_number(std::size_t number, Grid grid);

/// The expected pixels of a screen, computed only from the rule in placement.hpp.
ScreenPixels expected_screen(const Pattern& pattern, const Placement& placement, Grid screen);

/// Makes the kernel treat a connector of the guest as unplugged or plugged in (sysfs; needs root).
class GuestPlug {
 public:
  explicit GuestPlug(const std::string& connector) : file_("/sys/class/drm/" + connector + "/status") {}
  GuestPlug(const GuestPlug&) = delete;
  GuestPlug& operator=(const GuestPlug&) = delete;
  ~GuestPlug() { set("detect"); }

  void out() const { set("off"); }
  void in() const { set("on"); }

 private:
  void set(const char* status) const { std::ofstream(file_) << status << std::flush; }
  std::string file_;
};

/// Number of files that this process has open.
inline std::size_t open_files() {
  const std::filesystem::directory_iterator files("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

}  // namespace symrig::bench_vm
