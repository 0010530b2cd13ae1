// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/viewer/live.hpp"
#include "symrig/viewer/server.hpp"
#include "viewer/camera_view.hpp"
#include "viewer/service.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <tbb/task_arena.h>

namespace symrig::viewer {

/// Answers for a finished scene. Each reply depends on the request and the scene alone.
///
/// GET "": the page. GET "facts": what the page knows of the scene. GET "kernel", "pack": what the page needs
/// to relight by itself; no pack of a large scene. POST "relight", "dual", "truth": a light (decode_light());
/// the reply is the picture, one plane or three. GET "leaves": tree order and the table of leaves. GET
/// "held-out/K": a pattern and its photograph.
///
/// With T on the camera's own pixels, "relight" gives these, and POST "quick" fewer of them if there are many
/// (CameraView). GET "places": the numbers of CellPlaces. GET "sees/K": the light that pixel K sees. All else
/// stays on the cells, and there is no pack.
class ViewService final : public Service {
 public:
  ViewService(StoredScene scene, ViewOptions options, const std::string& secret, std::string nonce);

  std::optional<ViewReply> refused(const ViewRequest& request) const override {
    return gate_.refused(request);
  }
  ViewReply answer(const ViewRequest& request) override;
  std::uint64_t max_body() const override;

 private:
  ViewReply posted(std::string_view what, std::string_view light) const;
  ViewReply got(std::string_view what) const;
  nlohmann::json facts() const;
  ViewReply held_out(std::string_view number) const;
  ViewReply of_camera(std::string_view what) const;

  StoredScene scene_;
  std::optional<CameraView> camera_;
  ViewOptions options_;
  Gate gate_;
  std::string nonce_;
  std::string pack_;  // empty: the scene is too large for a page
  nlohmann::json sections_ = nlohmann::json::object();
};

/// Answers for a scene that is being captured, and for the finished scene afterwards.
///
/// GET "": the page. GET "live": how far the capture is, as JSON. GET "last": the last photograph and its
/// pattern. GET "facts", "leaves", POST "relight", "dual": as ViewService, of the tensor so far. 404 if there
/// is none yet.
class LiveService final : public Service {
 public:
  LiveService(std::shared_ptr<const LiveScene> scene, ViewOptions options, std::string secret,
              std::string nonce);

  std::optional<ViewReply> refused(const ViewRequest& request) const override {
    return gate_.refused(request);
  }
  ViewReply answer(const ViewRequest& request) override;
  std::uint64_t max_body() const override;

 private:
  ViewReply finished(const ViewRequest& request, const LiveScene::Now& now);
  ViewReply got(std::string_view what, const LiveScene::Now& now);
  nlohmann::json first_facts() const;
  nlohmann::json facts(const TransportTensor& tensor) const;
  const TransportTensor* tensor(const LiveScene::Now& now);

  std::shared_ptr<const LiveScene> scene_;
  ViewOptions options_;
  std::string secret_, nonce_;
  Gate gate_;
  tbb::task_arena one_thread_{1};  // visitors take at most one processor from the capture
  std::optional<TransportTensor> tensor_;
  std::int64_t made_ = 0;  // the number of tensor_
  std::unique_ptr<ViewService> finished_;
};

}  // namespace symrig::viewer
