// What both C++ programs share: a picture, a camera, time and memory.
#pragma once

#include "embree.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

// Ends the program where a call of prismarch's fails.
inline void check(prismarch_status status, const prismarch_error &error) {
  if (status != PRISMARCH_OK) {
    std::fprintf(stderr, "prismarch: %s\n", error.message);
    std::exit(1);
  }
}

inline double seconds() {
  using namespace std::chrono;
  return duration<double>(steady_clock::now().time_since_epoch()).count();
}

// What Embree holds for a device, in bytes.
inline std::atomic<long long> embree_bytes{0};

inline RTCDevice new_device() {
  embree_bytes = 0;
  RTCDevice device = rtcNewDevice(nullptr);
  rtcSetDeviceMemoryMonitorFunction(
      device,
      [](void *, ssize_t bytes, bool) {
        embree_bytes += bytes;
        return true;
      },
      nullptr);
  return device;
}

struct Vec {
  float x, y, z;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(float s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec normalize(Vec a) { return 1 / std::sqrt(dot(a, a)) * a; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// Heights of a square map, 16 bits.
struct Map {
  int side;
  std::vector<uint16_t> texels;

  explicit Map(int side) : side(side), texels(size_t(side) * side) {
    for (int j = 0; j < side; j++)
      for (int i = 0; i < side; i++) {
        const float a = 6.2831853f * i / side, b = 6.2831853f * j / side;
        const float h = 0.5f + 0.2f * std::sin(5 * a + 2 * std::sin(3 * b)) + 0.2f * std::sin(7 * b) * std::cos(4 * a) +
                        0.08f * std::sin(31 * a) * std::sin(29 * b);
        texels[size_t(j) * side + i] = uint16_t(65535 * h);
      }
  }

  // Bilinear, repeating; texel i's centre at (i + 0.5) / side.
  float height(float s, float t) const {
    const float x = s * side - 0.5f, y = t * side - 0.5f;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const float u = x - i, v = y - j;
    auto at = [&](int i, int j) {
      const int m = side;
      return texels[size_t(((j % m) + m) % m) * m + ((i % m) + m) % m] / 65535.0f;
    };
    return (1 - v) * ((1 - u) * at(i, j) + u * at(i + 1, j)) + v * ((1 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
  }

  prismarch_map *create() const {
    const prismarch_texels texels = {this->texels.data(), PRISMARCH_TEXEL_U16, 0, 0};
    prismarch_map *map;
    prismarch_error error;
    check(prismarch_map_create(uint32_t(side), uint32_t(side), &texels, PRISMARCH_WRAP_REPEAT, &map, &error), error);
    return map;
  }
};

// A geometry of a surface; the bytes that the surface takes beside its map. The geometry keeps the surface, and that the map, which is
// let go of here; where geometries keep nothing, the surface stays until the program ends.
inline RTCGeometry geometry_of(RTCDevice device, const prismarch_surface_desc &desc, size_t *bytes) {
  prismarch_error error;
  prismarch_surface *surface;
  RTCGeometry geometry;
  check(prismarch_surface_create(&desc, &surface, &error), error);
  check(prismarch_geometry_create(device, surface, &geometry, &error), error);
  check(prismarch_surface_bytes(surface, bytes, &error), error);
  if (prismarch_geometry_keeps_surface())
    prismarch_surface_release(surface);
  prismarch_map_release(desc.map);
  return geometry;
}

// A scene of one geometry, which it keeps.
inline RTCScene scene_of(RTCDevice device, RTCGeometry geometry) {
  rtcSetGeometryMask(geometry, 0xffffffffu);
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

// A grey picture of a scene: light from one side, with shadows.
inline std::vector<float> render(RTCScene scene, int size, Vec eye, Vec target) {
  const Vec forward = normalize(target - eye), right = normalize(cross(forward, {0, 0, 1})), up = cross(right, forward);
  const Vec light = normalize({0.5f, -0.3f, 0.8f});
  std::vector<float> picture(size_t(size) * size);
  for (int y = 0; y < size; y++)
    for (int x = 0; x < size; x++) {
      const float a = 0.8f * ((x + 0.5f) / size - 0.5f), b = 0.8f * (0.5f - (y + 0.5f) / size);
      const Vec d = forward + a * right + b * up;
      RTCRayHit query = ray_at(&eye.x, &d.x);
      intersect1(scene, &query, nullptr);
      float shade = 0.2f;
      if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
        Vec n = normalize({query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z});
        if (dot(n, d) > 0)
          n = -1 * n;
        const Vec p = eye + query.ray.tfar * d + 1e-3f * n;
        RTCRayHit shadow = ray_at(&p.x, &light.x);
        occluded1(scene, &shadow.ray, nullptr);
        const float lit = shadow.ray.tfar < 0 ? 0 : std::fmax(0.0f, dot(n, light));
        shade = 0.1f + 0.9f * lit;
      }
      picture[size_t(y) * size + x] = shade;
    }
  return picture;
}

// Mean of |a - b|.
inline double difference(const std::vector<float> &a, const std::vector<float> &b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); i++)
    sum += std::fabs(a[i] - b[i]);
  return sum / double(a.size());
}

inline bool write_pgm(const std::string &path, const std::vector<float> &picture, int size) {
  std::FILE *file = std::fopen(path.c_str(), "wb");
  if (!file)
    return false;
  std::fprintf(file, "P5\n%d %d\n255\n", size, size);
  for (float shade : picture)
    std::fputc(int(255 * std::sqrt(std::fmin(1.0f, shade)) + 0.5f), file);
  return std::fclose(file) == 0;
}
