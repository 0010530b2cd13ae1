// SPDX-License-Identifier: Apache-2.0
// A folder with frames of a simulated sensor, for commands that read one.
#pragma once

#include "command.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/file.hpp"
#include "unit/hdr/simulated_sensor.hpp"

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>

#include <fmt/format.h>

namespace symrig::test {

/// Frames of a simulated sensor, written as 16-bit PNG, and the capture.toml that names them.
class SensorFolder : public CommandTest {
 protected:
  static constexpr Grid kGrid{160, 160};

  void SetUp() override {
    std::filesystem::create_directory(path("frames"));
    toml_ = "symrig = 1\n[sensor]\nbits = 12\n";
  }

  /// electrons: of pixel i.
  void write_frame(const std::string& name, const std::function<double(std::size_t)>& electrons,
                   const std::function<double(double)>& processed = {}) {
    Image<float> image(kGrid);
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      double code = sample(sensor_, electrons(i), random_);
      if (processed) code = std::round(4095 * processed(code / 4095));
      image.values()[i] = static_cast<float>(code) / 65'535.F;
    }
    ASSERT_TRUE(write_image(path("frames/" + name), image).ok());
  }
  void write_dark_and_flat() {
    std::string dark;
    for (int k = 0; k < 6; ++k) {
      const std::string name = fmt::format("dark{}.png", k);
      write_frame(name, [](std::size_t) { return 0.0; });
      dark += fmt::format("\"{}\", ", name);
    }
    toml_ += "dark = [" + dark + "]\n";
    for (const double level : {0.1, 0.25, 0.4, 0.55, 0.7}) {
      const std::string name = fmt::format("flat{:.2f}", level);
      for (const char* each : {"a", "b"})
        write_frame(name + each + ".png", [&](std::size_t) { return level * sensor_.full_well(); });
      toml_ += fmt::format("[[sensor.flat]]\nfiles = [\"{0}a.png\", \"{0}b.png\"]\n", name);
    }
  }
  static double shade(std::size_t i) { return static_cast<double>(1 + i % 997) / 997; }
  /// A scene of all shades, at exposures twice as long from one to the next. last: what the shutter really
  /// was open in the last of them, as a share of what is stated.
  void write_bracket(const std::function<double(double)>& processed = {}, double last = 1) {
    for (int k = 0; k < 4; ++k) {
      const std::string name = fmt::format("still{}.png", k);
      write_frame(
          name,
          [&](std::size_t i) {
            return 0.12 * shade(i) * (k == 3 ? last : 1) * (1 << k) * sensor_.full_well();
          },
          processed);
      toml_ += fmt::format("[[sensor.bracket]]\nfile = \"{}\"\nexposure = \"{} ms\"\n", name, 5 << k);
    }
  }
  void write_toml() const { write_text(path("frames/capture.toml"), toml_); }

  NoiseModel sensor_ = NoiseModel::from_electrons({});
  Random random_{31};
  std::string toml_;
};

}  // namespace symrig::test
