// SPDX-License-Identifier: Apache-2.0

#include "viewer/service.hpp"

#include "symrig/tensor/internal/half.hpp"
#include "viewer/page_tensor.hpp"
#include "viewer/page_text.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace symrig::viewer {

namespace {

constexpr int kTopOfPlane = 7;

/// Reads numbers from bytes; false at their end.
class LightReader {
 public:
  explicit LightReader(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  bool read(T& value) {
    if (rest_.size() < sizeof(T)) return false;
    std::memcpy(&value, rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    return true;
  }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
};

struct Run {
  std::uint32_t first = 0, length = 0;
};

std::optional<std::vector<Run>> read_runs(LightReader& reader, std::uint64_t pixels) {
  std::uint32_t count = 0;
  if (!reader.read(count) || count > reader.left() / sizeof(Run)) return std::nullopt;
  std::vector<Run> runs(count);
  for (Run& run : runs)
    if (!reader.read(run) || run.first > pixels || run.length > pixels - run.first) return std::nullopt;
  return runs;
}

bool read_plane(LightReader& reader, Image<float>& plane) {
  const auto runs = read_runs(reader, plane.values().size());
  if (!runs) return false;
  std::uint64_t halves = 0;
  for (const Run& run : *runs)
    for (float& value : plane.values().subspan(run.first, run.length)) {
      tensor::Half half = 0;
      if (!reader.read(half)) return false;
      value = tensor::from_half(half);
      if (!std::isfinite(value)) return false;
      ++halves;
    }
  tensor::Half padding = 0;
  return halves % 2 == 0 || reader.read(padding);
}

}  // namespace

/// The page joins runs with less than 8 dark pixels between them, so a pixel takes less than 3 bytes.
std::uint64_t most_light_bytes(Grid grid) {
  return 3 * (std::uint64_t{4} * static_cast<std::uint64_t>(grid.size()) + 64);
}

std::optional<std::vector<Image<float>>> decode_light(std::string_view bytes, Grid grid) {
  LightReader reader(bytes);
  std::uint32_t planes = 0;
  if (!reader.read(planes) || (planes != 1 && planes != 3)) return std::nullopt;
  std::vector<Image<float>> light(planes, Image<float>(grid));
  for (Image<float>& plane : light)
    if (!read_plane(reader, plane)) return std::nullopt;
  if (reader.left() != 0) return std::nullopt;
  return light;
}

void append_plane(std::string& to, std::span<const float> values) {
  std::vector<tensor::Half> halves(values.size() + values.size() % 2);
  const auto exponent = static_cast<std::int32_t>(tensor::to_halves(values, kTopOfPlane, halves.data()));
  to.append(reinterpret_cast<const char*>(&exponent), sizeof(exponent));
  to.append(reinterpret_cast<const char*>(halves.data()), halves.size() * sizeof(tensor::Half));
}

namespace {

constexpr std::string_view kNumbers = "application/octet-stream";

template <class T>
void append(std::string& to, std::span<const T> values) {
  to.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

/// White light shows all channels of the scene; light k of a coloured one shows channel k.
void append_channels(std::string& to, const Image<float>& seen, std::size_t light, bool white) {
  const int channels = seen.channels();
  const int first = white || channels == 1 ? 0 : static_cast<int>(light);
  const int end = white ? channels : first + 1;
  for (int channel = first; channel < end; ++channel) append_plane(to, seen.plane(channel));
}

}  // namespace

ViewReply refusal(unsigned status, std::string text) {
  return {.status = status, .body = std::move(text) + "\n"};
}

ViewReply nothing_here() {
  return refusal(404, "There is nothing at this address.");
}

ViewReply json_reply(const nlohmann::json& value) {
  return {.type = "application/json",
          .body = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)};
}

ViewReply page_reply(const nlohmann::json& facts, std::string_view nonce) {
  return {.type = "text/html; charset=utf-8",
          .body = page_text({.facts = facts, .nonce = nonce}),
          .policy = content_policy(nonce, true)};
}

ViewReply picture_reply(std::string_view light, Grid grid, const Seen& seen) {
  const auto lights = decode_light(light, grid);
  if (!lights) return refusal(400, "This is no light of the scene's size.");
  ViewReply reply{.type = kNumbers};
  for (std::size_t k = 0; k < lights->size(); ++k) {
    const auto picture = seen((*lights)[k]);
    if (!picture) return refusal(500, picture.error().line());
    append_channels(reply.body, *picture, k, lights->size() == 1);
  }
  return reply;
}

ViewReply relit_reply(std::string_view light, const TransportTensor& tensor, bool dual) {
  return picture_reply(
      light, dual ? tensor.camera_grid() : tensor.projector_grid(),
      [&](const Image<float>& one) { return dual ? tensor.apply_transposed(one) : tensor.apply(one); });
}

ViewReply planes_reply(const Image<float>& picture) {
  ViewReply reply{.type = kNumbers};
  for (int channel = 0; channel < picture.channels(); ++channel)
    append_plane(reply.body, picture.plane(channel));
  return reply;
}

ViewReply photograph_reply(const Image<float>& pattern, const Image<float>& photograph) {
  ViewReply reply = planes_reply(pattern);
  reply.body += planes_reply(photograph).body;
  return reply;
}

ViewReply places_reply(const CellPlaces& places) {
  ViewReply reply{.type = kNumbers};
  append(reply.body, std::span<const float>(places.affine));
  append(reply.body, std::span<const float>(places.x));
  append(reply.body, std::span<const float>(places.y));
  return reply;
}

ViewReply leaves_reply(const TransportTensor& tensor) {
  const auto camera = tensor.camera_tree().order(), projector = tensor.projector_tree().order();
  std::vector<PageLeaf> table;
  for (const Leaf& leaf : tensor.leaves()) table.push_back(page_leaf(leaf, tensor.symmetric()));
  const std::array<std::int32_t, 3> head{static_cast<std::int32_t>(camera.size()),
                                         tensor.symmetric() ? 0 : static_cast<std::int32_t>(projector.size()),
                                         static_cast<std::int32_t>(table.size())};
  ViewReply reply{.type = kNumbers};
  append(reply.body, std::span<const std::int32_t>(head));
  append(reply.body, camera);
  if (!tensor.symmetric()) append(reply.body, projector);
  append(reply.body, std::span<const PageLeaf>(table));
  return reply;
}

namespace {

/// "127.0.0.1", "localhost" or "[::1]", with any port: `ssh -L` may have another one. Another name means that
/// a foreign site's name was made to point here (DNS rebinding).
bool is_this_machine(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  if (colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos) {
    const std::string_view port = host.substr(colon + 1);
    if (port.empty() || port.find_first_not_of("0123456789") != std::string_view::npos) return false;
    host = host.substr(0, colon);
  }
  return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

/// The page's own requests state no origin or this machine.
bool is_own_origin(std::string_view origin) {
  constexpr std::string_view kScheme = "http://";
  return origin.empty() ||
         (origin.substr(0, kScheme.size()) == kScheme && is_this_machine(origin.substr(kScheme.size())));
}

/// Takes as long for a wrong text as for the right one.
bool begins_with(std::string_view text, std::string_view secret) {
  if (text.size() < secret.size()) return false;
  unsigned difference = 0;
  for (std::size_t k = 0; k < secret.size(); ++k)
    difference |= static_cast<unsigned char>(text[k] ^ secret[k]);
  return difference == 0;
}

}  // namespace

std::optional<ViewReply> Gate::refused(const ViewRequest& request) const {
  if (!is_this_machine(request.host) || !is_own_origin(request.origin))
    return refusal(403, "symrig answers only to 127.0.0.1 and localhost.");
  if (!begins_with(request.target, root_))
    return refusal(403, "The address lacks its secret. Open the address that symrig printed.");
  return std::nullopt;
}

std::optional<ViewReply> Gate::refused_or_odd(const ViewRequest& request) const {
  if (auto refusal = refused(request)) return refusal;
  if (request.post() || request.method == "GET" || request.method == "HEAD") return std::nullopt;
  return refusal(405, "Use GET or POST.");
}

std::string_view Gate::asked(const ViewRequest& request) const {
  const std::string_view path = request.target.substr(0, request.target.find('?'));
  return path.substr(root_.size());
}

}  // namespace symrig::viewer
