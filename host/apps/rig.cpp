// SPDX-License-Identifier: Apache-2.0
#include "rig.hpp"

#include "meter.hpp"
#include "symrig/base/nearest_name.hpp"
#include "symrig/calibration/registration_file.hpp"
#include "symrig/rig/exec_probe.hpp"
#include "symrig/rig/open_rig.hpp"

#include <filesystem>
#include <optional>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

constexpr std::string_view kExec = "exec:";

Error not_simulated(const std::string& rig) {
  return {ErrorCode::unknown_name, fmt::format("'{}' is not a simulated rig", rig),
          "give a simulated rig, such as sim:vgroove-textured: only these know the exact transport"};
}

std::string scene_help() {
  std::string text;
  for (const SceneInfo& scene : scenes()) text += fmt::format("  {:<16}  {}\n", scene.name, scene.about);
  return text;
}

std::string scene_key_help() {
  std::string text;
  for (const SceneKey& key : scene_keys())
    text += fmt::format("  {:<16}  {} ({})\n", fmt::format("{}={}", key.name, key.standard), key.meaning,
                        key.values);
  return text;
}

/// "simm:gumy" and "gumy" mean sim:gummy.
std::string meant_scene(const std::string& rig) {
  const std::size_t colon = rig.find(':');
  const std::string name = rig.substr(colon == std::string::npos ? 0 : colon + 1);
  const auto nearest = nearest_name(name.substr(0, name.find('?')), scene_names());
  return nearest ? fmt::format("did you mean 'sim:{}'? ", *nearest) : std::string();
}

/// A rig that is neither simulated nor a child process is a rig file.
Result<void> check_file(const std::string& rig) {
  std::error_code failed;
  const bool there = std::filesystem::exists(rig, failed);
  if (there || failed == std::errc::permission_denied) return {};  // reading it gives the exact error
  if (rig.ends_with(".toml"))
    return Error{ErrorCode::not_found, fmt::format("there is no rig file {}", rig), "check the path"};
  return Error{ErrorCode::unknown_name, fmt::format("there is no rig '{}'", rig),
               meant_scene(rig) +
                   "give a rig file, such as rig.toml, or a simulated rig, such as sim:vgroove-textured"};
}

Result<OpenedRig> open_exec_rig(const std::string& rig) {
  ExecOptions options;
  options.keep_waiting = [] { return !interrupted(); };
  SYMRIG_TRY(auto probe, ExecProbe::open(rig.substr(kExec.size()), std::move(options)));
  return OpenedRig{std::move(probe), nullptr, "camera"};
}

Result<RigDescription> read_checked(const std::string& rig) {
  SYMRIG_CHECK(check_file(rig));
  return read_rig_file(rig);
}

Result<OpenedRig> open_described(RigDescription file) {
  file.options.keep_waiting = [] { return !interrupted(); };
  SYMRIG_TRY(auto real, open_rig_file(std::move(file)));
  const Rig* inside = real.get();
  return OpenedRig{std::move(real), inside, "camera"};
}

/// Registers a rig that has moved.
Result<Registration> register_now(Probe& rig) {
  RegistrationOptions options;
  options.progress = [](const ProgressEvent&) { return !interrupted(); };
  return register_camera(rig, options);
}

bool is_exec(const std::string& rig) {
  return rig.starts_with(kExec);
}

}  // namespace

bool is_simulated(const std::string& rig) {
  return rig.starts_with("sim:");
}

bool is_rig_file(const std::string& rig) {
  return !is_simulated(rig) && !is_exec(rig);
}

JobFiles rig_files(const std::string& rig) {
  return is_rig_file(rig) ? JobFiles().reads_settings("the rig file or a file of it", rig) : JobFiles();
}

Result<std::unique_ptr<VirtualRig>> open_simulated_rig(const std::string& rig) {
  if (!is_simulated(rig)) return not_simulated(rig);
  return open_virtual_rig(rig);
}

