// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/image_topics_node.h"

#include <algorithm>

#include "stereo/conversions_node.h"

namespace tld_follower::stereo {
namespace {

struct Topic {
  const char* name;
  const Texture& (CameraViews::*view)();
};
constexpr std::array<Topic, 4> kTopics{{{"image_mono", &CameraViews::Grey},
                                        {"image_color", &CameraViews::Colour},
                                        {"image_rect", &CameraViews::RectifiedGrey},
                                        {"image_rect_color", &CameraViews::RectifiedColour}}};

}  // namespace

ImageTopics::ImageTopics(image_transport::ImageTransport* transport, const std::string& camera,
                         const std::function<void()>& changed) {
  const auto on_change = [changed](const image_transport::SingleSubscriberPublisher&) {
    changed();
  };
  for (size_t i = 0; i < kTopics.size(); ++i) {
    publishers_[i] = transport->advertise(camera + "/" + kTopics[i].name, 1, on_change, on_change);
  }
}

bool ImageTopics::AreNeeded() const {
  return std::any_of(publishers_.begin(), publishers_.end(),
                     [](const auto& publisher) { return publisher.getNumSubscribers() > 0; });
}

void ImageTopics::Publish(const sensor_msgs::Image::ConstPtr& raw, CameraViews* views) const {
  for (size_t i = 0; i < kTopics.size(); ++i) {
    if (publishers_[i].getNumSubscribers() == 0) continue;
    const Texture& view = (views->*kTopics[i].view)();
    const bool is_raw = view.pixels.data == raw->data.data();
    publishers_[i].publish(is_raw ? raw : ToMessage(view, raw->header));
  }
}

}  // namespace tld_follower::stereo
