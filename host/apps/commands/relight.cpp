// SPDX-License-Identifier: Apache-2.0
// relight applies the tensor; dual applies its transpose.
#include "symrig/job/relight.hpp"

#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "rig.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/image/file.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct RelightArguments {
  std::string scene, light, lights, output, memory;
  std::string views, from_view, to_view, mosaic;  // "" if not given
  std::string format = "exr";                     // of many pictures
  std::optional<double> exposure;
  bool resume = false, cells = false;
};

Result<std::optional<View>> view_of(const char* option, const std::string& text) {
  if (text.empty()) return std::optional<View>();
  if (const auto numbers = two_numbers(text, ','))
    return std::optional(View{numbers->first, numbers->second});
  return Error{ErrorCode::bad_argument, fmt::format("{} '{}' is not ROW,COLUMN", option, text),
               "give for example 0,0, the top left view"};
}

/// The views of --views, else those of the scene file.
Result<ViewLayout> layout_of(const std::string& text, const TransportTensor& tensor) {
  if (text.empty()) return tensor.camera_tree().views();
  if (const auto numbers = two_numbers(text, 'x')) return ViewLayout{numbers->first, numbers->second};
  return Error{ErrorCode::bad_argument, fmt::format("--views '{}' is not ROWSxCOLUMNS", text),
               "give for example 3x2: three rows of two views"};
}

Result<ViewRelight> asked(const RelightArguments& arguments, const TransportTensor& tensor) {
  SYMRIG_TRY(const ViewLayout views, layout_of(arguments.views, tensor));
  SYMRIG_TRY(const std::optional<View> from, view_of("--from-view", arguments.from_view));
  SYMRIG_TRY(const std::optional<View> to, view_of("--to-view", arguments.to_view));
  if ((from || to) && views.single())
    return Error{ErrorCode::bad_argument, "the scene file has only one view",
                 "give --views ROWSxCOLUMNS: the views that tile its pictures, such as 3x3"};
  return ViewRelight{views, from, to};
}

/// Single views, and colours of a mosaic, are known on the cells.
bool asks_for_cells(const RelightArguments& arguments) {
  return arguments.cells || !arguments.from_view.empty() || !arguments.to_view.empty() ||
         !arguments.mosaic.empty();
}

/// The tensor as the options ask for it.
Result<Relighter> relighter_of(const RelightArguments& arguments, const OpenedScene& opened) {
  const bool of_cells = asks_for_cells(arguments);
  if (opened.scene.camera && !of_cells) return Relighter::begin(opened.scene.camera);
  if (opened.scene.camera_left_out && !of_cells)
    print_error("relight",
                "warning: pictures have the projector's cells; `symrig relight`, in one process, "
                "gives the camera's pixels");
  RelightOptions options;
  SYMRIG_TRY(options.views, asked(arguments, opened.scene.tensor));
  if (!arguments.mosaic.empty()) {
    SYMRIG_TRY(options.mosaic, parse_bayer(arguments.mosaic));
  }
  Result<Relighter> relighter = Relighter::begin(opened.transport, options);
  if (!relighter) return hint_in_command_words(relighter.error());
  return relighter;
}

/// What has the size of a light, for messages.
const char* projector_of(const RelightArguments& arguments) {
  return arguments.from_view.empty() ? "the scene's projector" : "that view";
}

Result<Image<float>> light_of(const char* command, const RelightArguments& arguments, Grid grid,
                              const std::string& of) {
  std::string warning;
  SYMRIG_TRY(Image<float> light, read_light(arguments.light, grid, of, &warning));
  if (!warning.empty()) print_error(command, "warning: " + warning);
  return light;
}

Result<Image<float>> relit(const RelightArguments& arguments, const OpenedScene& opened) {
  SYMRIG_TRY(const Relighter relighter, relighter_of(arguments, opened));
  SYMRIG_TRY(const Image<float> light,
             light_of("relight", arguments, relighter.light_grid(), projector_of(arguments)));
  return relighter.relight(light);
}

