#pragma once

// Embrun: physically based pictures of particle fluids, without a mesh.
//
//   #include <embrun/embrun.h>
//   embrun::RenderOptions options;               // everything has a default
//   options.width = 1920, options.height = 1080;
//   embrun::render_file("dam.bgeo", "dam.png", options);
//
// Lengths are metres, angles degrees, absorption is per metre, radiance is linear RGB (Rec. 709). Every mistake of the
// user's ends in an exception derived from std::runtime_error whose text says what is wrong, where, and what to do.

#include <embrun/cloud_options.h>
#include <embrun/compare.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace embrun {

/// "0.1.0"
const char* version();

using Point = std::array<double, 3>;
using Color = std::array<float, 3>;

/// Particles in memory.
struct Particles {
  std::vector<Point> positions;
  /// One per particle, or empty: RenderOptions::radius, else half the rest spacing, for all.
  std::vector<float> radii;
};

/// Another fluid beside the first. It wins over the fluids before it where their surfaces overlap.
struct FluidOptions {
  std::string file;
  std::optional<double> ior;                ///< default: RenderOptions::ior
  std::optional<Color> absorption;          ///< default: RenderOptions::absorption
  std::optional<Color> extinction, albedo;  ///< as RenderOptions::extinction and albedo; default: clear, white
  double phase_g = 0;
};

/// What is rendered, and how. Names are those of the command line; a wrong one throws and lists the right ones.
struct RenderOptions {
  // The picture.
  int width = 1280, height = 720;
  std::optional<std::array<int, 4>> crop;  ///< x, y, width, height of the part that is rendered; row 0 is the top
  int samples = 64;                        ///< per pixel
  int first_sample = 0;                    ///< index of the first: with a crop, replays one path
  std::uint32_t seed = 0;
  int threads = 0;             ///< 0: as many as the machine has
  std::string filter = "box";  ///< of a pixel: box, tent, gaussian, blackman-harris
  /// path: all light. whitted: direct light, mirror reflection and refraction. ao: ambient occlusion, which needs no light.
  /// gauss: all light, the first diffuse reflection by a quadrature rule of one node for each sample, for comparison.
  std::string integrator = "path";
  std::optional<double> occlusion_distance;  ///< of ao: what is farther away occludes nothing, metres; none: no limit
  std::optional<int> gauss_nodes;            ///< of gauss: nodes of its rule; none: as many as samples
  int max_depth = 256;                       ///< scattering events of a path
  int refractions = -1;                      ///< after that many a ray goes straight on; -1: any number
  /// How shadow rays meet interfaces. off: they end there, and small lights reach the inside by chance alone. straight:
  /// they go straight on, with Fresnel's and the medium's transmittance; quiet, but biased: light comes from where it would
  /// come without refraction. auto: straight for whitted, which has no other light in water, off for the others.
  std::string boundary_nee = "auto";
  /// Most radiance that light found after the first scattering may bring to a sample, per channel; biased. None: no limit.
  std::optional<double> clamp;

  // The camera: from and to, or a view that is framed on the particles.
  std::optional<Point> camera_from, camera_to;
  std::optional<double> fov;           ///< vertical; default 35
  std::string view = "three-quarter";  ///< front, side, top, three-quarter
  std::string up = "y";                ///< y, z

  // The surface.
  std::optional<double> radius;     ///< default: the particles' own, else half the rest spacing
  int order = 3;                    ///< neighbourhood order n
  std::string kernel = "metaball";  ///< metaball, zhu-bridson, blinn
  std::string threshold = "auto";   ///< auto, thesis, or a number
  std::string recover = "smooth";   ///< smooth, thesis, off
  std::string normal = "weighted";  ///< weighted, gradient
  std::string method = "fast";      ///< fast, thesis
  /// Whether rays meet the particles themselves or a triangle mesh of the same surface: direct, mesh.
  std::string representation = "direct";
  std::optional<double> mesh_cell;     ///< of the mesh, metres; default: half the radius
  std::optional<double> density_cell;  ///< of the grid that holds what is inside a mesh; default: half the radius

