// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/route.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::projector::drm {
namespace {

/// What the search has found so far.
struct Search {
  std::vector<std::string> connectors;  // full names of all connectors
  std::vector<std::string> connected;
  std::vector<FoundConnector> matches;
  std::optional<Error> unopened;  // the first card that could not be queried
};

bool matches(const std::string& wanted, const std::string& card, const Connector& connector) {
  if (wanted.empty()) return connector.connected;
  return wanted == connector.name || wanted == card + "-" + connector.name;
}

/// Keeps the card open if one of its connectors matches.
void look_at(Search& search, const std::string& card, std::unique_ptr<Kms> kms, const std::string& wanted) {
  const auto resources = kms->resources();
  std::vector<Connector> found;
  for (const std::uint32_t id : resources.value.connectors) {
    auto connector = kms->connector(id, true);
    if (!connector) continue;
    const std::string name = card + "-" + connector.value.name;
    search.connectors.push_back(name);
    if (connector.value.connected) search.connected.push_back(name);
    if (matches(wanted, card, connector.value)) found.push_back(std::move(connector.value));
  }
  for (auto& connector : found) search.matches.push_back({card, nullptr, std::move(connector)});
  if (!found.empty()) search.matches.back().kms = std::move(kms);  // several matches are an error anyway
}

Error none(const Search& search, const std::string& wanted) {
  if (search.unopened && search.matches.empty()) return *search.unopened;
  if (search.connectors.empty())
    return {ErrorCode::device_lost, "this computer has no graphics card for displays",
            "`symrig list` shows projectors"};
  if (wanted.empty())
    return {ErrorCode::device_lost, "no projector is connected",
            fmt::format("connect one to {}", fmt::join(search.connectors, ", "))};
  return {
      ErrorCode::unknown_name, fmt::format("there is no connector '{}'", wanted),
      suggestion(wanted, std::vector<std::string_view>(search.connectors.begin(), search.connectors.end())) +
          fmt::format("this computer has {}", fmt::join(search.connectors, ", "))};
}

Error several(const Search& search, const std::string& wanted) {
  std::vector<std::string> names;
  for (const auto& match : search.matches) names.push_back(match.card + "-" + match.connector.name);
  return {ErrorCode::bad_argument,
          wanted.empty() ? fmt::format("{} displays are connected", names.size())
                         : fmt::format("'{}' matches {} connectors", wanted, names.size()),
          fmt::format("choose one of {}", fmt::join(names, ", "))};
}

}  // namespace

Result<FoundConnector> find_connector(Cards& cards, const std::string& wanted) {
  Search search;
  for (const std::string& card : cards.names()) {
    if (wanted.starts_with("card") && !wanted.starts_with(card + "-")) continue;
    auto kms = cards.open(card);
    if (kms)
      look_at(search, card, *std::move(kms), wanted);
    else if (kms.error().code == ErrorCode::device_lost && !search.unopened)
      search.unopened = kms.error();
  }
  if (search.matches.empty()) return none(search, wanted);
  if (search.matches.size() > 1) return several(search, wanted);
  FoundConnector found = std::move(search.matches.front());
  if (found.connector.connected) return found;
  return Error{ErrorCode::device_lost,
               fmt::format("nothing is connected to {}-{}", found.card, found.connector.name),
               search.connected.empty()
                   ? "connect the projector and switch it on"
                   : fmt::format("a display is connected to {}", fmt::join(search.connected, ", "))};
}

}  // namespace symrig::projector::drm
