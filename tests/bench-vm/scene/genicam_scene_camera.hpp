// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/scene_camera.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
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

/// How the USB3 Vision camera is.
struct Usb3Link {
  std::string serial;         ///< by which the host finds it
  Grid camera;                ///< of the simulated camera
  Nanoseconds readout{0};     ///< as the camera states it
  std::uint16_t port = 3240;  ///< of its USB/IP server. 0: any that is free
};

/// The GigE Vision camera of tests/gige: control and frames are packets of the guest's network. Its trigger
/// counter counts the frames that the link lost. It delivers late and swapped frames with the next one, and
/// with their own stamps.
/// fails: bad_argument (a fault that this camera has not), io (the address is taken).
Result<std::unique_ptr<SceneCamera>> open_gige_camera(const GigeLink& link, const FaultRates& faults);

/// The USB3 Vision camera of tests/u3v behind USB/IP (`usbip attach -r 127.0.0.1 -b 1-1`), with the same
/// faults. After it was unplugged, attach it again.
/// fails: as open_gige_camera; io (the port is taken).
Result<std::unique_ptr<SceneCamera>> open_usb3_camera(const Usb3Link& link, const FaultRates& faults);

}  // namespace symrig::bench_vm
