// SPDX-License-Identifier: Apache-2.0
#include "viewer/gate.hpp"

#include "viewer/replies.hpp"

namespace symrig::viewer {
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
