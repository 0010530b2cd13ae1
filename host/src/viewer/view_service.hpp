// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/viewer/server.hpp"
#include "viewer/gate.hpp"
#include "viewer/service.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace symrig::viewer {

/// Answers for a finished scene. Each reply depends on the request and the scene alone.
///
/// GET "": the page. GET "facts": what the page knows of the scene. GET "kernel", "pack": what the page needs
/// to relight by itself; no pack of a large scene. POST "relight", "dual", "truth": a light (light_code.hpp);
/// the reply is the picture, one plane or three. GET "leaves": tree order and the table of leaves. GET
/// "held-out/K": a pattern and its photograph.
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

  StoredScene scene_;
  ViewOptions options_;
  Gate gate_;
  std::string nonce_;
  std::string pack_;  // empty: the scene is too large for a page
  nlohmann::json sections_ = nlohmann::json::object();
};

}  // namespace symrig::viewer
