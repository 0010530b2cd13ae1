// SPDX-License-Identifier: Apache-2.0
// Stands in for the transport to DLP controllers in a build without hidapi.
#include "projector/dlpc350/find_controllers.hpp"

namespace symrig::projector::dlpc350 {

std::vector<FoundController> find_controllers() {
  return {};
}

Result<std::unique_ptr<HidTransport>> open_transport(const std::string& /*path*/) {
  return Error{ErrorCode::device_refused, "this build of symrig has no driver for DLP controllers",
               "install libhidapi-dev and build with -DSYMRIG_DLPC=ON"};
}

}  // namespace symrig::projector::dlpc350
