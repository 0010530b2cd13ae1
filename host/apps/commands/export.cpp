// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "meter.hpp"
#include "output.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/job/dense_file.hpp"
#include "symrig/tensor/file.hpp"

#include <memory>
#include <string>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

constexpr std::int64_t kMostDenseBytes = std::int64_t{2} << 30;

struct ExportArguments {
  std::string scene, dense;
};

Result<void> run(const ExportArguments& arguments) {
  SYMRIG_CHECK(JobFiles()
                   .reads("the scene", arguments.scene)
                   .writes("--dense", arguments.dense, FileFormat::matrix)
                   .check());
  SYMRIG_TRY(const StoredScene scene, load_scene(arguments.scene, {.camera = false}));
  {
    Meter meter("export", "columns");
    SYMRIG_CHECK(save_dense(arguments.dense, scene.tensor, kMostDenseBytes, meter.progress()));
  }
  return print(fmt::format("{}: T, {} camera pixels x {} projector pixels, {}\n", arguments.dense,
                           grouped(static_cast<double>(scene.tensor.camera_grid().size())),
                           grouped(static_cast<double>(scene.tensor.projector_grid().size())),
                           byte_size(scene.tensor.dense_bytes())));
}

}  // namespace

Job add_export(CLI::App& command) {
  const auto arguments = std::make_shared<ExportArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  command
      .add_option("--dense", arguments->dense,
                  "File for T as a matrix: .npy (NumPy) or .mat (MATLAB, Octave)")
      ->required()
      ->type_name("T.npy|T.mat");
  command.footer(
      std::string("Example:\n"
                  "  symrig export scene.h5 --dense T.mat\n"
                  "\n"
                  "For small scenes of one channel: a matrix of 2 GiB at most. Numbers are 32-bit floats.\n"
                  "A rig `dense:T.npy` measures such a matrix again.\n"
                  "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