  // Points of surfaces, which are no fluid.
  CloudOptions cloud;
  std::string point_surface = "splats";  ///< splats, mls: a smooth moving least squares surface through them
  /// Of mls: how far a point is felt, in splat radii, 1 to 16; default: default_mls_support.
  std::optional<double> mls_support;
  /// Level of detail: one splat stands for all those of a part of the cloud that is smaller than so many pixels, and after
  /// scattering than so many footprints of the path. 0: off, every splat counts. Default: 1 for a file of splats
  /// (splat_file), else off.
  std::optional<double> lod;

  // Water and surroundings.
  double ior = 1.33;
  std::optional<Color> absorption;                 ///< default: that of clear water
  std::string environment = "sky";                 ///< sky, studio, white, or a latitude-longitude picture file
  std::optional<double> sun;                       ///< diameter of the sky's sun in degrees, 0: none; default 26
  std::string floor = "plain";                     ///< none, plain, checker
  std::optional<double> floor_height;              ///< default: cuts through the lowest layer of particles
  std::optional<std::array<double, 6>> container;  ///< x0, y0, z0, x1, y1, z1
  std::vector<std::string> meshes;                 ///< PLY or OBJ files, shown as grey objects

  // The inside of the fluid: what its particles do to light.
  /// Per metre at rest density; default: none, or with color_by 1 / (4 radii). Infinite: the fluid is opaque, a body of its
  /// albedo under its reflecting surface.
  std::optional<Color> extinction;
  Color albedo{1, 1, 1};                 ///< scattering / extinction
  double phase_g = 0;                    ///< mean cosine of scattering, Henyey-Greenstein
  std::optional<double> density_radius;  ///< of the balls that fill the fluid with it; default: the particles' radius
  std::string color_by;                  ///< attribute that gives each particle its albedo, through the colour map
  std::string color_map = "spectrum";    ///< spectrum, heat, grey
  std::string overlap = "sum";           ///< where several fluids' particles overlap: min, max, sum

  // Other fluids and particles.
  std::vector<FluidOptions> fluids;
  std::string kinds;  ///< by an attribute of the main file: "type:0=foam,1=spray,2=bubble"; others are water
  std::vector<std::string> foam, bubbles, sand, spray;  ///< files
  /// Radii of those without one in the file; default: 1/2, 1/4, 1 and 1/4 of the fluid's.
  std::optional<double> foam_radius, bubble_radius, sand_radius, spray_radius;
  /// Per metre, where foam lies as close as its diameters; default: 1 / diameter. Infinite: opaque balls.
  std::optional<Color> foam_extinction;
  std::optional<Color> sand_color;  ///< reflectance
  std::optional<double> tank;       ///< thickness of a glass tank round the container, metres
  double tank_ior = 1.5;

  // What is written.
  bool denoise = false;
  std::string layer = "beauty";  ///< of formats with one layer: beauty, albedo, normal, depth, samples, variance
  double exposure = 0;           ///< stops, PNG
  std::string tone = "filmic";   ///< filmic, srgb: the tone curve of PNG
  std::string command;           ///< kept in the file's metadata, and shown to replay a bad sample
};

/// A scene file (docs/scene-files.md), and what is to be different from what it says.
struct SceneInput {
  std::string file;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< names and values: what its $name stands for
  std::optional<std::array<int, 2>> size;                       ///< without a crop, all of it is rendered
  std::optional<std::array<int, 4>> crop;
  std::optional<int> samples, max_depth, refractions;
  std::optional<std::string> integrator;
  std::optional<double> occlusion_distance;
  std::optional<int> gauss_nodes;
  std::optional<std::string> boundary_nee;
  std::optional<double> clamp;
  std::optional<std::uint32_t> seed;
  std::optional<std::string> filter;
  std::optional<std::string> representation;  ///< of all fluids
  std::optional<double> mesh_cell;            ///< of those that are meshed
  std::optional<double> density_cell;         ///< likewise
  std::optional<double> lod;                  ///< of all clouds
};

