// SPDX-License-Identifier: BSD-3-Clause
#include <nodelet/nodelet.h>

#include <optional>
#include <pluginlib/class_list_macros.hpp>

#include "stereo/stereo_node.h"

namespace tld_follower::stereo {

/// StereoNode in a nodelet manager: images and results pass as shared pointers within it.
class StereoCloudNodelet : public nodelet::Nodelet {
 private:
  // A std::invalid_argument of a wrong parameter goes to the manager, which tells the loader.
  void onInit() override { node_.emplace(getNodeHandle(), getPrivateNodeHandle()); }

  std::optional<StereoNode> node_;
};

}  // namespace tld_follower::stereo

PLUGINLIB_EXPORT_CLASS(tld_follower::stereo::StereoCloudNodelet, nodelet::Nodelet)
