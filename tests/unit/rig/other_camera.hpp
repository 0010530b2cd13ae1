// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <string>
#include <vector>

namespace symrig::test {

/// A camera between a rig and another camera, which it borrows.
class OtherCamera : public Camera {
 public:
  explicit OtherCamera(Camera& inner) : inner_(inner) {}
  Grid grid() const override { return inner_.grid(); }
  int channels() const override { return inner_.channels(); }
  CameraTiming timing() const override { return inner_.timing(); }
  const NoiseModel& noise() const override { return inner_.noise(); }
  const Image<std::uint8_t>* dead() const override { return inner_.dead(); }
  std::string describe() const override { return inner_.describe(); }
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    return inner_.take(count, patience);
  }

 private:
  Camera& inner_;
};

}  // namespace symrig::test