/// Throws when an option is out of range or unknown.
void check_options(const RenderOptions& options);

/// Throws when a picture with these options could not be written there: call it before hours of rendering.
void check_output(const std::string& path, const RenderOptions& options);

/// One layer of a picture: width * height * channels values, interleaved, row 0 at the top.
struct Layer {
  std::string name;  ///< beauty, albedo, normal, depth, samples, variance
  int channels = 0;
  std::vector<float> values;
};

struct Picture {
  int width = 0, height = 0;  ///< of the layers: those of the crop
  int x = 0, y = 0;           ///< where they lie in the full picture
  std::vector<Layer> layers;
};

struct Progress {
  const char* stage = "";  ///< reading, sorting, building, meshing (a part of building), rendering, writing
  double fraction = 0;     ///< of the stage, 0 to 1
  double elapsed = 0;      ///< seconds, of the stage
  double remaining = -1;   ///< seconds, an estimate; negative: unknown
};

struct RenderHooks {
  /// Called at the start of every stage, now and then during rendering, and at its end; never by two threads at once.
  std::function<void(const Progress&)> progress;
  /// When it becomes true, rendering stops soon; what there is is kept.
  const std::atomic<bool>* cancel = nullptr;
};

/// Rays of one kind. The rate is per second of one thread's work on them.
struct RayReport {
  std::uint64_t rays = 0;
  double rays_per_second = 0;
};

/// What was chosen, done and found.
struct RenderReport {
  // Machine.
  std::string version, instruction_set;
  int threads = 0;
  double peak_memory_bytes = 0;  ///< of the whole process
  double surface_bytes = 0;      ///< of the surface alone
  // Seconds.
  double read_seconds = 0, build_seconds = 0, render_seconds = 0, write_seconds = 0, cpu_seconds = 0;
  /// Of the processor, all threads of the process together: other work on the machine hardly changes them.
  double build_cpu_seconds = 0, render_cpu_seconds = 0;
  /// Parts of build_seconds: meshes of fluids; what is in those on grids; the trees that rays find meshes and balls with.
  double mesh_seconds = 0, grid_seconds = 0, tree_seconds = 0;
  std::uint64_t grid_cells = 0;
  std::uint64_t mesh_vertices = 0, mesh_triangles = 0;  ///< of fluids
  // Particles.
  std::string input, format;
  std::uint64_t particles = 0, dropped = 0, recovered = 0;
  double radius = 0;
  std::string radius_source;  ///< given, file, spacing, nearest-neighbour
  double spacing = 0;         ///< rest spacing; 0: none could be measured
  double threshold = 0, influence_radius = 0;
  /// Of a scan, what its splats are, a line each; then the figures of particles are of splats.
  std::vector<std::string> scan;
  // Choices.
  Point camera_from{}, camera_to{};
  double fov = 0;
  std::optional<double> floor_height;
  std::string pinning_flags;       ///< the flags that would make the same choices for another frame
  std::vector<std::string> notes;  ///< what was left out or put right, one sentence each
  // Picture.
  int width = 0, height = 0, samples = 0;
  int planned_samples = 0;  ///< per pixel, that the options or the scene file ask for
  std::uint32_t seed = 0;
  std::uint64_t samples_done = 0;  ///< in all pixels
  bool cancelled = false;
  double relative_error = 0;  ///< standard error of a pixel over the mean, root mean square
  // Light transport.
  RayReport camera_rays, outside_rays, inside_rays, shadow_rays;
  std::uint64_t scatterings = 0;
  std::uint64_t bent_directions = 0;        ///< sent across the surface by a shading normal, and put right
  std::uint64_t medium_contradictions = 0;  ///< crossings that disagreed with the medium, and were put right
  std::uint64_t medium_collisions = 0;      ///< scatterings in media, between surfaces
  std::uint64_t majorants_exceeded = 0;     ///< extinctions above their bound: a defect of ours, please report it
  std::uint64_t bad_samples = 0;            ///< NaN, infinite, negative or stuck: left out
  /// What renders one of them alone, for the first few: RenderOptions::command with flags that overrule its own.
  std::vector<std::string> replay_commands;
  std::vector<std::string> contradiction_commands;  ///< likewise, of the samples with medium_contradictions
};

