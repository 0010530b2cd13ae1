// SPDX-License-Identifier: Apache-2.0

#include "rig.hpp"

#include "meter.hpp"
#include "symrig/base/text.hpp"
#include "symrig/job/rig_by_name.hpp"

#include <limits>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {

namespace {

bool not_interrupted() {
  return !interrupted();
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

}  // namespace

Result<OpenedRig> open_bare_rig(const std::string& rig, std::optional<int> exposures) {
  return symrig::open_bare_rig(rig, exposures, not_interrupted);
}

Result<OpenedRig> open_rig_to_calibrate(const std::string& rig) {
  return symrig::open_rig_to_calibrate(rig, not_interrupted);
}

Result<OpenedRig> open_rig(const std::string& rig, const std::string& registration, double max_seconds) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return symrig::open_rig(rig, registration, not_interrupted, max_seconds > 0 ? max_seconds : kNoLimit);
}

void add_registration(CLI::App& command, std::string& registration) {
  command
      .add_option(
          "--registration", registration,
          "If the camera has pixels of its own: the file of `symrig calibrate --rig` (default: the one "
          "that the rig file names)")
      ->type_name("registration.h5");
}

std::string trouble_text(const RigTrouble& trouble) {
  std::string text;
  for (const std::string& line : trouble_lines(trouble)) text += line + "\n";
  return text;
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
         "  dense:FILE or dense:FILE?grid=ROWSxCOLS&views=ROWSxCOLS: a matrix T of yours in a .npy, .mat or "
         "HDF5 file;\n"
         "    with a key of a simulated rig, such as &noise=camera, the matrix is the scene of that rig\n"
         "Scenes:\n" +
         scene_help() + "Keys of a simulated rig, with their defaults:\n" + scene_key_help();
}

Result<OpenedScene> open_here(const std::string& path, const LoadOptions& options) {
  SYMRIG_TRY(StoredScene scene, load_scene(path, options));
  auto transport = std::make_shared<const TransportTensor>(scene.tensor);
  return OpenedScene{std::move(scene), std::move(transport)};
}

}  // namespace symrig::apps
