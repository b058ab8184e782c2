#pragma once

// The judge of ray-surface intersectors: a slow, simple model of the same surface in double precision. It shares no
// header with src/geometry: what the surface is comes in as plain numbers.

#include <array>
#include <cstdint>
#include <vector>

namespace oracle {

struct Vec {
  double x = 0, y = 0, z = 0;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(Vec a);

enum class Kernel { metaball, zhu_bridson, blinn };

/// f(u) and f'(u), u = r/b, written down again from the formulas.
double kernel_value(Kernel kernel, double u);
double kernel_slope(Kernel kernel, double u);
double kernel_support(Kernel kernel);

/// A particle of the main field (share 1/T) or of the recovered one (share w/T').
struct Particle {
  Vec centre;
  double influence = 1;  ///< b
  double radius = 1;     ///< R: the scale on which its field varies along a ray
  double share = 1;
  bool recovered = false;
};

/// The surface is g = 0 with g = max(D/T, D'/T') - 1; liquid where g > 0.
struct Sample {
  double g = -1;
  Vec gradient;          ///< of the larger branch
  double other = -1;     ///< the smaller branch, less 1
  double curvature = 0;  ///< bound on the second derivative of either branch near the point
  double radius = 0;     ///< mean of R over the particles felt, by their share of the field
};

struct Ray {
  Vec origin, direction;
  double t_min = 0, t_max = 1e30;
};

class Surface {
 public:
  Surface(Kernel kernel, std::vector<Particle> particles);

  Sample sample(Vec x) const;
  bool inside(Vec x) const { return sample(x).g > 0; }
  /// Whether the surface passes within max(tolerance, 1e-3 local radius) of x.
  bool surface_within(Vec x, double tolerance) const;

  /// Whether particles smaller than the tolerance are within it of x.
  bool dust_within(Vec x, double tolerance) const;

  Kernel kernel() const { return kernel_; }
  /// The particles whose support meets the ray between t_min and t_max.
  std::vector<Particle> gather(const Ray& ray) const;
  Vec low() const { return low_; }
  Vec high() const { return high_; }

 private:
  struct Block {
    std::size_t begin, end;
    Vec low, high;
    double reach;
  };
  /// Calls visit_particle for every particle of the blocks for whose box and reach `reaches` holds.
  template <class Reaches, class Visit>
  void visit(const Reaches& reaches, const Visit& visit_particle) const;

  Kernel kernel_;
  std::vector<Particle> particles_;  // sorted so that blocks are compact
  std::vector<Block> blocks_;        // of 32 particles
  std::vector<Block> groups_;        // of 32 blocks
  double smallest_influence_ = 1e300;
  Vec low_, high_;
};

/// Walks along a ray from crossing to crossing.
///
/// An interval is settled when bounds prove it: every particle's least and greatest distance from the interval give
/// upper and lower bounds of both fields. The rest is halved down to `step` times the smallest radius of a particle
/// that is felt there (0.02 unless told), then sampled with slopes: a change of sign is bisected, a maximum or minimum
/// between samples is searched for.
class Crossings {
 public:
  /// `finest`: intervals are never halved below this length, whatever the radii.
  Crossings(const Surface& surface, const Ray& ray, double finest, double step = 0.02);

  bool starts_inside() const { return starts_inside_; }
  /// The next crossing; false when there is none before t_max.
  bool next(double& t);

 private:
  struct Interval {
    double a, b;
  };
  struct Value {
    double g, slope;
  };
  Value value(double t) const;
  void select(double a, double b);
  void bounds(double a, double b, double& low, double& high) const;
  bool next_top_interval();
  bool settle_leaf(Interval leaf, double& t);
  double bisect(double a, double b) const;

  Kernel kernel_;
  Ray ray_;
  double finest_, step_;
  // The tube, sorted by where the ray enters a support.
  struct Chord {
    double enter, exit, centre, distance_squared, inverse_influence, share, radius;
    bool recovered;
  };
  std::vector<Chord> tube_;
  std::size_t next_chord_ = 0;
  std::vector<Chord> open_;  // those entered and not yet left
  // The chords of the current top interval, as arrays: main first, then recovered.
  std::vector<double> centre_, distance_squared_, inverse_influence_, share_;
  std::size_t main_count_ = 0;
  double smallest_radius_ = 0;
  double top_length_ = 1, position_ = 0;
  std::vector<Interval> stack_;
  bool starts_inside_ = false, inside_ = false;
};

enum class Start { unknown, outside, inside };

/// What an intersector said.
struct Answer {
  bool hit = false;
  double t = 0;
  bool entering = false;
  Vec position, normal;  ///< the geometric normal
};

enum class Verdict {
  right,
  missed,     ///< no hit, but the ray gets deeper than the tolerance on the other side
  false_hit,  ///< a hit with no surface near it
  early,      ///< a hit before the surface
  late,       ///< a hit after the ray was deeper than the tolerance on the other side
  wrong_way,  ///< on the surface, but leaving where it should enter or the other way round
  bad_normal  ///< right, but position or geometric normal contradict it
};
inline constexpr int verdict_count = 7;
const char* name_of(Verdict verdict);

struct Judgement {
  Verdict verdict = Verdict::right;
  double expected = -1;  ///< where the ray first crosses to the other side for longer than the tolerance; -1: nowhere
};

/// Judges an answer. Wrong is what differs from the first crossing by more than `tolerance` (1e-3 R0) measured along the
/// normal: |dt cos theta| > tolerance, or a penetration deeper than the tolerance that is not hit. Shallower penetrations
/// may be hit or not. A ray that starts within the tolerance of the surface is on the side that it says; with side
/// unknown both are accepted there. Where radii differ, the tolerance is 1e-3 of the local radius if that is more.
Judgement judge(const Surface& surface, const Ray& ray, Start side, const Answer& answer, double tolerance);

}  // namespace oracle
