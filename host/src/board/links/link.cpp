// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/link.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/board/internal/links.hpp"
#include "symrig/board/virtual_bench.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

struct Scheme {
  std::string_view text;
  Transport transport;
};
constexpr std::array<Scheme, 7> kSchemes{{{"virtual:tcp:", Transport::virtual_tcp},
                                          {"virtual:unix:", Transport::virtual_unix},
                                          {"sim:", Transport::sim},
                                          {"usb:", Transport::usb},
                                          {"serial:", Transport::serial},
                                          {"tcp:", Transport::tcp},
                                          {"unix:", Transport::unix_socket}}};

std::string_view scheme_of(Transport transport) {
  return std::find_if(kSchemes.begin(), kSchemes.end(),
                      [transport](const Scheme& scheme) { return scheme.transport == transport; })
      ->text;
}

Error malformed(std::string_view text, std::string_view why) {
  return {
      ErrorCode::bad_argument, fmt::format("'{}' is not a device: {}", text, why),
      "a device is sim:, usb:SERIAL, serial:/dev/ttyACM0, tcp:HOST:PORT, unix:PATH, virtual:tcp:HOST:PORT or "
      "virtual:unix:PATH"};
}

/// "ubs:123" means "usb:".
Error unknown_scheme(std::string_view text) {
  Error error = malformed(text, "it does not begin with a known kind of link");
  std::vector<std::string_view> known;
  known.reserve(kSchemes.size());
  for (const Scheme& scheme : kSchemes) known.push_back(scheme.text);
  const std::size_t colon = text.find(':');
  error.hint =
      suggestion(text.substr(0, colon == std::string_view::npos ? colon : colon + 1), known) + error.hint;
  return error;
}

std::optional<std::uint32_t> number(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The value of the only allowed option, "?key=value"; removes it from `rest`. nullopt: another option.
std::optional<std::string_view> take_option(std::string_view& rest, std::string_view key) {
  const std::size_t mark = rest.find('?');
  if (mark == std::string_view::npos) return "";
  std::string_view option = rest.substr(mark + 1);
  rest = rest.substr(0, mark);
  if (option.substr(0, key.size()) != key || option.size() <= key.size() + 1 || option[key.size()] != '=')
    return std::nullopt;
  return option.substr(key.size() + 1);
}

/// Removes "?jumper=OUT:IN" from `rest`, if present. sim: names lines, virtual links number pins.
Result<void> take_jumper(std::string_view text, std::string_view& rest, DeviceUri& uri) {
  const auto jumper = take_option(rest, "jumper");
  if (!jumper) return malformed(text, "its only option is ?jumper=OUT:IN");
  if (jumper->empty()) return {};
  const std::size_t colon = jumper->find(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == jumper->size())
    return malformed(text, "its jumper must be OUT:IN, two lines");
  uri.jumper_from = jumper->substr(0, colon);
  uri.jumper_to = jumper->substr(colon + 1);
  const auto pin = [](const std::string& name) { return number(name).value_or(255) < 255; };
  if (uri.transport != Transport::sim && !(pin(uri.jumper_from) && pin(uri.jumper_to)))
    return malformed(text, "its jumper must be GPIO:GPIO, two pin numbers");
  return {};
}

Result<DeviceUri> parse_sim(std::string_view text, std::string_view rest) {
  DeviceUri uri{.transport = Transport::sim};
  SYMRIG_CHECK(take_jumper(text, rest, uri));
  if (!rest.empty()) return malformed(text, "no text is allowed between sim: and its options");
  return uri;
}

Result<DeviceUri> parse_serial(std::string_view text, std::string_view rest) {
  const auto baud = take_option(rest, "baud");
  if (!baud) return malformed(text, "the only option of serial: is ?baud=N");
  if (rest.empty()) return malformed(text, "the path of the serial port is missing");
  DeviceUri uri{.transport = Transport::serial, .place = std::string(rest)};
  if (baud->empty()) return uri;
  const auto rate = number(*baud);
  if (!rate || *rate == 0) return malformed(text, fmt::format("'{}' is not a baud rate", *baud));
  uri.baud = *rate;
  return uri;
}

Result<DeviceUri> parse_socket(std::string_view text, std::string_view rest, DeviceUri uri) {
  const std::size_t colon = rest.rfind(':');
  if (colon == std::string_view::npos) return malformed(text, "the port is missing");
  std::string_view host = rest.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']')
    host = host.substr(1, host.size() - 2);
  else if (host.find(':') != std::string_view::npos)
    return malformed(text, "an IPv6 address needs brackets, [::1]");
  if (host.empty()) return malformed(text, "the host is missing");
  const auto port = number(rest.substr(colon + 1));
  if (!port || *port == 0 || *port > 65'535)
    return malformed(text, fmt::format("'{}' is not a port, 1 to 65535", rest.substr(colon + 1)));
  uri.place = host;
  uri.port = static_cast<std::uint16_t>(*port);
  return uri;
}

Result<DeviceUri> parse_path(std::string_view text, std::string_view rest, DeviceUri uri) {
  if (rest.empty()) return malformed(text, "the path of the socket is missing");
  uri.place = rest;
  return uri;
}

Result<DeviceUri> parse_virtual(std::string_view text, std::string_view rest, Transport transport) {
  DeviceUri uri{.transport = transport};
  SYMRIG_CHECK(take_jumper(text, rest, uri));
  return transport == Transport::virtual_tcp ? parse_socket(text, rest, uri) : parse_path(text, rest, uri);
}

}  // namespace

