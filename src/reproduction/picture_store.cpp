#include "reproduction/picture_store.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "base/error.h"
#include "io/file_bytes.h"
#include "io/image_read.h"
#include "io/image_write.h"

namespace embrun {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const PictureResult& r) {
  return {{"name", r.name},
          {"flags", r.flags},
          {"width", r.width},
          {"height", r.height},
          {"samples", r.samples},
          {"threads", r.threads},
          {"build_seconds", r.build_seconds},
          {"render_seconds", r.render_seconds},
          {"surface_bytes", r.surface_bytes},
          {"triangles", r.triangles},
          {"grid_cells", r.grid_cells},
          {"contradictions", r.contradictions},
          {"bad_samples", r.bad_samples},
          {"instruction_set", r.instruction_set},
          {"particles", r.particles},
          {"radius", r.radius},
          {"spacing", r.spacing},
          {"threshold", r.threshold}};
}

PictureResult from_json(const Json& j) {
  PictureResult r;
  j.at("name").get_to(r.name);
  j.at("flags").get_to(r.flags);
  j.at("width").get_to(r.width);
  j.at("height").get_to(r.height);
  j.at("samples").get_to(r.samples);
  j.at("threads").get_to(r.threads);
  j.at("build_seconds").get_to(r.build_seconds);
  j.at("render_seconds").get_to(r.render_seconds);
  j.at("surface_bytes").get_to(r.surface_bytes);
  j.at("triangles").get_to(r.triangles);
  j.at("grid_cells").get_to(r.grid_cells);
  j.at("contradictions").get_to(r.contradictions);
  j.at("bad_samples").get_to(r.bad_samples);
  j.at("instruction_set").get_to(r.instruction_set);
  j.at("particles").get_to(r.particles);
  j.at("radius").get_to(r.radius);
  j.at("spacing").get_to(r.spacing);
  j.at("threshold").get_to(r.threshold);
  return r;
}

/// What an earlier run has written down, if it was the same picture.
std::optional<PictureResult> read_record(const std::filesystem::path& path, const std::string& signature) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return std::nullopt;
  try {
    const std::vector<std::byte> bytes = read_file_bytes(path.string());
    const auto* text = reinterpret_cast<const char*>(bytes.data());
    const Json json = Json::parse(text, text + bytes.size());
    if (json.at("signature") != signature) return std::nullopt;
    return from_json(json.at("picture"));
  } catch (const std::exception&) {  // it is not ours, or damaged: made again
    return std::nullopt;
  }
}

Image beauty_of(const Picture& picture) {
  for (const Layer& layer : picture.layers) {
    if (layer.name != "beauty") continue;
    Image image = make_image(picture.width, picture.height, layer.channels);
    image.pixels = layer.values;
    return image;
  }
  throw Error("a picture without a beauty layer");
}

Image mean_of(const Image& a, const Image& b) {
  Image mean = a;
  for (std::size_t i = 0; i < mean.pixels.size(); ++i) mean.pixels[i] = 0.5f * (a.pixels[i] + b.pixels[i]);
  return mean;
}

/// What is of both halves together.
void add_half(PictureResult& r, const RenderReport& report, int half) {
  r.width = report.width;
  r.height = report.height;
  r.samples += report.samples;
  r.threads = report.threads;
  if (half == 1 || report.build_cpu_seconds < r.build_seconds) r.build_seconds = report.build_cpu_seconds;
  r.render_seconds += report.render_cpu_seconds;
  r.surface_bytes = report.surface_bytes;
  r.triangles = report.mesh_triangles;
  r.grid_cells = report.grid_cells;
  r.contradictions += report.medium_contradictions;
  r.bad_samples += report.bad_samples;
  r.instruction_set = report.instruction_set;
  r.particles = report.particles;
  r.radius = report.radius;
  r.spacing = report.spacing;
  r.threshold = report.threshold;
}

}  // namespace

std::filesystem::path PictureStore::mean_file(const std::string& name) const {
  return std::filesystem::path(options_.folder) / "renders" / (name + ".exr");
}
std::filesystem::path PictureStore::half_file(const std::string& name, int half) const {
  return std::filesystem::path(options_.folder) / "renders" / fmt::format("{}-{}.exr", name, half);
}
std::filesystem::path PictureStore::record_file(const std::string& name) const {
  return std::filesystem::path(options_.folder) / "renders" / (name + ".json");
}

Image PictureStore::read(const std::string& name) const { return read_image(mean_file(name)); }

std::string PictureStore::signature(const PictureSpec& spec) const {
  std::error_code none;
  return fmt::format("{} {} ({} bytes) {} --spp {} --seed {} --threads {}", version(), spec.particles,
                     std::filesystem::file_size(spec.particles, none), flags_of(spec.options), spec.samples,
                     options_.seed, spec.options.threads);
}

PictureResult PictureStore::make(const PictureSpec& spec) {
  // Seeds go with the picture, so that they are the same whether those before it were kept or rendered; no two pictures
  // share one, so that the noise of the two is independent.
  const std::uint32_t first_seed = options_.seed + 2 * next_seed_++;
  const std::string wanted = signature(spec);
  if (const auto record = read_record(record_file(spec.name), wanted)) {
    std::error_code none;
    const auto there = [&](const std::filesystem::path& path) { return std::filesystem::is_regular_file(path, none); };
    if (there(mean_file(spec.name)) && there(half_file(spec.name, 1)) && there(half_file(spec.name, 2))) {
      ++kept_;
      return *record;
    }
  }
  PictureResult result;
  result.name = spec.name;
  result.flags = flags_of(spec.options);
  Image halves[2];
  for (const int half : {1, 2}) {
    if (hooks_.render.cancel != nullptr && hooks_.render.cancel->load()) throw Interrupted{};
    RenderOptions options = spec.options;
    options.samples = spec.samples / 2;
    options.seed = first_seed + static_cast<std::uint32_t>(half - 1);
    Renderer renderer(spec.particles, options, hooks_.render);
    if (!renderer.add_samples(options.samples, hooks_.render)) throw Interrupted{};
    add_half(result, renderer.report(), half);
    Image& image = halves[half - 1];
    image = beauty_of(renderer.picture());
    write_image(half_file(spec.name, half), image, {},
                {{"software", fmt::format("Embrun {}", version())},
                 {"flags", result.flags},
                 {"seed", std::to_string(options.seed)},
                 {"samples", std::to_string(options.samples)}});
  }
  write_image(mean_file(spec.name), mean_of(halves[0], halves[1]), {},
              {{"software", fmt::format("Embrun {}", version())},
               {"flags", result.flags},
               {"samples", std::to_string(result.samples)}});
  write_text_file(record_file(spec.name).string(),
                  Json{{"signature", wanted}, {"picture", to_json(result)}}.dump(2) + "\n");
  ++rendered_;
  return result;
}

}  // namespace embrun
