// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/viewer/live.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace symrig {

struct ViewOptions {
  std::string title;       ///< the heading of the page
  std::uint16_t port = 0;  ///< 0: any free port
  /// A tensor of at most this size is sent to the page, which then relights by itself: faster than asking,
  /// above all over a network. Larger ones are relit here, and so is T on a camera's own
  /// pixels, which the page shows where the scene has it. units: bytes.
  std::int64_t max_local_bytes = 64'000'000;
  /// photograph = T · pattern with the true T of a simulated scene; may be empty.
  std::function<Result<Image<float>>(const Image<float>&)> truth;
};

/// Serves the page of one scene on 127.0.0.1, on one thread. The address contains a secret of 128 random
/// bits. Requests without it, or with the name of another host, are refused, so pages of other sites reach
/// nothing. Memory is bounded: at most 64 connections, and no request larger than its light.
class ViewServer {
 public:
  /// The scene is shown as it is now.  fails: bad_argument (neither 1 nor 3 channels), io (the port is in
  /// use).
  static Result<ViewServer> open(StoredScene scene, ViewOptions options);
  /// The same of a scene that is being captured.
  static Result<ViewServer> open(std::shared_ptr<const LiveScene> scene, ViewOptions options);
  ViewServer(ViewServer&&) noexcept;
  ViewServer& operator=(ViewServer&&) noexcept;
  ~ViewServer();

  /// "http://127.0.0.1:PORT/SECRET/"
  std::string address() const;
  /// Answers until keep_going() is false. It is asked at least ten times a second.
  void run(const std::function<bool()>& keep_going);

 private:
  class Listener;
  explicit ViewServer(std::unique_ptr<Listener> listener);
  std::unique_ptr<Listener> listener_;
};

}  // namespace symrig
