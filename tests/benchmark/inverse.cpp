// SPDX-License-Identifier: Apache-2.0
// usage: benchmark_inverse SCENE.h5
// Solvers of TAO for inverse transport: applications of T and Tᵀ until the residual is within 1 % and 0.1 %
// of the smallest possible. The first wanted pictures are of the scene under lights from 0 to 1; the last two
// are out of reach.
#include "ranks.hpp"
#include "solve.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/tensor/file.hpp"

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::inverse_benchmark {
namespace {

struct Wanted {
  std::string name;
  Image<float> picture;
};

Result<std::vector<Wanted>> pictures(const TransportTensor& tensor) {
  std::vector<Wanted> all;
  for (const char* light : {"natural", "letters", "white"}) {
    SYMRIG_TRY(const Image<float> shining, read_light(light, tensor.projector_grid(), "the projector"));
    SYMRIG_TRY(Image<float> seen, tensor.apply(shining));
    all.push_back({light, std::move(seen)});
  }
  SYMRIG_TRY(const Image<float> flood, tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.F)));
  double mean = 0;
  for (const float v : flood.values()) mean += v / static_cast<double>(flood.values().size());
  Image<float> flat(flood.grid(), flood.channels(), static_cast<float>(mean / 2));
  all.push_back({"even grey", std::move(flat)});
  Image<float> letters(flood.grid(), flood.channels());
  SYMRIG_TRY(const Image<float> drawn, read_light("letters", flood.grid(), "the camera"));
  for (int channel = 0; channel < flood.channels(); ++channel)
    for (std::size_t i = 0; i < drawn.values().size(); ++i)
      letters.plane(channel)[i] = static_cast<float>(mean / 2) * drawn.values()[i];
  all.push_back({"letters on black", std::move(letters)});
  return all;
}

struct Method {
  const char* name;
  bool scaled;
};

std::string cell(const TransportOperator& transport, const Wanted& wanted, const Method& method,
                 double tolerance) {
  const auto found = mpi::solve(
      transport, wanted.picture,
      {.tolerance = tolerance, .applications = 200, .method = method.name, .scaled = method.scaled});
  if (!found) return found.error().line();
  return fmt::format("{}{} ({:.3f} %, bound {:.3f} %)", found->converged ? "" : "> ", found->applications,
                     100 * found->residual, 100 * found->unreachable);
}

int run(const char* path) {
  const auto scene = load_scene(path);
  const auto wanted = scene ? pictures(scene->tensor) : Result<std::vector<Wanted>>(scene.error());
  if (!wanted) {
    fmt::print(stderr, "{}\n", wanted.error().line());
    return 1;
  }
  for (const Wanted& one : *wanted)
    for (const Method& method : {Method{"bqnls", true}, {"blmvm", true}, {"bncg", true}, {"bqnls", false}})
      fmt::print("{:17} {:6}{:10} 1 %: {:36} 0.1 %: {}\n", one.name, method.name,
                 method.scaled ? "" : " unscaled", cell(scene->tensor, one, method, 0.01),
                 cell(scene->tensor, one, method, 0.001));
  return 0;
}

}  // namespace
}  // namespace symrig::inverse_benchmark

int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape): a benchmark may end so
  const symrig::mpi::Session session(argc, argv);
  if (argc == 2) return symrig::inverse_benchmark::run(argv[1]);
  fmt::print(stderr, "usage: benchmark_inverse SCENE.h5\n");
  return 2;
}
