// SPDX-License-Identifier: Apache-2.0
#include "dealt_transport.hpp"

#include "polish.hpp"
#include "requests.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace symrig::mpi {
namespace {

/// So many patterns go to the other ranks at once: T is read once for as many.
constexpr std::size_t kTogether = 16;

// Pictures go one by one. All in one message would need memory of their own and copies, and leave the caches
// (docs/research/machines.md, "What the exchanges cost").

/// On the first rank.
void send(const Ranks& ranks, std::span<const Image<float>> pictures) {
  for (const Image<float>& picture : pictures) ranks.send(picture.values());
}

/// On the others.
void receive(const Ranks& ranks, std::span<Image<float>> pictures) {
  for (Image<float>& picture : pictures) ranks.broadcast(picture.values());
}

/// The sum over the ranks, on the first one.
void add_up(const Ranks& ranks, std::span<Image<float>> pictures) {
  for (Image<float>& picture : pictures) ranks.add_up(picture.values());
}

Result<std::vector<Image<float>>> photographs(const TransportTensor& share,
                                              std::span<const Image<float>> patterns) {
  if (patterns.size() != 1) return share.apply_batch(patterns);
  SYMRIG_TRY(Image<float> photograph, share.apply(patterns[0]));
  std::vector<Image<float>> one;
  one.push_back(std::move(photograph));
  return one;
}

/// Every rank with its own share.
Result<Share> open_share(const Ranks& ranks, std::string& path) {
  ranks.broadcast_text(path);
  Result<Share> mine = read_share(path, ranks.rank(), ranks.count());
  SYMRIG_CHECK(ranks.all(mine ? Result<void>() : Result<void>(mine.error())));
  const std::vector<std::uint64_t> identities = ranks.gather(mine->identity);
  Result<void> same;
  if (std::set(identities.begin(), identities.end()).size() > 1)
    same = Error{ErrorCode::bad_value,
                 fmt::format("{}: the machines have different scenes under this name", path),
                 "give a path on a file system that they share, or copy the file again"};
  SYMRIG_CHECK(ranks.all(same));
  return mine;
}

/// One rank that helps.
class Helper {
 public:
  Helper(const Ranks& ranks, TransportTensor share) : ranks_(ranks), tensor_(std::move(share)) {}

  /// False if it cannot.
  bool does(const Request& request) {
    switch (request.kind) {
      case Request::open:
        return open();
      case Request::photographs:
        return photographs_of(static_cast<std::size_t>(request.number)).ok();
      case Request::adjoint:
        return adjoint().ok();
      case Request::refit:
        help_polish(ranks_);
        return true;  // the first rank reports what failed
      case Request::end:
        return true;
    }
    return false;
  }

 private:
  /// The first rank reports what failed.
  bool open() {
    std::string path;
    const Result<Share> share = open_share(ranks_, path);
    if (share) tensor_ = share->scene.tensor;
    return true;
  }

  Result<void> photographs_of(std::size_t count) {
    const Grid grid = tensor_.projector_grid();
    if (patterns_.size() < count || patterns_[0].grid() != grid) patterns_.assign(count, Image<float>(grid));
    const auto patterns = std::span(patterns_).first(count);
    receive(ranks_, patterns);
    SYMRIG_TRY(std::vector<Image<float>> mine, photographs(tensor_, patterns));
    add_up(ranks_, mine);
    return {};
  }

  Result<void> adjoint() const {
    Image<float> picture(tensor_.camera_grid(), tensor_.channels());
    receive(ranks_, {&picture, 1});
    SYMRIG_TRY(Image<float> mine, tensor_.adjoint(picture));
    add_up(ranks_, std::span(&mine, 1));
    return {};
  }

  Ranks ranks_;
  TransportTensor tensor_;
  std::vector<Image<float>> patterns_;  ///< the memory of those that came last
};

}  // namespace

Result<std::shared_ptr<const DealtTransport>> DealtTransport::open(const Ranks& ranks,
                                                                   const std::filesystem::path& path) {
  std::string name = path.string();
  Together opening(ranks, {Request::open});
  Result<Share> share = open_share(ranks, name);
  opening.done();
  if (!share) return share.error();
  return std::make_shared<const DealtTransport>(ranks, *std::move(share));
}

Result<Image<float>> DealtTransport::apply(const Image<float>& pattern) const {
  SYMRIG_TRY(std::vector<Image<float>> one, apply_batch(std::span(&pattern, 1)));
  return std::move(one[0]);
}

Result<std::vector<Image<float>>> DealtTransport::apply_batch(std::span<const Image<float>> patterns) const {
  const Image<float> right(projector_grid());
  for (const Image<float>& pattern : patterns)
    if (pattern.grid() != right.grid() || pattern.channels() != 1)
      return share_.scene.tensor.apply_batch(patterns);  // its error
  std::vector<Image<float>> all;
  all.reserve(patterns.size());
  for (std::size_t first = 0; first < patterns.size(); first += kTogether) {
    const auto batch = patterns.subspan(first, std::min(kTogether, patterns.size() - first));
    Together product(ranks_, {Request::photographs, static_cast<std::int32_t>(batch.size())});
    send(ranks_, batch);
    SYMRIG_TRY(std::vector<Image<float>> mine, photographs(share_.scene.tensor, batch));
    add_up(ranks_, mine);
    product.done();
    std::move(mine.begin(), mine.end(), std::back_inserter(all));
  }
  return all;
}

Result<Image<float>> DealtTransport::adjoint(const Image<float>& picture) const {
  if (picture.grid() != camera_grid() || picture.channels() != channels())
    return share_.scene.tensor.adjoint(picture);  // its error
  Together product(ranks_, {Request::adjoint});
  send(ranks_, {&picture, 1});
  SYMRIG_TRY(Image<float> light, share_.scene.tensor.adjoint(picture));
  add_up(ranks_, std::span(&light, 1));
  product.done();
  return light;
}

int help(const Ranks& ranks, TransportTensor share) {
  Helper helper(ranks, std::move(share));
  while (true) {
    Request request{};
    ranks.broadcast_value(request);
    if (request.kind == Request::end) return request.number;
    Together work;
    if (helper.does(request)) work.done();
  }
}

void release(const Ranks& ranks, int exit_code) {
  Request end{Request::end, exit_code};
  ranks.broadcast_value(end);
}

}  // namespace symrig::mpi
