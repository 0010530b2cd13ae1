// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace symrig::viewer {

/// A request, as far as an answer depends on it.
struct ViewRequest {
  std::string_view method = {};  ///< "GET", "HEAD", "POST"
  std::string_view target = {};  ///< "/SECRET/relight"
  std::string_view host = {};    ///< the header Host
  std::string_view origin = {};  ///< the header Origin, or ""
  std::string_view body = {};

  bool post() const { return method == "POST"; }
};

struct ViewReply {
  unsigned status = 200;
  std::string_view type = "text/plain; charset=utf-8";
  std::string body = {};
  std::string policy = {};  ///< the header Content-Security-Policy
};

/// Answers requests, without any network, on one thread.
class Service {
 public:
  Service() = default;
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  virtual ~Service() = default;

  /// The refusal of a request from elsewhere: another host, another origin, no secret. The body is not read.
  virtual std::optional<ViewReply> refused(const ViewRequest& request) const = 0;
  virtual ViewReply answer(const ViewRequest& request) = 0;
  /// The largest body that any request may have. units: bytes.
  virtual std::uint64_t max_body() const = 0;
};

}  // namespace symrig::viewer
