// SPDX-License-Identifier: Apache-2.0

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig {

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  char text[sizeof "2026-01-31T23:59:58Z"] = "";
  if (gmtime_r(&now, &parts) == nullptr) return {};
  return std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts) > 0 ? text : "";
}

namespace {

bool simulated(const std::string& rig) {
  return rig.starts_with("sim:");
}

/// True if both scenes answer a random pattern equally, except for rounding.
bool same_light(const SceneUri& a, const SceneUri& b) {
  if (a.size != b.size || a.channels != b.channels) return false;
  const auto one = make_scene(a);
  const auto two = make_scene(b);
  if (!one || !two) return true;  // not known
  constexpr unsigned kSeed = 3;
  constexpr double kRounding = 1e-5;
  const Image<float> pattern = random_pattern(a.size, kSeed);
  const Image<float> p = (*one)->apply(pattern);
  const Image<float> q = (*two)->apply(pattern);
  double difference = 0, light = 0;
  for (std::size_t i = 0; i < p.values().size(); ++i) {
    const double d = static_cast<double>(p.values()[i]) - q.values()[i];
    difference += d * d;
    light += static_cast<double>(p.values()[i]) * p.values()[i];
  }
  return difference <= kRounding * kRounding * light;
}

std::vector<std::string> differences(const SceneUri& file, const SceneUri& rig) {
  std::vector<std::string> found;
  const auto compare = [&](const char* what, const auto& was, const auto& is) {
    if (!(was == is)) found.push_back(fmt::format("{} is {}, the file's is {}", what, is, was));
  };
  compare("the scene", file.name, rig.name);
  compare("size", to_string(file.size), to_string(rig.size));
  compare("channels", file.channels, rig.channels);
  compare("seed", file.seed, rig.seed);
  compare("psf", file.psf, rig.psf);
  compare("indirect", file.indirect, rig.indirect);
  return found;
}

}  // namespace

namespace {

/// Both are one matrix, on any rig.
bool same_matrix(const std::string& captured, const std::string& rig) {
  if (!is_dense(captured) || !is_dense(rig)) return false;
  const auto one = parse_dense_uri(captured), other = parse_dense_uri(rig);
  if (!one || !other || one->file != other->file || one->views != other->views) return false;
  return one->grid == other->grid || one->grid.size() == 0 || other->grid.size() == 0;
}

}  // namespace

std::vector<std::string> differences_of_scene(const std::string& captured, const std::string& rig) {
  if (captured.empty() || captured == rig || same_matrix(captured, rig)) return {};
  if (!simulated(captured) || !simulated(rig))
    return {fmt::format("the rig is {}, the file's is {}", rig, captured)};
  const auto file = parse_scene_uri(captured);
  const auto given = parse_scene_uri(rig);
  if (!file || !given) return {fmt::format("the rig is {}, the file's is {}", rig, captured)};
  if (same_light(*file, *given)) return {};
  return differences(*file, *given);
}

std::string other_scene_warning(const std::string& of, const std::vector<std::string>& differences) {
  if (differences.empty()) return "";
  return fmt::format("{} was captured from another scene: {}; the errors include this difference", of,
                     fmt::join(differences, ", "));
}

namespace {

/// A node, identified by the beginnings of its two blocks in tree order.
using Node = std::pair<std::int32_t, std::int32_t>;

/// The beginning of the block that contains `pixel`.
std::int32_t block_begin(const BlockTree& tree, int level, std::int32_t pixel) {
  const auto blocks = tree.level(level);
  const auto after = std::upper_bound(blocks.begin(), blocks.end(), pixel,
                                      [](std::int32_t p, const Block& block) { return p < block.begin; });
  return std::prev(after)->begin;
}

/// A leaf may be stored in either half of a symmetric tensor. This gives both the same order.
Node ordered(std::int32_t row, std::int32_t col) {
  return {std::max(row, col), std::min(row, col)};
}

/// The leaves of each level as nodes.
std::vector<std::vector<Node>> leaf_nodes(const TransportTensor& tensor) {
  std::vector<std::vector<Node>> nodes(tensor.levels());
  for (const Leaf& leaf : tensor.leaves())
    nodes[leaf.level].push_back(ordered(leaf.row_begin, leaf.col_begin));
  for (const ScalarLeaf& scalar : tensor.scalars())
    nodes[tensor.scalar_level(scalar)].push_back(ordered(scalar.row, scalar.col));
  for (int level = 0; level < tensor.levels(); ++level) {
    const auto blocks = tensor.camera_tree().level(level);
    for (const EmptyLeaf& empty : tensor.empties(level))
      nodes[level].push_back(ordered(blocks[empty.row_block].begin, blocks[empty.col_block].begin));
  }
  return nodes;
}

/// The nodes of `level` that contain these deeper ones, each once.
std::vector<Node> parents_of(const std::vector<Node>& deeper, const BlockTree& tree, int level) {
  std::vector<Node> parents;
  parents.reserve(deeper.size());
  for (const auto& [row, col] : deeper)
    parents.push_back(ordered(block_begin(tree, level, row), block_begin(tree, level, col)));
  std::sort(parents.begin(), parents.end());
  parents.erase(std::unique(parents.begin(), parents.end()), parents.end());
  return parents;
}

}  // namespace

