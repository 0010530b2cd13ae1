// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <memory>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct InspectArguments {
  std::string scene, json, memory;
};

std::string size_lines(const std::string& file, const StoredScene& scene) {
  const TransportTensor& tensor = scene.tensor;
  const double dense = tensor.dense_bytes();
  const auto bytes = static_cast<double>(tensor.bytes());
  return fmt::format(
      "{}: projector {} -> camera {}, {} channel{}, {}\n"
      "captured from {}\n"
      "{} low-rank leaves and {} single entries in {}; T as a full matrix: {} ({:.3g} times as much)\n",
      file, to_string(tensor.projector_grid()), to_string(tensor.camera_grid()), tensor.channels(),
      tensor.channels() == 1 ? "" : "s", tensor.symmetric() ? "symmetric (one half stored)" : "not symmetric",
      captured_scene(scene).empty() ? "(not stated)" : captured_scene(scene),
      grouped(static_cast<double>(tensor.leaves().size())),
      grouped(static_cast<double>(tensor.scalar_count() + std::ssize(tensor.column_rows()))),
      byte_size(bytes), byte_size(dense), bytes > 0 ? dense / bytes : 0.0);
}

std::string level_table(const TransportTensor& tensor) {
  std::string text = fmt::format("{:>5} {:>12} {:>12} {:>12} {:>12} {:>12}\n", "level", "rank1", "lowrank",
                                 "empty", "scalar", "subdivided");
  const std::vector<NodeCounts> levels = node_counts(tensor);
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const LeafCounts& leaves = levels[level].leaves;
    text += fmt::format("{:>5} {:>12} {:>12} {:>12} {:>12} {:>12}\n", level, leaves.rank1, leaves.low_rank,
                        leaves.empty, leaves.scalar, levels[level].subdivided);
  }
  return text;
}

std::string rank_line(const TransportTensor& tensor) {
  std::int32_t highest = 0;
  for (const Leaf& leaf : tensor.leaves()) highest = std::max(highest, leaf.rank);
  return fmt::format("highest rank of a leaf: {}\n", highest);
}

Result<void> run(const InspectArguments& arguments) {
  SYMRIG_CHECK(JobFiles()
                   .reads("the scene", arguments.scene)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  SYMRIG_TRY(const StoredScene scene, load_scene(arguments.scene, {.memory = memory}));
  SYMRIG_CHECK(write_text(arguments.json, inspection_json(scene)));
  if (is_standard_output(arguments.json)) return {};
  std::string text = size_lines(arguments.scene, scene) + level_table(scene.tensor) + rank_line(scene.tensor);
  if (scene.camera)
    text += fmt::format("on the camera's own pixels: {}, {} rows of T with {:.3g} coefficients each, {}\n",
                        to_string(scene.camera->camera_grid()),
                        grouped(static_cast<double>(scene.camera->rows())),
                        static_cast<double>(scene.camera->coefficients()) /
                            static_cast<double>(std::max<std::int64_t>(scene.camera->rows(), 1)),
                        byte_size(static_cast<double>(scene.camera->bytes())));
  if (const std::string missing = missing_pixels(scene); !missing.empty())
    text += fmt::format("not on the camera's own pixels: {}\n", missing);
  for (const HeldOut& one : scene.held_out) text += fmt::format("held-out photograph: {}\n", one.name);
  return print(text);
}

}  // namespace

Job add_inspect(CLI::App& command) {
  const auto arguments = std::make_shared<InspectArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  add_memory(command, arguments->memory);
  add_json(command, arguments->json);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig inspect scene.h5 --json -\n"
          "\n"
          "Level 0 is the whole picture; each level divides a block into four. A symmetric tensor stores "
          "and counts each\n"
          "pair of blocks once. The file format is HDF5, see docs/file-format.md.\n"
          "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
