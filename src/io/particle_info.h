#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "particles/cloud_kind.h"
#include "particles/particle_set.h"
#include "particles/radius.h"
#include "particles/spacing.h"
#include "particles/splat_cloud.h"

namespace embrun {

struct AttributeInfo {
  std::string name;
  std::string file_name;  ///< where the file calls it otherwise
  AttributeType type = AttributeType::float32;
  std::size_t components = 1;
  std::vector<double> least, greatest;  ///< one per component
  std::size_t strings = 0;              ///< size of the string table of a text attribute
  std::size_t replaced_non_finite = 0;
};

/// What the points of a scan become.
struct CloudInfo {
  CloudVerdict verdict;
  SplatReport splats;
  std::optional<Vec3d> sensor;  ///< that normals were turned to
  bool closed = false;
  bool ellipses = false;
  bool has_colours = false;
};

/// What `embrun info` says about a particle file.
struct ParticleInfo {
  std::string file;
  std::string format;
  std::size_t count = 0;
  std::size_t dropped_non_finite = 0;
  Vec3d low, high;  ///< bounds of the positions, metres
  std::vector<AttributeInfo> attributes;
  SpacingEstimate spacing;
  /// Absent when no radius can be derived and the user has to give one; `radius_problem` says why.
  std::optional<RadiusChoice> radius;
  double least_radius = 0, greatest_radius = 0;
  std::string radius_problem;
  std::optional<CloudInfo> cloud;  ///< of a scan; then there are no rest spacing and no radius
  std::vector<std::string> notes;
};

/// `given_radius` is the user's, if any; a bad one throws Error.
ParticleInfo describe_particles(const ParticleSet& particles, const std::string& file,
                                std::optional<double> given_radius);

/// The same of a scan: makes its splats. Throws Error as make_splats() does.
ParticleInfo describe_cloud(const ParticleSet& particles, const std::string& file, const CloudVerdict& verdict,
                            const SplatOptions& options);

/// What `splats` are and were made by; the arguments as those of make_splats().
CloudInfo describe_splats(const SplatCloud& splats, const CloudVerdict& verdict, const SplatOptions& options);
/// Several lines for people, each ending with a line feed.
std::string to_text(const CloudInfo& cloud);

/// Several lines for people, ending with a line feed.
std::string to_text(const ParticleInfo& info);
/// A JSON object; lengths in metres, null where there is no value.
std::string to_json(const ParticleInfo& info);

}  // namespace embrun
