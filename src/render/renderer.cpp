#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <span>
#include <sstream>

#include "base/error.h"
#include "embrun/embrun.h"
#include "image/denoise.h"
#include "io/atomic_file.h"
#include "io/image_write.h"
#include "io/particle_info.h"
#include "io/read_particles.h"
#include "io/read_scene.h"
#include "io/splat_file.h"
#include "render/cloud_options.h"
#include "render/cloud_scene.h"
#include "render/default_scene.h"
#include "render/fluid_meshes.h"
#include "render/kind_options.h"
#include "render/option_names.h"
#include "render/render_loop.h"
#include "render/stopwatch.h"
#include "scene/kind_scene.h"

#ifndef EMBRUN_VERSION
#define EMBRUN_VERSION "unknown"
#endif

namespace embrun {
namespace {

/// A number as a flag: exact, and as short as that allows. (v + 0 has no sign when it is 0.)
std::string number(double v) {
  const std::string short_form = fmt::format("{:.12g}", v + 0.0);
  return std::strtod(short_form.c_str(), nullptr) == v ? short_form : fmt::format("{}", v);
}
std::string triple(Vec3d v) { return number(v.x) + "," + number(v.y) + "," + number(v.z); }

RayReport ray_report(const RayCounter& c) {
  return {c.rays, c.timed_ns > 0 ? 1e9 * static_cast<double>(c.timed_rays) / static_cast<double>(c.timed_ns) : 0};
}

ParticleSet to_set(const Particles& particles) {
  if (particles.positions.empty()) throw Error("particles: there are none");
  if (!particles.radii.empty() && particles.radii.size() != particles.positions.size())
    throw Error(
        fmt::format("particles: {} radii for {} positions", particles.radii.size(), particles.positions.size()));
  ParticleSet set;
  set.format = "memory";
  for (std::size_t i = 0; i < particles.positions.size(); ++i) {
    const Point& p = particles.positions[i];
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      throw Error(fmt::format("particles: the position of particle {} is not finite", i));
    set.positions.push_back({p[0], p[1], p[2]});
  }
  if (!particles.radii.empty()) {
    Attribute radius;
    radius.name = "radius";
    radius.floats = particles.radii;
    set.attributes.push_back(std::move(radius));
  }
  return set;
}

/// The scene of a file, with what is to be different.
SceneFile read_scene(const SceneInput& input) {
  std::vector<SceneParameter> parameters;
  for (const auto& [name, value] : input.parameters) parameters.push_back({name, value});
  SceneFile file = read_scene(input.file, parameters);
  SceneDescription& scene = file.scene;
  if (input.size) {
    scene.film.width = (*input.size)[0];
    scene.film.height = (*input.size)[1];
    scene.film.crop.reset();
  }
  if (input.crop) {
    const auto& c = *input.crop;
    scene.film.crop = PixelWindow{c[0], c[1], c[2], c[3]};
  }
  scene.integrator.samples = input.samples.value_or(scene.integrator.samples);
  set_integrator(scene.integrator, input.integrator, input.occlusion_distance, input.gauss_nodes);
  scene.integrator.max_depth = input.max_depth.value_or(scene.integrator.max_depth);
  scene.integrator.max_refractions = input.refractions.value_or(scene.integrator.max_refractions);
  if (input.boundary_nee)
    scene.integrator.straight_shadows = straight_shadows_from_name(*input.boundary_nee, scene.integrator.kind);
  scene.integrator.clamp = input.clamp.value_or(scene.integrator.clamp);
  scene.integrator.seed = input.seed.value_or(scene.integrator.seed);
  if (input.filter) scene.camera.filter = filter_from_name(*input.filter);
  for (SplatsDescription& splats : scene.splats) splats.detail = input.lod.value_or(splats.detail);
  for (FluidDescription& fluid : scene.fluids) {
    fluid.detail = input.lod.value_or(fluid.detail);
    if (input.representation && representation_from_name(*input.representation) == Representation::mesh)
      fluid.method = SurfaceMethod::mesh;
    else if (input.representation && fluid.method == SurfaceMethod::mesh)
      fluid.method = SurfaceMethod::fast;
    if (fluid.method != SurfaceMethod::mesh) continue;
    fluid.mesh_cell = input.mesh_cell.value_or(fluid.mesh_cell);
    fluid.density_cell = input.density_cell.value_or(fluid.density_cell);
  }
  return file;
}

ImageWriteOptions write_options(const RenderOptions& options) {
  ImageWriteOptions write;
  write.layer = options.layer;
  write.tone.exposure = static_cast<float>(options.exposure);
  write.tone.curve = tone_curve_from_name(options.tone);
  return write;
}

}  // namespace

const char* version() { return EMBRUN_VERSION; }

void check_options(const RenderOptions& o) {
  kernel_from_name(o.kernel);
  threshold_from_text(o.threshold);
  recover_from_name(o.recover);
  normal_from_name(o.normal);
  method_from_names(o.method, o.representation);
  if (o.mesh_cell && !(*o.mesh_cell > 0 && std::isfinite(*o.mesh_cell)))
    throw Error(fmt::format("mesh cell {}: it must be positive", *o.mesh_cell));
  if (o.density_cell && !(*o.density_cell > 0 && std::isfinite(*o.density_cell)))
    throw Error(fmt::format("density cell {}: it must be positive", *o.density_cell));
  up_from_name(o.up);
  floor_from_name(o.floor);
  filter_from_name(o.filter);
  parse_view(o.view);
  tone_curve_from_name(o.tone);
  splat_options(o.cloud);
  if (o.lod && !(*o.lod >= 0 && std::isfinite(*o.lod)))
    throw Error(fmt::format("level of detail {}: it is a number of pixels, 0 (off) or greater", *o.lod));
  if (o.lod.value_or(0) > 0 && method_from_names(o.method, o.representation) != SurfaceMethod::fast)
    throw Error("levels of detail are of surfaces that are found directly, by the method fast");
  surface_from_name(o.cloud.points);
  check_cloud_surface(o);
  straight_shadows_from_name(o.boundary_nee, integrator_from_name(o.integrator));
  check_layer_name(o.layer);
  if (o.radius && !(*o.radius > 0 && std::isfinite(*o.radius)))
    throw Error(fmt::format("radius {}: it must be positive", *o.radius));
  if (o.density_radius && !(*o.density_radius > 0 && std::isfinite(*o.density_radius)))
    throw Error(fmt::format("density radius {}: it must be positive", *o.density_radius));
  if (o.first_sample < 0) throw Error(fmt::format("first sample {}: it must not be negative", o.first_sample));
  if (o.threads < 0) throw Error(fmt::format("{} threads: give 1 or more, or 0 for all", o.threads));
  if (o.fov && !(*o.fov > 0 && *o.fov < 180))
    throw Error(fmt::format("field of view {}: it must lie between 0 and 180 degrees", *o.fov));
  if (o.floor_height && !std::isfinite(*o.floor_height)) throw Error("the floor's height is not finite");
  if (!(std::abs(o.exposure) <= 100))
    throw Error(fmt::format("exposure {}: it must lie within -100 and 100 stops", o.exposure));
  if (o.sun && !(*o.sun >= 0 && *o.sun <= 90))
    throw Error(fmt::format("sun of {} degrees: give up to 90, or 0 for none", *o.sun));
  if (o.sun && o.environment != "sky")
    throw Error(fmt::format("a sun in environment \"{}\": only the sky has one", o.environment));
  if (o.camera_to && !o.camera_from) throw Error("a camera target without a place: give where the camera is, too");
  if (o.extinction && is_opaque({(*o.extinction)[0], (*o.extinction)[1], (*o.extinction)[2]}) && !o.color_by.empty())
    throw Error("infinite extinction: what is opaque has one albedo, which an attribute cannot colour");
  // Everything else is checked as part of a scene: here, of one with a particle.
  MeasuredParticles one;
  one.particles.positions = {{0, 0, 0}};
  one.radius.radius = o.radius.value_or(1);
  check_kind_options(o);
  RenderOptions plain = without_files(o);
  std::vector<std::string> notes;
  validate(make_scene(one, plain, notes));
}

void check_output(const std::string& path, const RenderOptions& options) {
  check_image_output(path);
  check_layer_name(options.layer);
}

struct Renderer::State {
  RenderOptions options;
  RenderReport report;
  FlatScene scene;
  std::unique_ptr<CpuBackend> backend;
  Film film;
  RenderCounts counts;
  std::uint32_t next_sample = 0;

