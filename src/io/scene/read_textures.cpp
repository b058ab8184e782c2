#include <fmt/format.h>

#include <algorithm>

#include "io/image_read.h"
#include "io/scene/reading.h"
#include "io/text.h"

namespace embrun {
namespace {

/// The checkerboard of the world's coordinates: Embrun's own.
TextureDescription read_world_checker(SceneObject& texture) {
  TextureDescription result;
  result.kind = TextureKind::checker;
  result.first = texture.color("color0").value_or(grey(0.4f));
  result.second = texture.color("color1").value_or(grey(0.2f));
  result.cell = texture.number("cell", 1);
  result.origin = texture.vector("origin").value_or(Vec3d{});
  result.axis_u = texture.integer("axis_u", 0, 2).value_or(0);
  result.axis_v = texture.integer("axis_v", 0, 2).value_or(2);
  return result;
}

void read_to_uv(SceneObject& texture, TextureDescription& result) {
  const Placement m = texture.placement("to_uv");
  result.to_uv = {m.x_axis.x, m.y_axis.x, m.origin.x, m.x_axis.y, m.y_axis.y, m.origin.y};
}

/// The index of a picture, read once however many textures show it.
int picture_of(SceneReading& reading, SceneObject& texture, const std::string& path, bool raw) {
  std::vector<PictureDescription>& pictures = reading.result.scene.pictures;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    if (pictures[i].file == path && pictures[i].raw == raw) return static_cast<int>(i);
  PictureDescription picture;
  picture.file = path;
  picture.raw = raw;
  const std::vector<std::byte> bytes = reading.read_bytes(path);
  picture.image = read_image(bytes, path, {}, raw ? PixelEncoding::raw : PixelEncoding::srgb);
  const EnvironmentRepair repair = clean_environment(picture.image);
  if (repair.not_finite + repair.negative > 0)
    texture.warn(fmt::format("{} pixels are not finite and {} negative; their channels count as 0", repair.not_finite,
                             repair.negative));
  pictures.push_back(std::move(picture));
  return static_cast<int>(pictures.size() - 1);
}

TextureDescription read_bitmap(SceneReading& reading, SceneObject& texture) {
  TextureDescription result;
  result.kind = TextureKind::bitmap;
  const std::optional<std::string> name = texture.text("filename");
  if (!name) texture.fail("'filename' is missing");
  const std::string filter = texture.text("filter_type").value_or("bilinear");
  const std::string wrap = texture.text("wrap_mode").value_or("repeat");
  if (filter != "bilinear" && filter != "nearest")
    texture.fail(fmt::format("'filter_type' is {}: there are bilinear, nearest", embrun::quoted(filter)));
  if (wrap != "repeat" && wrap != "mirror" && wrap != "clamp")
    texture.fail(fmt::format("'wrap_mode' is {}: there are repeat, mirror, clamp", embrun::quoted(wrap)));
  result.filter = filter == "nearest" ? TextureFilter::nearest : TextureFilter::bilinear;
  result.wrap = wrap == "mirror" ? TextureWrap::mirror : wrap == "clamp" ? TextureWrap::clamp : TextureWrap::repeat;
  const bool raw = texture.flag("raw").value_or(false);
  result.picture = picture_of(reading, texture, reading.path_of(texture, *name), raw);
  read_to_uv(texture, result);
  texture.ignore("format", "pictures are kept in single precision");
  return result;
}

}  // namespace

TextureDescription read_texture(SceneReading& reading, SceneObject& bsdf, std::string_view name, Rgb fallback) {
  if (!bsdf.has(name)) return constant_texture_description(fallback);
  const XmlElement& property = reading.resolve(*bsdf.property(name));
  if (property.tag != "texture") return constant_texture_description(bsdf.color(name).value_or(fallback));
  SceneObject texture = reading.object(property);
  TextureDescription result;
  if (texture.type() == "bitmap") {
    result = read_bitmap(reading, texture);
  } else if (texture.type() == "checkerboard") {
    result.kind = TextureKind::uv_checker;
    result.first = texture.color("color0").value_or(grey(0.4f));
    result.second = texture.color("color1").value_or(grey(0.2f));
    read_to_uv(texture, result);
  } else if (texture.type() == "world_checkerboard") {
    result = read_world_checker(texture);
  } else if (texture.type() == "mesh_attribute") {
    const std::string attribute = texture.text("name").value_or("vertex_color");
    if (attribute != "vertex_color") texture.fail("of attributes there is 'vertex_color' alone, of point clouds");
    result.kind = TextureKind::own;
  } else {
    texture.fail(
        "this texture is not supported: there are bitmap, checkerboard, mesh_attribute, and Embrun's "
        "world_checkerboard");
  }
  texture.finish();
  return result;
}

}  // namespace embrun