std::vector<NodeCounts> node_counts(const TransportTensor& tensor) {
  const std::vector<LeafCounts> leaves = tensor.leaves_per_level();
  std::vector<NodeCounts> counts(leaves.size());
  for (std::size_t l = 0; l < leaves.size(); ++l) counts[l].leaves = leaves[l];
  if (!tensor.symmetric()) return counts;
  const std::vector<std::vector<Node>> nodes = leaf_nodes(tensor);
  std::vector<Node> deeper;  // every node of the level below, leaf or subdivided
  for (std::size_t l = nodes.size(); l-- > 0;) {
    deeper = parents_of(deeper, tensor.camera_tree(), static_cast<int>(l));
    counts[l].subdivided = static_cast<std::int64_t>(deeper.size());
    deeper.insert(deeper.end(), nodes[l].begin(), nodes[l].end());
  }
  return counts;
}

namespace {

struct Lit {
  std::vector<bool> pixel;
  double mean_white = 0;
  std::int64_t pixels = 0;
};

double channel_mean(const Image<float>& image, std::size_t pixel) {
  double sum = 0;
  for (int c = 0; c < image.channels(); ++c) sum += image.plane(c)[pixel];
  return sum / image.channels();
}

/// Camera pixels that the projector lights: flood-lit prediction above a tenth of its mean.
Lit lit_pixels(const Image<float>& flood) {
  const std::size_t n = flood.grid().size();
  double mean = 0;
  for (std::size_t i = 0; i < n; ++i) mean += channel_mean(flood, i) / static_cast<double>(n);
  Lit lit{std::vector<bool>(n, false)};
  for (std::size_t i = 0; i < n; ++i) {
    const double white = channel_mean(flood, i);
    if (!(white > 0.1 * mean)) continue;
    lit.pixel[i] = true;
    lit.mean_white += white;
    ++lit.pixels;
  }
  if (lit.pixels > 0) lit.mean_white /= static_cast<double>(lit.pixels);
  return lit;
}

double rms_over(const Lit& lit, const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (int c = 0; c < a.channels(); ++c)
    for (std::size_t i = 0; i < lit.pixel.size(); ++i)
      if (lit.pixel[i]) sum += std::pow(static_cast<double>(a.plane(c)[i]) - b.plane(c)[i], 2);
  const double samples = static_cast<double>(lit.pixels) * a.channels();
  return samples > 0 ? std::sqrt(sum / samples) : 0;
}

}  // namespace

Result<HeldOutError> held_out_error(const TransportOperator& tensor, const HeldOut& held_out) {
  const bool fits = held_out.photograph.grid() == tensor.camera_grid() &&
                    held_out.photograph.channels() == tensor.channels();
  if (!fits)
    return Error{ErrorCode::size_mismatch,
                 "held-out photograph '" + held_out.name + "' is " + to_string(held_out.photograph.grid()) +
                     ", the tensor's camera " + to_string(tensor.camera_grid()),
                 "fit the scene again"};
  SYMRIG_TRY(const Image<float> predicted, tensor.apply(held_out.pattern));
  SYMRIG_TRY(const Image<float> flood, tensor.apply(Image<float>(tensor.projector_grid(), 1, 1.0F)));
  const Lit lit = lit_pixels(flood);
  return HeldOutError{held_out.name, rms_over(lit, predicted, held_out.photograph), lit.mean_white,
                      lit.pixels};
}

}  // namespace symrig
