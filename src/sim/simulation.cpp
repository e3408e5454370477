// SPDX-License-Identifier: BSD-3-Clause
#include "sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "sim/distance.h"

namespace tld_follower::sim {
namespace {

constexpr int64_t kStepsPerSecond = 500;
constexpr int64_t kNanosecondsPerStep = 1000000000 / kStepsPerSecond;
constexpr int64_t kStepsPerTick = 5;
static_assert(Physics::kStep * kStepsPerSecond == 1.0);

constexpr double kHurricane = 40.0;  // [m/s]

// Two touches of the same object within this time belong to one episode.
constexpr int64_t kEpisodeGap = kStepsPerSecond / 5;

// The target's owner number in the list of contacts; other objects follow in their order.
constexpr size_t kTarget = 0;

bool Belongs(const btCollisionObject* object, const MobileRobot& robot) {
  const auto& parts = robot.parts();
  return std::any_of(parts.begin(), parts.end(),
                     [object](const RobotPart& part) { return part.body.rigid == object; });
}

// What a ground robot rolls on.
bool IsGround(const btCollisionObject* object) { return object->getCollisionShape()->isConcave(); }

}  // namespace

// Everything that a reset makes anew.
struct Simulation::State {
  explicit State(const Simulation& simulation)
      : physics(simulation.world_),
        vehicle(simulation.cast_.MakeVehicle(&physics)),
        target(simulation.cast_.MakeTarget(&physics)),
        sensors(simulation.config_.sensors, simulation.config_.seed, vehicle->body(),
                simulation.world_.gravity),
        exposure(simulation.config_.effects.exposure_change,
                 simulation.config_.effects.exposure_time, simulation.config_.seed),
        last_touch(size_t(physics.objects().size()) + 1, std::numeric_limits<int64_t>::min() / 2) {}

  // It is nothing that the vehicle could run into.
  bool IsIgnored(const btCollisionObject* object) const {
    return Belongs(object, *vehicle) || (!vehicle->flies() && IsGround(object));
  }

