// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>

namespace tld_follower::stereo {

/// Large messages that are published as shared pointers, with their memory used again. One thread
/// takes from it; subscribers in the same process may hold what they got as long as they like.
template <typename Message>
class MessagePool {
 public:
  /// A message that nobody else holds, with whatever was in it last.
  boost::shared_ptr<Message> Take() {
    for (auto& message : messages_) {
      if (!message) message = boost::make_shared<Message>();
      if (message.use_count() == 1) {
        // The last reader's reads come before what is written from now on.
        std::atomic_thread_fence(std::memory_order_acquire);
        return message;
      }
    }
    return boost::make_shared<Message>();  // All are held: that is left to their holders.
  }

 private:
  std::array<boost::shared_ptr<Message>, 3> messages_;
};

}  // namespace tld_follower::stereo
