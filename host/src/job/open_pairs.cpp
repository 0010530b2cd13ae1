// SPDX-License-Identifier: Apache-2.0
#include "job/open_pairs.hpp"

#include "rig/pairs/each_pair.hpp"
#include "symrig/calibration/registration_file.hpp"
#include "symrig/rig/open_rig.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/sim/simulated_pairs.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::job {
namespace {

Result<LinkedPair> linked(std::size_t pair, const PairEntry& entry, const KeepWaiting& keep_waiting) {
  auto link = PairLink::open(*entry.address, keep_waiting);
  if (!link) return rig::of_pair(pair, link.error());
  return LinkedPair{*entry.address, *std::move(link)};
}

/// Whether the first pair is a simulated one. Then all are.
Result<bool> is_simulated_pair(const RigDescription& file) {
  SYMRIG_TRY(const LinkedPair first, linked(0, file.pairs.front(), file.options.keep_waiting));
  return first.link->fact("kind") == "simulated";
}

Result<OpenedRig> open_linked(const RigDescription& file) {
  if (file.board.transport != Transport::sim)
    return Error{
        ErrorCode::bad_argument,
        fmt::format("{}: simulated pairs cannot be fired by the board {}", file.path, file.board.text()),
        "give the simulated board: uri = \"sim:\""};
  std::vector<LinkedPair> pairs;
  for (std::size_t k = 0; k < file.pairs.size(); ++k) {
    if (!file.pairs[k].registration.empty())
      return rig::of_pair(
          k, {ErrorCode::bad_argument, "a simulated pair shares its pixels, so it has no registration",
              "remove the key"});
    SYMRIG_TRY(LinkedPair one, linked(k, file.pairs[k], file.options.keep_waiting));
    pairs.push_back(std::move(one));
  }
  SimulatedPairHooks hooks;
  hooks.options = [own = file.options](RigOptions& options) {
    options.exposures = own.exposures == 0 ? options.exposures : own.exposures;
    options.retakes = own.retakes;
    options.device_patience = own.device_patience;
    options.keep_waiting = own.keep_waiting;
  };
  SYMRIG_TRY(auto paired, open_simulated_pairs(std::move(pairs), file.pair_layout, file.options.keep_waiting,
                                               std::move(hooks)));
  const Rig* inside = &paired->rig();
  const std::string noise = paired->uri().camera_noise ? "camera" : "off";
  return OpenedRig{std::move(paired), inside, noise};
}

/// What converts the photographs of each pair to its cells.
Result<std::vector<ToCells>> gatherers(const RigDescription& file) {
  std::vector<ToCells> all(file.pairs.size());
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (file.pairs[k].registration.empty()) continue;
    auto found = load_registration(file.pairs[k].registration);
    if (!found) return rig::of_pair(k, found.error());
    auto weights = found->weights();
    if (!weights) return rig::of_pair(k, weights.error());
    const auto shared = std::make_shared<const CellWeights>(*std::move(weights));
    all[k] = [shared](const Radiance& photograph) { return shared->gather(photograph); };
  }
  return all;
}

}  // namespace

Result<OpenedRig> open_pairs(RigDescription file) {
  if (std::ranges::all_of(file.pairs, [](const PairEntry& pair) { return pair.address.has_value(); })) {
    SYMRIG_TRY(const bool simulated, is_simulated_pair(file));
    if (simulated) return open_linked(file);
  }
  if (!file.grid)
    return Error{ErrorCode::bad_argument, fmt::format("{}: several pairs need capture.grid", file.path),
                 "give the cells of one pair: grid = \"ROWSxCOLUMNS\""};
  SYMRIG_TRY(auto to_cells, gatherers(file));
  file.options.reading = read_pairs(file.options.reading, pair_layout_of(file), std::move(to_cells));
  SYMRIG_TRY(auto real, open_rig_file(std::move(file)));
  const Rig* inside = real.get();
  return OpenedRig{std::move(real), inside, "camera"};
}

}  // namespace symrig::job