  void read_file(const std::string& path, const RenderHooks& hooks);
  void read_scene_file(const SceneInput& input, const RenderHooks& hooks);
  void build(ParticleSet particles, const std::string& name, const RenderHooks& hooks);
  void build_scan(ParticleSet particles, const CloudVerdict& verdict, const std::string& name,
                  const RenderHooks& hooks);
  void build_splats(const std::string& path, const RenderHooks& hooks);
  void start(const SceneDescription& description, const RenderHooks& hooks);
  void record_levels();
  void built(const Stopwatch& watch, const RenderHooks& hooks);
  void record_surface();
  void record_view(const SceneDescription& description);
  void record_choices(const MeasuredParticles& measured, const SceneDescription& description);
  std::string replay_command(const PixelSample& sample) const;
  ImageMetadata metadata() const;
  ImageLayers layers() const;
};

void Renderer::State::read_file(const std::string& path, const RenderHooks& hooks) {
  check_options(options);
  if (is_splat_file(path)) {
    build_splats(path, hooks);
    return;
  }
  const Stopwatch watch;
  tell(hooks, "reading", 0, 0);
  ParticleSet particles = read_particles(path);
  report.read_seconds = watch.seconds();
  tell(hooks, "reading", 1, report.read_seconds);
  if (const CloudVerdict verdict = cloud_verdict(particles, options.cloud); verdict.is_surface) {
    build_scan(std::move(particles), verdict, path, hooks);
  } else {
    check_fluid_options(options, path);
    build(std::move(particles), path, hooks);
  }
}

void Renderer::State::read_scene_file(const SceneInput& input, const RenderHooks& hooks) {
  check_options(options);
  const Stopwatch watch;
  tell(hooks, "reading", 0, 0);
  SceneFile file = read_scene(input);
  report.read_seconds = watch.seconds();
  tell(hooks, "reading", 1, report.read_seconds);

  const Stopwatch building;
  tell(hooks, "building", 0, 0);
  report.input = input.file;
  report.format = "scene";
  report.notes = std::move(file.warnings);
  start(file.scene, hooks);
  for (const FluidDescription& fluid : file.scene.fluids) report.particles += fluid.positions.size();
  if (!file.scene.fluids.empty()) {
    report.radius = static_cast<double>(file.scene.fluids.front().surface.radius);
    report.radius_source = "scene";
    report.spacing = file.scene.fluids.front().surface.spacing;
  }
  built(building, hooks);
}

/// Building has taken what `watch` says.
void Renderer::State::built(const Stopwatch& watch, const RenderHooks& hooks) {
  report.build_seconds = watch.seconds();
  report.build_cpu_seconds = watch.cpu_seconds();
  tell(hooks, "building", 1, report.build_seconds);
}

/// Compiles the scene and gets ready to render it.
void Renderer::State::start(const SceneDescription& description, const RenderHooks& hooks) {
  const Stopwatch watch;
  FluidMeshCounts meshes;
  const MeshProgress progress = [&](double fraction) { tell(hooks, "meshing", fraction, watch.seconds()); };
  run_on_threads(options.threads, [&] {
    scene = compile_meshing(description, &meshes, progress);
    backend = std::make_unique<CpuBackend>(scene);
  });
  report.mesh_seconds = meshes.seconds;
  report.grid_seconds = meshes.grid_seconds;
  report.grid_cells = meshes.grid_cells;
  report.mesh_vertices = meshes.vertices;
  report.mesh_triangles = meshes.triangles;
  report.threshold = static_cast<double>(meshes.threshold);
  report.influence_radius = static_cast<double>(meshes.influence_radius);
  report.recovered = meshes.recovered;
  report.tree_seconds = backend->tree_seconds();
  film = make_film(description.film);
  next_sample = static_cast<std::uint32_t>(options.first_sample);
  report.version = version();
  report.instruction_set = backend->kernels().name;
  report.threads = thread_count(options.threads);
  report.width = film.window.width;
  report.height = film.window.height;
  report.seed = description.integrator.seed;
  report.planned_samples = description.integrator.samples;
  if (const std::size_t nodes = scene.hemisphere_nodes.size();
      nodes > 0 && static_cast<std::size_t>(description.integrator.samples) % nodes != 0)
    report.notes.push_back(
        fmt::format("{} samples a pixel are no multiple of the {} nodes of Gauss's rule: by themselves they are a "
                    "part of a picture, whose mean is not that of the hemisphere",
                    description.integrator.samples, nodes));
  const CameraSettings& camera = description.camera;
  report.camera_from = {camera.eye.x, camera.eye.y, camera.eye.z};
  report.camera_to = {camera.target.x, camera.target.y, camera.target.z};
  report.fov = camera.vertical_fov;
  record_surface();
}

/// The first fluid's surface, unless that is a mesh.
void Renderer::State::record_surface() {
  RenderReport& r = report;
  if (!scene.surfaces.empty()) {
    const ImplicitSurfaceStats& stats = scene.surfaces.front().stats();
    r.threshold = static_cast<double>(stats.threshold);
    r.influence_radius = static_cast<double>(stats.influence_radius);
    r.recovered = stats.recovered_particles;
    r.surface_bytes = static_cast<double>(stats.bytes);
  } else if (!scene.coarse_owners.empty()) {
    const CoarseSurface& coarse = scene.coarse_owners.front();
    r.threshold = static_cast<double>(coarse.threshold);
    r.influence_radius = static_cast<double>(coarse.influence_radius);
    r.recovered = coarse.spray_particles;
  } else if (!scene.thesis_surfaces.empty()) {
    const ThesisSurface& surface = *scene.thesis_surfaces.front();
    r.threshold = static_cast<double>(surface.model().threshold);
    r.influence_radius = static_cast<double>(surface.model().influence_radius);
    r.recovered = surface.model().recovered.size();
    r.surface_bytes = static_cast<double>(surface.bytes());
  }
  record_levels();
}

/// Which levels of detail the fluids have.
void Renderer::State::record_levels() {
  for (std::size_t i = 0; i < scene.fluids.size(); ++i) {
    const FluidLevels& levels = scene.fluids[i].levels;
    if (levels.footprints == 0) continue;
    std::string what;
    for (int level = levels.finest; level <= levels.coarsest; ++level)
      what += (what.empty() ? "" : ", ") +
              (level == 0 ? std::string("the particles' own")
                          : fmt::format("cells of {:.3g} m", std::ldexp(static_cast<double>(levels.spacing), level)));
    report.notes.push_back(
        fmt::format("levels of detail{}: {}", scene.fluids.size() > 1 ? fmt::format(" of fluid {}", i + 1) : "", what));
  }
  for (const CoarseSurface& coarse : scene.coarse_owners) report.surface_bytes += static_cast<double>(coarse.bytes());
}

void Renderer::State::build(ParticleSet particles, const std::string& name, const RenderHooks& hooks) {
  const Stopwatch watch;
  tell(hooks, "building", 0, 0);
  report.input = name;
  report.format = particles.format;
  report.dropped = particles.dropped_non_finite;
  const std::size_t read = particles.size();
  const MeasuredParticles measured = measure(std::move(particles), options, name);
  report.dropped += read - measured.particles.size();
  report.notes = measured.particles.notes;
  if (measured.particles.dropped_non_finite > 0)
    report.notes.push_back(fmt::format("{}: {} particles with a coordinate that is not finite were left out", name,
                                       measured.particles.dropped_non_finite));

  SceneDescription description = make_scene(measured, options, report.notes);
  start(description, hooks);
  record_choices(measured, description);
  built(watch, hooks);
}

void Renderer::State::build_scan(ParticleSet particles, const CloudVerdict& verdict, const std::string& name,
                                 const RenderHooks& hooks) {
  const Stopwatch watch;
  tell(hooks, "building", 0, 0);
  check_scan_options(options, name);
  report.input = name;
  report.format = particles.format;
  report.dropped = particles.dropped_non_finite;
  report.notes = particles.notes;
  const SplatOptions splats = splat_options(options.cloud);
  SplatCloud cloud;
  run_on_threads(options.threads, [&] { cloud = make_splats(std::move(particles), splats, name); });
  report.dropped += cloud.report.points_in - cloud.size();
  report.particles = cloud.size();
  report.radius = cloud.report.median_radius;
  report.radius_source = to_string(cloud.report.radius);
  report.spacing = cloud.report.shape.spacing;
  std::istringstream lines(to_text(describe_splats(cloud, verdict, splats)));
  for (std::string line; std::getline(lines, line);) report.scan.push_back(line);
  const SceneDescription description = make_cloud_scene(cloud, options, name, report.notes);
  start(description, hooks);
  record_view(description);
  built(watch, hooks);
}

/// A file of splats, which is mapped.
void Renderer::State::build_splats(const std::string& path, const RenderHooks& hooks) {
  const Stopwatch watch;
  tell(hooks, "building", 0, 0);
  check_scan_options(options, path);
  const std::shared_ptr<const SplatHierarchy> splats = open_splat_file(path);
  report.input = path;
  report.format = "splats";
  report.particles = splats->splat_count;
  report.radius = static_cast<double>(splats->median_radius);
  report.radius_source = "file";
  report.scan.push_back(describe_splat_file(*splats));
  const SceneDescription description = make_splat_file_scene(splats, options, path, report.notes);
  start(description, hooks);
  record_view(description);
  built(watch, hooks);
}

/// Camera and floor, and the flags that pin them.
void Renderer::State::record_view(const SceneDescription& description) {
  RenderReport& r = report;
  const CameraSettings& camera = description.camera;
  r.pinning_flags = fmt::format("--camera-from {} --camera-to {} --fov {}", triple(camera.eye), triple(camera.target),
                                number(camera.vertical_fov));
  if (!description.patches.empty()) {
    const Vec3d up = to_double(up_basis(description.up).up);
    r.floor_height = dot(description.patches.front().center, up);
    r.pinning_flags += " --floor-height " + number(*r.floor_height);
  }
}

void Renderer::State::record_choices(const MeasuredParticles& measured, const SceneDescription& description) {
  RenderReport& r = report;
  r.particles = measured.particles.size();
  r.radius = measured.radius.radius;
  r.radius_source = to_string(measured.radius.source);
  r.spacing = measured.spacing.spacing;
  record_view(description);
  if (measured.radius.radii.empty()) r.pinning_flags += " --radius " + number(r.radius);
  r.pinning_flags += fmt::format(" --threshold {}", static_cast<float>(r.threshold));
}

std::string Renderer::State::replay_command(const PixelSample& sample) const {
  std::string flags = fmt::format("--crop {},{},1,1 --first-sample {} --spp 1", sample.x, sample.y, sample.sample);
  if (!scene.hemisphere_nodes.empty()) flags += fmt::format(" --gauss-nodes {}", scene.hemisphere_nodes.size());
  return options.command.empty() ? flags : options.command + " " + flags;
}

ImageMetadata Renderer::State::metadata() const {
  const std::time_t now = std::time(nullptr);
  ImageMetadata data;
  data.emplace_back("software", std::string("Embrun ") + version());
  if (!options.command.empty()) data.emplace_back("command", options.command);
  data.emplace_back("seed", std::to_string(report.seed));
  data.emplace_back("samples", std::to_string(next_sample - static_cast<std::uint32_t>(options.first_sample)));
  if (options.denoise) data.emplace_back("denoised", "yes");
  data.emplace_back("date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now)));
  data.emplace_back("render_seconds", fmt::format("{:.2f}", report.render_seconds));
  data.emplace_back("choices", report.pinning_flags);
  return data;
}

ImageLayers Renderer::State::layers() const {
  ImageLayers result = resolve(film);
  if (options.denoise) {
    Image clean = embrun::denoise(result);
    clean.name = "beauty";
    *result.find("beauty") = std::move(clean);
  }
  return result;
}

Renderer::Renderer(const std::string& particle_file, const RenderOptions& options, const RenderHooks& hooks)
    : state_(std::make_unique<State>()) {
  state_->options = options;
  state_->read_file(particle_file, hooks);
}

Renderer::Renderer(const Particles& particles, const RenderOptions& options, const RenderHooks& hooks)
    : state_(std::make_unique<State>()) {
  check_options(options);
  state_->options = options;
  state_->build(to_set(particles), "particles", hooks);
}

Renderer::Renderer(const SceneInput& scene, const RenderOptions& options, const RenderHooks& hooks)
    : state_(std::make_unique<State>()) {
  state_->options = options;
  state_->read_scene_file(scene, hooks);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

bool Renderer::add_samples(int count, const RenderHooks& hooks) {
  if (count < 0) throw Error(fmt::format("{} samples: give 0 or more", count));
  State& s = *state_;
  const Stopwatch watch;
  RenderControl control;
  control.threads = s.options.threads;
  control.cancel = hooks.cancel;
  tell(hooks, "rendering", 0, 0);
  control.progress = [&](std::uint64_t done, std::uint64_t total) {
    tell(hooks, "rendering", static_cast<double>(done) / static_cast<double>(total), watch.seconds());
  };
  RenderCounts counts =
      embrun::render_samples(*s.backend, s.film, s.next_sample, static_cast<std::uint32_t>(count), control);
  add(s.counts.paths, counts.paths);
  s.counts.bad_samples.insert(s.counts.bad_samples.end(), counts.bad_samples.begin(), counts.bad_samples.end());
  s.counts.contradicting.insert(s.counts.contradicting.end(), counts.contradicting.begin(), counts.contradicting.end());
  s.next_sample += static_cast<std::uint32_t>(count);
  s.report.cancelled = s.report.cancelled || counts.cancelled;
  s.report.render_seconds += watch.seconds();
  s.report.render_cpu_seconds += watch.cpu_seconds();
  return !counts.cancelled;
}

Picture Renderer::picture() const {
  const ImageLayers layers = state_->layers();
  Picture picture;
  picture.width = layers.window.width;
  picture.height = layers.window.height;
  picture.x = layers.window.x;
  picture.y = layers.window.y;
  for (const Image& layer : layers.layers) picture.layers.push_back({layer.name, layer.channels, layer.pixels});
  return picture;
}

void Renderer::write(const std::string& path) {
  const Stopwatch watch;
  write_image(path, state_->layers(), write_options(state_->options), state_->metadata());
  state_->report.write_seconds += watch.seconds();
}

RenderReport Renderer::report() const {
  const State& s = *state_;
  RenderReport r = s.report;
  r.samples = static_cast<int>(s.next_sample) - s.options.first_sample;
  r.samples_done = good_samples(s.film);
  r.bad_samples = bad_samples(s.film);
  r.relative_error = r.samples_done > 0 ? relative_error(resolve(s.film)) : 0;
  const PathCounters& p = s.counts.paths;
  r.camera_rays = ray_report(p.camera);
  r.outside_rays = ray_report(p.outside);
  r.inside_rays = ray_report(p.inside);
  r.shadow_rays = ray_report(p.shadow);
  r.scatterings = p.scatterings;
  r.bent_directions = p.bends;
  r.medium_contradictions = p.contradictions;
  r.medium_collisions = p.collisions;
  r.majorants_exceeded = p.majorants;
  const auto add_commands = [&s](const std::vector<PixelSample>& samples, std::vector<std::string>& commands) {
    for (std::size_t i = 0; i < std::min<std::size_t>(samples.size(), 8); ++i)
      commands.push_back(s.replay_command(samples[i]));
  };
  add_commands(s.counts.bad_samples, r.replay_commands);
  add_commands(s.counts.contradicting, r.contradiction_commands);
  r.cpu_seconds = embrun::cpu_seconds();
  r.peak_memory_bytes = embrun::peak_memory_bytes();
  return r;
}

namespace {

template <class Input>
RenderReport render_input(const Input& input, const std::string& picture_file, const RenderOptions& options,
                          const RenderHooks& hooks) {
  check_options(options);
  check_output(picture_file, options);
  Renderer renderer(input, options, hooks);
  renderer.add_samples(renderer.report().planned_samples, hooks);
  if (renderer.report().samples_done > 0) {
    tell(hooks, "writing", 0, 0);
    renderer.write(picture_file);
    tell(hooks, "writing", 1, renderer.report().write_seconds);
  }
  return renderer.report();
}

}  // namespace

RenderReport render_file(const std::string& particle_file, const std::string& picture_file,
                         const RenderOptions& options, const RenderHooks& hooks) {
  return render_input(particle_file, picture_file, options, hooks);
}

RenderReport render_file(const SceneInput& scene, const std::string& picture_file, const RenderOptions& options,
                         const RenderHooks& hooks) {
  return render_input(scene, picture_file, options, hooks);
}

std::string describe_scene(const SceneInput& scene, std::vector<std::string>& warnings) {
  SceneFile file = read_scene(scene);
  validate(file.scene);
  warnings = std::move(file.warnings);
  return write_scene(file.scene);
}

std::string describe_scene(const std::string& particle_file, const RenderOptions& options,
                           std::vector<std::string>& warnings) {
  check_options(options);
  if (is_splat_file(particle_file)) {
    check_scan_options(options, particle_file);
    return write_scene(make_splat_file_scene(open_splat_file(particle_file), options, particle_file, warnings));
  }
  ParticleSet particles = read_particles(particle_file);
  if (cloud_verdict(particles, options.cloud).is_surface) {
    check_scan_options(options, particle_file);
    const SplatCloud cloud = make_splats(std::move(particles), splat_options(options.cloud), particle_file);
    return write_scene(make_cloud_scene(cloud, options, particle_file, warnings));
  }
  check_fluid_options(options, particle_file);
  MeasuredParticles measured = measure(std::move(particles), options, particle_file);
  measured.file = particle_file;
  return write_scene(make_scene(measured, options, warnings));
}

Picture render(const Particles& particles, const RenderOptions& options, const RenderHooks& hooks,
               RenderReport* report) {
  Renderer renderer(particles, options, hooks);
  renderer.add_samples(options.samples, hooks);
  if (report != nullptr) *report = renderer.report();
  return renderer.picture();
}

std::string describe_file(const std::string& particle_file, bool json, std::optional<double> radius,
                          const CloudOptions& cloud) {
  const SplatOptions splats = splat_options(cloud);
  if (is_splat_file(particle_file)) return describe_splat_file(*open_splat_file(particle_file), particle_file, json);
  const ParticleSet particles = read_particles(particle_file);
  const CloudVerdict verdict = cloud_verdict(particles, cloud);
  const ParticleInfo info = verdict.is_surface ? describe_cloud(particles, particle_file, verdict, splats)
                                               : describe_particles(particles, particle_file, radius);
  return json ? to_json(info) : to_text(info);
}

void check_text_output(const std::string& path) { check_writable(path); }

void write_text_file(const std::string& path, const std::string& text) {
  write_file_atomically(path, std::as_bytes(std::span(text.data(), text.size())));
}

}  // namespace embrun
