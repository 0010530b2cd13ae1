// SPDX-License-Identifier: Apache-2.0

#include "symrig/job/rig_by_name.hpp"

#include "symrig/base/text.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/rig/exec_probe.hpp"
#include "symrig/rig/internal/each_pair.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/rig/rig_file.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "symrig/sim/simulated_pairs.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
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
    options.most_seconds = own.most_seconds;
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

/// Opens a rig of several pairs: devices of this computer or behind servers, or simulated pairs behind
/// servers.
/// fails: as PairLink::open, open_simulated_pairs, load_registration and Rig::open; bad_argument (the board
/// does not fit, or the grid is missing).
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

}  // namespace

}  // namespace symrig::job

namespace symrig {

namespace {

constexpr std::string_view kExec = "exec:";

Error not_simulated(const std::string& rig) {
  return {ErrorCode::unknown_name, fmt::format("'{}' is not a simulated rig", rig),
          "give a simulated rig, such as sim:vgroove-textured"};
}

/// "simm:gumy" and "gumy" mean sim:gummy.
std::string meant_scene(const std::string& rig) {
  const std::size_t colon = rig.find(':');
  const std::string name = rig.substr(colon == std::string::npos ? 0 : colon + 1);
  const auto nearest = nearest_name(name.substr(0, name.find('?')), scene_names());
  return nearest ? fmt::format("did you mean 'sim:{}'? ", *nearest) : std::string();
}

Result<OpenedRig> open_exec_rig(const std::string& rig, const KeepWaiting& keep_waiting) {
  ExecOptions options;
  options.keep_waiting = keep_waiting;
  SYMRIG_TRY(auto probe, ExecProbe::open(rig.substr(kExec.size()), std::move(options)));
  return OpenedRig{std::move(probe), nullptr, "camera"};
}

Result<RigDescription> read_checked(const std::string& rig, RigUse use = RigUse::capture) {
  SYMRIG_CHECK(check_rig_exists(rig));
  return read_rig_file(rig, use);
}

Result<OpenedRig> open_described(RigDescription file, const KeepWaiting& keep_waiting) {
  file.options.keep_waiting = keep_waiting;
  if (!file.pairs.empty()) return job::open_pairs(std::move(file));
  SYMRIG_TRY(auto real, open_rig_file(std::move(file)));
  const Rig* inside = real.get();
  return OpenedRig{std::move(real), inside, "camera"};
}

Result<BayerPattern> filters_of(const Rig& rig, const std::string& file) {
  if (rig.mosaic() != Mosaic::none) return filters(rig.mosaic());
  return Error{ErrorCode::bad_argument,
               fmt::format("{}: capture.colour: the camera's pixels have no colour filters", file),
               "remove the key, or give camera.format a format with a mosaic (symrig info lists them)"};
}

/// Registers a rig that has moved.
Result<Registration> register_now(Probe& rig, const KeepWaiting& keep_waiting) {
  RegistrationOptions options;
  options.progress = [&keep_waiting](const ProgressEvent&) { return !keep_waiting || keep_waiting(); };
  return register_camera(rig, options);
}

/// Above this, T is not taken to be symmetric: far above the rounding of a float, far below a tolerance.
constexpr double kSymmetric = 1e-5;

Result<void> check_symmetric_matrix(double share, const std::string& rig) {
  if (share <= kSymmetric) return {};
  return Error{
      ErrorCode::bad_value,
      fmt::format("{}: T is not symmetric: T and its transpose differ by {:.2g} of the largest entry", rig,
                  share),
      "give (T + T') / 2 if the difference is noise"};
}

Result<OpenedRig> open_dense_rig(const std::string& rig) {
  SYMRIG_TRY(const DenseUri uri, parse_dense_uri(rig));
  SYMRIG_TRY(DenseMatrix matrix, read_dense(uri));
  Result<void> symmetric = check_symmetric_matrix(asymmetry(matrix), rig);
  return OpenedRig{make_dense_rig(std::move(matrix), rig, uri.views), nullptr, "off", nullptr,
                   std::move(symmetric)};
}

bool is_exec(const std::string& rig) {
  return rig.starts_with(kExec);
}

}  // namespace

Result<void> check_rig_exists(const std::string& rig) {
  std::error_code failed;
  const bool there = std::filesystem::exists(rig, failed);
  if (there || failed == std::errc::permission_denied) return {};  // reading it gives the exact error
  if (rig.ends_with(".toml"))
    return Error{ErrorCode::not_found, fmt::format("there is no rig file {}", rig), "check the path"};
  return Error{ErrorCode::unknown_name, fmt::format("there is no rig '{}'", rig),
               meant_scene(rig) +
                   "give a rig file, such as rig.toml, or a simulated rig, such as sim:vgroove-textured"};
}

bool is_simulated(const std::string& rig) {
  if (!is_dense(rig)) return rig.starts_with("sim:");
  const auto uri = parse_dense_uri(rig);
  return uri && !uri->rig_keys.empty();
}

bool is_rig_file(const std::string& rig) {
  return !is_simulated(rig) && !is_exec(rig) && !is_dense(rig);
}

JobFiles rig_files(const std::string& rig) {
  if (is_rig_file(rig)) return JobFiles().reads_settings("the rig file or a file of it", rig);
  if (!is_dense(rig)) return {};
  const auto uri = parse_dense_uri(rig);
  return uri ? JobFiles().reads("the matrix", uri->file) : JobFiles();
}

Result<std::unique_ptr<VirtualRig>> open_simulated_rig(const std::string& rig) {
  if (!is_simulated(rig)) return not_simulated(rig);
  return open_virtual_rig(rig);
}

namespace {

Result<OpenedRig> open_with(const std::string& rig, const std::function<void(RigOptions&)>& set,
                            const KeepWaiting& keep_waiting, RigUse use) {
  if (is_simulated(rig)) {
    VirtualRigHooks hooks;
    hooks.options = set;
    SYMRIG_TRY(auto simulated, open_virtual_rig(rig, std::move(hooks)));
    const Rig* inside = &simulated->rig();
    const SceneUri& uri = simulated->uri();
    const std::string noise = uri.camera_noise ? "camera" : "off";
    Result<void> symmetric = uri.given ? check_symmetric_matrix(uri.given->asymmetry, rig) : Result<void>();
    return OpenedRig{std::move(simulated), inside, noise, nullptr, std::move(symmetric)};
  }
  if (is_exec(rig)) return open_exec_rig(rig, keep_waiting);
  if (is_dense(rig)) return open_dense_rig(rig);
  SYMRIG_TRY(RigDescription file, read_checked(rig, use));
  set(file.options);
  return open_described(std::move(file), keep_waiting);
}

}  // namespace

Result<OpenedRig> open_bare_rig(const std::string& rig, std::optional<int> exposures,
                                const KeepWaiting& keep_waiting) {
  return open_with(
      rig, [exposures](RigOptions& options) { options.exposures = exposures.value_or(options.exposures); },
      keep_waiting, RigUse::capture);
}

Result<OpenedRig> open_rig_to_calibrate(const std::string& rig, const KeepWaiting& keep_waiting) {
  return open_with(
      rig,
      [](RigOptions& options) {
        if (options.exposures == 0) options.exposures = kUnforeseenExposures;
      },
      keep_waiting, RigUse::one_pair);
}

Result<OpenedRig> open_rig(const std::string& rig, const std::string& registration,
                           const KeepWaiting& keep_waiting, double most_seconds) {
  std::optional<RigDescription> described;
  if (is_rig_file(rig)) {
    SYMRIG_TRY(described, read_checked(rig));
  }
  const std::string file = registration.empty() && described ? described->registration : registration;
  const bool again = described && described->registers_again;
  const bool colour = described && described->colour;
  const auto limit = [most_seconds](RigOptions& options) { options.most_seconds = most_seconds; };
  const auto open = [&]() -> Result<OpenedRig> {
    if (!described) return open_with(rig, limit, keep_waiting, RigUse::capture);
    limit(described->options);
    return open_described(*std::move(described), keep_waiting);
  };
  if (file.empty()) return open();
  // The file first: it takes no time, and the devices may.
  SYMRIG_TRY(const Registration found, load_registration(file));
  SYMRIG_TRY(OpenedRig opened, open());
  std::optional<BayerPattern> mosaic;
  if (colour) {
    SYMRIG_TRY(mosaic, filters_of(*opened.rig, rig));
  }
  SYMRIG_TRY(auto registered, RegisteredProbe::make(std::move(opened.probe), found, mosaic));
  registered->watch_motion(found.watch(opened.rig == nullptr ? Mosaic::none : opened.rig->mosaic()));
  if (again)
    registered->register_again([keep_waiting](Probe& moved) { return register_now(moved, keep_waiting); });
  opened.registered = registered.get();
  opened.coaxial = require_coaxial(found.shape().parallax);
  opened.probe = std::move(registered);
  return opened;
}

RigTrouble OpenedRig::trouble() const {
  RigTrouble found = rig == nullptr ? RigTrouble() : rig->trouble();
  if (registered != nullptr) found.registered_again = registered->registered_again();
  return found;
}

Result<std::shared_ptr<const Scene>> open_truth(const std::string& rig) {
  if (!is_simulated(rig)) return not_simulated(rig);
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
  SYMRIG_TRY(std::unique_ptr<Scene> scene, make_scene(uri));
  return std::shared_ptr<const Scene>(std::move(scene));
}

TrueTransport truth_of(std::shared_ptr<const Scene> scene) {
  return [scene = std::move(scene)](const Image<float>& pattern) -> Result<Image<float>> {
    if (pattern.grid() != scene->grid())
      return Error{ErrorCode::size_mismatch,
                   fmt::format("the rig's grid is {}, the scene file's {}", to_string(scene->grid()),
                               to_string(pattern.grid())),
                   "give the rig that the scene was captured from"};
    return scene->apply(pattern);
  };
}

TrueTransport told(TrueTransport truth, Progress progress) {
  return [truth = std::move(truth), progress = std::move(progress),
          done = std::int64_t{0}](const Image<float>& pattern) mutable -> Result<Image<float>> {
    if (progress && !progress({"comparing with the true transport", done++, 0}))
      return Error{ErrorCode::interrupted, "stopped before the comparison was complete",
                   "nothing was written"};
    return truth(pattern);
  };
}

namespace {

void add_reopened(std::vector<std::string>& lines, const char* device, std::int64_t times) {
  if (times > 0) lines.push_back(fmt::format("the {} was lost and reconnected {} times", device, times));
}

}  // namespace

std::vector<std::string> repair_lines(const RigTrouble& trouble) {
  std::vector<std::string> lines;
  if (trouble.retaken > 0)
    lines.push_back(fmt::format("{} photographs were retaken; frames: {}", trouble.retaken,
                                trouble.frames.trouble().empty() ? "all correct" : trouble.frames.trouble()));
  add_reopened(lines, "board", trouble.boards_reopened);
  add_reopened(lines, "camera", trouble.cameras_reopened);
  add_reopened(lines, "projector", trouble.projectors_reopened);
  if (trouble.registered_again > 0)
    lines.push_back(fmt::format("the rig moved and was registered again {} times", trouble.registered_again));
  return lines;
}

std::vector<std::string> trouble_lines(const RigTrouble& trouble) {
  std::vector<std::string> lines = repair_lines(trouble);
  for (const std::string& warning : rig_warnings(trouble)) lines.push_back("warning: " + warning);
  return lines;
}

std::int64_t lost_frames(const FrameCounts& frames) {
  std::int64_t lost = frames.missing;
  for (std::size_t k = 0; k < FrameCounts::kVerdicts; ++k) {
    const auto verdict = static_cast<Verdict>(k);
    if (verdict != Verdict::certain && verdict != Verdict::guard) lost += frames[verdict];
  }
  return lost;
}

}  // namespace symrig
