// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "viewer/service.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace symrig::viewer {

/// Lets in requests to this machine's name that know the secret.
class Gate {
 public:
  explicit Gate(const std::string& secret) : root_("/" + secret + "/") {}

  /// The refusal of a request from elsewhere: another host, another origin, no secret.
  std::optional<ViewReply> refused(const ViewRequest& request) const;
  /// Also refuses methods other than GET, HEAD and POST.
  std::optional<ViewReply> refused_or_odd(const ViewRequest& request) const;
  /// What a request that was let in asks for: "relight" of "/SECRET/relight?x".
  std::string_view asked(const ViewRequest& request) const;

 private:
  std::string root_;
};

}  // namespace symrig::viewer