  Physics physics;
  std::unique_ptr<MobileRobot> vehicle, target;
  Sensors sensors;
  Exposure exposure;
  std::vector<int64_t> last_touch;  // Step of the last contact with each owner.
  uint32_t collisions = 0;
};

Simulation::Simulation(const SimulationConfig& config, const WarningSink& warn)
    : config_(config),
      resources_(Resources::ForWorld(config.world_file)),
      world_(LoadWorld(config.world_file, resources_, warn)),
      cast_(world_, config.cast),
      camera_(cast_.Mounted(config.camera)),
      image_noise_(config.image_noise, config.seed) {
  camera_.Check();
  if (!(config_.frame_rate >= 1 && config_.frame_rate <= 250)) {
    throw std::invalid_argument("the frame rate must be 1 to 250 Hz");
  }
  const CameraEffects& effects = config_.effects;
  if (!(effects.blur_pictures >= 1 && effects.blur_pictures <= 64)) {
    throw std::invalid_argument("blur_pictures must be 1 to 64");
  }
  Reset();
  renderer_ = std::make_unique<Renderer>(camera_, world_, MakeScene(), config_.effects.shadow_map,
                                         resources_, warn);
}

Simulation::~Simulation() = default;

void Simulation::Reset() {
  state_ = std::make_unique<State>(*this);
  step_ = 0;
  frame_ = 0;
}

// Frames that move, as Render gives them: the parts of both robots, then the models with a script.
Scene Simulation::MakeScene() const {
  Scene scene;
  int frame = 0;
  for (const MobileRobot* robot : {state_->vehicle.get(), state_->target.get()}) {
    const int label = robot == state_->target.get() ? kTargetLabel : kVehicleLabel;
    for (const RobotPart& part : robot->parts()) {
      const btTransform to_part = part.links.front()->pose.inverse();
      for (const RobotLink* link : part.links) {
        for (Visual visual : link->visuals) {
          visual.pose = to_part * visual.pose;
          scene.visuals.push_back({std::move(visual), frame, label});
        }
        for (Collision shape : link->collisions) {
          shape.pose = to_part * shape.pose;
          scene.shadows.push_back({std::move(shape), frame});
        }
      }
      ++frame;
    }
  }
  int label = kFirstModelLabel;
  for (const Model& model : world_.models) {
    const int own = model.script.empty() ? -1 : frame++;
    for (const Visual& visual : model.visuals) scene.visuals.push_back({visual, own, label});
    for (const Collision& shape : model.collisions) scene.shadows.push_back({shape, own});
    ++label;
  }
  return scene;
}

int64_t Simulation::FrameStep(uint64_t frame) const {
  return std::llround(double(frame) / config_.frame_rate * kStepsPerSecond);
}

Moment Simulation::Advance() {
  Moment moment;
  while (!moment.tick && !moment.frame) {
    state_->vehicle->Actuate(time());
    state_->target->Actuate(time());
    ++step_;
    state_->physics.Step(time());
    state_->vehicle->Measure();
    state_->target->Measure();
    CountContacts();
    moment.tick = step_ % kStepsPerTick == 0;
    moment.slow_tick = step_ % (2 * kStepsPerTick) == 0;
    moment.frame = step_ == FrameStep(frame_ + 1);
    if (moment.tick) state_->sensors.Sample(double(kStepsPerTick) / kStepsPerSecond);
    if (moment.frame) {
      ++frame_;
      state_->exposure.Advance(1 / config_.frame_rate);
    }
  }
  return moment;
}

int64_t Simulation::time_ns() const { return step_ * kNanosecondsPerStep; }

void Simulation::CountContacts() {
  for (const RobotPart& part : state_->vehicle->parts()) {
    state_->physics.ForEachContact(part.body.rigid, [this](const btCollisionObject* other) {
      if (state_->IsIgnored(other)) return;
      const size_t owner =
          Belongs(other, *state_->target) ? kTarget : size_t(other->getWorldArrayIndex()) + 1;
      const bool is_new = step_ - state_->last_touch[owner] > kEpisodeGap;
      state_->last_touch[owner] = step_;
      if (is_new && state_->vehicle->ready()) ++state_->collisions;
    });
  }
}

// The picture as it was some seconds before this moment.
void Simulation::Draw(double before, StereoImages* images, TargetMask* mask) {
  std::vector<btTransform> frames;
  for (const MobileRobot* robot : {state_->vehicle.get(), state_->target.get()}) {
    for (const RobotPart& part : robot->parts()) frames.push_back(part.body.PoseBefore(before));
  }
  for (const Model& model : world_.models) {
    if (!model.script.empty()) frames.push_back(model.PoseAt(time() - before));
  }
  renderer_->Render(frames.front() * camera_.Mount(), frames, images, mask);
}

void Simulation::Render(StereoImages* images, TargetMask* mask) {
  const int pictures = config_.effects.blur_pictures;
  for (int i = pictures - 1; i > 0; --i) {
    Draw(i * config_.effects.shutter_time / (pictures - 1), images, nullptr);
    blur_.Add(*images);
  }
  Draw(0, images, mask);
  if (pictures > 1) {
    blur_.Add(*images);
    blur_.Take(images);
  }
  state_->exposure.Apply(images);
  image_noise_.Add(frame_, Eye::kLeft, &images->left);
  image_noise_.Add(frame_, Eye::kRight, &images->right);
}

bool Simulation::SetWind(const btVector3& wind) {
  if (!(wind.length() <= kHurricane)) return false;
  state_->physics.SetWind(wind);
  return true;
}

Truth Simulation::Measure() const {
  Truth truth;
  truth.collisions = state_->collisions;
  truth.distance = truth.clearance = std::numeric_limits<double>::infinity();
  const btVector3 eye =
      (state_->vehicle->body().Pose() * camera_.Mount() * camera_.Optical(Eye::kLeft)).getOrigin();
  for (const RobotPart& part : state_->target->parts()) {
    truth.distance = std::min(truth.distance, Distance(eye, *part.body.rigid));
  }
  const btCollisionObjectArray& objects = state_->physics.objects();
  for (const RobotPart& part : state_->vehicle->parts()) {
    const btCollisionObject& own = *part.body.rigid;
    for (int i = 0; i < objects.size(); ++i) {
      if (state_->IsIgnored(objects[i])) continue;
      truth.clearance =
          std::min(truth.clearance,
                   Distance(*own.getCollisionShape(), own.getWorldTransform(),
                            *objects[i]->getCollisionShape(), objects[i]->getWorldTransform()));
    }
  }
  return truth;
}

MobileRobot& Simulation::vehicle() { return *state_->vehicle; }
MobileRobot& Simulation::target() { return *state_->target; }
const MobileRobot& Simulation::vehicle() const { return *state_->vehicle; }
const MobileRobot& Simulation::target() const { return *state_->target; }
const Sensors& Simulation::sensors() const { return state_->sensors; }
double Simulation::ReadRange() { return state_->sensors.ReadRange(state_->physics); }

}  // namespace tld_follower::sim