Result<Image<float>> dual_picture(const RelightArguments& arguments, const TransportTensor& tensor) {
  SYMRIG_TRY(const Image<float> light,
             light_of("dual", arguments, tensor.camera_grid(), "the scene's camera"));
  return tensor.apply_transposed(light);
}

/// shown: the output is for viewing.
Result<void> check_exposure(const RelightArguments& arguments, bool shown) {
  if (!arguments.exposure) return {};
  if (!shown)
    return Error{ErrorCode::bad_argument,
                 fmt::format("--exposure applies to {} only; .exr and .pfm store radiance unchanged",
                             arguments.lights.empty() ? ".png" : "png pictures and films"),
                 "remove it, or write a .png"};
  if (std::isfinite(*arguments.exposure) && *arguments.exposure > 0) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("--exposure {} is not a positive number", *arguments.exposure),
               "give the factor that maps white to 1"};
}

/// What an EXR header states.
/// exposure: none for many pictures.
Result<PictureFacts> facts_of(const RelightArguments& arguments, bool dual, std::optional<double> exposure) {
  SYMRIG_TRY(std::string scene, file_hash(arguments.scene));
  std::string view = dual ? "projector" : "camera";
  if (!arguments.from_view.empty()) view += ", lit from view " + arguments.from_view;
  if (!arguments.to_view.empty()) view += ", seen from view " + arguments.to_view;
  return PictureFacts{
      .units = dual ? "radiance per unit of light from the camera" : "radiance per unit of projector light",
      .exposure = exposure,
      .view = std::move(view),
      .light = std::filesystem::path(arguments.light).filename().string(),
      .scene = std::move(scene)};
}

std::string result_text(const RelightArguments& arguments, const Image<float>& picture, double exposure) {
  const auto [least, most] = std::minmax_element(picture.values().begin(), picture.values().end());
  std::string text = fmt::format("{}: {}, {} channel{}, radiance {:.4g} to {:.4g}", arguments.output,
                                 to_string(picture.grid()), picture.channels(),
                                 picture.channels() == 1 ? "" : "s", *least, *most);
  if (is_png(arguments.output)) text += fmt::format(", exposure {:.4g}", exposure);
  return text + "\n";
}

/// Refuses --views if no single view is relit or written.
Result<void> check_views(const CLI::App& command, const RelightArguments& arguments) {
  const bool one = !arguments.from_view.empty() || !arguments.to_view.empty();
  const std::array<Idle, 1> options{{{"--views", !one, "without --from-view or --to-view"}}};
  return check_effects(command, options);
}

/// Refuses options that do nothing for one light, or nothing for many.
Result<void> check_lights(const CLI::App& command, const RelightArguments& arguments) {
  if (arguments.light.empty() == arguments.lights.empty())
    return Error{ErrorCode::bad_argument,
                 arguments.light.empty() ? "there is no light" : "--light and --lights are both given",
                 "give --light IMAGE, or --lights with a folder of lights or a film"};
  const bool one = arguments.lights.empty(), film = is_film(arguments.output);
  const std::array<Idle, 4> options{{{"--format", one, "with --light: the suffix of -o chooses the format"},
                                     {"--format", film, "with a film"},
                                     {"--resume", one, "with --light: one picture is written as a whole"},
                                     {"--resume", film, "with a film: it is written as a whole"}}};
  return check_effects(command, options);
}

/// What the pictures of many lights depend on beside scene and lights.
std::string request_text(const RelightArguments& arguments, const OpenedScene& opened) {
  std::string text = "format " + arguments.format;
  if (opened.scene.camera && !asks_for_cells(arguments)) text += ", the camera's own pixels";
  const auto add = [&text](const char* option, const std::string& value) {
    if (!value.empty()) text += fmt::format(", {} {}", option, value);
  };
  add("--views", arguments.views);
  add("--from-view", arguments.from_view);
  add("--to-view", arguments.to_view);
  add("--mosaic", arguments.mosaic);
  return text;
}

