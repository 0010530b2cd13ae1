// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/viewer/page.hpp"
#include "symrig/viewer/server.hpp"

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

constexpr double kMegabyte = 1e6;

struct ViewArguments {
  std::string scene, page, memory;
  std::optional<int> port;
  std::optional<double> max_megabytes;
  bool cells = false;
};

std::string title_of(const ViewArguments& arguments) {
  return std::filesystem::path(arguments.scene).filename().string();
}

Result<void> export_scene(const ViewArguments& arguments, const StoredScene& scene) {
  ExportOptions options{.title = title_of(arguments)};
  if (arguments.max_megabytes)
    options.max_bytes = static_cast<std::int64_t>(*arguments.max_megabytes * kMegabyte);
  SYMRIG_TRY(const ExportedPage page, export_page(scene, options));
  SYMRIG_CHECK(write_text(arguments.page, page.html));
  if (is_standard_output(arguments.page)) return {};
  const std::string smaller =
      page.reduced
          ? fmt::format(
                "\nThe whole scene ({}) takes more than {:.3g} MB, so the page has a lower "
                "resolution; a larger --max-mb allows more.",
                to_string(scene.tensor.camera_grid()), static_cast<double>(options.max_bytes) / kMegabyte)
          : "";
  return print(fmt::format("{}: {}{}, {}, open it in a browser{}\n", arguments.page, to_string(page.camera),
                           scene.camera_left_out ? " on the projector's cells" : "",
                           byte_size(static_cast<double>(page.html.size())), smaller));
}

Result<void> serve(const ViewArguments& arguments, StoredScene scene) {
  ViewOptions options{.title = title_of(arguments),
                      .port = static_cast<std::uint16_t>(arguments.port.value_or(0)),
                      .truth = true_transport_of(scene)};
  SYMRIG_TRY(ViewServer server, ViewServer::open(std::move(scene), std::move(options)));
  SYMRIG_CHECK(print(
      fmt::format("{}\nOpen this address in a browser of this machine. Ctrl-C ends.\n", server.address())));
  server.run([] { return !interrupted(); });
  return {};
}

Result<void> check_values(const CLI::App& command, const ViewArguments& arguments) {
  const std::array<Idle, 3> options{
      {{"--cells", !arguments.page.empty(), "with --export, whose page is on the cells"},
       {"--port", !arguments.page.empty(), "with --export, which serves nothing"},
       {"--max-mb", arguments.page.empty(), "without --export"}}};
  SYMRIG_CHECK(check_effects(command, options));
  if (arguments.port) SYMRIG_CHECK(check_port(*arguments.port));
  if (arguments.max_megabytes && !(*arguments.max_megabytes > 0 && *arguments.max_megabytes <= 400))
    return Error{ErrorCode::bad_argument,
                 fmt::format("--max-mb {} is not above 0 and at most 400", *arguments.max_megabytes),
                 "browsers open pages of 50 to 100 MB well"};
  return {};
}

Result<void> run(const CLI::App& command, const ViewArguments& arguments) {
  SYMRIG_CHECK(check_values(command, arguments));
  SYMRIG_CHECK(JobFiles()
                   .reads("the scene", arguments.scene)
                   .writes("--export", arguments.page, FileFormat::page)
                   .check());
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  const bool camera = arguments.page.empty() && !arguments.cells;
  SYMRIG_TRY(StoredScene scene, load_scene(arguments.scene, {.memory = memory, .camera = camera}));
  if (scene.tensor.channels() != 1 && scene.tensor.channels() != 3)
    return Error{
        ErrorCode::bad_value,
        fmt::format("{} has {} channels; the page shows 1 or 3", arguments.scene, scene.tensor.channels()),
        "use symrig relight"};
  return arguments.page.empty() ? serve(arguments, std::move(scene)) : export_scene(arguments, scene);
}

}  // namespace

Job add_view(CLI::App& command) {
  const auto arguments = std::make_shared<ViewArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  add_memory(command, arguments->memory);
  command
      .add_option("--export", arguments->page,
                  "Serve nothing: write one HTML file that contains the scene, on the projector's cells, and "
                  "opens without symrig")
      ->type_name("scene.html");
  command
      .add_option("--max-mb", arguments->max_megabytes,
                  "Largest exported file in MB; a larger scene gets a lower resolution (default: 50)")
      ->type_name("MB");
  command.add_flag("--cells", arguments->cells,
                   "Pictures on the projector's cells, also where the scene has the camera's own pixels");
  add_port(command, arguments->port);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig view scene.h5\n"
          "  symrig view scene.h5 --export scene.html\n"
          "\n"
          "Shows a page in a browser: drag lights and see the scene under them. The page is served on "
          "127.0.0.1 only, and\n"
          "its address contains a secret. For a scene on another machine: ssh -L "
          "8080:127.0.0.1:PORT that-machine.\n"
          "The page loads nothing from any network. Its pictures have the camera's own pixels if the scene "
          "has them, and the\n"
          "projector's cells with --cells or --export.\n"
          "\n") +
      kExitCodes);
  takes_number<double>(command.get_option("--max-mb"));
  return [&command, arguments] { return run(command, *arguments); };
}

}  // namespace symrig::apps
