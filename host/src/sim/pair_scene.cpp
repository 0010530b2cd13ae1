// SPDX-License-Identifier: Apache-2.0
#include "sim/pair_scene.hpp"

#include "sim/rig_profiles.hpp"
#include "sim/view.hpp"

#include <fmt/format.h>

namespace symrig::sim {

Result<PairScene> parse_pair_scene(std::string_view uri, ViewLayout pairs) {
  PairScene scene;
  SYMRIG_TRY(scene.uri, parse_scene_uri(uri));
  scene.layout = {pairs, scene.uri.size};
  const ViewLayout views = views_of(scene.uri);
  const bool dealt = pairs.rows >= 1 && pairs.cols >= 1 && views.rows % pairs.rows == 0 &&
                     views.cols % pairs.cols == 0 && views.fits(scene.uri.size);
  if (!dealt)
    return Error{ErrorCode::bad_argument,
                 fmt::format("the {} views of sim:{} cannot be dealt to {} pairs", to_string(views),
                             scene.uri.name, to_string(pairs)),
                 "give a scene with several views, such as sim:views2 for 1x2 pairs"};
  if (is_bench(scene.uri))
    return Error{ErrorCode::bad_argument, "simulated pairs have cameras that share the projectors' cells",
                 "remove the keys of a bench, such as camera and turn"};
  if (profile_of(scene.uri).planes > 0)
    return Error{ErrorCode::bad_argument,
                 fmt::format("the profile {} shows bit planes, but several pairs need whole pictures",
                             scene.uri.profile),
                 "give another profile, such as screen60"};
  return scene;
}

}  // namespace symrig::sim