Result<void> run_sequence(const RelightArguments& arguments, const OpenScene& open) {
  const bool film = is_film(arguments.output);
  SYMRIG_CHECK(check_exposure(arguments, film || arguments.format == "png"));
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  SYMRIG_TRY(const OpenedScene opened,
             open(arguments.scene, {.memory = memory, .camera = !asks_for_cells(arguments)}));
  SYMRIG_TRY(const Relighter relighter, relighter_of(arguments, opened));
  SYMRIG_TRY(const LightSequence lights,
             LightSequence::open(arguments.lights, relighter.light_grid(), projector_of(arguments)));
  SequenceOutput output{.path = arguments.output,
                        .suffix = "." + arguments.format,
                        .exposure = arguments.exposure,
                        .resume = arguments.resume,
                        .asked = request_text(arguments, opened)};
  // A film states nothing. To hash a large scene takes as long as to apply it.
  if (!film) {
    SYMRIG_TRY(output.facts, facts_of(arguments, false, {}));
  }
  std::optional<Meter> meter(std::in_place, "relight", "pictures");
  const Result<SequenceResult> result = relight_sequence(relighter, lights, output, meter->progress());
  meter.reset();
  if (!result) return hint_in_command_words(result.error());
  std::string text = fmt::format("{}: {} pictures, {}, {} channel{}", arguments.output, result->pictures,
                                 to_string(result->grid), result->channels, result->channels == 1 ? "" : "s");
  if (result->kept > 0) text += fmt::format(", {} of them from before", result->kept);
  if (film || arguments.format == "png") text += fmt::format(", exposure {:.4g}", result->exposure);
  return print(text + "\n");
}

Result<void> check_files(const RelightArguments& arguments) {
  JobFiles files;
  files.reads("the scene", arguments.scene);
  if (arguments.lights.empty()) {
    SYMRIG_CHECK(check_picture_suffix(arguments.output));
    files.reads("--light", arguments.light).writes("-o", arguments.output, FileFormat::picture);
  } else {
    files.reads("--lights", arguments.lights)
        .writes("-o", arguments.output, is_film(arguments.output) ? FileFormat::film : FileFormat::folder);
  }
  return files.check();
}

Result<void> run(const CLI::App& command, const RelightArguments& arguments, bool dual,
                 const OpenScene& open) {
  if (!dual) {
    SYMRIG_CHECK(check_lights(command, arguments));
    SYMRIG_CHECK(check_views(command, arguments));
  }
  SYMRIG_CHECK(check_files(arguments));
  if (!arguments.lights.empty()) return run_sequence(arguments, open);
  SYMRIG_CHECK(check_exposure(arguments, is_png(arguments.output)));
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  SYMRIG_TRY(const OpenedScene opened,
             open(arguments.scene, {.memory = memory, .camera = !dual && !asks_for_cells(arguments)}));
  SYMRIG_TRY(Image<float> picture,
             dual ? dual_picture(arguments, opened.scene.tensor) : relit(arguments, opened));
  const double exposure = arguments.exposure.value_or(automatic_exposure(picture));
  PictureFacts facts;  // other formats state none, and the hash reads the whole scene
  if (is_exr(arguments.output)) {
    SYMRIG_TRY(facts, facts_of(arguments, dual, exposure));
  }
  SYMRIG_CHECK(write_picture(arguments.output, picture, exposure, facts));
  return print(result_text(arguments, picture, exposure));
}

/// Help text: lights.
std::string light_help() {
  std::string text =
      "IMAGE is an EXR, PNG or PFM file of that grid. Its values are linear light (PNG: code / "
      "largest code);\n"
      "any finite value is allowed. Colour becomes luminance, because projectors show white light.\n"
      "Or IMAGE is a built-in light:\n";
  for (const BuiltInLight& one : built_in_lights())
    text += fmt::format("  {:<9}  {}\n", one.name, one.meaning);
  return text;
}

void add_views(CLI::App& command, RelightArguments& arguments) {
  command
      .add_option("--from-view", arguments.from_view,
                  "Light the scene from this view only, with a light of its size (the top left view is 0,0)")
      ->type_name("ROW,COLUMN");
  command.add_option("--to-view", arguments.to_view, "Write the picture of this view only")
      ->type_name("ROW,COLUMN");
  command
      .add_option("--views", arguments.views,
                  "Rows and columns of views that tile the pictures (default: from the scene file)")
      ->type_name("ROWSxCOLUMNS");
}

