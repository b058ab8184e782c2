#include "io/cloud_files.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "io/particle_files.h"

namespace embrun::test {

std::vector<CloudPoint> cloud_points(std::size_t count) {
  std::vector<CloudPoint> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float t = static_cast<float>(i);
    points[i] = {0.25f * t,
                 -0.5f * t,
                 8 - t,
                 static_cast<std::uint8_t>(i * 7),
                 static_cast<std::uint8_t>(255 - i),
                 static_cast<std::uint8_t>(i % 3),
                 static_cast<std::uint16_t>(1000 + i)};
  }
  return points;
}

std::string lzf_packed(std::string_view bytes) {
  std::string packed, run;
  const auto flush = [&] {
    if (run.empty()) return;
    packed += static_cast<char>(run.size() - 1);
    packed += run;
    run.clear();
  };
  for (std::size_t at = 0; at < bytes.size();) {
    std::size_t best = 0, back = 0;
    for (std::size_t d = 1; d <= std::min<std::size_t>(at, 8192); ++d) {
      std::size_t n = 0;
      while (n < 264 && at + n < bytes.size() && bytes[at + n] == bytes[at + n - d]) ++n;
      if (n > best) best = n, back = d;
    }
    if (best < 3) {
      run += bytes[at++];
      if (run.size() == 32) flush();
      continue;
    }
    flush();
    const std::size_t length = best - 2, high = (back - 1) >> 8;
    packed += static_cast<char>(std::min<std::size_t>(length, 7) << 5 | high);
    if (length >= 7) packed += static_cast<char>(length - 7);
    packed += static_cast<char>((back - 1) & 255);
    at += best;
  }
  flush();
  return packed;
}

std::string as_pcd(const std::vector<CloudPoint>& points, PcdKind kind) {
  const std::string n = std::to_string(points.size());
  FileBytes file(false);
  file.text(
      "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS x y z rgb intensity _ histogram\n"
      "SIZE 4 4 4 4 2 1 4\nTYPE F F F F U U F\nCOUNT 1 1 1 1 1 3 2\nWIDTH " +
      n + "\nHEIGHT 1\nVIEWPOINT 1 2.5 -3 1 0 0 0\nPOINTS " + n + "\nDATA ");
  const auto packed_colour = [](const CloudPoint& p) {
    return static_cast<std::uint32_t>(p.red << 16 | p.green << 8 | p.blue);
  };
  if (kind == PcdKind::ascii) {
    file.text("ascii\n");
    for (std::size_t i = 0; i < points.size(); ++i) {
      const CloudPoint& p = points[i];
      char text[200];
      std::snprintf(text, sizeof text, "%g %g %g %.9g %d 0 0 0 %zu -%zu\n", static_cast<double>(p.x),
                    static_cast<double>(p.y), static_cast<double>(p.z),
                    static_cast<double>(std::bit_cast<float>(packed_colour(p))), p.intensity, i, i);
      file.text(text);
    }
    return file.str();
  }
  if (kind == PcdKind::binary) {
    file.text("binary\n");
    for (std::size_t i = 0; i < points.size(); ++i) {
      const CloudPoint& p = points[i];
      file.number(p.x).number(p.y).number(p.z).number(packed_colour(p)).number(p.intensity).text("abc");
      file.number(static_cast<float>(i)).number(-static_cast<float>(i));
    }
    return file.str();
  }
  FileBytes values(false);
  for (const CloudPoint& p : points) values.number(p.x);
  for (const CloudPoint& p : points) values.number(p.y);
  for (const CloudPoint& p : points) values.number(p.z);
  for (const CloudPoint& p : points) values.number(packed_colour(p));
  for (const CloudPoint& p : points) values.number(p.intensity);
  for (std::size_t i = 0; i < points.size(); ++i) values.text("abc");
  for (std::size_t i = 0; i < points.size(); ++i) values.number(static_cast<float>(i)).number(-static_cast<float>(i));
  const std::string packed = lzf_packed(values.str());
  file.text("binary_compressed\n").number(static_cast<std::uint32_t>(packed.size()));
  return file.number(static_cast<std::uint32_t>(values.str().size())).text(packed).str();
}

