// SPDX-License-Identifier: Apache-2.0
// relight and dual: the tensor applied, and its transpose.
#include "command.hpp"
#include "console.hpp"
#include "files.hpp"
#include "light.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct Arguments {
  std::string scene, light, output;
  std::optional<double> exposure;
};

Result<void> check_exposure(const Arguments& arguments) {
  if (!arguments.exposure) return {};
  if (!is_png(arguments.output))
    return Error{ErrorCode::bad_argument,
                 "--exposure is for .png pictures; .exr and .pfm hold radiance as it is",
                 "leave it out or write a .png"};
  if (std::isfinite(*arguments.exposure) && *arguments.exposure > 0) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("--exposure {} is not a positive number", *arguments.exposure),
               "give the factor that brings white to 1"};
}

/// Brings all but the brightest half percent of the values below white.
double automatic_exposure(const Image<float>& picture) {
  std::vector<float> values(picture.values().begin(), picture.values().end());
  const auto rank = static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  const float white = values[static_cast<std::size_t>(rank)];
  return white > 0 ? 1.0 / static_cast<double>(white) : 1.0;
}

std::string told(const Arguments& arguments, const Image<float>& picture, double exposure) {
  const auto [least, most] = std::minmax_element(picture.values().begin(), picture.values().end());
  std::string text = fmt::format("{}: {}, {} channel{}, radiance {:.4g} to {:.4g}", arguments.output,
                                 to_string(picture.grid()), picture.channels(),
                                 picture.channels() == 1 ? "" : "s", *least, *most);
  if (is_png(arguments.output)) text += fmt::format(", exposure {:.4g}", exposure);
  return text + "\n";
}

Result<void> run(const Arguments& arguments, bool dual) {
  SYMRIG_CHECK(check_picture_output(arguments.output));
  SYMRIG_CHECK(check_exposure(arguments));
  SYMRIG_TRY(const StoredScene scene, load_scene(arguments.scene));
  const TransportTensor& tensor = scene.tensor;
  SYMRIG_TRY(const Image<float> light,
             dual ? read_light(arguments.light, tensor.camera_grid(), "the scene's camera")
                  : read_light(arguments.light, tensor.projector_grid(), "the scene's projector"));
  SYMRIG_TRY(const Image<float> picture, dual ? tensor.apply_transposed(light) : tensor.apply(light));
  const double exposure = arguments.exposure.value_or(automatic_exposure(picture));
  SYMRIG_CHECK(write_picture(arguments.output, picture, exposure));
  return print(told(arguments, picture, exposure));
}

Job add(CLI::App& app, bool dual, const char* name, const char* about, const char* footer) {
  CLI::App* command = app.add_subcommand(name, about);
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  command->add_option("--light", arguments->light, "Picture of the light, or a built-in one, see below")
      ->required()
      ->type_name("IMAGE");
  command
      ->add_option("-o,--output", arguments->output,
                   "Picture to write: .exr, .pfm (radiance) or .png (to look at)")
      ->required()
      ->type_name("out.exr");
  command
      ->add_option("--exposure", arguments->exposure,
                   "For .png: factor that brings white to 1 (default: 99.5 % of the values end below white)")
      ->type_name("X");
  command->footer(std::string(footer) + "\n" + light_help() + "\n" + kExitCodes);
  return [arguments, dual] { return run(*arguments, dual); };
}

}  // namespace

Job add_relight(CLI::App& app) {
  return add(app, false, "relight", "The photograph of the scene under any light: T times the light",
             "Example:\n"
             "  symrig relight scene.h5 --light letters -o relit.png\n"
             "  symrig relight scene.h5 --light my-light.exr -o relit.exr\n"
             "\n"
             "The light has the projector's grid. The result has the camera's, in radiance per unit of "
             "projector light.\n");
}

Job add_dual(CLI::App& app) {
  return add(
      app, true, "dual", "The projector's view: the transpose of T times light shone from the camera",
      "Example:\n"
      "  symrig dual scene.h5 --light white -o projector-view.png\n"
      "\n"
      "By Helmholtz reciprocity light may be sent backwards: --light is shone from the camera's pixels (the "
      "camera's\n"
      "grid), and the result is what the projector would see (the projector's grid) [Sen et al. 2005].\n");
}

}  // namespace symrig::apps
