// SPDX-License-Identifier: BSD-3-Clause
#include <nodelet/nodelet.h>

#include <exception>
#include <optional>
#include <pluginlib/class_list_macros.hpp>

#include "stereo/stereo_node.h"

namespace tld_follower::stereo {

/// StereoNode in a nodelet manager: images and results pass as shared pointers within it.
class StereoCloudNodelet : public nodelet::Nodelet {
 private:
  void onInit() override try {
    node_.emplace(getNodeHandle(), getPrivateNodeHandle());
  } catch (const std::exception& problem) {
    NODELET_FATAL("%s", problem.what());
    throw;  // The manager tells the loader, which ends, and goes on without this nodelet.
  }

  std::optional<StereoNode> node_;
};

}  // namespace tld_follower::stereo

PLUGINLIB_EXPORT_CLASS(tld_follower::stereo::StereoCloudNodelet, nodelet::Nodelet)