std::string as_las(const std::vector<CloudPoint>& points, LasKind kind) {
  const std::uint32_t count = static_cast<std::uint32_t>(points.size());
  const bool extended = kind.format >= 6;
  const std::uint16_t header = kind.minor == 4 ? 375 : kind.minor == 3 ? 235 : 227;
  constexpr int sizes[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  const auto zeroes = [](std::size_t n) { return std::string(n, '\0'); };
  FileBytes file(false);
  file.text("LASF").text(zeroes(20)).number(std::uint8_t{1}).number(static_cast<std::uint8_t>(kind.minor));
  file.text(zeroes(64)).number(std::uint16_t{1}).number(std::uint16_t{2026}).number(header);
  // A variable length record of 10 bytes stands between header and points.
  file.number(std::uint32_t{header} + 64u).number(std::uint32_t{1}).number(static_cast<std::uint8_t>(kind.format));
  file.number(static_cast<std::uint16_t>(sizes[kind.format] + kind.extra_bytes));
  file.number(extended ? std::uint32_t{0} : count).text(zeroes(20));
  for (int i = 0; i < 3; ++i) file.number(0.001);
  for (const double offset : {500000.0, 4000000.0, 100.0}) file.number(offset);
  file.text(zeroes(48));
  if (kind.minor >= 3) file.text(zeroes(8));
  if (kind.minor == 4) file.text(zeroes(12)).number(std::uint64_t{count}).text(zeroes(120));
  file.text(zeroes(20)).number(std::uint16_t{10}).text(zeroes(32)).text("ten bytes!");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CloudPoint& p = points[i];
    for (const float x : {p.x, p.y, p.z})
      file.number(static_cast<std::int32_t>(std::lround(1000.0 * static_cast<double>(x))));
    file.number(p.intensity);
    if (extended) {
      file.number(std::uint8_t{2 | 9 << 4}).number(std::uint8_t{4 | 1 << 4}).number(std::uint8_t{64});  // withheld
      file.number(std::uint8_t{5}).number(std::int16_t{-2500}).number(std::uint16_t{77});
    } else {
      file.number(std::uint8_t{2 | 3 << 3}).number(static_cast<std::uint8_t>(6 | 1 << 5));  // synthetic
      file.number(std::int8_t{-15}).number(std::uint8_t{5}).number(std::uint16_t{77});
    }
    const bool timed = extended || kind.format == 1 || kind.format >= 3;
    if (timed) file.number(123456789.25 + static_cast<double>(i));
    const int f = kind.format;
    if (f == 2 || f == 3 || f == 5 || f == 7 || f == 8 || f == 10) {
      for (const std::uint8_t c : {p.red, p.green, p.blue}) file.number(static_cast<std::uint16_t>(c * 257));
    }
    if (f == 8 || f == 10) file.number(std::uint16_t{4321});
    if (f == 4 || f == 5 || f >= 9) file.text(zeroes(29));
    file.text(zeroes(static_cast<std::size_t>(kind.extra_bytes)));
  }
  return file.str();
}

std::string as_obj_cloud(const std::vector<CloudPoint>& points, bool colours, bool normals) {
  std::string file = "# a cloud\no scan\n";
  for (const CloudPoint& p : points) {
    char text[200];
    std::snprintf(text, sizeof text, "v %g %g %g", static_cast<double>(p.x), static_cast<double>(p.y),
                  static_cast<double>(p.z));
    file += text;
    if (colours) {
      std::snprintf(text, sizeof text, " %.9g %.9g %.9g", p.red / 255.0, p.green / 255.0, p.blue / 255.0);
      file += text;
    }
    file += "\n";
    if (normals) file += "vn 0 0 1\n";
  }
  return file;
}

}  // namespace embrun::test