Result<OpenedRig> open_bare_rig(const std::string& rig, std::optional<int> exposures) {
  const auto set = [exposures](RigOptions& options) {
    options.exposures = exposures.value_or(options.exposures);
  };
  if (is_simulated(rig)) {
    VirtualRigHooks hooks;
    hooks.options = set;
    SYMRIG_TRY(auto simulated, open_virtual_rig(rig, std::move(hooks)));
    const Rig* inside = &simulated->rig();
    const std::string noise = simulated->uri().camera_noise ? "camera" : "off";
    return OpenedRig{std::move(simulated), inside, noise};
  }
  if (is_exec(rig)) return open_exec_rig(rig);
  SYMRIG_TRY(RigDescription file, read_checked(rig));
  set(file.options);
  return open_described(std::move(file));
}

Result<OpenedRig> open_rig(const std::string& rig, const std::string& registration) {
  std::optional<RigDescription> described;
  if (is_rig_file(rig)) {
    SYMRIG_TRY(described, read_checked(rig));
  }
  const std::string file = registration.empty() && described ? described->registration : registration;
  const bool again = described && described->registers_again;
  const auto open = [&] { return described ? open_described(*std::move(described)) : open_bare_rig(rig); };
  if (file.empty()) return open();
  // The file first: it takes no time, and the devices may.
  SYMRIG_TRY(const Registration found, load_registration(file));
  SYMRIG_TRY(OpenedRig opened, open());
  SYMRIG_TRY(auto registered, RegisteredProbe::make(std::move(opened.probe), found));
  registered->watch_motion(found.watch());
  if (again) registered->register_again(register_now);
  opened.registered = registered.get();
  opened.coaxial = require_coaxial(found.shape().parallax);
  opened.probe = std::move(registered);
  return opened;
}

void add_registration(CLI::App& command, std::string& registration) {
  command
      .add_option(
          "--registration", registration,
          "If the camera has pixels of its own: the file of `symrig calibrate --rig` (default: the one "
          "that the rig file names)")
      ->type_name("registration.h5");
}

RigTrouble OpenedRig::trouble() const {
  RigTrouble found = rig == nullptr ? RigTrouble() : rig->trouble();
  if (registered != nullptr) found.registered_again = registered->registered_again();
  return found;
}

std::string trouble_text(const RigTrouble& trouble) {
  std::string text;
  if (trouble.retaken > 0)
    text += fmt::format("{} photographs were retaken; frames: {}\n", trouble.retaken,
                        trouble.frames.trouble().empty() ? "all correct" : trouble.frames.trouble());
  const auto reopened = [&text](const char* device, std::int64_t times) {
    if (times > 0) text += fmt::format("the {} was lost and reconnected {} times\n", device, times);
  };
  reopened("board", trouble.boards_reopened);
  reopened("camera", trouble.cameras_reopened);
  reopened("projector", trouble.projectors_reopened);
  if (trouble.registered_again > 0)
    text += fmt::format("the rig moved and was registered again {} times\n", trouble.registered_again);
  if (!trouble.exposures.empty())
    text += fmt::format(
        "warning: exposure times and pixel values do not match: {}; check exposure_offset, the strobe "
        "line and the camera's linearity\n",
        trouble.exposures);
  return text;
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

std::string known_scenes() {
  return listed(scene_names());
}

std::string rig_help() {
  return "RIG is a rig file (docs/rig-file.md), or one of these (quote them in a shell):\n"
         "  sim:NAME or sim:NAME?key=value&key=value: a simulated rig, which runs the real firmware on a "
         "board\n"
         "    in virtual time\n"
         "  exec:COMMAND: a program of yours, which gets patterns and answers photographs "
         "(docs/howto-own-rig.md)\n"
         "Scenes:\n" +
         scene_help() + "Keys of a simulated rig, with their defaults:\n" + scene_key_help();
}

}  // namespace symrig::apps
