// SPDX-License-Identifier: Apache-2.0
#include "solve.hpp"

#include "commands.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "ranks.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::mpi {
namespace {

struct SolveArguments {
  std::string scene, wanted, output, json;
  SolveOptions options;
};

struct Solved {
  Solution found;
  Grid camera;
  int channels = 1;
  double seconds = 0;
};

/// A grey picture is wanted in every channel; colour becomes luminance on a scene of one channel.
Result<Image<float>> read_wanted(const std::string& path, Grid grid, int channels) {
  SYMRIG_TRY(Image<float> picture, read_image(path));
  if (picture.grid() != grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} is {}, the scene's camera is {} (rows x columns)", path,
                             to_string(picture.grid()), to_string(grid)),
                 fmt::format("scale the picture to {} rows and {} columns", grid.rows, grid.cols)};
  if (picture.channels() == channels) return picture;
  if (channels == 1) return to_gray(picture);
  if (picture.channels() == 1) {
    Image<float> grey(grid, channels);
    for (int channel = 0; channel < channels; ++channel)
      std::copy(picture.values().begin(), picture.values().end(), grey.plane(channel).begin());
    return grey;
  }
  return Error{ErrorCode::size_mismatch,
               fmt::format("{} has {} channels, the scene {}", path, picture.channels(), channels),
               "give a grey picture, or one with the channels of the scene"};
}

Result<Solved> solve_scene(const SolveArguments& arguments) {
  SYMRIG_TRY(const apps::OpenedScene opened, open_dealt(arguments.scene, {}));
  const TransportOperator& transport = *opened.transport;
  SYMRIG_TRY(const Image<float> wanted,
             read_wanted(arguments.wanted, transport.camera_grid(), transport.channels()));
  const Stopwatch watch;
  apps::Meter meter("solve", "applications");
  SYMRIG_TRY(Solution found, solve(transport, wanted, arguments.options, meter.progress()));
  return Solved{std::move(found), transport.camera_grid(), transport.channels(), watch.seconds()};
}

std::string to_json(const SolveArguments& arguments, const Solved& solved) {
  const auto [least, most] =
      std::minmax_element(solved.found.light.values().begin(), solved.found.light.values().end());
  const nlohmann::ordered_json json{{"command", "solve"},
                                    {"scene", arguments.scene},
                                    {"wanted", arguments.wanted},
                                    {"grid", {solved.camera.rows, solved.camera.cols}},
                                    {"channels", solved.channels},
                                    {"ranks", Ranks::world().count()},
                                    {"residual", solved.found.residual},
                                    {"unreachable", solved.found.unreachable},
                                    {"converged", solved.found.converged},
                                    {"applications", solved.found.applications},
                                    {"light", {{"least", *least}, {"most", *most}}},
                                    {"most", arguments.options.most},
                                    {"tolerance", arguments.options.tolerance},
                                    {"seconds", solved.seconds}};
  return apps::json_text(json, 1);
}

std::string result_text(const SolveArguments& arguments, const Solved& solved) {
  const Solution& found = solved.found;
  const auto [least, most] = std::minmax_element(found.light.values().begin(), found.light.values().end());
  std::string text = fmt::format("{}: {}, light {:.4g} to {:.4g}\n", arguments.output,
                                 to_string(found.light.grid()), *least, *most);
  text += fmt::format("residual {:.3g} % of the wanted picture, {} applications of T, {}\n",
                      100 * found.residual, found.applications, apps::duration(solved.seconds));
  if (found.unreachable > 0)
    text += fmt::format("no light of 0 to {:.4g} has a residual below {:.3g} %\n", arguments.options.most,
                        100 * found.unreachable);
  if (!found.converged)
    text += fmt::format(
        "stopped at the limit: a residual down to {:.3g} % may exist; more --applications "
        "tell\n",
        100 * found.unreachable);
  return text;
}

Result<void> run(const SolveArguments& arguments) {
  SYMRIG_CHECK(apps::check_picture_suffix(arguments.output));
  SYMRIG_CHECK(JobFiles()
                   .reads("the scene", arguments.scene)
                   .reads("--wanted", arguments.wanted)
                   .writes("-o", arguments.output, FileFormat::picture)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  SYMRIG_TRY(const Solved solved, solve_scene(arguments));
  PictureFacts facts;  // other formats state none, and the hash reads the whole scene
  if (apps::is_exr(arguments.output)) {
    SYMRIG_TRY(std::string scene, file_hash(arguments.scene));
    facts = {.units = "projector light, 1 is full light", .view = "projector", .scene = std::move(scene)};
  }
  SYMRIG_CHECK(apps::write_picture(arguments.output, solved.found.light, 1, facts));
  SYMRIG_CHECK(apps::write_text(arguments.json, to_json(arguments, solved)));
  return is_standard_output(arguments.json) ? Result<void>() : apps::print(result_text(arguments, solved));
}

}  // namespace

apps::Job add_solve(CLI::App& command) {
  const auto arguments = std::make_shared<SolveArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  command
      .add_option("--wanted", arguments->wanted, "Picture that the scene shall look like: .exr, .png or .pfm")
      ->required()
      ->type_name("IMAGE");
  command.add_option("-o,--output", arguments->output, "Light to write: .exr or .pfm, or .png (for viewing)")
      ->required()
      ->type_name("light.exr");
  command.add_option("--most", arguments->options.most, "Largest light of a pixel (default: 1, full light)")
      ->type_name("X");
  command
      .add_option("--tolerance", arguments->options.tolerance,
                  "Stop this close to the smallest possible residual, as a share of the wanted picture "
                  "(default: 0.001)")
      ->type_name("X");
  command
      .add_option("--applications", arguments->options.applications,
                  "Stop after so many applications of T and its transpose (default: 50)")
      ->type_name("N");
  apps::add_json(command, arguments->json);
  for (const char* option : {"--most", "--tolerance"}) apps::takes_number<double>(command.get_option(option));
  apps::takes_number<int>(command.get_option("--applications"));
  command.footer(
      std::string("Example:\n"
                  "  mpirun symrig-mpi solve scene.h5 --wanted look.exr -o light.exr --json solved.json\n"
                  "  symrig-mpi solve scene.h5 --wanted look.exr -o light.exr\n"
                  "\n"
                  "Inverse light transport: finds the light of 0 to --most under which the scene looks like "
                  "IMAGE.\n"
                  "IMAGE has the camera's grid, in radiance per unit of projector light. Its values are "
                  "linear\n"
                  "(PNG: code / largest code). All its channels count. The light has one channel.\n"
                  "The residual is |T light - wanted| / |wanted|.\n"
                  "\n") +
      apps::kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::mpi
