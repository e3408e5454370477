// SPDX-License-Identifier: BSD-3-Clause
#include "sim/world.h"

#include <console_bridge/console.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <sdf/sdf.hh>
#include <sstream>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

btVector3 ToBullet(const ignition::math::Vector3d& v) {
  return {btScalar(v.X()), btScalar(v.Y()), btScalar(v.Z())};
}

btTransform ToBullet(const ignition::math::Pose3d& pose) {
  const auto& q = pose.Rot();
  return btTransform(
      btQuaternion(btScalar(q.X()), btScalar(q.Y()), btScalar(q.Z()), btScalar(q.W())),
      ToBullet(pose.Pos()));
}

btTransform FinitePose(const ignition::math::Pose3d& pose, const std::string& what) {
  if (!pose.IsFinite()) throw std::runtime_error("the pose of " + what + " is not finite");
  return ToBullet(pose);
}

std::array<float, 3> ToRgb(const ignition::math::Color& c) { return {c.R(), c.G(), c.B()}; }

// The place of an SDF object in the world: poses of frames given relative to others are resolved.
template <typename SdfObject>
btTransform Resolve(const SdfObject& object, const std::string& what) {
  ignition::math::Pose3d pose;
  const sdf::Errors errors = object.SemanticPose().Resolve(pose);
  if (!errors.empty()) {
    throw std::runtime_error("the pose of " + what + " is wrong: " + errors.front().Message());
  }
  return FinitePose(pose, what);
}

void CheckSize(const Geometry& geometry, const std::string& owner) {
  const btVector3& size = geometry.size;
  const bool flat = geometry.type == Geometry::Type::kPlane;
  for (const btScalar length : {size.x(), size.y(), flat ? size.x() : size.z()}) {
    if (!(length > 0 && std::isfinite(length))) {
      throw std::runtime_error("'" + owner + "' has a size or scale that is not positive");
    }
  }
}

// An SDF <heightmap>; what it says of textures is left to <material>.
Geometry ReadTerrain(const sdf::Heightmap& map, const Resources& resources,
                     const std::string& owner) {
  Geometry result;
  result.type = Geometry::Type::kTerrain;
  result.size = ToBullet(map.Size());
  result.mesh = map.Uri();
  CheckSize(result, owner);
  if (map.Position() != ignition::math::Vector3d::Zero) {
    throw std::runtime_error("'" + owner + "' moves its heightmap by <pos>; use <pose>");
  }
  const std::string file = resources.Find(map.Uri());
  if (file.empty()) throw std::runtime_error("there is no heightmap '" + map.Uri() + "'");
  result.terrain = std::make_shared<const Terrain>(LoadTerrain(file, result.size));
  return result;
}

Geometry ReadGeometry(const sdf::Geometry& geometry, const Resources& resources,
                      const std::string& owner) {
  Geometry result;
  switch (geometry.Type()) {
    case sdf::GeometryType::BOX:
      result.type = Geometry::Type::kBox;
      result.size = ToBullet(geometry.BoxShape()->Size());
      break;
    case sdf::GeometryType::CYLINDER: {
      const auto* cylinder = geometry.CylinderShape();
      result.type = Geometry::Type::kCylinder;
      result.size = {btScalar(cylinder->Radius()), btScalar(cylinder->Radius()),
                     btScalar(cylinder->Length())};
      break;
    }
    case sdf::GeometryType::SPHERE:
      result.type = Geometry::Type::kSphere;
      result.size.setValue(btScalar(geometry.SphereShape()->Radius()),
                           btScalar(geometry.SphereShape()->Radius()),
                           btScalar(geometry.SphereShape()->Radius()));
      break;
    case sdf::GeometryType::PLANE: {
      const auto* plane = geometry.PlaneShape();
      result.type = Geometry::Type::kPlane;
      result.size = {btScalar(plane->Size().X()), btScalar(plane->Size().Y()), 0};
      break;
    }
    case sdf::GeometryType::MESH:
      result.type = Geometry::Type::kMesh;
      result.mesh = geometry.MeshShape()->Uri();
      result.size = ToBullet(geometry.MeshShape()->Scale());
      break;
    case sdf::GeometryType::HEIGHTMAP:
      return ReadTerrain(*geometry.HeightmapShape(), resources, owner);
    default:
      throw std::runtime_error(
          "'" + owner +
          "' has a geometry other than box, cylinder, sphere, plane, heightmap or mesh");
  }
  CheckSize(result, owner);
  return result;
}

