// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/plane_watch.hpp"

#include <memory>

namespace symrig::bench_vm {

/// Serves an emulated DLPC350 by USB/IP (`usbip attach -r 127.0.0.1 -b 1-1`). The result tells what the
/// controller shows, and keeps it alive. Call it before priorities are raised.
PlaneWatch::Controller serve_controller();

}  // namespace symrig::bench_vm
