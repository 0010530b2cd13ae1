// SPDX-License-Identifier: Apache-2.0
// usage: mpirun -n N benchmark_machines [GIGABYTES [SIDE]]
//        benchmark_machines --costs
//        mpirun -n N benchmark_machines --network
// One number of ranks against another: applies a tensor of random leaves that is dealt over the ranks, 16
// lights at a time and one at a time. Each rank makes its own leaves, so no file is read. --costs: the time
// of a factor by the shape of its leaves, which decides how leaves are dealt. --network: what the exchanges
// of symrig-mpi take between the ranks, by their size.
#include "dealt_transport.hpp"
#include "ranks.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <malloc.h>

namespace symrig::machines_benchmark {
namespace {

/// Pairs of blocks of one level, each a leaf.
struct Leaves {
  Grid grid;
  int level, rank;
  std::size_t pairs;  ///< as many of them
};

std::vector<float> random_factors(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> factors(n);
  for (float& v : factors) v = static_cast<float>(random.uniform());
  return factors;
}

/// Every leaf has the same factors, because only their number costs time. Leaves go through all pairs of
/// blocks in order, and again from the start.
TransportTensor made(const Leaves& leaves, mpi::LeafRange range) {
  const BlockTree tree(leaves.grid);
  const auto blocks = tree.level(leaves.level);
  TensorBuilder builder(tree, 1);
  builder.pack_leaves();  // floats of all leaves would need twice the memory of the tensor
  const auto largest =
      static_cast<std::size_t>(2 * std::max_element(blocks.begin(), blocks.end(), [](auto& a, auto& b) {
                                     return a.size() < b.size();
                                   })->size());
  const std::vector<float> factors = random_factors(largest * static_cast<std::size_t>(leaves.rank), 1);
  std::size_t at = 0;
  while (at < range.end)
    for (std::size_t i = 0; i < blocks.size() && at < range.end; ++i)
      for (std::size_t j = 0; j < i && at < range.end; ++j, ++at) {
        if (at < range.begin) continue;
        const auto size = static_cast<std::size_t>(leaves.rank) *
                          static_cast<std::size_t>(blocks[i].size() + blocks[j].size());
        builder.add_leaf(blocks[i].begin, blocks[i].end, blocks[j].begin, blocks[j].end, leaves.rank,
                         leaves.level, std::span(factors).first(size));
      }
  return std::move(builder).finish();
}

std::vector<Image<float>> lights(Grid grid, std::size_t count) {
  Random random(2);
  std::vector<Image<float>> all(count, Image<float>(grid));
  for (Image<float>& light : all)
    for (float& v : light.values()) v = static_cast<float>(random.uniform());
  return all;
}

/// The fastest of several: other work on the machine only makes it slower.
template <class Work>
double fastest(int rounds, const Work& work) {
  double best = 1e9;
  for (int round = 0; round < rounds; ++round) {
    const Stopwatch watch;
    work();
    best = std::min(best, watch.seconds());
  }
  return best;
}

void print_speed(const mpi::Ranks& ranks, const TransportOperator& transport, double bytes) {
  const std::vector<Image<float>> sixteen = lights(transport.projector_grid(), 16);
  double squares = 0;
  const double batch = fastest(7, [&] {
    const auto seen = transport.apply_batch(sixteen);
    squares = 0;
    for (const float v : seen->back().values()) squares += static_cast<double>(v) * v;
  });
  const double one = fastest(7, [&] { static_cast<void>(transport.apply(sixteen[0])); });
  fmt::print("{} ranks, first rank {:.2f} GB: 16 lights {:.1f} ms, one light {:.1f} ms, norm {:.8g}\n",
             ranks.count(), bytes / 1e9, 1e3 * batch, 1e3 * one, std::sqrt(squares));
}

int run_ranks(int argc, char** argv) {
  const mpi::Ranks ranks = mpi::Ranks::world();
  const double gigabytes = argc > 1 ? std::strtod(argv[1], nullptr) : 2;
  const int side = argc > 2 ? static_cast<int>(std::strtol(argv[2], nullptr, 10)) : 512;
  Leaves leaves{{side, side}, 5, 4, 0};
  const double leaf_bytes = 2.0 * leaves.rank * 2 * side * side / 1024;
  leaves.pairs = static_cast<std::size_t>(gigabytes * 1e9 / leaf_bytes);
  const std::vector<std::int64_t> costs(leaves.pairs, 1);
  const auto range = mpi::deal(costs, 0, ranks.count())[static_cast<std::size_t>(ranks.rank())];
  mpi::Share share{{made(leaves, range), "{}", {}}, 0};
  if (!ranks.first()) return mpi::help(ranks, std::move(share.scene.tensor));
  const auto bytes = static_cast<double>(share.scene.tensor.bytes());
  print_speed(ranks, mpi::DealtTransport(ranks, std::move(share)), bytes);
  mpi::release(ranks, 0);
  return 0;
}

/// Microseconds of one exchange: the fastest of several rounds of many.
template <class Exchange>
double microseconds(std::size_t bytes, const Exchange& exchange) {
  constexpr std::size_t kRoundBytes = std::size_t{64} << 20, kMost = 2000;
  const std::size_t times = std::clamp<std::size_t>(kRoundBytes / bytes, 2, kMost);
  return 1e6 / static_cast<double>(times) * fastest(7, [&] {
           mpi::meet();
           for (std::size_t k = 0; k < times; ++k) exchange(k);
         });
}

/// What the dealt jobs exchange: lights are broadcast, photographs are added up on the first rank, and a
/// polish adds up doubles for all ranks. A rank that only sends could run ahead, so that the next exchange
/// would overlap with this one: broadcasts go out from each rank in turn, and a sum on the first rank is
/// followed by a broadcast of 8 bytes, whose time is taken off.
int run_network() {
  const mpi::Ranks ranks = mpi::Ranks::world();
  double answer = 0, after = 0;
  if (ranks.first()) fmt::print("bytes, us of a broadcast, of a sum on the first rank, of a sum for all\n");
  for (const std::size_t bytes :
       {std::size_t{8}, std::size_t{1} << 10, std::size_t{1} << 14, std::size_t{1} << 17,
        std::size_t{1} << 20, std::size_t{1} << 24, std::size_t{1} << 26}) {
    std::vector<float> floats(bytes / sizeof(float));
    std::vector<double> doubles(bytes / sizeof(double));
    const double broadcast = microseconds(bytes, [&](std::size_t k) {
      ranks.broadcast(std::span(floats), static_cast<int>(k % static_cast<std::size_t>(ranks.count())));
    });
    if (answer == 0) answer = broadcast;
    const double first = microseconds(bytes, [&](std::size_t) {
      ranks.add_up(floats);
      ranks.broadcast_value(after);
    });
    const double all = microseconds(bytes, [&](std::size_t) { ranks.add_up_for_all(doubles); });
    if (ranks.first()) fmt::print("{:9} {:10.1f} {:10.1f} {:10.1f}\n", bytes, broadcast, first - answer, all);
  }
  return 0;
}

int run_costs() {
  const Grid grid{512, 512};
  const std::vector<Image<float>> sixteen = lights(grid, 16);
  fmt::print("pixels of a block, rank, MB, ns a factor value for 16 lights, for one\n");
  for (const auto& [level, rank, mega] : {std::tuple(6, 1, 12.5),
                                          {6, 1, 25.0},
                                          {6, 1, 50.0},
                                          {6, 1, 100.0},
                                          {5, 1, 100.0},
                                          {5, 1, 400.0},
                                          {4, 1, 400.0},
                                          {4, 4, 100.0}}) {
    const double values = 2.0 * rank * 512 * 512 / std::pow(4.0, level);
    const auto pairs = static_cast<std::size_t>(mega * 1e6 / values);
    const TransportTensor tensor = made({grid, level, rank, pairs}, {0, pairs});
    const double count = values * static_cast<double>(pairs);
    const double batch = fastest(5, [&] { static_cast<void>(tensor.apply_batch(sixteen)); });
    const double one = fastest(5, [&] { static_cast<void>(tensor.apply(sixteen[0])); });
    fmt::print("{:6.0f} {:3} {:6.0f} {:8.3f} {:8.3f}\n", 512 * 512 / std::pow(4.0, level), rank,
               2 * count / 1e6, 1e9 * batch / count, 1e9 * one / count);
  }
  return 0;
}

}  // namespace
}  // namespace symrig::machines_benchmark

int main(int argc, char** argv) {
  // As the commands do (host/apps/program.cpp): large memory is kept for the next product.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 2'000'000'000);
  mallopt(M_ARENA_MAX, 1);
  const symrig::mpi::Session session(argc, argv);
  if (argc > 1 && std::string(argv[1]) == "--costs") return symrig::machines_benchmark::run_costs();
  if (argc > 1 && std::string(argv[1]) == "--network") return symrig::machines_benchmark::run_network();
  return symrig::machines_benchmark::run_ranks(argc, argv);
}
