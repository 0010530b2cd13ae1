// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace symrig::bench_vm {

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
