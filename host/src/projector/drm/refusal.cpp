// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/route.hpp"

#include <cerrno>
#include <system_error>

#include <fmt/format.h>

namespace symrig::projector::drm {

Error refusal(const std::string& name, const std::string& what, Errno error) {
  const std::string cause = fmt::format("{}: {} ({})", name, what, std::generic_category().message(error));
  switch (error) {
    case EACCES:
    case EPERM:
      return {ErrorCode::device_lost, name + ": another program has taken over the screen",
              "keep desktops and other viewers off this card, and open the projector again"};
    case ENODEV:
    case ENXIO:
    case ENOENT:
    case EIO:
      return {ErrorCode::device_lost, name + ": the display or its card is lost",
              "connect it, and open the projector again"};
    case ENOMEM:
    case ENOSPC:
      return {ErrorCode::limit, cause,
              "the card has too little memory for pictures of this size: use a smaller mode"};
    case EBUSY:
    case ETIMEDOUT:
      return {ErrorCode::timeout, cause, "check that the projector is on, and open it again"};
    default:
      return {ErrorCode::device_refused, cause,
              "the driver cannot do this: try another mode or another card"};
  }
}

}  // namespace symrig::projector::drm
