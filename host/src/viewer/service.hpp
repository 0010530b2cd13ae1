// SPDX-License-Identifier: Apache-2.0
// What answers requests, and what a finished and a live scene have in common: replies, lights on the wire,
// the secret.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "viewer/camera_view.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

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

/// Lights and pictures on the wire between page and server. Browsers send large bodies slowly, and most of a
/// light is dark. All numbers are little-endian; a half is an IEEE 754 binary16.

namespace symrig::viewer {

/// The largest light of a grid. units: bytes.
std::uint64_t most_light_bytes(Grid grid);

/// A light: the number of planes (1 or 3); for each plane the number of runs, the first pixel and the length
/// of each run, in 32 bits each, then the halves of all runs, padded to 4 bytes. Pixels outside the runs are
/// dark. Nothing if the bytes are no finite light of this grid.
std::optional<std::vector<Image<float>>> decode_light(std::string_view bytes, Grid grid);

/// Appends a plane of a picture: an exponent of 32 bits, then halves, padded to 4 bytes.
/// value = half · 2^exponent.  error: ≤ 2⁻¹¹ |value| + 2⁻³² of the largest value.
void append_plane(std::string& to, std::span<const float> values);

ViewReply refusal(unsigned status, std::string text);
/// "There is nothing at this address."
ViewReply nothing_here();
ViewReply json_reply(const nlohmann::json& value);
/// The page with these facts.
ViewReply page_reply(const nlohmann::json& facts, std::string_view nonce);

/// The picture under a light (decode_light()), one plane or three. grid: of the light.
using Seen = std::function<Result<Image<float>>(const Image<float>& light)>;
ViewReply picture_reply(std::string_view light, Grid grid, const Seen& seen);
/// The same of a tensor. dual: its transpose.
ViewReply relit_reply(std::string_view light, const TransportTensor& tensor, bool dual);
/// All planes of a picture.
ViewReply planes_reply(const Image<float>& picture);
/// A pattern and its photograph.
ViewReply photograph_reply(const Image<float>& pattern, const Image<float>& photograph);
/// Floats: the affine map, x of each cell, y of each cell.
ViewReply places_reply(const CellPlaces& places);
/// Numbers of 32 bits: pixels of the camera, pixels of the projector (0 if it has the camera's order),
/// leaves; the orders; 7 numbers a leaf.
ViewReply leaves_reply(const TransportTensor& tensor);

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
