// SPDX-License-Identifier: Apache-2.0
// Stands in for the transport to DLP controllers in a build without hidapi.
#include "symrig/projector/internal/dlp_link.hpp"

namespace symrig::projector::dlp {

std::vector<FoundController> find_controllers() {
  return {};
}

Error missing(std::string_view /*name*/, const std::string& /*path*/) {
  return {ErrorCode::device_refused, "this build of symrig has no driver for DLP controllers",
          "install libhidapi-dev and build with -DSYMRIG_DLPC=ON"};
}

Result<std::unique_ptr<HidTransport>> open_transport(const ControllerKind& kind, const std::string& path) {
  return missing(kind.name, path);
}

}  // namespace symrig::projector::dlp
