// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <image_transport/image_transport.h>
#include <sensor_msgs/Image.h>

#include <array>
#include <functional>
#include <string>

#include "stereo/views.h"

namespace tld_follower::stereo {

/// What image_proc publishes of one camera: image_mono, image_color, image_rect and
/// image_rect_color, each made only while somebody subscribes to it.
class ImageTopics {
 public:
  /// Topics are advertised in `camera` (left or right); `changed` is called when subscribers come
  /// or go.
  ImageTopics(image_transport::ImageTransport* transport, const std::string& camera,
              const std::function<void()>& changed);

  bool AreNeeded() const;

  /// Publishes what is subscribed to. `raw`, the message that `views` were made of, is published
  /// itself where a view is nothing else. Throws std::invalid_argument as `views` do.
  void Publish(const sensor_msgs::Image::ConstPtr& raw, CameraViews* views) const;

 private:
  std::array<image_transport::Publisher, 4> publishers_;
};

}  // namespace tld_follower::stereo
