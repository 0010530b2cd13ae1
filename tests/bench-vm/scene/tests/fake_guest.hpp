// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/ports.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <sys/stat.h>

namespace symrig::bench_vm {

/// Files in place of the guest's devices. Tests read what was written to them. The trace is a named pipe.
class FakeGuest {
 public:
  FakeGuest() {
    std::string name = (std::filesystem::temp_directory_path() / "bench-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    for (std::size_t i = 0; i < places_.gpio_lines.size(); ++i) {
      std::filesystem::create_directories(line_folder(i));
      std::ofstream(line_folder(i) / "pull") << "";
    }
    std::ofstream(folder_ / "inject") << "";
    ::mkfifo((folder_ / "trace_pipe").c_str(), 0600);
    places_.gpio_sysfs = folder_.string();
    places_.tracefs = folder_.string();
  }
  FakeGuest(const FakeGuest&) = delete;
  FakeGuest& operator=(const FakeGuest&) = delete;
  ~FakeGuest() { std::filesystem::remove_all(folder_); }

  const BenchPlaces& places() const { return places_; }
  std::string pulled(const std::string& line) const {
    return read(line_folder(static_cast<std::size_t>(*places_.line(line))) / "pull");
  }
  std::string inject() const { return (folder_ / "inject").string(); }
  std::string injected() const { return read(folder_ / "inject"); }

 private:
  std::filesystem::path line_folder(std::size_t i) const {
    return folder_ / ("sim_gpio" + std::to_string(i));
  }
  static std::string read(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }

  std::filesystem::path folder_;
  BenchPlaces places_{"", 500, {"camera_trigger", "camera_strobe", "vsync"}, "", ""};
};

}  // namespace symrig::bench_vm
