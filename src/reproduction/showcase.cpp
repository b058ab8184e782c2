#include "reproduction/showcase.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <random>

#include "io/read_particles.h"
#include "particles/radius.h"

namespace embrun {
namespace {

/// Picks particles of a fluid and writes those that replace them.
class Picker {
 public:
  Picker(const std::string& file, double radius, std::string folder, std::string name)
      : sized_(size_particles(read_particles(file), radius, file)), folder_(std::move(folder)), name_(std::move(name)) {
    for (const Vec3d& p : sized_.particles.positions) heights_.push_back(p.y);
    std::sort(heights_.begin(), heights_.end());
  }

  /// Grains at the particles of the lowest layers, a handful for each.
  std::string sand() {
    const double top = height(0.001) + 3.5 * radius();
    return write(
        "sand", [&](const Vec3d& p) { return p.y < top ? 6 : 0; }, 0.2, 0.4, 0.9);
  }
  /// Bubbles here and there, below the surface.
  std::string bubbles() {
    const double top = height(0.85);
    return write(
        "bubbles", [&](const Vec3d& p) { return p.y < top && uniform(0, 1) < 0.04 ? 1 : 0; }, 0.1, 0.4, 0.5);
  }
  /// Rafts on what is above that share of the particles.
  std::string foam(double share) {
    const double bottom = height(share);
    return write(
        "foam",
        [&](const Vec3d& p) {
          const bool raft = std::sin(3 / scale() * p.x + 0.5) + std::sin(4 / scale() * p.z + 0.3) > 0.6;
          return p.y > bottom && raft ? 6 : 0;
        },
        0.2, 0.4, 0.9);
  }

 private:
  double radius() const { return sized_.radius.radius; }
  double height(double q) const {
    return heights_[static_cast<std::size_t>(q * static_cast<double>(heights_.size() - 1))];
  }
  double scale() const { return 40 * radius(); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  /// For each particle as many as `count` says, about where it is: radii from `least` to `most`, places within `spread`,
  /// all in radii of the fluid's.
  std::string write(const std::string& kind, const std::function<int(const Vec3d&)>& count, double least, double most,
                    double spread) {
    random_.seed(1);
    std::string text = "x,y,z,radius\n";
    for (const Vec3d& p : sized_.particles.positions) {
      for (int n = count(p); n > 0; --n) {
        const double reach = spread * radius();
        text += fmt::format("{:.5f},{:.5f},{:.5f},{:.5f}\n", p.x + uniform(-reach, reach), p.y + uniform(-reach, reach),
                            p.z + uniform(-reach, reach), radius() * uniform(least, most));
      }
    }
    const std::string path = (std::filesystem::path(folder_) / fmt::format("{}-{}.csv", name_, kind)).string();
    write_text_file(path, text);
    return path;
  }

  SizedParticles sized_;
  std::vector<double> heights_;
  std::mt19937 random_;
  std::string folder_, name_;
};

/// The pictures of one figure, as far as there are particles for them.
class Showcase {
 public:
  Showcase(const ReproduceOptions& options, const std::string& picked, std::vector<std::string>& notes)
      : options_(options), picked_(picked), notes_(notes) {}

  void calm_pool() {
    const auto water = find("calm_pool", "figures 67a and 67c");
    if (!water) return;
    Picker pick(*water, options_.radius, picked_, "calm");
    RenderOptions foam = view({3.6, 2.2, 3.4}, {0.2, 0.55, 0});
    foam.foam = {pick.foam(0.97)};
    add("figure67a", "foam on a calm pool", *water, foam);
    RenderOptions sand = view({0.9, 1.15, 4.6}, {0.25, 0.38, 0});
    sand.bubbles = {pick.bubbles()};
    sand.sand = {pick.sand()};
    add("figure67c", "bubbles and sand in a calm pool", *water, sand);
  }

  void dam_break(const std::string& water) {
    const RenderOptions turbulent = view({6.4, 3.2, 2.2}, {0.3, 0.9, -0.3});
    if (const auto foam = find("dam_break_foam", "figure 67b")) {
      RenderOptions o = turbulent;
      o.foam = {*foam};
      add("figure67b", "foam on turbulent water", water, o);
    }
    if (const auto bubbles = find("dam_break_bubbles", "figure 67d")) {
      Picker pick(water, options_.radius, picked_, "turbulent");
      RenderOptions o = turbulent;
      o.bubbles = {*bubbles};
      o.sand = {pick.sand()};
      add("figure67d", "bubbles and sand in turbulent water", water, o);
    }
  }

  void two_fluids() {
    const auto heavy = find("two_fluids_heavy", "figure 68"), light = find("two_fluids_light", "figure 68");
    if (!heavy || !light) return;
    Picker pick(*heavy, options_.radius, picked_, "fluids");
    const RenderOptions plain = view({3.6, 3.0, 5.4}, {0, 0.75, 0});
    RenderOptions clear = plain;
    clear.fluids.push_back({*light, {}, {}, {}, {}, 0});
    add("figure68a", "continuous particles, clear", *heavy, clear);
    RenderOptions colours = plain;
    colours.extinction = Color{25, 25, 25};
    colours.albedo = {0.9f, 0.12f, 0.08f};
    colours.density_radius = 0.04;
    colours.fluids.push_back({*light, {}, {}, Color{25, 25, 25}, Color{0.08f, 0.2f, 0.9f}, 0});
    add("figure68b", "a red and a blue fluid", *heavy, colours);
    RenderOptions sand = clear;
    sand.bubbles = {pick.bubbles()};
    sand.sand = {pick.sand()};
    add("figure68c", "bubbles and sand", *heavy, sand);
    RenderOptions foam = clear;
    foam.foam = {pick.foam(0.8)};
    add("figure68d", "foam", *heavy, foam);
  }

  std::vector<PictureSpec> pictures;

 private:
  std::optional<std::string> find(const std::string& name, const std::string& what) {
    auto file = find_particles(options_.data, name);
    if (!file) notes_.push_back(fmt::format("Left out: {}, for {} has no {}.", what, options_.data, name));
    return file;
  }

  RenderOptions view(Point from, Point to) const {
    RenderOptions o = picture_of({}, Way::direct, "", options_).options;
    o.camera_from = from;
    o.camera_to = to;
    o.fov = 32;
    o.max_depth = 32;  // white foam under eight bounces is grey
    return o;
  }

  void add(const std::string& name, const std::string& what, const std::string& water, const RenderOptions& options) {
    pictures.push_back({name, "figure " + name.substr(6) + ", " + what, water, options, scale_of(options_).samples});
  }

  const ReproduceOptions& options_;
  const std::string& picked_;
  std::vector<std::string>& notes_;
};

}  // namespace

std::vector<PictureSpec> showcase_pictures(const ReproduceOptions& options, const std::string& picked,
                                           std::vector<std::string>& notes) {
  Showcase showcase(options, picked, notes);
  showcase.calm_pool();
  if (const auto water = find_particles(options.data, "dam_break")) showcase.dam_break(*water);
  showcase.two_fluids();
  std::sort(showcase.pictures.begin(), showcase.pictures.end(),
            [](const PictureSpec& a, const PictureSpec& b) { return a.name < b.name; });
  return std::move(showcase.pictures);
}

}  // namespace embrun