std::vector<std::string_view> device_schemes() {
  std::vector<std::string_view> schemes;
  schemes.reserve(kSchemes.size());
  for (const Scheme& scheme : kSchemes) schemes.push_back(scheme.text);
  return schemes;
}

bool looks_like_uri(std::string_view text) {
  return text.find(':') != std::string_view::npos;
}

Result<DeviceUri> DeviceUri::parse(std::string_view text) {
  for (const Scheme& scheme : kSchemes) {
    if (text.substr(0, scheme.text.size()) != scheme.text) continue;
    const std::string_view rest = text.substr(scheme.text.size());
    switch (scheme.transport) {
      case Transport::sim:
        return parse_sim(text, rest);
      case Transport::usb:
        return DeviceUri{.transport = Transport::usb, .place = std::string(rest)};
      case Transport::serial:
        return parse_serial(text, rest);
      case Transport::tcp:
        return parse_socket(text, rest, {.transport = Transport::tcp});
      case Transport::unix_socket:
        return parse_path(text, rest, {.transport = Transport::unix_socket});
      case Transport::virtual_tcp:
      case Transport::virtual_unix:
        return parse_virtual(text, rest, scheme.transport);
    }
  }
  return unknown_scheme(text);
}

std::string DeviceUri::text() const {
  const bool bracketed = place.find(':') != std::string::npos && port != 0;
  std::string text(scheme_of(transport));
  text += bracketed ? "[" + place + "]" : place;
  if (port != 0) text += fmt::format(":{}", port);
  if (transport == Transport::serial && baud != DeviceUri{}.baud) text += fmt::format("?baud={}", baud);
  if (!jumper_from.empty()) text += fmt::format("?jumper={}:{}", jumper_from, jumper_to);
  return text;
}

namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kDialPatience = 5s;
/// An Arduino restarts when its port opens. Its boot loader waits for a second for a new program, then the
/// board starts.
constexpr Nanoseconds kSerialRestart = 2s;

Result<std::unique_ptr<Link>> over(Result<Fd> fd, const DeviceUri& uri, Nanoseconds restart_time = {}) {
  if (!fd) return std::move(fd).error();
  return board::make_stream_link(std::move(fd).value(), uri.text(), restart_time);
}

Result<std::unique_ptr<Link>> open_virtual(const DeviceUri& uri) {
  SYMRIG_TRY(const VirtualBench bench, VirtualBench::connect(uri));
  if (!uri.jumper_from.empty())
    SYMRIG_CHECK(bench.jumper(static_cast<std::uint8_t>(std::stoul(uri.jumper_from)),
                              static_cast<std::uint8_t>(std::stoul(uri.jumper_to))));
  return bench.link();
}

}  // namespace

Result<std::unique_ptr<Link>> open_link(const DeviceUri& uri) {
  switch (uri.transport) {
    case Transport::sim:
      return board::open_sim_device(uri);
    case Transport::usb:
      return board::open_usb(uri.place);
    case Transport::serial:
      return over(board::open_serial(uri.place, uri.baud), uri, kSerialRestart);
    case Transport::tcp:
      return over(board::connect_tcp(uri.place, uri.port, kDialPatience), uri);
    case Transport::unix_socket:
      return over(board::connect_unix(uri.place), uri);
    case Transport::virtual_tcp:
    case Transport::virtual_unix:
      return open_virtual(uri);
  }
  return Error{ErrorCode::bad_argument, "unknown kind of link"};
}

}  // namespace symrig
