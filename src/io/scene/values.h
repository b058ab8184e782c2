#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "io/scene/xml_tree.h"
#include "math/rgb.h"
#include "scene/placement.h"

namespace embrun {

// The values of a scene file's elements. Each function throws a located Error for what is not such a value; numbers
// have to be finite.

/// A number of an attribute of the element.
double parse_number(const XmlTree& tree, const XmlElement& element, std::string_view attribute, std::string_view text);
/// Numbers separated by commas, blanks or both.
std::vector<double> parse_numbers(const XmlTree& tree, const XmlElement& element, std::string_view attribute,
                                  std::string_view text);

/// <point> and <vector>: x, y, z (0 where one is missing), or value="x, y, z".
Vec3d read_vector(const XmlTree& tree, const XmlElement& element);
/// <transform>: its steps, the first one applied first.
Placement read_transform(const XmlTree& tree, const XmlElement& element);
/// The eye, target and up of a <transform> that is one <lookat>, or such a one after <scale x="-1"/>, which mirrors the
/// picture; nothing for all others.
struct LookAt {
  Vec3d origin, target, up;
  bool mirrored = false;
};
std::optional<LookAt> read_look_at(const XmlTree& tree, const XmlElement& transform);

/// <rgb>: one number or three, or #rrggbb in sRGB.
Rgb read_rgb(const XmlTree& tree, const XmlElement& element);
/// <spectrum>: one number for all wavelengths, or "wavelength:value, ..." in nanometres: of light as it is, else as
/// seen in daylight, so that a white that reflects everything is 1,1,1.
Rgb read_spectrum(const XmlTree& tree, const XmlElement& element, bool of_light);

/// The names of Mitsuba's older files in today's form: toWorld is to_world, intIOR is int_ior.
std::string snake_case(std::string_view name);

}  // namespace embrun