/// Several lines for people, ending with a line feed.
std::string to_text(const RenderReport& report);
/// A JSON object.
std::string to_json(const RenderReport& report);

/// A render under way: construct it (which reads and builds), add samples, take the picture, add more.
class Renderer {
 public:
  Renderer(const std::string& particle_file, const RenderOptions& options, const RenderHooks& hooks = {});
  Renderer(const Particles& particles, const RenderOptions& options, const RenderHooks& hooks = {});
  /// Of the options only what is written counts, and the threads and the first sample; the scene has the rest.
  explicit Renderer(const SceneInput& scene, const RenderOptions& options = {}, const RenderHooks& hooks = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Adds so many samples to every pixel; false when it was cancelled.
  bool add_samples(int count, const RenderHooks& hooks = {});
  /// The picture so far; denoised if the options say so.
  Picture picture() const;
  /// Writes the picture so far; the extension names the format: exr, pfm, hdr, png.
  void write(const std::string& path);
  /// Everything up to now.
  RenderReport report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Reads particles, renders, and writes the picture (also when it was cancelled, unless there is no sample at all).
RenderReport render_file(const std::string& particle_file, const std::string& picture_file,
                         const RenderOptions& options = {}, const RenderHooks& hooks = {});

/// The same for a scene file.
RenderReport render_file(const SceneInput& scene, const std::string& picture_file, const RenderOptions& options = {},
                         const RenderHooks& hooks = {});

/// What was understood of a scene file, as a scene file: everything spelt out, files by absolute paths. `warnings`
/// receives what has no effect, a sentence each.
std::string describe_scene(const SceneInput& scene, std::vector<std::string>& warnings);
/// The scene that a render of a particle file with these options is of, as a scene file.
std::string describe_scene(const std::string& particle_file, const RenderOptions& options,
                           std::vector<std::string>& warnings);

/// Renders particles in memory.
Picture render(const Particles& particles, const RenderOptions& options = {}, const RenderHooks& hooks = {},
               RenderReport* report = nullptr);

/// How the surface of a particle file becomes a triangle mesh. Names are those of RenderOptions.
struct MeshOptions {
  std::optional<double> cell;  ///< side of the cells it is made from, metres; default: half the particles' radius
  std::string density_file;    ///< also the particles' density on a grid, as an OpenVDB file; or empty
  std::optional<double> density_cell;    ///< of that grid, metres; default: half the particles' radius
  std::optional<double> density_radius;  ///< of the balls that fill the fluid with it; default: the particles' radius
  // The surface.
  std::optional<double> radius;
  int order = 3;
  std::string kernel = "metaball";
  std::string threshold = "auto";
  std::string recover = "smooth";
  std::string normal = "weighted";
  std::string kinds;
  int threads = 0;      ///< 0: as many as the machine has
  std::string command;  ///< kept in the file's head
};

/// What was chosen, done and found.
struct MeshReport {
  std::string version, instruction_set;
  int threads = 0;
  double peak_memory_bytes = 0;  ///< of the whole process
  // Seconds: reading; spacing, radius and lost particles; the field on a grid; triangles; writing.
  double read_seconds = 0, measure_seconds = 0, sample_seconds = 0, extract_seconds = 0, write_seconds = 0;
  double density_seconds = 0;  ///< sampling the density
  double cpu_seconds = 0;
  // Particles.
  std::string input, format;
  std::uint64_t particles = 0, dropped = 0, recovered = 0;
  double radius = 0;
  std::string radius_source;  ///< given, file, spacing, nearest-neighbour
  double spacing = 0;         ///< rest spacing; 0: none could be measured
  double threshold = 0, influence_radius = 0;
  // The mesh: closed, so it has a volume.
  double cell = 0;
  std::uint64_t vertices = 0, triangles = 0, components = 0;
  Point low{}, high{};  ///< its bounds
  double volume = 0, area = 0;
  /// Of the density: side of its voxels; voxels that are not 0; its integral, m3 of fluid at rest density.
  double density_cell = 0;
  std::uint64_t density_voxels = 0;
  double density_integral = 0;
  std::vector<std::string> notes;  ///< what was left out or put right, one sentence each
};

/// Several lines for people, ending with a line feed.
std::string to_text(const MeshReport& report);
/// A JSON object.
std::string to_json(const MeshReport& report);

/// Throws when an option is out of range or unknown, or when a mesh could not be written there.
void check_mesh_options(const MeshOptions& options);
void check_mesh_output(const std::string& mesh_file);
/// Throws when this library was built without OpenVDB, or a density could not be written there (.vdb).
void check_density_output(const std::string& density_file);

/// Reads particles and writes the mesh of their surface, the one that a render of them shows; the extension names the
/// format: ply, obj.
MeshReport mesh_file(const std::string& particle_file, const std::string& mesh_file, const MeshOptions& options = {},
                     const RenderHooks& hooks = {});

/// How the points of a file become splats with their levels of detail.
struct SplatFileOptions {
  CloudOptions cloud;
  /// Reads the file in pieces, whatever its size. Otherwise that is done of binary PLY files of more than 4 million points.
  bool stream = false;
  double memory = 2;    ///< GiB of points that are sorted at a time, >= 0.001; others wait in scratch files
  std::string scratch;  ///< folder of scratch files; default: that of the output
  int threads = 0;      ///< 0: as many as the machine has
};

struct SplatFileReport {
  std::string version, input;
  int threads = 0;
  bool streamed = false;
  double peak_memory_bytes = 0;  ///< of the whole process
  double read_seconds = 0, sort_seconds = 0, build_seconds = 0, cpu_seconds = 0;
  std::uint64_t points = 0, dropped = 0, splats = 0, nodes = 0, bricks = 0, file_bytes = 0;
  std::uint64_t runs = 0;  ///< sorted by themselves and put away; 0: all fitted into memory
  double least_radius = 0, median_radius = 0, greatest_radius = 0;
  std::string radius_source;  ///< given, file, spacing
  bool closed = false, has_colors = false;
  std::vector<std::string> notes;  ///< what was left out, one sentence each
};

/// Several lines for people, ending with a line feed.
std::string to_text(const SplatFileReport& report);
/// A JSON object.
std::string to_json(const SplatFileReport& report);

/// Throws when an option is out of range or unknown, or when a file of splats could not be written there (.splats).
void check_splat_file_options(const SplatFileOptions& options);
void check_splat_output(const std::string& splat_file);

/// Reads a cloud and writes its splats with their levels of detail, which a render maps instead of reading. The cloud may
/// be far larger than memory. The same bytes for any memory and any number of threads.
SplatFileReport splat_file(const std::string& point_file, const std::string& splat_file,
                           const SplatFileOptions& options = {}, const RenderHooks& hooks = {});

/// What is in a particle file: count, attributes, bounds; of a fluid the rest spacing and radius, of a scan what its splats
/// would be. For people, or as a JSON object. `radius`: as RenderOptions::radius.
std::string describe_file(const std::string& particle_file, bool json, std::optional<double> radius = std::nullopt,
                          const CloudOptions& cloud = {});

/// Throws when write_text_file could not write there.
void check_text_output(const std::string& path);
/// Replaces a file whole: it holds the old or the new text, whatever happens.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace embrun
