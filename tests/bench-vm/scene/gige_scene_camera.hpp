// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/scene_camera.hpp"
#include "symrig/base/units.hpp"
#include "symrig/image/grid.hpp"

#include <memory>
#include <string>

namespace symrig::bench_vm {

/// How the GigE Vision camera and its link are.
struct GigeLink {
  std::string address;     ///< on the loopback network, such as 127.0.7.1
  Grid camera;             ///< of the simulated camera
  Nanoseconds readout{0};  ///< as the camera states it
  double packet_loss = 0;  ///< share of stream packets that are lost
};

/// The GigE Vision camera of tests/gige: control and frames are packets of the guest's network. Its trigger
/// counter counts the frames that the link lost.
/// fails: bad_argument (a fault that this camera has not), io (the address is taken).
Result<std::unique_ptr<SceneCamera>> open_gige_camera(const GigeLink& link, const FaultRates& faults);

}  // namespace symrig::bench_vm
