// SPDX-License-Identifier: Apache-2.0
#include "rig.hpp"

#include <filesystem>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

Error not_simulated(const std::string& rig) {
  std::error_code ignored;
  const std::string hint = "use a simulated rig, for example sim:vgroove-textured";
  if (std::filesystem::exists(rig, ignored))
    return {ErrorCode::bad_format,
            fmt::format("rig {}: this version cannot open a rig described in a file", rig), hint};
  return {ErrorCode::unknown_name, fmt::format("no rig is called '{}'", rig), hint};
}

}  // namespace

bool is_simulated(const std::string& rig) {
  return rig.starts_with("sim:");
}

Result<std::unique_ptr<sim::VirtualRig>> open_rig(const std::string& rig) {
  if (!is_simulated(rig)) return not_simulated(rig);
  return sim::open_virtual_rig(rig);
}

Result<std::shared_ptr<const sim::Scene>> open_truth(const std::string& rig) {
  if (!is_simulated(rig)) return not_simulated(rig);
  SYMRIG_TRY(const sim::SceneUri uri, sim::parse_scene_uri(rig));
  SYMRIG_TRY(std::unique_ptr<sim::Scene> scene, sim::make_scene(uri));
  return std::shared_ptr<const sim::Scene>(std::move(scene));
}

TrueTransport truth_of(std::shared_ptr<const sim::Scene> scene, Progress progress) {
  return [scene = std::move(scene), progress = std::move(progress),
          done = std::int64_t{0}](const Image<float>& pattern) mutable -> Result<Image<float>> {
    if (progress && !progress({"comparing with the true transport", done++, 0}))
      return Error{ErrorCode::interrupted, "stopped before the comparison was done", "nothing was written"};
    if (pattern.grid() != scene->grid())
      return Error{ErrorCode::size_mismatch,
                   fmt::format("the rig's grid is {}, the scene file's {}", to_string(scene->grid()),
                               to_string(pattern.grid())),
                   "give the rig that the scene was captured from"};
    return scene->apply(pattern);
  };
}

std::string known_scenes() {
  std::string text;
  for (const std::string_view name : sim::scene_names())
    text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

std::string rig_help() {
  return "RIG is sim:NAME or sim:NAME?key=value&key=value (quote it in a shell). It runs the real firmware "
         "on a board in "
         "virtual time.\n"
         "  scenes: " +
         known_scenes() +
         "\n"
         "  size=128x128    rows x columns of the grid        channels=1     1 or 3\n"
         "  noise=camera    or off                            seed=1         textures and noise\n"
         "  black=0.0005    projector black level             psf=0          blur [A, 1-2A, A], both sides\n"
         "  misalign=0      camera shift in pixels            flare=0        share of light in a camera "
         "flare\n"
         "  dead=0          share of dead camera pixels       indirect=1     factor on all light but the "
         "direct\n"
         "  exposures=4     frames a photograph               ratio=8        between exposures\n"
         "  drift=0         lamp change over 1,000 photographs\n";
}

}  // namespace symrig::apps