void add_lights(CLI::App& command, RelightArguments& arguments) {
  command
      .add_option("--lights", arguments.lights,
                  "Many lights: a folder of pictures in the order of their names, or a .y4m film")
      ->type_name("DIR|film.y4m");
  takes_words(command
                  .add_option("--format", arguments.format,
                              "With --lights: format of the pictures in the folder (default: exr)")
                  ->type_name("exr|pfm|png"),
              {"exr", "pfm", "png"});
  command.add_flag("--resume", arguments.resume,
                   "With --lights: keep the pictures that an earlier call has written, and make the others");
}

Job add(CLI::App& command, bool dual, const char* footer, OpenScene open) {
  const auto arguments = std::make_shared<RelightArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  add_memory(command, arguments->memory);
  CLI::Option* const light =
      command
          .add_option("--light", arguments->light, "Picture of the light, or a built-in light (see below)")
          ->type_name("IMAGE");
  if (dual) light->required();
  if (!dual) add_lights(command, *arguments);
  command
      .add_option("-o,--output", arguments->output,
                  dual ? "Picture to write: .exr or .pfm (radiance), or .png (for viewing)"
                       : "Picture to write: .exr or .pfm (radiance), or .png (for viewing); with --lights a "
                         "folder, or a .y4m film")
      ->required()
      ->type_name("out.exr");
  command
      .add_option(
          "--exposure", arguments->exposure,
          dual ? "For .png: factor that maps white to 1 (default: 99.5 % of the values are below white)"
               : "For .png and films: factor that maps white to 1 (default: 99.5 % of the values are below "
                 "white; "
                 "with --lights, those of the flood-lit scene)")
      ->type_name("X");
  if (!dual) {
    command.add_flag("--cells", arguments->cells,
                     "Pictures on the projector's cells, also where the scene has the camera's own pixels");
    add_views(command, *arguments);
    takes_words(
        command
            .add_option("--mosaic", arguments->mosaic,
                        "The scene was measured as a raw mosaic with these colours: write a colour picture")
            ->type_name("RGGB|GRBG|GBRG|BGGR"),
        {"RGGB", "GRBG", "GBRG", "BGGR"});
  }
  command.footer(std::string(footer) + "\n" + light_help() + "\n" + kExitCodes);
  takes_number<double>(command.get_option("--exposure"));
  return [&command, arguments, dual, open = std::move(open)] { return run(command, *arguments, dual, open); };
}

}  // namespace

Job add_relight(CLI::App& command) {
  return add_relight_of(command, open_here);
}

Job add_relight_of(CLI::App& command, OpenScene open) {
  return add(
      command, false,
      "Example:\n"
      "  symrig relight scene.h5 --light letters -o relit.png\n"
      "  symrig relight scene.h5 --light my-light.exr -o relit.exr\n"
      "  symrig relight scene.h5 --lights walk.y4m -o pictures.y4m\n"
      "  symrig relight scene.h5 --light letters --views 3x3 --from-view 1,1 --to-view 0,2 -o "
      "view.png\n"
      "\n"
      "The light has the projector's grid. The result has the camera's grid, in radiance per unit of "
      "projector light.\n"
      "A scene of a camera with more pixels than the projector has both: the camera's own pixels, and with\n"
      "--cells, --from-view, --to-view or --mosaic the projector's grid.\n"
      "Of a film, luma is the light: white of its range is 1. --lights is the fast way for many lights.\n",
      std::move(open));
}

Job add_dual(CLI::App& command) {
  return add(command, true,
             "Example:\n"
             "  symrig dual scene.h5 --light white -o projector-view.png\n"
             "\n"
             "Helmholtz reciprocity allows light to be sent backwards. --light shines from the camera's "
             "pixels (the camera's\n"
             "grid). The result is what the projector would see (the projector's grid) [Sen et al. 2005].\n",
             open_here);
}

}  // namespace symrig::apps
