// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/input_node.h"

#include <boost/bind/bind.hpp>
#include <utility>
#include <vector>

namespace tld_follower::stereo {
namespace {

constexpr double kCheckPeriod = 5;   // [s of wall-clock time]
constexpr uint32_t kNewestOnly = 1;  // A queue of more would only make pairs older under load.

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

StereoInput::StereoInput(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                         Callback on_pair)
    : handle_(handle),
      transport_(handle),
      parameters_(ReadInputParameters(private_handle, transport_)),
      hints_(parameters_.image_transport, ros::TransportHints().tcpNoDelay(), private_handle),
      on_pair_(std::move(on_pair)) {
  MakeSynchroniser();
  images_[0].registerCallback([this](const ros::MessageEvent<const Image>& m) { OnMessage<0>(m); });
  infos_[0].registerCallback(
      [this](const ros::MessageEvent<const CameraInfo>& m) { OnMessage<1>(m); });
  images_[1].registerCallback([this](const ros::MessageEvent<const Image>& m) { OnMessage<2>(m); });
  infos_[1].registerCallback(
      [this](const ros::MessageEvent<const CameraInfo>& m) { OnMessage<3>(m); });
  check_timer_ = handle_.createWallTimer(ros::WallDuration(kCheckPeriod),
                                         [this](const ros::WallTimerEvent&) { Check(); });
}

void StereoInput::MakeSynchroniser() {
  using namespace boost::placeholders;
  const auto queue_size = static_cast<uint32_t>(parameters_.queue_size);
  if (parameters_.approximate_sync) {
    synchroniser_ = std::make_unique<Approximate>(queue_size);
  } else {
    synchroniser_ = std::make_unique<Exact>(queue_size);
  }
  std::visit(
      [this](auto& synchroniser) {
        synchroniser->registerCallback(boost::bind(&StereoInput::OnPair, this, _1, _2, _3, _4));
      },
      synchroniser_);
}

template <int kInput, typename Message>
void StereoInput::OnMessage(const ros::MessageEvent<const Message>& event) {
  const ros::Time stamp = event.getConstMessage()->header.stamp;
  // After a jump back in time (a bag that starts over, a reset simulation) messages that wait for
  // their partners would crowd out all new ones.
  if (stamp < newest_[kInput]) {
    MakeSynchroniser();
    newest_ = {};
  }
  newest_[kInput] = stamp;
  ++received_[kInput];
  std::visit([&event](auto& synchroniser) { synchroniser->template add<kInput>(event); },
             synchroniser_);
}

void StereoInput::OnPair(const Image::ConstPtr& left_image, const CameraInfo::ConstPtr& left_info,
                         const Image::ConstPtr& right_image,
                         const CameraInfo::ConstPtr& right_info) {
  ++pairs_;
  on_pair_(left_image, left_info, right_image, right_info);
}

void StereoInput::Subscribe(bool wanted) {
  if (wanted == subscribed_) return;
  subscribed_ = wanted;
  received_ = {};
  pairs_ = 0;
  if (!wanted) {
    MakeSynchroniser();  // Forgets what waits for a partner.
    for (auto& image : images_) image.unsubscribe();
    for (auto& info : infos_) info.unsubscribe();
    return;
  }
  images_[0].subscribe(transport_, "left/image_raw", kNewestOnly, hints_);
  infos_[0].subscribe(handle_, "left/camera_info", kNewestOnly, hints_.getRosHints());
  images_[1].subscribe(transport_, "right/image_raw", kNewestOnly, hints_);
  infos_[1].subscribe(handle_, "right/camera_info", kNewestOnly, hints_.getRosHints());
  check_timer_.stop();  // A whole period from now on.
  check_timer_.start();
}

void StereoInput::Check() {
  const ros::Time now = ros::Time::now();
  const bool clock_stands = ros::Time::isSimTime() && !now.isZero() && now == last_check_;
  last_check_ = now;
  const auto received = std::exchange(received_, {});
  const int pairs = std::exchange(pairs_, 0);
  // A simulation at pause owes no images.
  if (!subscribed_ || pairs > 0 || clock_stands) return;

  const std::array<std::string, 4> topics{images_[0].getTopic(), infos_[0].getTopic(),
                                          images_[1].getTopic(), infos_[1].getTopic()};
  const std::array<uint32_t, 4> publishers{
      images_[0].getNumPublishers(), infos_[0].getSubscriber().getNumPublishers(),
      images_[1].getNumPublishers(), infos_[1].getSubscriber().getNumPublishers()};
  std::vector<std::string> unpublished, silent;
  for (size_t i = 0; i < topics.size(); ++i) {
    if (received[i] == 0) (publishers[i] == 0 ? unpublished : silent).push_back(topics[i]);
  }
  if (!unpublished.empty()) {
    warn_("no disparity: nobody publishes " + Joined(unpublished) +
          " (are the cameras running, and in the namespace " + handle_.getNamespace() + "?)");
  } else if (!silent.empty()) {
    warn_("no disparity: nothing arrives on " + Joined(silent) + " (check with: rostopic hz)");
  } else {
    warn_("no disparity: images and camera_info arrive, but none of them pair up; " +
          std::string(parameters_.approximate_sync
                          ? "their stamps are too far apart for queue_size"
                          : "their stamps must be identical, else set approximate_sync"));
  }
}

}  // namespace tld_follower::stereo