Material ReadMaterial(const sdf::Material* material) {
  Material result;
  if (material == nullptr) return result;
  // SDF's own default is black, which would hide a texture.
  if (material->Element()->HasElement("diffuse")) result.colour = ToRgb(material->Diffuse());
  if (const sdf::Pbr* pbr = material->PbrMaterial()) {
    if (const sdf::PbrWorkflow* metal = pbr->Workflow(sdf::PbrWorkflowType::METAL)) {
      result.texture = metal->AlbedoMap();
      result.light_map = metal->LightMap();
    }
  }
  if (material->Element()->HasElement("tld:texture_size")) {
    result.texture_size = material->Element()->GetElement("tld:texture_size")->Get<double>();
    if (!(result.texture_size > 0 && std::isfinite(result.texture_size))) {
      throw std::runtime_error("<tld:texture_size> must be positive");
    }
  }
  return result;
}

// libsdformat 12 has no accessor for friction, so its element is looked up.
double ReadFriction(const sdf::Collision& collision) {
  sdf::ElementPtr element = collision.Element();
  for (const char* name : {"surface", "friction", "ode", "mu"}) {
    if (!element->HasElement(name)) return 1.0;
    element = element->GetElement(name);
  }
  const double friction = element->Get<double>();
  if (!(friction >= 0 && std::isfinite(friction))) {
    throw std::runtime_error("the friction of '" + collision.Name() + "' must be 0 or more");
  }
  return friction;
}

std::vector<Waypoint> ReadScript(const sdf::Model& model) {
  std::vector<Waypoint> script;
  if (!model.Element()->HasElement("tld:waypoint")) return script;
  for (sdf::ElementPtr element = model.Element()->GetElement("tld:waypoint"); element;
       element = element->GetNextElement("tld:waypoint")) {
    std::istringstream text(element->Get<std::string>());
    double time, x, y, z, roll, pitch, yaw;
    std::string rest;
    if (!(text >> time >> x >> y >> z >> roll >> pitch >> yaw) || text >> rest) {
      throw std::runtime_error("a <tld:waypoint> of '" + model.Name() +
                               "' is not seven numbers: t x y z roll pitch yaw");
    }
    if (!script.empty() && !(time > script.back().time)) {
      throw std::runtime_error("the waypoints of '" + model.Name() + "' are not in order of time");
    }
    const ignition::math::Pose3d pose(x, y, z, roll, pitch, yaw);
    script.push_back({time, FinitePose(pose, "a waypoint of '" + model.Name() + "'")});
  }
  return script;
}

Model ReadModel(const sdf::Model& model, const Resources& resources, const WarningSink& warn) {
  Model result;
  result.name = model.Name();
  result.script = ReadScript(model);
  if (!model.Static() && result.script.empty()) {
    warn("model '" + model.Name() + "' is not <static>; it is held in place all the same");
  }
  const btTransform model_pose =
      result.script.empty() ? Resolve(model, model.Name()) : btTransform::getIdentity();
  for (uint64_t l = 0; l < model.LinkCount(); ++l) {
    const sdf::Link& link = *model.LinkByIndex(l);
    const btTransform link_pose = model_pose * Resolve(link, model.Name() + "::" + link.Name());
    for (uint64_t v = 0; v < link.VisualCount(); ++v) {
      const sdf::Visual& visual = *link.VisualByIndex(v);
      result.visuals.push_back({link_pose * Resolve(visual, visual.Name()),
                                ReadGeometry(*visual.Geom(), resources, model.Name()),
                                ReadMaterial(visual.Material())});
    }
    for (uint64_t c = 0; c < link.CollisionCount(); ++c) {
      const sdf::Collision& collision = *link.CollisionByIndex(c);
      Geometry geometry = ReadGeometry(*collision.Geom(), resources, model.Name());
      if (geometry.type == Geometry::Type::kMesh) {
        throw std::runtime_error("'" + model.Name() +
                                 "' has a mesh as <collision>; use primitives");
      }
      result.collisions.push_back({link_pose * Resolve(collision, collision.Name()),
                                   std::move(geometry), ReadFriction(collision)});
    }
  }
  return result;
}

// libsdformat would lump a URDF's fixed links and drop its textures, so robots are read apart:
// here only their name, file and pose are kept.
sdf::InterfaceModelPtr KeepUrdfApart(const sdf::NestedInclude& include, sdf::Errors&) {
  const std::string& file = include.ResolvedFileName();
  if (std::filesystem::path(file).extension() != ".urdf") return nullptr;
  const std::string name =
      include.LocalModelName().value_or(std::filesystem::path(file).stem().string());
  auto model = std::make_shared<sdf::InterfaceModel>(name, sdf::RepostureFunction(), false, "root",
                                                     ignition::math::Pose3d::Zero);
  model->AddLink(sdf::InterfaceLink("root", ignition::math::Pose3d::Zero));
  return model;
}

