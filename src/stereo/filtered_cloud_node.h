// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/server.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tld_follower/CloudFilterConfig.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "stereo/cloud_filter.h"
#include "stereo/warning_node.h"

namespace tld_follower::stereo {

/// The topic points2_filtered. A thread of its own filters the newest cloud, so that the cloud
/// itself never waits for it; clouds that come while one is filtered are left out but for the last.
class FilteredCloud {
 public:
  /// The topic is relative to `handle`, parameters to `filter_handle`; `changed` is called when
  /// subscribers come or go.
  FilteredCloud(ros::NodeHandle handle, const ros::NodeHandle& filter_handle,
                const std::function<void()>& changed);
  ~FilteredCloud();
  FilteredCloud(const FilteredCloud&) = delete;
  FilteredCloud& operator=(const FilteredCloud&) = delete;

  bool IsNeeded() const { return publisher_.getNumSubscribers() > 0; }

  /// Hands over a cloud laid out as pcl::PointXYZRGB.
  void Offer(const sensor_msgs::PointCloud2::ConstPtr& cloud);

 private:
  void Work();
  void Publish(const sensor_msgs::PointCloud2& cloud, const CloudFilterParameters& parameters);

  ros::Publisher publisher_;
  Warner warn_;

  std::mutex mutex_;  // Guards what follows, up to stop_.
  std::condition_variable changed_;
  CloudFilterParameters parameters_;
  sensor_msgs::PointCloud2::ConstPtr newest_;
  bool stop_ = false;

  std::unique_ptr<dynamic_reconfigure::Server<tld_follower::CloudFilterConfig>> reconfigure_server_;
  std::thread worker_;
};

}  // namespace tld_follower::stereo