sdf::ParserConfig MakeParser(const Resources& resources) {
  sdf::ParserConfig parser;
  parser.SetFindCallback([&resources](const std::string& uri) { return resources.Find(uri); });
  parser.RegisterCustomModelParser(KeepUrdfApart);
  parser.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  parser.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::ERR);
  return parser;
}

}  // namespace

btTransform Model::PoseAt(double time) const {
  if (script.empty()) return btTransform::getIdentity();
  if (time <= script.front().time) return script.front().pose;
  for (size_t i = 1; i < script.size(); ++i) {
    const Waypoint &from = script[i - 1], &to = script[i];
    if (time >= to.time) continue;
    const btScalar share = btScalar((time - from.time) / (to.time - from.time));
    return btTransform(from.pose.getRotation().slerp(to.pose.getRotation(), share),
                       from.pose.getOrigin().lerp(to.pose.getOrigin(), share));
  }
  return script.back().pose;
}

const RobotPlacement& World::Robot(const std::vector<std::string>& names) const {
  const RobotPlacement* found = nullptr;
  std::string listed;
  for (const std::string& wanted : names) {
    listed += (listed.empty() ? "'" : " or '") + wanted + "'";
    for (const RobotPlacement& placement : robots) {
      if (placement.name != wanted) continue;
      if (found != nullptr) {
        throw std::runtime_error("the world '" + file + "' places both '" + found->name +
                                 "' and '" + wanted + "'; it must be one of them");
      }
      found = &placement;
    }
  }
  if (found != nullptr) return *found;
  throw std::runtime_error("the world '" + file + "' does not <include> a robot named " + listed);
}

double World::GroundHeight(double x, double y) const {
  double height = 0;
  for (const Model& model : models) {
    for (const Collision& collision : model.collisions) {
      if (collision.geometry.type != Geometry::Type::kTerrain) continue;
      const btVector3 place = collision.pose.inverse() * btVector3(btScalar(x), btScalar(y), 0);
      const double own = collision.geometry.terrain->Height(place.x(), place.y());
      height = std::max(height, own + collision.pose.getOrigin().z());
    }
  }
  return height;
}

World LoadWorld(const std::string& file, const Resources& resources, const WarningSink& warn) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw std::runtime_error("cannot read the world '" + file + "': no such file");
  }
  sdf::Console::Instance()->SetQuiet(true);  // What it has to say comes back as errors.
  // What is no valid SDF it tries as URDF, whose parser would complain of that on the console.
  console_bridge::noOutputHandler();
  sdf::Root root;
  const sdf::Errors errors = root.Load(file, MakeParser(resources));
  console_bridge::restorePreviousOutputHandler();
  if (!errors.empty()) {
    const auto line = errors.front().LineNumber();
    throw std::runtime_error("cannot read the world '" + file + "'" +
                             (line ? ", line " + std::to_string(*line) : "") + ": " +
                             errors.front().Message());
  }
  if (root.WorldCount() == 0) {
    throw std::runtime_error("cannot read the world '" + file + "': it has no <world>");
  }
  const sdf::World& source = *root.WorldByIndex(0);
  try {
    World world;
    world.file = file;
    world.name = source.Name();
    if (!source.Gravity().IsFinite()) throw std::runtime_error("its gravity is not finite");
    world.gravity = ToBullet(source.Gravity());
    if (source.Scene() != nullptr) world.ambient = ToRgb(source.Scene()->Ambient());
    if (source.Element()->HasElement("tld:sky")) {
      world.sky_texture = source.Element()->GetElement("tld:sky")->Get<std::string>();
    }
    for (uint64_t i = 0; i < source.LightCount(); ++i) {
      const sdf::Light& light = *source.LightByIndex(i);
      if (light.Type() != sdf::LightType::DIRECTIONAL) continue;
      const double length = light.Direction().Length();
      if (!(length > 0 && std::isfinite(length))) {
        throw std::runtime_error("light '" + light.Name() + "' has no direction");
      }
      world.sun_direction = ToBullet(light.Direction()).normalized();
      world.sun_colour = ToRgb(light.Diffuse());
    }
    for (uint64_t i = 0; i < source.ModelCount(); ++i) {
      world.models.push_back(ReadModel(*source.ModelByIndex(i), resources, warn));
    }
    for (uint64_t i = 0; i < source.InterfaceModelCount(); ++i) {
      const sdf::NestedInclude& include = *source.InterfaceModelNestedIncludeByIndex(i);
      const std::string& name = source.InterfaceModelByIndex(i)->Name();
      world.robots.push_back(
          {name, include.ResolvedFileName(),
           FinitePose(include.IncludeRawPose().value_or(ignition::math::Pose3d::Zero), name)});
    }
    return world;
  } catch (const std::runtime_error& problem) {
    throw std::runtime_error("cannot read the world '" + file + "': " + problem.what());
  }
}

}  // namespace tld_follower::sim
